/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The end of a run: what was written, what is said of it, and its status. */
#include "run.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "record/matroska.h"

namespace codedexposure::app
{

namespace
{

/* What was read is a file whose head lists the tracks of a recording. */
bool
has_tracks (const std::string &recording)
{
  const auto info = recording_info (recording, false);
  return info && info->head.video != 0 && info->head.lines != 0;
}

} // namespace

void
Run::say_no_frame ()
{
  if (damaged_ && has_tracks (job_.source))
    status_.line ("error: no coded frame of " + job_.source +
                  " can be decoded: they are damaged or missing; use "
                  "another copy of the recording");
  else if (damaged_)
    status_.line ("error: the head of the stream is damaged, so its tracks "
                  "cannot be found; if ffmpeg reads it, \"ffmpeg -i IN.mkv "
                  "-map 0 -c copy OUT.mkv\" writes a new one");
  else if (job_.times.is_part () && !failed_)
    status_.line (
        "no coded frame lies in this part of the recording" +
        (job_.times.start
                ? format (", from %g s on; check whether frames were lost "
                          "there, or the recording ends before it",
                      double (*job_.times.start) / double (GST_SECOND))
                : ""));
  else if (interrupted_ && exit_ != Exit::interrupted)
    status_.line ("stopped before the first coded frame");
  else if (!interrupted_ && !failed_) // else the error says why
    status_.line ("error: no coded frame arrived");
}

/* A recording gets its name however it ends; other results only if they are
 * whole. False: something could not be written. */
bool
Run::publish ()
{
  /* From NULL it would open files, and wait for who reads a pipe. */
  if (GST_STATE (pipeline ()) != GST_STATE_NULL)
    gst_element_set_state (pipeline (), GST_STATE_READY);
  if (job_.window)
    job_.window->finish ();
  stop ();
  const bool whole =
      exit_ == Exit::done && (job_.ends_by_signal || !interrupted_) && !failed_;
  const auto how = container_damaged_             ? Outputs::Finish::discard
                   : whole || job_.ends_by_signal ? Outputs::Finish::publish
                                                  : Outputs::Finish::keep;
  const bool failed = failed_ || (recording_ && recording_->is_removed ());
  const auto errors = job_.outputs.finish (how, failed);
  for (const std::string &error : errors)
    status_.line ("error: " + error);
  return errors.empty ();
}

std::string
Run::flaws () const
{
  /* What writes pictures takes coded frames without pictures for lost ones. */
  auto counting = job_.recorders;
  if (counting.empty () && job_.counted &&
      counter_of (job_.counted, "frames-not-coded") > 0)
    counting = {job_.counted};
  std::string text = flaws_of (pipeline (), counting, job_.hurried);
  for (const auto &queue : leaky_queues_)
    for (GstElement *element : job_.hurried)
      if (queue->is_before (element) && queue->skipped () > 0)
        text += format (", %" G_GINT64_FORMAT " skipped by %s",
            queue->skipped (), GST_OBJECT_NAME (element));
  return text;
}

RunResult
Run::finish ()
{
  if (job_.options.verbose && frames () > 0)
    print_counters ();
  const std::string flaws = failed_ ? flaws_before_error_ : this->flaws ();
  if (job_.counted) {
    not_coded_ = counter_of (job_.counted, "frames-not-coded");
    lost_ = counter_of (job_.counted, "frames-lost");
  }
  const guint64 lost = counters_of (job_.recorders, "frames-lost");
  lost_ = std::max (lost_, lost);
  if (job_.reader)
    missing_ = counter_of (job_.reader, "frames-missing");
  const bool published = publish ();
  RunResult result{exit_, frames (), container_damaged_, interrupted_};
  if (container_damaged_)
    return result;
  if (counter_ && frames () == 0 &&
      (exit_ != Exit::nobody || job_.times.is_part ())) {
    say_no_frame ();
    result.exit = interrupted_ ? Exit::interrupted
                  : job_.times.is_part () && !damaged_ && !failed_
                      ? Exit::nobody
                      : Exit::failed;
  } else if (result.exit == Exit::done) {
    damaged_ |= job_.is_cut_short;
    if (interrupted_ && !job_.ends_by_signal)
      result.exit = Exit::interrupted;
    else if (damaged_ || lost > 0)
      result.exit = Exit::damaged;
  }
  if (result.exit == Exit::done && receivers_ && receivers_->count () == 0) {
    status_.line ("nobody received the stream");
    result.exit = Exit::nobody;
  }
  if (job_.judge)
    result.exit = job_.judge (result);
  if (!published || window_failed_ || (recording_ && recording_->is_removed ()))
    result.exit = Exit::failed;
  const std::string wrote = job_.outputs.summary (guint64 (frames ()));
  if (frames () > 0 || !counter_)
    print_result (flaws, wrote);
  if (lost > 0)
    status_.line (coded_frames (lost) +
                  (lost == 1 ? " was lost and is" : " were lost and are") +
                  " not in the recording, which says where");
  if (job_.options.json)
    print_json (result.exit, flaws);
  return result;
}

void
Run::print_result (const std::string &flaws, const std::string &wrote)
{
  const bool whole =
      exit_ == Exit::done && (job_.ends_by_signal || !interrupted_);
  const bool in_vain = exit_ == Exit::failed && !job_.outputs.empty ();
  if (!job_.has_result || (wrote.empty () && (in_vain || !counter_)))
    return;
  std::string text;
  if (counter_)
    text = coded_frames (guint64 (frames ())) +
           (job_.source.empty () ? "" : " of " + job_.source) + flaws;
  if (const int count = receivers_ ? receivers_->count () : 0; count > 0)
    text += format ("; sent to %d receiver%s", count, count > 1 ? "s" : "");
  if (!wrote.empty ())
    text += (text.empty () ? "" : "; ") +
            std::string (exit_ == Exit::failed ? "kept what was complete: "
                         : whole               ? "wrote "
                                               : "stopped; kept ") +
            wrote;
  status_.line (text);
}

void
Run::print_json (Exit exit, const std::string &flaws) const
{
  std::vector<std::string> outputs = job_.outputs.names ();
  outputs.insert (outputs.end (), wrote_.begin (), wrote_.end ());
  nlohmann::ordered_json json = {{"command", job_.command},
      {"source", job_.source}, {"frames", frames ()}, {"not_coded", not_coded_},
      {"lost", lost_}, {"missing", missing_},
      {"pictures", job_.outputs.pictures ()},
      {"flaws", flaws.empty () ? "" : flaws.substr (2)}, {"outputs", outputs},
      {"damaged", damaged_}, {"interrupted", interrupted_},
      {"status", int (exit)}};
  if (!error_.text.empty ())
    json["error"] = error_.text, json["element"] = error_.element;
  if (!job_.schedule.empty ())
    json["schedule"] = job_.schedule;
  app::print_json (json);
}

void
Run::print_counters ()
{
  const double seconds = seconds_since (began_);
  const double cpu = cpu_seconds () - cpu_at_start_;
  status_.line (
      format ("%.1f s, %.1f coded frames/s, %.0f %% of one processor core",
          seconds, double (frames ()) / seconds, 100 * cpu / seconds));
  each_element (pipeline (), [this] (GstElement *element) {
    const std::string counters = counters_of (element);
    if (!counters.empty ())
      status_.line (counters);
  });
  for (const auto &queue : leaky_queues_)
    status_.line (queue->counters ());
}

} // namespace codedexposure::app
