/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Messages and counters of elements, as texts for the user. */
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gst/gst.h>

#include "common/raii.h"

namespace codedexposure::app
{

/** printf into a string. */
std::string format (const char *pattern, ...) G_GNUC_PRINTF (1, 2);

/** "one, two". */
std::string joined (const std::vector<std::string> &texts);

double seconds_since (std::chrono::steady_clock::time_point begin);

/** "1 coded frame", "2 coded frames". */
std::string coded_frames (std::uint64_t count);

/** "m:ss" of a time in seconds. */
std::string minutes (double seconds);

/** Processor time of this process so far, in seconds. */
double cpu_seconds ();

/** The Debian package of @p element; empty if not known. */
std::string package_of (std::string_view element);

/** What an ERROR, WARNING or INFO message says. */
struct Told {
  explicit Told (GstMessage *message);

  std::unique_ptr<GError, FreeWith<g_error_free>> error;
  gst::CharPtr debug;
};
/** The next message that @p pipeline posts of these GstMessageTypes, within @p
 * patience; null: there is none. */
gst::MessagePtr next_message (
    GstElement *pipeline, int types, GstClockTime patience = 0);

/** Source and text of such a message with its details, without the position in
 * the code; properties are named as the options of commands. Of an INFO
 * message, the details alone, as gst-launch-1.0 prints them. */
std::string told (GstMessage *message);
/** Whether an error of an element of @p kind is the one after which aravissrc
 * ends: its camera sent nothing for 2 s. */
bool is_silence (std::string_view kind, const Told &told);
/** What the user can do about an error of an element of @p kind; empty: its
 * text says it.
 * @p change  of the schedule, "from A to B"; empty: there was none. */
std::string remedy_for (
    std::string_view kind, const Told &told, const std::string &change = {});

/** "name: field=value ..." of an element message. */
std::string fields_of (GstMessage *message);

/** An element message about frames that were lost or damaged, as a warning for
 * the user; empty: it is about something else.
 * @p origin  position from which the user counts, ns. */
std::string notice (GstMessage *posted, GstClockTime origin);

/** A value of the statistics of @p element; 0: it has none of that name. */
guint64 counter_of (GstElement *element, const char *counter);
/** The sum of those of @p elements. */
guint64 counters_of (
    const std::vector<GstElement *> &elements, const char *counter);

/** ", 3 lost, 1 corrupted": coded frames of @p pipeline, from the largest
 * counters of its elements, of which several count the same frames; empty:
 * none.
 * @p recorders  count those that are lost; if there are none, any element does
 * but those that are @p hurried. */
std::string flaws_of (GstElement *pipeline,
    const std::vector<GstElement *> &recorders,
    const std::vector<GstElement *> &hurried);

/** "name: counter=value ...": the counters in the property stats of an element
 * of this plugin (without stats: its read-only numbers), or the shown and late
 * frames of a video sink; empty for other elements. */
std::string counters_of (GstElement *element);

} // namespace codedexposure::app
