/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/session.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <utility>

#include "base/try.h"

namespace codedexposure
{

namespace
{

[[gnu::format (printf, 1, 2)]] std::string
format (const char *text, ...)
{
  std::array<char, 256> line;
  va_list args;
  va_start (args, text);
  std::vsnprintf (line.data (), line.size (), text, args);
  va_end (args);
  return line.data ();
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

} // namespace

Result<void>
CalibrationSession::expect (const Pattern &grating, double pixels_per_mirror)
{
  ASSIGN_OR_RETURN (
      live_, LiveMoire::make (centred_mapping (options_.camera,
                                  options_.mirrors, pixels_per_mirror),
                 {.period = grating.period,
                     .bits = options_.bits,
                     .off_beam = options_.off_beam}));
  return {};
}

template <typename Pixel>
Result<std::optional<CalibrationSession::Alignment>>
CalibrationSession::align (
    ImageView<const Pixel> frame, const StageOptions &stage)
{
  if (!live_)
    return std::optional<Alignment> ();
  Result<LiveReading> reading = live_->solve (frame);
  if (!reading) {
    aligned_ = 0;
    last_.reset ();
    return reading.error ();
  }
  const StageCorrection correction = correct_stage (reading->mapping, stage);
  aligned_ = correction.state == CalibrationStage::aligned ? aligned_ + 1 : 0;
  last_ = live_->fringes ();
  if (!first_)
    first_ = last_;
  first_->caption = "Before alignment";
  last_->caption = "After alignment";
  return std::optional (Alignment{*std::move (reading), correction});
}

template <typename Pixel>
Result<void>
CalibrationSession::collect (const Pattern &shown, ImageView<const Pixel> frame)
{
  const Pattern pattern = options_.off_beam ? shown.complement () : shown;
  if (!calibration_) {
    ASSIGN_OR_RETURN (calibration_, Calibration::make (options_.camera,
                                        options_.mirrors, options_.patterns));
  }
  const auto added = calibration_->add (pattern, frame, options_.bits);
  if (added)
    collected_++;
  else
    calibration_.reset ();
  return added;
}

Result<std::optional<CalibrationResult>>
CalibrationSession::solve ()
{
  if (!calibration_)
    return std::optional<CalibrationResult> ();
  Result<CalibrationResult> result = calibration_->solve ();
  calibration_.reset ();
  if (!result)
    return result.error ();
  return std::optional (*std::move (result));
}

template <typename Pixel>
Result<std::optional<CalibrationSession::Phase>>
CalibrationSession::find_phase (ImageView<const Pixel> frame)
{
  if (!options_.schedule)
    return Error{"there is no schedule whose phase could be found"};
  Schedule seen = *options_.schedule;
  if (options_.off_beam) {
    ASSIGN_OR_RETURN (seen, seen.complement ());
  }
  ASSIGN_OR_RETURN (const TilePhase tile, find_tile_phase (frame, seen));
  confidence_ = std::max (confidence_, tile.confidence);
  if (tile.confidence < kSure)
    return std::optional<Phase> ();
  ASSIGN_OR_RETURN (Schedule found, moved (*options_.schedule, tile.phase));
  return std::optional (Phase{tile, std::move (found)});
}

#define INSTANTIATE(Pixel)                                                     \
  template Result<std::optional<CalibrationSession::Alignment>>                \
  CalibrationSession::align (ImageView<const Pixel>, const StageOptions &);    \
  template Result<void> CalibrationSession::collect (                          \
      const Pattern &, ImageView<const Pixel>);                                \
  template Result<std::optional<CalibrationSession::Phase>>                    \
      CalibrationSession::find_phase (ImageView<const Pixel>);
INSTANTIATE (std::uint8_t)
INSTANTIATE (std::uint16_t)

namespace
{

std::vector<std::string>
pose_lines (
    const Mapping &mapping, const StageCorrection &correction, int decimals)
{
  const Pose sigma = mapping.pose_sigma ();
  return {format ("rotation %+.*f ± %.0e°    magnification %.*f ± %.0e",
              decimals, correction.rotation, sigma.rotation, decimals + 1,
              correction.magnification, sigma.magnification),
      format ("offset x %+.*f  y %+.*f ± %.0e mirrors    worst corner %.3f",
          decimals, correction.offset.x, decimals, correction.offset.y,
          sigma.shift_x, correction.deviation)};
}

} // namespace

std::vector<std::string>
alignment_lines (const CalibrationSession::Alignment &alignment)
{
  const LiveReading &reading = alignment.reading;
  auto lines = pose_lines (reading.mapping, alignment.correction, 4);
  lines.push_back (format ("contrast x %.2f  y %.2f    covered %.0f %%%s",
      reading.contrast.x, reading.contrast.y, 100 * reading.coverage,
      reading.saturated > 0 ? "    SATURATED: less light" : ""));
  return lines;
}

std::string
travel_line (const StageCorrection &todo)
{
  return format ("x %+.2f µm   y %+.2f µm   θ %+.1f m°   magnify %+.2f ‰",
      todo.stage_x, todo.stage_y, todo.stage_theta, todo.magnify);
}

std::vector<std::string>
mapping_lines (
    const CalibrationResult &result, const StageCorrection &correction)
{
  return pose_lines (result.mapping, correction, 5);
}

std::vector<std::string>
report_lines (
    const CalibrationResult &result, const StageCorrection &correction)
{
  const Pose sigma = result.mapping.pose_sigma ();
  return {
      format ("Rotation %+.5f ± %.0e degrees; magnification %.6f ± %.0e pixels "
              "per mirror",
          correction.rotation, sigma.rotation, correction.magnification,
          sigma.magnification),
      format ("Offset from the nearest aligned position: x %+.5f, y %+.5f ± "
              "%.0e mirrors",
          correction.offset.x, correction.offset.y, sigma.shift_x),
      format ("Stage travel that remains: x %+.2f µm, y %+.2f µm, θ %+.1f "
              "thousandths of a degree",
          correction.stage_x, correction.stage_y, correction.stage_theta),
      format (
          "Blur between mirrors and pixels: %.2f pixels (standard deviation)",
          result.psf_sigma),
      format ("Residuals divided by those that noise explains: %.2f (1: the "
              "mapping explains all but noise)",
          result.misfit)};
}

std::string
alignment_verdict (const StageCorrection &correction, double tolerance)
{
  if (correction.deviation <= tolerance)
    return format ("Aligned: the worst corner is off by %.3f mirrors, within "
                   "the tolerance of %g mirrors",
        correction.deviation, tolerance);
  return format ("Not aligned: the worst corner is off by %.3f mirrors, above "
                 "the tolerance of %g mirrors. Decode with the mapping, or "
                 "align again",
      correction.deviation, tolerance);
}

} // namespace codedexposure
