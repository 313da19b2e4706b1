/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "status.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace codedexposure::app
{

Status::Status (std::string what, bool verbose)
    : what_ (std::move (what)), terminal_ (isatty (STDERR_FILENO) != 0),
      verbose_ (verbose)
{
}

void
Status::progress (const std::string &text)
{
  if (terminal_) {
    std::fprintf (stderr, "\r%s: %s\033[K", what_.c_str (), text.c_str ());
    open_ = true;
  } else if (verbose_ && Clock::now () >= next_) {
    std::fprintf (stderr, "%s: %s\n", what_.c_str (), text.c_str ());
    next_ = Clock::now () + std::chrono::seconds (10);
  }
}

void
Status::line (const std::string &text)
{
  end_progress ();
  std::fprintf (stderr, "%s: %s\n", what_.c_str (), text.c_str ());
}

void
Status::output (const std::string &text)
{
  end_progress ();
  std::printf ("%s: %s\n", what_.c_str (), text.c_str ());
  std::fflush (stdout);
}

void
Status::end_progress ()
{
  if (std::exchange (open_, false))
    std::fprintf (stderr, "\r\033[K");
}

} // namespace codedexposure::app
