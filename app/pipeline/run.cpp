/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Plays a pipeline: progress, errors, the end, and the result. */
#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "pipeline/buffer_watch.h"
#include "pipeline/frame_limit.h"
#include "pipeline/job.h"
#include "pipeline/leaky_queue.h"
#include "pipeline/loop.h"
#include "pipeline/messages.h"
#include "pipeline/receivers.h"
#include "pipeline/recording_branch.h"
#include "pipeline/status.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

using Clock = std::chrono::steady_clock;

class Run : public Loop
{
public:
  explicit Run (Job &job)
      : Loop (job.graph.pipeline ()), job_ (job),
        status_ (job.command, job.options.verbose),
        damaged_ (job.salvage && job.retry <= 0)
  {
  }
  ~Run () override { stop (); }

  RunResult play ();

private:
  void prepare ();
  void watch_window ();
  void begin () override;
  void on_signal (int times) override;
  void on_message (GstMessage *message) override;
  void on_error (GstMessage *message);
  void on_element_message (const GstStructure *structure, GstMessage *message);
  bool try_to_connect_again (std::string_view kind, const GError *error);
  bool is_closed_window (GstObject *source, const GError *error) const;
  void start_playing ();
  bool set_playing ();
  void end_when_received (Exit exit);
  void wait_for_receivers ();
  void end_after_error (GstObject *failed);
  void end (Exit exit);
  void stop () { gst_element_set_state (pipeline (), GST_STATE_NULL); }
  void tick ();
  void watch_for_silence (gint64 frames);
  RunResult finish ();
  void say_no_frame ();
  bool publish ();
  void print_result (const std::string &flaws, const std::string &wrote);
  void print_json (Exit exit, const std::string &flaws) const;
  void print_counters ();
  gint64 frames () const { return counter_ ? counter_->frames ().load () : 0; }

  Job &job_;
  Status status_;
  std::unique_ptr<FrameCounter> counter_;
  std::vector<std::unique_ptr<LeakyQueue>> leaky_queues_;
  std::unique_ptr<BufferWatch> buffer_watch_;
  std::unique_ptr<Receivers> receivers_;
  std::unique_ptr<RecordingBranch> recording_; // beside a window
  std::unique_ptr<FrameLimit> limit_;
  Exit exit_ = Exit::done;
  Clock::time_point began_ = Clock::now ();
  Clock::time_point heard_ = Clock::now (); // the last new frame
  Clock::time_point retry_until_ = Clock::now ();
  gint64 frames_before_ = -1; // at the last tick
  double cpu_at_start_ = 0;
  bool playing_ = false;
  bool waiting_ = false; // for a receiver, or to try to connect again
  bool ending_ = false;  // the stream has ended
  bool silent_ = false;  // no frame came for a while, and that was said
  bool interrupted_ = false;
  bool failed_ = false; // the stream ends because of an error
  bool damaged_;        // frames are missing or damaged
  bool container_damaged_ = false;
  std::string noticed_; // the last notice
};

void
end_at_sources (GstElement *element, gpointer)
{
  const auto end = [] (GstElement *, GstPad *pad, gpointer) {
    gst_pad_push_event (pad, gst_event_new_eos ());
    return gboolean (TRUE);
  };
  gst_element_foreach_src_pad (element, end, nullptr);
}

void
Run::prepare ()
{
  if (job_.counted)
    counter_ = std::make_unique<FrameCounter> (pad_of (job_.counted, "sink"),
        job_.times, [this] { end (Exit::nobody); });
  each_element (pipeline (), [this] (GstElement *element) {
    gint leaky = 0;
    if (g_object_class_find_property (G_OBJECT_GET_CLASS (element), "leaky"))
      g_object_get (element, "leaky", &leaky, nullptr);
    if (leaky != 0)
      leaky_queues_.push_back (std::make_unique<LeakyQueue> (element));
  });
  if (job_.buffer)
    buffer_watch_ = std::make_unique<BufferWatch> (job_.buffer);
  if (job_.buffer && job_.buffer_may_fail)
    recording_ = std::make_unique<RecordingBranch> (pipeline (), job_.buffer);
  if (job_.server)
    receivers_ = std::make_unique<Receivers> (job_.server);
  if (job_.window)
    watch_window ();
  if (job_.limit)
    limit_ = std::make_unique<FrameLimit> (job_.limit);
}

void
Run::watch_window ()
{
  const auto said = [this] (const std::string &text, bool failed) {
    if (failed)
      status_.line ("error: " + text);
    else
      status_.output ("wrote " + text);
  };
  job_.window->begin ({[this] { on_signal (1); }, said});
}

RunResult
Run::play ()
{
  value_of (job_.outputs.check (), Exit::usage);
  prepare ();
  const auto errors = job_.outputs.claim (job_.options.force);
  for (const std::string &error : errors)
    status_.line ("error: " + error);
  if (!errors.empty ())
    return {};
  const auto on_tick = [] (gpointer self) {
    static_cast<Run *> (self)->tick ();
    return gboolean (G_SOURCE_CONTINUE);
  };
  const guint ticks = g_timeout_add (200, on_tick, this);
  run ();
  g_source_remove (ticks);
  return finish ();
}

void
Run::begin ()
{
  retry_until_ = Clock::now () + std::chrono::milliseconds (
                                     gint64 (job_.retry.value_or (0) * 1000));
  waiting_ = job_.waits_for_receiver;
  if (waiting_)
    gst_element_set_state (pipeline (), GST_STATE_PAUSED);
  else
    start_playing ();
}

void
Run::start_playing ()
{
  waiting_ = false;
  began_ = Clock::now ();
  cpu_at_start_ = cpu_seconds ();
  playing_ = set_playing ();
}

/* An error also ends a change of the state, which sinks wait for that have
 * their first frame. */
bool
Run::set_playing ()
{
  return gst_element_set_state (pipeline (), GST_STATE_PLAYING) !=
         GST_STATE_CHANGE_FAILURE;
}

void
Run::end (Exit exit)
{
  exit_ = exit;
  quit ();
}

/* Receivers may be behind. */
void
Run::end_when_received (Exit exit)
{
  exit_ = exit;
  ending_ = true;
  if (receivers_)
    wait_for_receivers ();
  else
    quit ();
}

void
Run::wait_for_receivers ()
{
  if (receivers_->are_done ())
    quit ();
  else
    status_.progress ("waiting for the receivers");
}

/* The first signal ends the stream, so that files are finished; the second
 * stops immediately. */
void
Run::on_signal (int times)
{
  if (times > 1 || !playing_ || failed_) {
    interrupted_ = true;
    status_.line ("stopped");
    end (Exit::interrupted);
    return;
  }
  if (std::exchange (interrupted_, true))
    return;
  status_.line ("stopping; press Ctrl-C again to stop immediately");
  /* Behind a recording, lines of the track are not yet matched to frames. */
  if (job_.reader && counter_)
    counter_->end ();
  else
    gst_element_send_event (pipeline (), gst_event_new_eos ());
}

bool
Run::try_to_connect_again (std::string_view kind, const GError *error)
{
  if (kind != "tcpclientsrc" || frames () > 0 ||
      !g_error_matches (
          error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_OPEN_READ))
    return false;
  stop ();
  playing_ = false;
  waiting_ = true;
  if (Clock::now () >= retry_until_)
    end (Exit::nobody);
  return true;
}

bool
Run::is_closed_window (GstObject *source, const GError *error) const
{
  return job_.has_window && GST_IS_ELEMENT (source) &&
         GST_OBJECT_FLAG_IS_SET (source, GST_ELEMENT_FLAG_SINK) &&
         g_error_matches (
             error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NOT_FOUND) &&
         frames () > 0;
}

/* Ends the stream, so that the frames before the error are in finished files.
 * The element that @failed takes nothing more, so the end is also sent from
 * it. A blocked element does not pass it on. */
void
Run::end_after_error (GstObject *failed)
{
  constexpr guint kPatience = 5; // s
  if (std::exchange (failed_, true))
    return;
  if (!playing_ || job_.outputs.empty () || !set_playing ()) {
    end (Exit::failed);
    return;
  }
  gst_element_send_event (pipeline (), gst_event_new_eos ());
  if (GST_IS_ELEMENT (failed))
    gst_element_call_async (
        GST_ELEMENT (failed), end_at_sources, nullptr, nullptr);
  const auto on_timeout = [] (gpointer self) {
    static_cast<Run *> (self)->end (Exit::failed);
    return gboolean (G_SOURCE_REMOVE);
  };
  g_timeout_add_seconds (kPatience, on_timeout, this);
}

void
Run::on_error (GstMessage *message)
{
  GstObject *source = GST_MESSAGE_SRC (message);
  if (recording_ && recording_->is_removed () && recording_->has (source))
    return; // it follows from the first
  GError *error = nullptr;
  gchar *detail = nullptr;
  gst_message_parse_error (message, &error, &detail);
  const CharPtr owned_detail (detail);
  const std::unique_ptr<GError, decltype (&g_error_free)> owned (
      error, g_error_free);
  const std::string kind = factory_of (source);

  if (try_to_connect_again (kind, error))
    return;
  if (is_closed_window (source, error)) {
    status_.line ("the window was closed");
    end (Exit::done);
    return;
  }
  /* A demuxer that finds a damaged index stops before the first frame. From
   * front to back it reads all frames, and meets the damage at the end. */
  if (job_.reader && !job_.salvage && error->domain == GST_STREAM_ERROR &&
      (source == GST_OBJECT (job_.reader) || kind == "filesrc" ||
          gst_object_has_as_ancestor (source, GST_OBJECT (job_.reader)))) {
    container_damaged_ = true;
    end (Exit::failed);
    return;
  }
  status_.line ("error: " + told (message, error, detail));
  const std::string remedy = remedy_for (kind, error, detail);
  if (!remedy.empty ())
    status_.line (remedy);
  if (recording_ && recording_->has (source)) {
    status_.line ("the recording ends here; the window goes on");
    recording_->remove ();
    return;
  }
  end_after_error (source);
}

/* Losses are warnings; all messages of this plugin are for --verbose. */
void
Run::on_element_message (const GstStructure *structure, GstMessage *message)
{
  const std::string_view name = gst_structure_get_name (structure);
  if (job_.on_message)
    job_.on_message (structure);
  const bool damage =
      name == "codedexposure/frames-damaged" ||
      name == "codedexposure/frames-missing" ||
      name == "codedexposure/stream-cut" ||
      /* Who receives may have joined late. */
      (name == "codedexposure/stream-incomplete" && !job_.retry);
  if (damage && (interrupted_ || failed_)) // the stream was cut here
    return;
  damaged_ |= damage;
  if (job_.options.verbose &&
      (name.starts_with ("codedexposure/") || name.starts_with ("dmdsync/") ||
          name.starts_with ("moirecalib/")))
    status_.line (fields_of (message));
  const std::string text = notice (structure);
  if (!text.empty () && std::exchange (noticed_, text) != text)
    status_.line (text);
}

void
Run::on_message (GstMessage *message)
{
  switch (GST_MESSAGE_TYPE (message)) {
  case GST_MESSAGE_EOS:
    end_when_received (failed_ ? Exit::failed : Exit::done);
    break;
  case GST_MESSAGE_ERROR:
    if (failed_) // it follows from the first
      set_playing ();
    else
      on_error (message);
    break;
  case GST_MESSAGE_WARNING:
    status_.line ("warning: " + warned (message));
    break;
  case GST_MESSAGE_INFO:
    if (job_.options.verbose)
      status_.line ("info: " + noted (message));
    break;
  case GST_MESSAGE_PROGRESS: {
    GstProgressType type;
    gchar *code = nullptr, *text = nullptr;
    gst_message_parse_progress (message, &type, &code, &text);
    status_.progress (text ? text : code);
    g_free (code);
    g_free (text);
    break;
  }
  case GST_MESSAGE_LATENCY:
    gst_bin_recalculate_latency (GST_BIN (pipeline ()));
    break;
  case GST_MESSAGE_ELEMENT:
    on_element_message (gst_message_get_structure (message), message);
    break;
  default:
    break;
  }
}

/* A camera whose frames are all incomplete posts no error. */
void
Run::watch_for_silence (gint64 frames)
{
  constexpr auto kSilence = std::chrono::seconds (5);
  if (std::exchange (frames_before_, frames) != frames)
    heard_ = Clock::now ();
  if (!job_.from_camera || silent_ || interrupted_ ||
      Clock::now () - heard_ < kSilence)
    return;
  silent_ = true;
  status_.line ("warning: no complete frame for 5 s; check the trigger of the "
                "camera and its network, which loses packets if the frames "
                "arrive incomplete");
}

void
Run::tick ()
{
  if (waiting_) {
    if (!receivers_ || receivers_->is_anybody_there ())
      start_playing ();
    else
      status_.progress ("waiting for a receiver");
    return;
  }
  if (ending_)
    return wait_for_receivers ();
  const double seconds =
      std::chrono::duration<double> (Clock::now () - began_).count ();
  const gint64 frames = this->frames ();
  watch_for_silence (frames);
  if (buffer_watch_ && !interrupted_ && !failed_ &&
      !(recording_ && recording_->is_removed ()))
    if (const std::string text = buffer_watch_->tick (); !text.empty ())
      status_.line (text);
  if (!counter_ || frames == 0)
    return;
  if (job_.window) {
    const std::string flaws = flaws_of (pipeline ());
    job_.window->tell (
        format ("%" G_GINT64_FORMAT " coded frames", frames) +
            (flaws.empty () ? ", none lost or corrupted" : flaws),
        !flaws.empty ());
  }
  const double done = counter_->done (job_.total.value_or (0));
  std::string text = format ("%" G_GINT64_FORMAT " coded frames in %s", frames,
      minutes (seconds).c_str ());
  if (done > 0 && done <= 1)
    text += format (", %.0f %%, %s left", 100 * done,
        minutes (seconds * (1 - done) / done).c_str ());
  status_.progress (text);
}

void
Run::say_no_frame ()
{
  if (damaged_)
    status_.line ("error: the head of the stream is damaged, so its tracks "
                  "cannot be found; if ffmpeg reads it, \"ffmpeg -i IN.mkv "
                  "-map 0 -c copy OUT.mkv\" writes a new one");
  else if (job_.times.is_part ())
    status_.line (
        "no coded frame lies in this part of the recording" +
        (job_.times.start
                ? format (", from %g s on; check whether that is after its end",
                      double (*job_.times.start) / double (GST_SECOND))
                : ""));
  else if (!interrupted_)
    status_.line ("error: no coded frame arrived");
  else if (exit_ != Exit::interrupted)
    status_.line ("stopped before the first coded frame");
}

/* A recording gets its name however it ends; other results only if they are
 * whole. False: something could not be written. */
bool
Run::publish ()
{
  stop ();
  const bool whole =
      exit_ == Exit::done && (job_.ends_by_signal || !interrupted_) && !failed_;
  const auto how = container_damaged_             ? Outputs::Finish::discard
                   : whole || job_.ends_by_signal ? Outputs::Finish::publish
                                                  : Outputs::Finish::keep;
  const auto errors = job_.outputs.finish (how);
  for (const std::string &error : errors)
    status_.line ("error: " + error);
  return errors.empty ();
}

RunResult
Run::finish ()
{
  if (job_.options.verbose && frames () > 0)
    print_counters ();
  if (job_.window)
    job_.window->finish ();
  const std::string flaws = flaws_of (pipeline ());
  const bool published = publish ();
  RunResult result{exit_, frames (), container_damaged_, interrupted_};
  if (container_damaged_)
    return result;
  if (counter_ && frames () == 0 &&
      (exit_ != Exit::nobody || job_.times.is_part ())) {
    say_no_frame ();
    result.exit = interrupted_                         ? Exit::interrupted
                  : job_.times.is_part () && !damaged_ ? Exit::nobody
                                                       : Exit::failed;
  } else if (result.exit == Exit::done) {
    if (interrupted_ && !job_.ends_by_signal)
      result.exit = Exit::interrupted;
    else if (damaged_)
      result.exit = Exit::damaged;
  }
  if (result.exit == Exit::done && receivers_ && receivers_->count () == 0) {
    status_.line ("nobody received the stream");
    result.exit = Exit::nobody;
  }
  if (!published || (recording_ && recording_->is_removed ()))
    result.exit = Exit::failed;
  const std::string wrote = job_.outputs.summary (guint64 (frames ()));
  if (frames () > 0 || !counter_)
    print_result (flaws, wrote);
  if (job_.options.json)
    print_json (result.exit, flaws);
  return result;
}

void
Run::print_result (const std::string &flaws, const std::string &wrote)
{
  const bool whole =
      exit_ == Exit::done && (job_.ends_by_signal || !interrupted_);
  if (!job_.has_result || (!counter_ && wrote.empty ()))
    return;
  std::string text;
  if (counter_)
    text = format ("%" G_GINT64_FORMAT " coded frames", frames ()) +
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
  nlohmann::ordered_json json = {{"command", job_.command},
      {"source", job_.source}, {"frames", frames ()},
      {"flaws", flaws.empty () ? "" : flaws.substr (2)},
      {"outputs", job_.outputs.names ()}, {"damaged", damaged_},
      {"interrupted", interrupted_}, {"status", int (exit)}};
  std::printf ("%s\n", json.dump ().c_str ());
}

void
Run::print_counters ()
{
  const double seconds =
      std::chrono::duration<double> (Clock::now () - began_).count ();
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

} // namespace

void
print_pipeline (Job &job)
{
  job.outputs.name_elements ();
  std::printf ("%s\n", launch_line (job.graph.pipeline ()).c_str ());
}

RunResult
play (Job &job)
{
  if (job.options.print) {
    print_pipeline (job);
    return {.exit = Exit::done};
  }
  return Run (job).play ();
}

} // namespace codedexposure::app
