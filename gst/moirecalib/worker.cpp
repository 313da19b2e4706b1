/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib's thread: gives frames to the session, draws and posts results.
 * Fields of messages: docs/streams.md. */
#include <algorithm>
#include <new>
#include <system_error>

#include "common/messages.h"
#include "moirecalib.h"

#define GST_CAT_DEFAULT moirecalib_debug

namespace codedexposure::gst::moire
{

namespace
{

StageMove
move_of (const StageCorrection &correction, const Pose &sigma)
{
  return {correction.offset.x, correction.offset.y, correction.rotation,
      correction.magnification, correction.deviation, correction.stage_x,
      correction.stage_y, correction.stage_theta, correction.magnify,
      sigma.shift_x, sigma.shift_y, sigma.rotation, sigma.magnification};
}

MoireMapping
message_of (const CalibrationResult &result, const StageCorrection &correction)
{
  const auto pixels = [&result] (PixelQuality what) {
    return guint64 (result.pixels (what));
  };
  const Pose pose = result.mapping.pose ();
  return {{move_of (correction, result.mapping.pose_sigma ())},
      result.mapping.to_json (), "", "", pose.shift_x, pose.shift_y,
      pose.stretch, result.psf_sigma, result.misfit,
      pixels (PixelQuality::good), pixels (PixelQuality::uncovered),
      pixels (PixelQuality::low_contrast), pixels (PixelQuality::saturated),
      pixels (PixelQuality::outlier)};
}

constexpr const char *kMapping = "mapping"; // code of PROGRESS messages

class Worker
{
public:
  explicit Worker (GstMoireCalib *self)
      : self_ (self), exchange_ (state (self).exchange)
  {
  }

  void run ();

private:
  void begin (guint run);
  void choose_schedule (std::optional<Schedule> &schedule);
  void find_phase (const Sample &sample);
  void align (const Sample &sample);
  void collect (const Sample &sample);
  void solve ();
  void finish (const CalibrationResult &result);
  void finish_second ();
  MoireMapping write_files (CalibrationReport report, const Settings &settings,
      const std::string &location, const std::string &to);
  void fail (const std::string &why);
  void fail_of_memory ();
  void set (Stage stage);
  void draw (const std::string &title, const std::vector<std::string> &lines,
      std::optional<double> progress);
  template <typename Use>
  auto with_pixels (const Sample &sample, Use use);

  /** What there is to do. */
  struct Task {
    guint run = 0;
    std::optional<Geometry> geometry; ///< of a new run, which begins
    std::optional<Sample> sample;
    bool collects = false;
    bool solves = false;
  };
  Task next_task ();
  void work_on (const Task &task);

  GstMoireCalib *self_;
  Exchange &exchange_;
  guint run_ = 0;
  Settings settings_;
  Geometry geometry_;
  std::optional<CalibrationSession> session_; ///< of this run
  std::optional<SecondSession> second_;       ///< beside it
  std::optional<StageCorrection> correction_; ///< that the panel shows
  bool failed_ = false;                       ///< in this run
};

void
Worker::begin (guint run)
{
  run_ = run;
  settings_ = settings_of (self_);
  session_.reset ();
  second_.reset ();
  correction_.reset ();
  failed_ = false;
  std::optional<Schedule> schedule = geometry_.schedule;
  if (geometry_.mode == Mode::phase)
    choose_schedule (schedule);
  session_.emplace (CalibrationSession::Options{.camera = geometry_.camera (),
      .mirrors = geometry_.mirrors,
      .bits = settings_.bits > 0 ? settings_.bits : geometry_.bits,
      .patterns = geometry_.patterns,
      .schedule = std::move (schedule),
      .off_beam = geometry_.off_beam});
  if (geometry_.mode == Mode::phase)
    return;
  const auto grating = Pattern::parse (settings_.live_pattern ());
  const auto expected = session_->expect (
      grating ? *grating : live_grating (), settings_.stage.pixels_per_mirror);
  if (!expected)
    POST_WARNING (self_, STREAM, FORMAT,
        "Fringes cannot be read: " + expected.error ().message);
}

/** The one whose phase is sought: the property's, or else the stream's. */
void
Worker::choose_schedule (std::optional<Schedule> &schedule)
{
  if (!settings_.schedule.empty ()) {
    const Result<Schedule> asked = Schedule::parse (settings_.schedule);
    if (!asked)
      return fail (asked.error ().message);
    schedule = *asked;
  }
  if (!schedule)
    fail (
        "the stream has no schedule in its tags; set the schedule property to "
        "what the mirrors show");
}

template <typename Use>
auto
Worker::with_pixels (const Sample &sample, Use use)
{
  MappedFrame mapped (geometry_.info, sample.frame.get (), GST_MAP_READ);
  using Said = decltype (use (ImageView<const guint8> ()));
  return mapped ? read_pixels (mapped, use)
                : Said (Error{"a frame cannot be read"});
}

void
Worker::set (Stage stage)
{
  {
    const std::lock_guard guard (exchange_.lock);
    if (exchange_.run != run_ || (exchange_.progress.stage == Stage::mapping &&
                                     int (stage) < int (Stage::mapping)))
      return;
    exchange_.progress.stage = stage;
    exchange_.progress.aligned_readings = session_ ? session_->aligned () : 0;
  }
  set_stage (self_, stage);
}

void
Worker::draw (const std::string &title, const std::vector<std::string> &lines,
    std::optional<double> progress)
{
  if (!settings_.overlay || geometry_.camera ().width < 160 ||
      geometry_.camera ().height < 120)
    return;
  PanelContent content{.title = title,
      .headline = correction_ && !progress ? travel_line (*correction_) : "",
      .lines = lines,
      .progress = progress,
      .correction = correction_,
      .stage = settings_.stage};
  if (correction_ && session_->last_fringes ()) {
    content.fringes_x = &session_->last_fringes ()->x;
    content.fringes_y = &session_->last_fringes ()->y;
  }
  auto panel =
      std::make_shared<const Panel> (draw_panel (geometry_.camera (), content));
  const std::lock_guard guard (exchange_.lock);
  exchange_.panel = std::move (panel);
}

void
Worker::align (const Sample &sample)
{
  locked (exchange_.lock,
      [&] { exchange_.progress.readings += exchange_.run == run_; });
  settings_ = settings_of (self_);
  const auto alignment = with_pixels (sample, [this] (auto pixels) {
    return session_->align (pixels, settings_.stage);
  });
  if (!alignment) {
    correction_.reset ();
    set (Stage::searching);
    return draw ("searching", {alignment.error ().message}, {});
  }
  if (!*alignment)
    return;
  const auto &[reading, correction] = **alignment;
  correction_ = correction;
  /* The reading comes first, so that a state follows its reason. */
  post_message (
      self_, MoireReading{{move_of (correction, reading.mapping.pose_sigma ())},
                 sample.number, sample.pts, stage_text (correction.state),
                 reading.contrast.x, reading.contrast.y, reading.coverage,
                 reading.saturated});
  set (correction.state);
  draw (stage_text (correction.state), alignment_lines (**alignment), {});
}

void
Worker::collect (const Sample &sample)
{
  if (failed_)
    return;
  if (session_->collected () == 0)
    settings_ = settings_of (self_);
  const int total = int (geometry_.patterns.size ()) * settings_.frames;
  const Pattern pattern = *Pattern::parse (sample.pattern);
  const auto added = with_pixels (sample,
      [&] (auto pixels) { return session_->collect (pattern, pixels); });
  if (!added)
    return fail (added.error ().message);
  if (sample.partner) {
    if (!second_)
      second_.emplace (geometry_, settings_);
    second_->collect (pattern, *sample.partner);
  }
  const int collected = session_->collected ();
  const std::string text = "frame " + std::to_string (collected) + " of " +
                           std::to_string (total) + ", " + sample.pattern;
  correction_.reset ();
  if (collected % settings_.frames == 0)
    post_progress (self_, GST_PROGRESS_TYPE_CONTINUE, kMapping, text);
  draw ("mapping", {text}, double (collected) / std::max (1, total));
}

/* Posted once: the next frames would fail in the same way. */
void
Worker::fail (const std::string &why)
{
  const bool maps = geometry_.mode != Mode::phase;
  failed_ = true;
  set (Stage::failed);
  if (maps) {
    draw ("no mapping", {why}, {});
    post_progress (self_, GST_PROGRESS_TYPE_ERROR, kMapping, why);
  }
  POST_WARNING (self_, STREAM, FAILED,
      std::string (
          maps ? "There is no mapping" : "The tile's phase cannot be found") +
          ": " + why);
}

/* The run ends; setting the mode begins another. */
void
Worker::fail_of_memory ()
{
  session_.reset ();
  failed_ = true;
  set (Stage::failed);
  GST_ELEMENT_WARNING (self_, RESOURCE, NO_SPACE_LEFT,
      ("The calibration ended: out of memory."), (nullptr));
}

void
Worker::find_phase (const Sample &sample)
{
  const auto found = with_pixels (
      sample, [this] (auto pixels) { return session_->find_phase (pixels); });
  if (!found)
    return fail (found.error ().message);
  {
    const std::lock_guard guard (exchange_.lock);
    exchange_.progress.confidence = session_->confidence ();
    if (!*found || exchange_.run != run_)
      return;
    exchange_.found.schedule = (*found)->schedule;
    exchange_.found.mapping.reset ();
    exchange_.found.due = true;
  }
  set (Stage::found);
  const auto &[tile, schedule] = **found;
  post_message (
      self_, MoirePhase{sample.number, sample.pts, tile.phase.x, tile.phase.y,
                 tile.confidence, tile.contrast, schedule.text ()});
}

void
Worker::solve ()
{
  if (failed_ || session_->collected () == 0)
    return;
  set (Stage::solving);
  draw ("solving", {std::to_string (session_->collected ()) + " frames"}, 1.0);
  finish_second ();
  const auto result = session_->solve ();
  if (!result)
    return fail (result.error ().message);
  if (*result)
    finish (**result);
}

/* @report: with the result. Returns the message of it, which names the files
 * that were written. */
MoireMapping
Worker::write_files (CalibrationReport report, const Settings &settings,
    const std::string &location, const std::string &to)
{
  const CalibrationResult &result = *report.result;
  const StageCorrection correction =
      correct_stage (result.mapping, settings.stage);
  MoireMapping message = message_of (result, correction);
  const auto take = [this] (const std::string &path, const Result<void> &done) {
    if (!done)
      POST_WARNING (self_, RESOURCE, WRITE, done.error ().message);
    return done ? path : "";
  };
  if (!location.empty ())
    message.location = take (location, result.mapping.save (location));
  if (to.empty ())
    return message;
  const double tolerance = settings.stage.tolerance;
  report.verdict = alignment_verdict (correction, tolerance);
  report.within = correction.deviation <= tolerance;
  report.lines = report_lines (result, correction);
  const auto live = Pattern::parse (settings.live_pattern ());
  if (live && report.before)
    report.lines.push_back (
        "Fringes: from white to white is a displacement of " +
        std::to_string (live->period) + " mirrors");
  message.report = take (to, write_report (to, report));
  return message;
}

/* Before that of the first camera, which ends the run. */
void
Worker::finish_second ()
{
  const Settings settings = settings_of (self_);
  const auto warn = [&] (const std::string &why) {
    POST_WARNING (self_, STREAM, FAILED,
        "There is no mapping of the second camera: " + why);
  };
  if (!second_ && !settings.second_location.empty ())
    warn ("its frames did not come with those of the first; put "
          "codedexposure-pair before moirecalib");
  if (!second_)
    return;
  const auto solved = second_->solve ();
  if (!solved)
    return warn (solved.error ().message);
  if (!*solved)
    return warn ("its frames cannot be read");
  const CalibrationResult &result = **solved;
  const MoireMapping message = write_files (
      {.title = "Second camera against mirrors", .result = &result}, settings,
      settings.second_location, settings.second_report);
  locked (
      self_, [&] { state (self_).second_mapping = result.mapping.to_json (); });
  locked (exchange_.lock, [&] { exchange_.found.second = result.mapping; });
  g_object_notify (G_OBJECT (self_), "second-mapping");
  post_message (self_, MoireSecondMapping{message});
}

void
Worker::finish (const CalibrationResult &result)
{
  const Settings settings = settings_of (self_);
  const MoireMapping message =
      write_files ({.title = "Camera against mirrors",
                       .before = session_->first_fringes (),
                       .after = session_->last_fringes (),
                       .result = &result},
          settings, settings.location, settings.report);
  locked (self_, [&] { state (self_).mapping = result.mapping.to_json (); });
  locked (exchange_.lock, [&] {
    exchange_.found.mapping = result.mapping;
    exchange_.found.schedule.reset ();
    exchange_.found.due = true;
  });
  set (Stage::mapped);
  correction_ = correct_stage (result.mapping, settings.stage);
  draw ("mapped", mapping_lines (result, *correction_), 1.0);
  post_progress (self_, GST_PROGRESS_TYPE_COMPLETE, kMapping,
      "mapped with " + std::to_string (session_->collected ()) + " frames");
  g_object_notify (G_OBJECT (self_), "mapping");
  post_message (self_, message);
}

/** The next one; the exchange's lock is held. Collected frames come first, and
 * are solved when there are no more. */
Worker::Task
Worker::next_task ()
{
  Task task;
  task.run = exchange_.run;
  if (exchange_.run != run_)
    task.geometry = exchange_.geometry;
  if (!exchange_.queue.samples.empty ()) {
    task.collects = true;
    task.sample = std::move (exchange_.queue.samples.front ());
    exchange_.queue.samples.pop_front ();
  } else if (exchange_.queue.solve) {
    task.solves = std::exchange (exchange_.queue.solve, false);
  } else {
    task.sample = std::exchange (exchange_.queue.live, std::nullopt);
  }
  return task;
}

void
Worker::work_on (const Task &task)
{
  if (task.geometry) {
    geometry_ = *task.geometry;
    begin (task.run);
  }
  if (!session_)
    return;
  if (task.solves)
    solve ();
  else if (task.collects)
    collect (*task.sample);
  else if (geometry_.mode != Mode::phase)
    align (*task.sample);
  else if (!failed_)
    find_phase (*task.sample);
}

void
Worker::run ()
{
  std::unique_lock guard (exchange_.lock);
  while (true) {
    exchange_.busy = false;
    exchange_.changed.notify_all ();
    exchange_.changed.wait (
        guard, [this] { return exchange_.quit || !exchange_.queue.empty (); });
    if (exchange_.quit)
      return;
    exchange_.busy = true;
    bool enough = true;
    try {
      const Task task = next_task ();
      guard.unlock ();
      work_on (task);
    } catch (const std::bad_alloc &) {
      enough = false;
    }
    if (guard.owns_lock ())
      guard.unlock ();
    if (!enough)
      fail_of_memory ();
    guard.lock ();
  }
}

} // namespace

void
set_stage (GstMoireCalib *self, Stage stage)
{
  const Stage before =
      locked (self, [&] { return std::exchange (state (self).stage, stage); });
  if (before == stage)
    return;
  post_message (self, MoireState{stage_text (stage), stage_text (before)});
  g_object_notify (G_OBJECT (self), "state");
}

bool
start_worker (GstMoireCalib *self)
{
  CalibState &st = state (self);
  Exchange &exchange = st.exchange;
  locked (exchange.lock, [&] {
    exchange.quit = exchange.flushing = false;
    exchange.geometry.reset ();
    exchange.panel.reset ();
    exchange.progress.stage = Stage::searching;
    exchange.found = {};
  });
  try {
    st.worker = std::thread ([self] { Worker (self).run (); });
  } catch (const std::system_error &failure) {
    POST_ERROR (self, RESOURCE, FAILED,
        "No thread for the calibration: " + std::string (failure.what ()));
    return false;
  }
  return true;
}

void
stop_worker (GstMoireCalib *self)
{
  CalibState &st = state (self);
  if (!st.worker.joinable ())
    return;
  locked (st.exchange.lock, [&] {
    st.exchange.quit = true;
    st.exchange.queue = {};
  });
  st.exchange.changed.notify_all ();
  st.worker.join ();
}

} // namespace codedexposure::gst::moire
