/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The lines that a command prints while it runs. */
#pragma once

#include <chrono>
#include <string>

namespace codedexposure::app
{

/** Prints lines to stderr. Progress rewrites the last line on a terminal. In a
 * log, it is a line every ten seconds if @p verbose. */
class Status
{
public:
  /** @p what  prefix of every line. */
  Status (std::string what, bool verbose);
  void progress (const std::string &text);
  void line (const std::string &text);
  /** A line on stdout. */
  void output (const std::string &text);

private:
  using Clock = std::chrono::steady_clock;
  void end_progress ();

  std::string what_;
  bool terminal_, verbose_;
  bool open_ = false; // the last line on the terminal is progress
  Clock::time_point next_ = Clock::now () + std::chrono::seconds (2);
};

} // namespace codedexposure::app
