/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What codedexposure-launch says on its terminal, and where it has it from. */
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <gst/gst.h>

namespace report
{

/** printf into a string. */
std::string format (const char *pattern, ...) G_GNUC_PRINTF (1, 2);

/** "m:ss" of a time in seconds. */
std::string minutes (double seconds);

/** Processor time of this process so far, in seconds. */
double cpu_seconds ();

/** The Debian package that has @p element; empty where that is not known. */
std::string package_of (std::string_view element);

/** Source and text of an ERROR or WARNING message, and what its writer added
 * for experts; not the place in the code. */
std::string told (GstMessage *message, const GError *error, const gchar *debug);
/** The same of a WARNING message. */
std::string warned (GstMessage *message);
/** The same of an INFO message: what its writer added, as gst-launch has it,
 * else the text. */
std::string noted (GstMessage *message);

/** "name: field=value ..." of an element message. */
std::string fields_of (GstMessage *message);

/** "name: counter=value ...": the read-only numbers of an element of the
 * plugin, shown and late frames of a video sink; empty for any other. */
std::string counters_of (GstElement *element);

/** Lines on stderr, the last of which may be progress: rewritten on a terminal,
 * one every ten seconds in a log. */
class Status
{
public:
  /** @p what  stands in front of every line. */
  explicit Status (std::string what);
  void progress (const std::string &text);
  void line (const std::string &text);

private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  bool terminal_;
  bool open_ = false; // the terminal's line is progress
  Clock::time_point next_ = Clock::now () + std::chrono::seconds (2);
};

} // namespace report
