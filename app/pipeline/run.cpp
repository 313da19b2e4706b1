/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Plays a pipeline: signals, progress and errors. */
#include "run.h"

#include <algorithm>
#include <csignal>
#include <utility>

#include <nlohmann/json.hpp>

#include "common/messages.h"
#include "pipeline/pads.h"
#include "record/matroska.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

void
end_at_sources (GstElement *element, gpointer)
{
  const auto end = [] (GstElement *, GstPad *pad, gpointer) {
    gst_pad_push_event (pad, gst_event_new_eos ());
    return gboolean (TRUE);
  };
  gst_element_foreach_src_pad (element, end, nullptr);
}

} // namespace

Run::Run (Job &job)
    : job_ (job), loop_ (g_main_loop_new (nullptr, FALSE)),
      status_ (job.command, job.options.verbose),
      damaged_ (job.salvage && !job.retry)
{
}

Run::~Run ()
{
  stop ();
  if (patience_)
    g_source_remove (patience_);
  g_main_loop_unref (loop_);
}

bool
Run::claim_outputs ()
{
  const auto errors = job_.outputs.claim (job_.options.force);
  for (const std::string &error : errors)
    status_.line ("error: " + error);
  if (!errors.empty () && job_.options.json)
    app::print_json ({{"error", joined (errors)}}, 2);
  return errors.empty ();
}

/* Signals are handled before files are made and the pipeline starts, so that
 * one in between leaves neither a file nor an open device. */
bool
Run::run_loop ()
{
  const auto on_bus = [] (GstBus *, GstMessage *message, gpointer self) {
    static_cast<Run *> (self)->on_message (message);
    return gboolean (G_SOURCE_CONTINUE);
  };
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline ()));
  gst_bus_add_watch (bus.get (), on_bus, this);
  /* The reader of the messages may be gone. */
  std::signal (SIGPIPE, SIG_IGN);
  std::optional<Signals> own;
  Signals &signals = job_.signals ? *job_.signals : own.emplace ();
  signals.tell ([this] (int times) { on_signal (times); });
  const bool claimed = claim_outputs ();
  if (claimed) {
    begin ();
    g_main_loop_run (loop_);
  }
  signals.tell (nullptr);
  gst_bus_remove_watch (bus.get ());
  return claimed;
}

void
Run::prepare ()
{
  if (job_.counted)
    counter_ = std::make_unique<FrameCounter> (pad_of (job_.counted, "sink"),
        job_.times, [this] { end (Exit::nobody); });
  if (job_.recorded)
    add_probe (pad_of (job_.recorded, "sink").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [this] (GstPad *pad, GstPadProbeInfo *info) {
          origin_ = stream_time (
              pad, GST_BUFFER_PTS (GST_PAD_PROBE_INFO_BUFFER (info)));
          return GST_PAD_PROBE_REMOVE;
        });
  each_element (pipeline (), [this] (GstElement *element) {
    gint leaky = 0;
    if (g_object_class_find_property (G_OBJECT_GET_CLASS (element), "leaky"))
      g_object_get (element, "leaky", &leaky, nullptr);
    if (leaky != 0)
      leaky_queues_.push_back (std::make_unique<LeakyQueue> (element));
  });
  for (GstElement *buffer : job_.buffers)
    buffer_watches_.emplace_back (buffer);
  if (job_.buffer_may_fail && !job_.buffers.empty ())
    recording_ =
        std::make_unique<RecordingBranch> (pipeline (), job_.buffers.front ());
  if (job_.server)
    receivers_ = std::make_unique<Receivers> (job_.server);
  if (job_.window)
    watch_window ();
}

void
Run::watch_window ()
{
  const auto wrote = [this] (const std::vector<std::string> &files,
                         const std::string &more) {
    wrote_.insert (wrote_.end (), files.begin (), files.end ());
    const std::string text = "wrote " + joined (files) + more;
    if (job_.options.json)
      status_.line (text);
    else
      status_.output (text);
  };
  const auto failed = [this] (const std::string &why) {
    status_.line ("error: " + why);
    if (!std::exchange (window_failed_, true) && error_.text.empty ())
      error_ = {"window", why};
  };
  const auto told = [this] (const std::string &text) { status_.line (text); };
  job_.window->begin (
      {pipeline (), [this] { on_signal (1); }, wrote, failed, told});
}

RunResult
Run::play ()
{
  value_of (job_.outputs.check (pipeline ()), Exit::usage);
  prepare ();
  const auto on_tick = [] (gpointer self) {
    static_cast<Run *> (self)->tick ();
    return gboolean (G_SOURCE_CONTINUE);
  };
  const guint ticks = g_timeout_add (200, on_tick, this);
  const bool claimed = run_loop ();
  g_source_remove (ticks);
  return claimed ? finish () : RunResult{};
}

void
Run::begin ()
{
  retry_until_ = Clock::now () + std::chrono::milliseconds (
                                     gint64 (job_.retry.value_or (0) * 1000));
  waiting_ = job_.waits_for_receiver || !job_.outputs.unread_pipe ().empty ();
  if (job_.waits_for_receiver)
    gst_element_set_state (pipeline (), GST_STATE_PAUSED);
  else if (!waiting_)
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
  g_main_loop_quit (loop_);
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
    g_main_loop_quit (loop_);
}

void
Run::wait_for_receivers ()
{
  if (receivers_->are_done ())
    g_main_loop_quit (loop_);
  else
    status_.progress ("waiting for the receivers");
}

/* The first signal ends the stream, so that files are finished; the second
 * stops immediately. */
void
Run::on_signal (int times)
{
  if (job_.is_moved_in) {
    end (Exit::done);
    return;
  }
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
  return job_.window && GST_IS_ELEMENT (source) &&
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
  flaws_before_error_ = flaws ();
  if (!playing_ || job_.outputs.empty () || !set_playing ()) {
    end (Exit::failed);
    return;
  }
  gst_element_send_event (pipeline (), gst_event_new_eos ());
  if (GST_IS_ELEMENT (failed))
    gst_element_call_async (
        GST_ELEMENT (failed), end_at_sources, nullptr, nullptr);
  const auto on_timeout = [] (gpointer data) {
    auto *self = static_cast<Run *> (data);
    self->patience_ = 0;
    self->end (Exit::failed);
    return gboolean (G_SOURCE_REMOVE);
  };
  patience_ = g_timeout_add_seconds (kPatience, on_timeout, this);
}

void
Run::on_error (GstMessage *message)
{
  GstObject *source = GST_MESSAGE_SRC (message);
  if (recording_ && recording_->is_removed () && recording_->has (source))
    return; // it follows from the first
  const Told parts (message);
  const GError *error = parts.error.get ();
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
  const std::string text = told (message);
  status_.line ("error: " + text);
  if (error_.text.empty ())
    error_ = {GST_OBJECT_NAME (source), text};
  const std::string remedy =
      remedy_for (kind, parts, counter_ ? counter_->schedule_change () : "");
  if (!remedy.empty ())
    status_.line (remedy);
  else if (job_.retry && frames () == 0 && error->domain == GST_STREAM_ERROR)
    status_.line (job_.source + " sends no recording; start \"codedexposure "
                                "send\" there, or set its --host and --port");
  if (recording_ && recording_->has (source)) {
    status_.line ("the recording ends here; the window goes on");
    recording_->remove ();
    if (playing_)
      set_playing ();
    return;
  }
  end_after_error (source);
}

namespace
{

/* Whether frames that are wanted may follow the last one that was read, behind
 * damage. A part that another program cut out has no last line either. */
bool
goes_on (const Job &job, GstMessage *stream_cut)
{
  const auto info = recording_info (job.source);
  const auto is_of_reader = [&] {
    return gst_object_has_as_ancestor (
        GST_MESSAGE_SRC (stream_cut), GST_OBJECT (job.reader));
  };
  const auto is_wanted = [&] (Nanoseconds pts) {
    return job.times.holds (GstClockTime (pts - info->start.value_or (0)));
  };
  /* Those of a second camera end on their own. */
  const auto has_more = [&] {
    return !gst_structure_has_field (
               gst_message_get_structure (stream_cut), "camera") &&
           std::cmp_greater (std::ranges::count_if (info->times, is_wanted),
               counter_of (job.reader, "frames"));
  };
  return info && (info->is_damaged ||
                     (job.is_finished && (!is_of_reader () || has_more ())));
}

} // namespace

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
  /* A demuxer takes the length that damage claims, which may be all the rest.
   */
  if (name == "codedexposure/stream-cut" && !job_.salvage &&
      goes_on (job_, message)) {
    container_damaged_ = true;
    end (Exit::failed);
    return;
  }
  damaged_ |= damage;
  if (job_.options.verbose &&
      (name.starts_with ("codedexposure/") || name.starts_with ("dmdsync/") ||
          name.starts_with ("moirecalib/")))
    status_.line (fields_of (message));
  if (name == gst::FramesLost::kName &&
      std::ranges::count (
          job_.hurried, GST_ELEMENT (GST_MESSAGE_SRC (message))))
    return;
  const std::string text = notice (message, origin_);
  if (!text.empty () && std::exchange (noticed_, text) != text)
    warn (text);
}

void
Run::warn (const std::string &text)
{
  if (!job_.said || job_.said->insert (text).second)
    status_.line (text);
}

void
Run::on_message (GstMessage *message)
{
  if (job_.window && job_.window->take (message))
    return;
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
    warn ("warning: " + told (message));
    break;
  case GST_MESSAGE_INFO:
    if (job_.options.verbose)
      status_.line ("info: " + told (message));
    break;
  case GST_MESSAGE_PROGRESS: {
    GstProgressType type;
    gchar *code = nullptr, *text = nullptr;
    gst_message_parse_progress (message, &type, &code, &text);
    status_.progress (text ? text : code);
    if (code == std::string_view ("upload"))
      uploading_ =
          type == GST_PROGRESS_TYPE_START || type == GST_PROGRESS_TYPE_CONTINUE;
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

/* A camera whose frames are all incomplete posts no error. Frames that wait for
 * a slow disk have come, and masks that are sent to the DMD trigger none yet.
 */
void
Run::watch_for_silence (gint64 frames)
{
  constexpr auto kSilence = std::chrono::seconds (5);
  guint waiting = 0;
  if (!job_.buffers.empty ())
    g_object_get (
        job_.buffers.front (), "current-level-buffers", &waiting, nullptr);
  if (std::exchange (frames_before_, frames) != frames || waiting > 0 ||
      uploading_)
    heard_ = Clock::now ();
  if (!job_.camera || silent_ || interrupted_ ||
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
    if (const std::string pipe = job_.outputs.unread_pipe (); !pipe.empty ())
      status_.progress ("waiting for a program that reads " + pipe);
    else if (!receivers_ || receivers_->is_anybody_there ())
      start_playing ();
    else
      status_.progress ("waiting for a receiver");
    return;
  }
  if (ending_)
    return wait_for_receivers ();
  const double seconds = seconds_since (began_);
  const gint64 frames = this->frames ();
  watch_for_silence (frames);
  if (!interrupted_ && !failed_ && !(recording_ && recording_->is_removed ()))
    for (BufferWatch &watch : buffer_watches_)
      if (const std::string text = watch.tick (); !text.empty ())
        status_.line (text);
  if (!counter_ || frames == 0 || job_.is_moved_in)
    return;
  if (job_.window) {
    const std::string flaws = this->flaws ();
    job_.window->tell (
        coded_frames (guint64 (frames)) +
            (flaws.empty () ? ", none lost or corrupted" : flaws),
        !flaws.empty ());
  }
  if (!job_.has_progress)
    return;
  const double done = counter_->done (job_.total.value_or (0));
  std::string text =
      coded_frames (guint64 (frames)) + " in " + minutes (seconds);
  if (done > 0 && done <= 1)
    text += format (", %.0f %%, %s left", 100 * done,
        minutes (seconds * (1 - done) / done).c_str ());
  status_.progress (text);
}

namespace
{

void
print_pipeline (Job &job)
{
  if (job.times.is_part ())
    usage_error ("--print shows a line for gst-launch-1.0, which plays a whole "
                 "recording; leave --start, --duration, --excerpt and "
                 "--find-phase out");
  value_of (job.outputs.check (job.graph.pipeline ()), Exit::usage);
  const std::string before = job.outputs.name_elements (job.options.force);
  std::printf (
      "%s%s\n", before.c_str (), launch_line (job.graph.pipeline ()).c_str ());
}

} // namespace

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
