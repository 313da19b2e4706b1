/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-launch: runs one pipeline for a script of this folder and
 * prints its progress, errors and counters. */
#include <atomic>
#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <sys/prctl.h>

#include "buffer_watch.h"
#include "byte_watch.h"
#include "each_element.h"
#include "excerpt.h"
#include "frame_counter.h"
#include "frame_limit.h"
#include "launch_options.h"
#include "leaky_queue.h"
#include "notes.h"
#include "plain_text.h"
#include "player.h"
#include "recording_branch.h"
#include "screen.h"
#include "whole_picture.h"
#include "window.h"

namespace
{

using namespace codedexposure::gst;
using namespace report;
using Clock = std::chrono::steady_clock;

/* Exit status; the scripts use it. */
enum ExitCode {
  kDone = 0,
  kFailed = 1,
  kUsage = 2,
  kDamaged = 3, // done, but frames are missing or not as they were recorded
  kNobodyListens = 4,
  kNoFrame = 5,
  kContainer = 6, // the container of the recording is damaged
  kEmpty = 7      // the excerpt has no frame
};

class Launch : public Player
{
public:
  explicit Launch (const LaunchOptions &options)
      : Player (options.what ? options.what : "launch", options.verbose),
        options_ (options)
  {
  }
  ~Launch () override { stop (); }

  int run ();

private:
  bool connect_counter ();
  void add_window ();
  void add_notes ();
  void add_recording ();
  bool finish_notes ();
  gint64 frames () const { return counter_ ? counter_->frames ().load () : 0; }
  void watch_leaky_queues ();
  void begin () override;
  bool has_receiver ();
  void play ();
  void on_signal (int times) override;
  void on_message (GstMessage *message) override;
  void on_error (GstMessage *message);
  void on_element_message (GstMessage *message);
  bool take_container_error (std::string_view kind, const GstObject *source,
      GQuark domain, const std::string &text);
  bool set_playing ();
  void end_after_error (GstObject *failed);
  void tick ();
  void watch_for_silence (gint64 frames);
  int finish (int code);
  void print_counters ();
  static gboolean on_tick (gpointer self)
  {
    static_cast<Launch *> (self)->tick ();
    return G_SOURCE_CONTINUE;
  }
  static gboolean on_end_timeout (gpointer self)
  {
    static_cast<Launch *> (self)->quit (kFailed);
    return G_SOURCE_REMOVE;
  }

  const LaunchOptions &options_;
  std::unique_ptr<FrameCounter> counter_;
  std::vector<std::unique_ptr<LeakyQueue>> leaky_queues_;
  std::unique_ptr<ByteWatch> byte_watch_;
  ObjectPtr<GstElement> buffer_;
  std::unique_ptr<BufferWatch> buffer_watch_;
  std::unique_ptr<RecordingBranch> recording_; // beside a window
  std::unique_ptr<FrameLimit> limit_;
  std::unique_ptr<ExcerptFilter> excerpt_;
  std::unique_ptr<NoteWriter> note_writer_;
  std::unique_ptr<NoteReader> note_reader_;
  std::unique_ptr<Window> window_;
  gint64 frames_before_ = -1; // at the last tick
  bool silent_ = false;       // no frame came for a while, and that was said
  Clock::time_point began_ = Clock::now ();
  Clock::time_point heard_ = Clock::now (); // the last new frame
  Clock::time_point retry_until_ = Clock::now ();
  double cpu_at_start_ = 0;
  bool playing_ = false;
  bool waiting_ = false; // for a receiver, or to try to connect again
  std::string noticed_;  // the last notice
  bool interrupted_ = false;
  bool reads_ = false;       // a recording, or from a sender
  bool said_needed_ = false; // the needed message came
  bool failed_ = false;      // the stream ends because of an error
  bool damaged_ = false;     // frames are missing or damaged
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

bool
Launch::connect_counter ()
{
  if (!options_.count)
    return true;
  const ObjectPtr<GstElement> element (find (options_.count));
  ObjectPtr<GstPad> sink (
      element ? gst_element_get_static_pad (element.get (), "sink") : nullptr);
  if (!sink) {
    status_.line (format (
        "the pipeline has no element %s to count frames at", options_.count));
    return false;
  }
  counter_ =
      std::make_unique<FrameCounter> (std::move (sink), options_.times, [this] {
        status_.line ("error: cannot seek in this stream; leave out --start "
                      "and --duration");
        quit (kFailed);
      });
  return true;
}

/* After the gates of the excerpt: only pictures that pass them are noted. */
void
Launch::add_notes ()
{
  if (options_.notes)
    if (const auto element = find ("output-kept"))
      note_writer_ =
          std::make_unique<NoteWriter> (element.get (), options_.notes);
  if (options_.from_notes)
    if (const auto element = find ("noted"))
      note_reader_ =
          std::make_unique<NoteReader> (element.get (), options_.from_notes);
}

/* False, with a message: they are not complete. */
bool
Launch::finish_notes ()
{
  const std::string problem = note_writer_ && !note_writer_->finish ()
                                  ? "cannot write the notes"
                              : note_reader_ ? note_reader_->finish ()
                                             : "";
  if (!problem.empty ())
    status_.line ("error: " + problem);
  return problem.empty ();
}

void
Launch::add_window ()
{
  if (!counter_ || !Window::is_in (pipeline_.get ()))
    return;
  const auto said = [this] (const std::string &text, bool failed) {
    if (failed)
      status_.line ("error: " + text);
    else
      status_.output ("wrote " + text);
  };
  window_ = std::make_unique<Window> (pipeline_.get (), counter_->pad (),
      find_screen ().room (), options_.what ? options_.what : "window",
      Window::Calls{[this] { on_signal (1); }, said});
}

/* A queue that is not leaky blocks its source. */
void
Launch::add_recording ()
{
  gint leaky = 0;
  buffer_ = find ("buffer");
  if (buffer_ && options_.live)
    buffer_watch_ = std::make_unique<BufferWatch> (buffer_.get ());
  if (buffer_)
    g_object_get (buffer_.get (), "leaky", &leaky, nullptr);
  if (window_ && leaky != 0)
    recording_ =
        std::make_unique<RecordingBranch> (pipeline_.get (), buffer_.get ());
}

void
Launch::watch_leaky_queues ()
{
  for_each_element (pipeline_.get (), [this] (GstElement *element) {
    gint leaky = 0;
    if (g_object_class_find_property (G_OBJECT_GET_CLASS (element), "leaky"))
      g_object_get (element, "leaky", &leaky, nullptr);
    if (leaky != 0)
      leaky_queues_.push_back (std::make_unique<LeakyQueue> (element));
  });
}

void
Launch::play ()
{
  waiting_ = false;
  began_ = Clock::now ();
  cpu_at_start_ = cpu_seconds ();
  playing_ = set_playing ();
}

/* A paused sink accepts receivers, so they do not miss the first frame. */
bool
Launch::has_receiver ()
{
  const ObjectPtr<GstElement> sink (find (options_.receiver));
  guint receivers = 0;
  g_object_get (sink.get (), "num-handles", &receivers, nullptr);
  return receivers > 0;
}

void
Launch::begin ()
{
  retry_until_ = Clock::now () +
                 std::chrono::milliseconds (gint64 (options_.retry * 1000));
  waiting_ = options_.receiver != nullptr;
  if (waiting_)
    gst_element_set_state (pipeline_.get (), GST_STATE_PAUSED);
  else
    play ();
}

int
Launch::run ()
{
  if (!connect_counter () ||
      !claim_outputs (options_.force, counter_ ? counter_->pad () : nullptr))
    return kFailed;
  if (counter_ && options_.times.excerpt)
    excerpt_ =
        std::make_unique<ExcerptFilter> (pipeline_.get (), counter_->pad (),
            *options_.times.excerpt, options_.ledger ? options_.ledger : "");
  add_notes ();
  for_each_element (pipeline_.get (), [] (GstElement *element) {
    if (g_str_has_prefix (GST_OBJECT_NAME (element), "from-zero"))
      begin_at_zero (element);
  });
  watch_leaky_queues ();
  add_window ();
  whole_picture::wait_for_inputs (pipeline_.get ());
  if (const ObjectPtr<GstElement> demuxer = find ("file");
      demuxer && counter_) {
    reads_ = true;
    byte_watch_ =
        std::make_unique<ByteWatch> (demuxer.get (), counter_->frames ());
  }
  if (options_.plain_text) {
    const ObjectPtr<GstElement> texts = find (options_.plain_text);
    const ObjectPtr<GstElement> demuxer = find ("file");
    make_texts_plain (texts.get ());
    keep_times_of_file (demuxer.get ());
  }
  add_recording ();
  if (const ObjectPtr<GstElement> limit = find ("limit"))
    limit_ = std::make_unique<FrameLimit> (limit.get ());
  const guint ticks = g_timeout_add (200, on_tick, this);
  const int code = loop ();
  g_source_remove (ticks);
  return finish (code);
}

/* Prints the result and returns the exit status. */
int
Launch::finish (int code)
{
  if (window_)
    window_->save_snapshots ();
  const bool no_frame = counter_ && frames () == 0;
  if (no_frame && damaged_ && code != kContainer) {
    status_.line ("error: the head of the stream is damaged, so its tracks "
                  "cannot be found; if ffmpeg reads it, \"ffmpeg -i IN.mkv "
                  "-map 0 -c copy OUT.mkv\" writes a new one");
    code = kNoFrame;
  } else if (code == kDone && no_frame && excerpt_) {
    status_.line ("no coded frame lies in the excerpt");
    code = kEmpty;
  } else if (code == kDone && no_frame) {
    status_.line (options_.times.start > 0
                      ? format ("error: no coded frame arrived; check whether "
                                "%g s is after the end",
                            options_.times.start)
                      : "error: no coded frame arrived");
    code = kNoFrame;
  } else if (code == kFailed && no_frame)
    code = kNoFrame;
  if (options_.verbose && frames () > 0)
    print_counters ();
  const std::string flaws = flaws_of (pipeline_.get ());
  const bool noted = finish_notes ();
  if (!finish_outputs (code != kContainer && noted) || !noted)
    return kFailed;
  if (excerpt_ && !excerpt_->finish ()) {
    status_.line ("error: cannot write the ledger");
    return kFailed;
  }
  const std::string wrote = outputs_.summary (guint64 (frames ()));
  if (code != kDone && !wrote.empty ())
    status_.line ("kept what was complete: " + wrote);
  if (code == kDone && options_.need)
    return said_needed_ ? kDone : kFailed;
  if (code != kDone || options_.no_result || (!counter_ && wrote.empty ()))
    return code;
  std::string result;
  if (counter_)
    result = format ("%" G_GINT64_FORMAT " coded frames", frames ()) + flaws +
             (wrote.empty () ? "" : "; ");
  status_.line (result + (wrote.empty () ? "" : "wrote " + wrote));
  if (recording_ && recording_->is_removed ())
    return kFailed;
  return damaged_ ? kDamaged : kDone;
}

/* The first signal ends the stream, so that files are finished; the second
 * stops immediately. */
void
Launch::on_signal (int times)
{
  if (times > 1 || !playing_ || failed_) {
    status_.line ("stopped");
    quit (kFailed);
    return;
  }
  if (std::exchange (interrupted_, true))
    return;
  status_.line ("stopping; press Ctrl-C again to stop immediately");
  /* Behind a recording, lines of the track are not yet matched to frames. */
  if (reads_ && counter_)
    counter_->end ();
  else
    gst_element_send_event (pipeline_.get (), gst_event_new_eos ());
}

/* An error also ends a change of the state, which sinks wait for that have
 * their first frame. */
bool
Launch::set_playing ()
{
  return gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING) !=
         GST_STATE_CHANGE_FAILURE;
}

/* A demuxer that finds a damaged index stops before the first frame. From front
 * to back it reads all frames, and meets the damage at the end. */
bool
Launch::take_container_error (std::string_view kind, const GstObject *source,
    GQuark domain, const std::string &text)
{
  const bool of_container =
      kind == "matroskademux" ||
      std::string_view (GST_OBJECT_NAME (source)) == "file-queue" ||
      (kind == "filesrc" && domain == GST_STREAM_ERROR);
  if (!of_container)
    return false;
  if (!options_.salvage) {
    quit (kContainer);
    return true;
  }
  status_.line ("warning: " + text);
  damaged_ = true;
  const ObjectPtr<GstElement> demuxer (find ("file"));
  if (!demuxer || demuxer->numsrcpads == 0) {
    quit (kNoFrame);
    return true;
  }
  /* A demuxer that has failed does not pass the end on. */
  if (kind == "matroskademux")
    gst_element_call_async (demuxer.get (), end_at_sources, nullptr, nullptr);
  set_playing ();
  return true;
}

/* Ends the stream, so that the frames before the error are in finished files.
 * The element that @failed takes nothing more, so the end is also sent from
 * it. A blocked element does not pass it on. */
void
Launch::end_after_error (GstObject *failed)
{
  constexpr guint kPatience = 5; // s
  if (std::exchange (failed_, true))
    return;
  if (!playing_ || outputs_.empty () || !set_playing ()) {
    quit (kFailed);
    return;
  }
  gst_element_send_event (pipeline_.get (), gst_event_new_eos ());
  if (GST_IS_ELEMENT (failed))
    gst_element_call_async (
        GST_ELEMENT (failed), end_at_sources, nullptr, nullptr);
  g_timeout_add_seconds (kPatience, on_end_timeout, this);
}

void
Launch::on_error (GstMessage *message)
{
  if (recording_ && recording_->is_removed () &&
      recording_->has (GST_MESSAGE_SRC (message)))
    return; // it follows from the first
  GError *error = nullptr;
  gchar *detail = nullptr;
  gst_message_parse_error (message, &error, &detail);
  const CharPtr owned_detail (detail);
  const std::unique_ptr<GError, decltype (&g_error_free)> owned (
      error, g_error_free);
  GstObject *source = GST_MESSAGE_SRC (message);
  const GstElementFactory *factory =
      GST_IS_ELEMENT (source) ? gst_element_get_factory (GST_ELEMENT (source))
                              : nullptr;
  const std::string_view kind = factory ? GST_OBJECT_NAME (factory) : "";

  if (kind == "tcpclientsrc" && frames () == 0 &&
      g_error_matches (
          error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_OPEN_READ)) {
    gst_element_set_state (pipeline_.get (), GST_STATE_NULL);
    playing_ = false;
    waiting_ = true;
    if (Clock::now () >= retry_until_)
      quit (kNobodyListens);
    return;
  }
  if (factory && GST_OBJECT_FLAG_IS_SET (source, GST_ELEMENT_FLAG_SINK) &&
      g_error_matches (
          error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NOT_FOUND) &&
      frames () > 0) {
    status_.line ("the window was closed");
    quit (kDone);
    return;
  }
  if (take_container_error (
          kind, source, error->domain, told (message, error, detail)))
    return;
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
Launch::on_element_message (GstMessage *message)
{
  const GstStructure *structure = gst_message_get_structure (message);
  const std::string_view name = gst_structure_get_name (structure);
  said_needed_ |= options_.need && name == options_.need;
  const bool damage =
      name == "codedexposure/frames-damaged" ||
      name == "codedexposure/frames-missing" ||
      name == "codedexposure/stream-cut" ||
      /* Who receives may have joined late. */
      (name == "codedexposure/stream-incomplete" && options_.retry <= 0);
  if (damage && (interrupted_ || failed_)) // the stream was cut here
    return;
  damaged_ |= damage;
  if (options_.verbose &&
      (name.starts_with ("codedexposure/") || name.starts_with ("dmdsync/") ||
          name.starts_with ("moirecalib/")))
    status_.line (fields_of (message));
  const std::string text = notice (structure);
  /* dmdsync and demux report the same loss. */
  if (!text.empty () && std::exchange (noticed_, text) != text)
    status_.line (text);
}

void
Launch::on_message (GstMessage *message)
{
  switch (GST_MESSAGE_TYPE (message)) {
  case GST_MESSAGE_EOS:
    quit (failed_ ? kFailed : kDone);
    break;
  case GST_MESSAGE_ERROR:
    if (failed_) // it follows from the first
      set_playing ();
    else
      on_error (message);
    break;
  case GST_MESSAGE_WARNING:
    /* A recording without a track has none to link; codedexposure-restore says
     * what follows from that. */
    if (const std::string text = warned (message);
        text.find ("subtitle_0") == text.npos)
      status_.line ("warning: " + text);
    break;
  case GST_MESSAGE_INFO:
    if (options_.verbose)
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
    gst_bin_recalculate_latency (GST_BIN (pipeline_.get ()));
    break;
  case GST_MESSAGE_ELEMENT:
    on_element_message (message);
    break;
  default:
    break;
  }
}

/* A camera whose frames are all incomplete posts no error. */
void
Launch::watch_for_silence (gint64 frames)
{
  constexpr auto kSilence = std::chrono::seconds (5);
  if (std::exchange (frames_before_, frames) != frames)
    heard_ = Clock::now ();
  if (!counter_ || !options_.camera || silent_ ||
      Clock::now () - heard_ < kSilence)
    return;
  silent_ = true;
  status_.line ("warning: no complete frame for 5 s; check the trigger of the "
                "camera and its network, which loses packets if the frames "
                "arrive incomplete");
}

void
Launch::tick ()
{
  if (waiting_) {
    if (!options_.receiver || has_receiver ())
      play ();
    else
      status_.progress ("waiting for a receiver");
    return;
  }
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
  if (window_) {
    const std::string flaws = flaws_of (pipeline_.get ());
    window_->tell (format ("%" G_GINT64_FORMAT " coded frames", frames) +
                       (flaws.empty () ? ", none lost or corrupted" : flaws),
        !flaws.empty ());
  }

  const double done = counter_->done (options_.total);
  std::string text = format ("%" G_GINT64_FORMAT " coded frames in %s", frames,
      minutes (seconds).c_str ());
  if (done > 0 && done <= 1)
    text += format (", %.0f %%, %s left", 100 * done,
        minutes (seconds * (1 - done) / done).c_str ());
  status_.progress (text);
}

void
Launch::print_counters ()
{
  const double seconds =
      std::chrono::duration<double> (Clock::now () - began_).count ();
  const double cpu = cpu_seconds () - cpu_at_start_;
  status_.line (
      format ("%.1f s, %.1f coded frames/s, %.0f %% of one processor core",
          seconds, double (frames ()) / seconds, 100 * cpu / seconds));

  for_each_element (pipeline_.get (), [this] (GstElement *element) {
    const std::string counters = counters_of (element);
    if (!counters.empty ())
      status_.line (counters);
  });
  for (const auto &queue : leaky_queues_)
    status_.line (queue->counters ());
}

} // namespace

int
main (int argc, char **argv)
{
  LaunchOptions options;
  const char *pipeline = options.parse (argc, argv);
  if (!pipeline)
    return kUsage;
  /* A script that is killed cannot pass that on. */
  prctl (PR_SET_PDEATHSIG, SIGTERM);

  int code = kFailed;
  {
    Launch launch (options);
    if (launch.parse (pipeline))
      code = launch.run ();
  }
  gst_deinit ();
  return code;
}
