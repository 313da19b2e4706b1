/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The lines that a command prints while it runs. */
#pragma once

#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

#include <unistd.h>

namespace codedexposure::app
{

/** Prints lines to stderr. Progress rewrites the last line on a terminal. In a
 * log, it is a line every ten seconds if @p verbose. */
class Status
{
public:
  /** @p what  prefix of every line. */
  Status (std::string what, bool verbose)
      : what_ (std::move (what)), terminal_ (isatty (STDERR_FILENO) != 0),
        verbose_ (verbose)
  {
  }

  void progress (const std::string &text)
  {
    if (terminal_) {
      std::fprintf (stderr, "\r%s: %s\033[K", what_.c_str (), text.c_str ());
      open_ = true;
    } else if (verbose_ && Clock::now () >= next_) {
      std::fprintf (stderr, "%s: %s\n", what_.c_str (), text.c_str ());
      next_ = Clock::now () + std::chrono::seconds (10);
    }
  }

  void line (const std::string &text)
  {
    end_progress ();
    std::fprintf (stderr, "%s: %s\n", what_.c_str (), text.c_str ());
  }

  /** A line on stdout. */
  void output (const std::string &text)
  {
    end_progress ();
    std::printf ("%s: %s\n", what_.c_str (), text.c_str ());
    std::fflush (stdout);
  }

private:
  using Clock = std::chrono::steady_clock;

  void end_progress ()
  {
    if (std::exchange (open_, false))
      std::fprintf (stderr, "\r\033[K");
  }

  std::string what_;
  bool terminal_, verbose_;
  bool open_ = false; // the last line on the terminal is progress
  Clock::time_point next_ = Clock::now () + std::chrono::seconds (2);
};

} // namespace codedexposure::app
