/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib's thread: reads fringes, collects patterns, solves, draws. */
#include <algorithm>
#include <cstdarg>

#include "gstmoirecalibstate.h"

#define GST_CAT_DEFAULT moirecalib_debug

namespace cexp::gst::moire
{

namespace
{

std::string format (const char *text, ...) G_GNUC_PRINTF (1, 2);

std::string
format (const char *text, ...)
{
  va_list args;
  va_start (args, text);
  const CharPtr made (g_strdup_vprintf (text, args));
  va_end (args);
  return made.get ();
}

Image<float>
copy_of (ImageView<const float> view)
{
  Image<float> image (view.width, view.height);
  for (int y = 0; y < view.height; y++)
    std::copy_n (view.row (y), view.width, image.view ().row (y));
  return image;
}

FringePair
fringes_of (const LiveMoire &live, const std::string &caption)
{
  return {{copy_of (live.phase (false)), copy_of (live.amplitude (false))},
      {copy_of (live.phase (true)), copy_of (live.amplitude (true))}, caption};
}

/** What to do, and how far it is. */
std::vector<std::string>
lines_of (const LiveReading &reading, const StageCorrection &todo)
{
  const Stance sigma = reading.mapping.stance_sigma ();
  return {
      format ("rotation %+.4f ± %.0e°    magnification %.5f ± %.0e",
          todo.rotation, sigma.rotation, todo.magnification,
          sigma.magnification),
      format ("offset x %+.4f  y %+.4f ± %.0e mirrors    worst corner %.3f",
          todo.offset.x, todo.offset.y, sigma.shift_x, todo.deviation),
      format ("stage: x %+.2f µm   y %+.2f µm   θ %+.1f m°   magnify %+.2f ‰",
          todo.stage_x, todo.stage_y, todo.stage_theta, todo.magnify),
      format ("contrast x %.2f  y %.2f    covered %.0f %%%s",
          reading.contrast.x, reading.contrast.y, 100 * reading.coverage,
          reading.saturated > 0 ? "    SATURATED: less light" : ""),
  };
}

/** @p schedule with its tile at @p phase. */
Result<Schedule>
moved (const Schedule &schedule, Offset phase)
{
  return Schedule::make ({.tile = schedule.tile (),
      .code = schedule.code (),
      .timing = schedule.timing (),
      .order = schedule.order (),
      .phase = phase,
      .leak = schedule.leak (),
      .pilot_rows = schedule.pilot_rows ()});
}

class Worker
{
public:
  explicit Worker (GstMoireCalib *self)
      : self_ (self), exchange_ (state (self).exchange)
  {
  }

  void run ();

private:
  int bits () const
  {
    return settings_.bits > 0 ? settings_.bits : geometry_.bits;
  }
  void begin (guint run);
  void begin_fringes ();
  void begin_phase ();
  void find_phase (const Sample &sample);
  void align (const Sample &sample);
  void collect (const Sample &sample);
  void solve ();
  void finish (const CalibrationResult &result);
  struct Written {
    std::string location, report; ///< empty: not
  };
  Written write_files (
      const CalibrationResult &result, const Settings &settings);
  void fail (const std::string &why);
  void fail_phase (const std::string &why);
  void set (Stage stage);
  void draw (const std::string &title, const std::vector<std::string> &lines,
      std::optional<double> progress);
  template <typename Use>
  auto with_pixels (const Sample &sample, Use use);

  GstMoireCalib *self_;
  Exchange &exchange_;
  guint run_ = 0;
  Settings settings_;
  Geometry geometry_;
  std::optional<LiveMoire> live_;
  std::optional<Schedule> schedule_; ///< whose tile is looked for
  std::optional<Calibration> calibration_;
  std::optional<FringePair> before_, after_;
  std::optional<StageCorrection> correction_;
  int aligned_ = 0;
  int collected_ = 0;
  bool failed_ = false; ///< in this run
};

void
Worker::begin (guint run)
{
  run_ = run;
  settings_ = settings_of (self_);
  live_.reset ();
  schedule_.reset ();
  calibration_.reset ();
  before_.reset ();
  after_.reset ();
  correction_.reset ();
  aligned_ = 0;
  collected_ = 0;
  failed_ = false;
  if (geometry_.mode == Mode::phase)
    begin_phase ();
  else
    begin_fringes ();
}

void
Worker::begin_fringes ()
{
  const auto pattern = Pattern::parse (
      settings_.pattern.empty () ? live_grating ().text () : settings_.pattern);
  const LiveMoire::Options options{
      .period = pattern ? pattern->period : live_grating ().period,
      .bits = bits ()};
  Result<LiveMoire> live =
      LiveMoire::make (centred_mapping (geometry_.camera, geometry_.mirrors,
                           settings_.stage.pixels_per_mirror),
          options);
  if (live)
    live_.emplace (*std::move (live));
  else
    GST_ELEMENT_WARNING (self_, STREAM, FORMAT,
        ("Fringes cannot be read: %s", live.error ().message.c_str ()),
        (nullptr));
}

void
Worker::begin_phase ()
{
  schedule_ = geometry_.schedule;
  if (!settings_.schedule.empty ()) {
    const Result<Schedule> asked = Schedule::parse (settings_.schedule);
    if (!asked)
      return fail_phase (asked.error ().message);
    schedule_ = *asked;
  }
  if (!schedule_)
    fail_phase ("the stream says nothing of its schedule; set the schedule "
                "property to what the mirrors show");
}

template <typename Use>
auto
Worker::with_pixels (const Sample &sample, Use use)
{
  MappedFrame mapped (geometry_.info, sample.frame.get (), GST_MAP_READ);
  using Said = decltype (use (ImageView<const guint8> ()));
  if (!mapped)
    return Said (Error{"a frame cannot be read"});
  if (GST_VIDEO_INFO_FORMAT (&geometry_.info) == GST_VIDEO_FORMAT_GRAY8)
    return use (view_of<const guint8> (mapped));
  return use (view_of<const guint16> (mapped));
}

void
Worker::set (Stage stage)
{
  {
    const std::lock_guard guard (exchange_.lock);
    if (exchange_.run != run_ || (exchange_.stage == Stage::mapping &&
                                     int (stage) < int (Stage::mapping)))
      return;
    exchange_.stage = stage;
    exchange_.aligned_readings = aligned_;
  }
  set_stage (self_, stage);
}

void
Worker::draw (const std::string &title, const std::vector<std::string> &lines,
    std::optional<double> progress)
{
  if (!settings_.overlay || geometry_.camera.width < 160 ||
      geometry_.camera.height < 120)
    return;
  PanelContent content{.title = title,
      .lines = lines,
      .progress = progress,
      .correction = correction_,
      .stage = settings_.stage};
  if (correction_ && after_) {
    content.fringes_x = &after_->x;
    content.fringes_y = &after_->y;
  }
  auto panel =
      std::make_shared<const Panel> (draw_panel (geometry_.camera, content));
  const std::lock_guard guard (exchange_.lock);
  exchange_.panel = std::move (panel);
}

void
Worker::align (const Sample &sample)
{
  {
    const std::lock_guard guard (exchange_.lock);
    exchange_.readings += exchange_.run == run_;
  }
  if (!live_)
    return;
  const auto reading = with_pixels (
      sample, [this] (auto pixels) { return live_->solve (pixels); });
  if (!reading) {
    aligned_ = 0;
    correction_.reset ();
    after_.reset ();
    set (Stage::searching);
    draw ("searching", {reading.error ().message}, {});
    return;
  }
  settings_ = settings_of (self_);
  correction_ = correct_stage (reading->mapping, settings_.stage);
  after_ = fringes_of (*live_, "last look");
  if (!before_)
    before_ = fringes_of (*live_, "first look");
  aligned_ = correction_->state == AlignmentState::aligned ? aligned_ + 1 : 0;
  /* Who waits for a state may then ask for the reading that made it. */
  say_reading (self_, sample, *reading, *correction_);
  set (Stage (correction_->state));
  draw (alignment_state_text (correction_->state),
      lines_of (*reading, *correction_), {});
}

void
Worker::collect (const Sample &sample)
{
  if (failed_)
    return;
  const int total = int (geometry_.patterns.size ()) * settings_.frames;
  if (!calibration_) {
    settings_ = settings_of (self_);
    Result<Calibration> made = Calibration::make (
        geometry_.camera, geometry_.mirrors, geometry_.patterns);
    if (!made)
      return fail (made.error ().message);
    calibration_.emplace (*std::move (made));
  }
  const Pattern pattern = *Pattern::parse (sample.pattern);
  const int significant = bits () > 0 ? bits () : 16;
  const auto added = with_pixels (sample, [&] (auto pixels) {
    if constexpr (sizeof (*pixels.data) == 1)
      return calibration_->add (pattern, pixels);
    else
      return calibration_->add (pattern, pixels, significant);
  });
  if (!added)
    return fail (added.error ().message);
  collected_++;
  const std::string text = "frame " + std::to_string (collected_) + " of " +
                           std::to_string (total) + ", " + sample.pattern;
  correction_.reset ();
  if (collected_ % settings_.frames == 0)
    say_progress (self_, GST_PROGRESS_TYPE_CONTINUE, text);
  draw ("mapping", {text}, double (collected_) / std::max (1, total));
}

/* Once: what the next frames have to say would be the same. */
void
Worker::fail (const std::string &why)
{
  failed_ = true;
  calibration_.reset ();
  set (Stage::failed);
  draw ("no mapping", {why}, {});
  say_progress (self_, GST_PROGRESS_TYPE_ERROR, why);
  GST_ELEMENT_WARNING (self_, STREAM, FAILED,
      ("There is no mapping: %s", why.c_str ()), (nullptr));
}

void
Worker::fail_phase (const std::string &why)
{
  failed_ = true;
  set (Stage::failed);
  GST_ELEMENT_WARNING (self_, STREAM, FAILED,
      ("The tile's phase cannot be found: %s", why.c_str ()), (nullptr));
}

void
Worker::find_phase (const Sample &sample)
{
  if (failed_)
    return;
  const auto tile = with_pixels (sample,
      [this] (auto pixels) { return find_tile_phase (pixels, *schedule_); });
  if (!tile)
    return fail_phase (tile.error ().message);
  {
    const std::lock_guard guard (exchange_.lock);
    exchange_.confidence = std::max (exchange_.confidence, tile->confidence);
  }
  if (tile->confidence < kSure)
    return;
  const Result<Schedule> found = moved (*schedule_, tile->phase);
  if (!found)
    return fail_phase (found.error ().message);
  {
    const std::lock_guard guard (exchange_.lock);
    if (exchange_.run != run_)
      return;
    exchange_.schedule = *found;
    exchange_.mapping.reset ();
    exchange_.setup_due = true;
  }
  set (Stage::found);
  say_phase (self_, sample, {*tile, *found});
}

void
Worker::solve ()
{
  if (!calibration_)
    return;
  set (Stage::solving);
  draw ("solving", {std::to_string (collected_) + " frames"}, 1.0);
  const Result<CalibrationResult> result = calibration_->solve ();
  if (!result)
    return fail (result.error ().message);
  finish (*result);
  calibration_.reset ();
}

Worker::Written
Worker::write_files (const CalibrationResult &result, const Settings &settings)
{
  Written written;
  const auto take = [this] (const std::string &path, const Result<void> &done) {
    if (!done)
      GST_ELEMENT_WARNING (self_, RESOURCE, WRITE,
          ("%s", done.error ().message.c_str ()), (nullptr));
    return done ? path : "";
  };
  if (!settings.location.empty ())
    written.location =
        take (settings.location, result.mapping.save (settings.location));
  if (settings.report.empty ())
    return written;
  const StageCorrection found = correct_stage (result.mapping, settings.stage);
  const Stance sigma = result.mapping.stance_sigma ();
  const CalibrationReport report{.title = "Camera against mirrors",
      .lines = {format (
                    "rotation %+.5f ± %.0e°", found.rotation, sigma.rotation),
          format ("magnification %.6f ± %.0e pixels a mirror",
              found.magnification, sigma.magnification),
          format ("from the nearest good place: x %+.5f, y %+.5f ± %.0e "
                  "mirrors; worst corner %.4f",
              found.offset.x, found.offset.y, sigma.shift_x, found.deviation),
          format ("blur of the optics %.2f pixels; misfit %.2f",
              result.psf_sigma, result.misfit)},
      .before = before_,
      .after = after_,
      .result = &result};
  written.report =
      take (settings.report, write_report (settings.report, report));
  return written;
}

void
Worker::finish (const CalibrationResult &result)
{
  const Settings settings = settings_of (self_);
  const Written written = write_files (result, settings);
  {
    const ObjectLock lock (self_);
    state (self_).mapping = result.mapping.to_json ();
  }
  {
    const std::lock_guard guard (exchange_.lock);
    exchange_.mapping = result.mapping;
    exchange_.schedule.reset ();
    exchange_.setup_due = true;
  }
  set (Stage::mapped);
  correction_ = correct_stage (result.mapping, settings.stage);
  const Stance sigma = result.mapping.stance_sigma ();
  draw ("mapped",
      {format ("rotation %+.5f ± %.0e°    magnification %.6f ± %.0e",
           correction_->rotation, sigma.rotation, correction_->magnification,
           sigma.magnification),
          format ("offset x %+.5f  y %+.5f ± %.0e mirrors    worst corner %.3f",
              correction_->offset.x, correction_->offset.y, sigma.shift_x,
              correction_->deviation)},
      1.0);
  say_progress (self_, GST_PROGRESS_TYPE_COMPLETE,
      "mapped with " + std::to_string (collected_) + " frames");
  g_object_notify (G_OBJECT (self_), "mapping");
  say_mapping (self_, result, written.location, written.report);
}

void
Worker::run ()
{
  std::unique_lock guard (exchange_.lock);
  while (true) {
    exchange_.busy = false;
    exchange_.changed.notify_all ();
    exchange_.changed.wait (guard, [this] {
      return exchange_.quit || exchange_.live || exchange_.solve ||
             !exchange_.samples.empty ();
    });
    if (exchange_.quit)
      return;
    exchange_.busy = true;
    const bool anew = exchange_.run != run_;
    const guint run = exchange_.run;
    if (anew)
      geometry_ = *exchange_.geometry;
    std::optional<Sample> sample;
    const bool collects = !exchange_.samples.empty ();
    bool solves = false;
    if (collects) {
      sample = std::move (exchange_.samples.front ());
      exchange_.samples.pop_front ();
    } else if (exchange_.solve) {
      solves = std::exchange (exchange_.solve, false);
    } else {
      sample = std::move (exchange_.live);
      exchange_.live.reset ();
    }

    guard.unlock ();
    if (anew)
      begin (run);
    if (solves)
      solve ();
    else if (collects)
      collect (*sample);
    else if (geometry_.mode == Mode::phase)
      find_phase (*sample);
    else
      align (*sample);
    guard.lock ();
  }
}

} // namespace

void
start_worker (GstMoireCalib *self)
{
  CalibState &st = state (self);
  Exchange &exchange = st.exchange;
  {
    const std::lock_guard guard (exchange.lock);
    exchange.quit = false;
    exchange.geometry.reset ();
    exchange.stage = Stage::searching;
    exchange.panel.reset ();
    exchange.mapping.reset ();
    exchange.schedule.reset ();
    exchange.setup_due = false;
  }
  st.worker = std::thread ([self] { Worker (self).run (); });
}

void
stop_worker (GstMoireCalib *self)
{
  CalibState &st = state (self);
  if (!st.worker.joinable ())
    return;
  {
    const std::lock_guard guard (st.exchange.lock);
    st.exchange.quit = true;
    st.exchange.live.reset ();
    st.exchange.samples.clear ();
    st.exchange.solve = false;
  }
  st.exchange.changed.notify_all ();
  st.worker.join ();
}

} // namespace cexp::gst::moire
