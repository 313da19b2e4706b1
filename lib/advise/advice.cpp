/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/advice.h"

#include <algorithm>
#include <cmath>

#include "advise/linear_estimate.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/* One-hot codes for every kind of tile, and the others for compact cells. */
constexpr const char *kUsual[] = {
    "sequential:2x1",
    "s-matrix:3x1",
    "sequential:lattice:3/1",
    "sequential:2x2",
    "sequential:lattice:4/2",
    "staircase:2x2",
    "staircase:lattice:4/2",
    "s-matrix:7x1",
    "sequential:4x2",
    "sequential:lattice:8/3,order=bit-reversal",
    "s-matrix:lattice:8/3",
    "sequential:3x3",
    "sequential:lattice:9/3",
    "sequential:4x4",
    "sequential:lattice:16/4,order=bit-reversal",
    "sequential:lattice:32/7,order=bit-reversal",
};

} // namespace

std::string
Prediction::text () const
{
  return schedule ? schedule->text () : "none";
}

namespace
{

/* Of a schedule without regions, or of a part of one. */
Result<Prediction>
predict_part (
    const std::optional<Schedule> &schedule, const Conditions &conditions)
{
  if (schedule && schedule->elements () > LinearEstimate::kMaxElements)
    return Error{"it has " + std::to_string (schedule->elements ()) +
                 " elements; predictions go up to " +
                 std::to_string (LinearEstimate::kMaxElements)};
  ASSIGN_OR_RETURN (const auto model,
      ExposureModel::make (schedule, conditions.camera, conditions.light));
  const Extent cell = schedule ? schedule->cell () : Extent{};
  const Camera &camera = conditions.camera;
  Prediction prediction;
  prediction.schedule = schedule;
  prediction.frame_rate =
      double (model.slots ()) * camera.rate.num / camera.rate.den;
  prediction.subframe = {
      camera.size.width / cell.width, camera.size.height / cell.height};
  prediction.efficiency = model.efficiency ();
  prediction.slot_electrons = model.slot_electrons ();
  ASSIGN_OR_RETURN (prediction.snr_white, model.snr (1.0));
  ASSIGN_OR_RETURN (prediction.snr_grey, model.snr (Prediction::kGrey));
  prediction.psnr =
      -10.0 * std::log10 (LinearEstimate (model, conditions.scene).error);
  prediction.overexposed = model.overexposed ();
  return prediction;
}

/* Mean power, by the shares of the pixels, of levels in dB below white. */
double
mean_level (const std::vector<Prediction> &parts,
    const std::vector<double> &shares, double Prediction::*level)
{
  double power = 0.0;
  for (std::size_t i = 0; i < parts.size (); i++)
    power += shares[i] * std::pow (10.0, -0.1 * (parts[i].*level));
  return -10.0 * std::log10 (power);
}

Prediction
joined (const Schedule &whole, std::vector<Prediction> parts,
    const std::vector<double> &shares)
{
  Prediction all =
      *std::ranges::min_element (parts, {}, &Prediction::frame_rate);
  all.schedule = whole;
  all.snr_white = mean_level (parts, shares, &Prediction::snr_white);
  all.snr_grey = mean_level (parts, shares, &Prediction::snr_grey);
  all.psnr = mean_level (parts, shares, &Prediction::psnr);
  all.efficiency = 0.0;
  for (std::size_t i = 0; i < parts.size (); i++) {
    all.efficiency += shares[i] * parts[i].efficiency;
    all.slot_electrons = std::min (all.slot_electrons, parts[i].slot_electrons);
    all.overexposed = all.overexposed || parts[i].overexposed;
  }
  all.parts = std::move (parts);
  return all;
}

Result<Prediction>
predict_regions (const Schedule &whole, const Conditions &conditions)
{
  const Extent size = conditions.camera.size;
  RETURN_IF_ERROR (whole.check_size (size.width, size.height));
  ASSIGN_OR_RETURN (
      auto background, predict_part (whole.background (), conditions));
  std::vector<Prediction> parts = {std::move (background)};
  std::vector<double> shares = {1.0};
  for (std::size_t i = 0; i < whole.regions ().size (); i++) {
    const Rect &rect = whole.regions ()[i].rect;
    Conditions inside = conditions;
    inside.camera.size = {rect.width, rect.height};
    ASSIGN_OR_RETURN (Prediction part,
        with_prefix (predict_part (whole.region (int (i)), inside),
            "region " + std::to_string (i) + ": "));
    parts.push_back (std::move (part));
    shares.push_back (double (rect.width) * rect.height /
                      (double (size.width) * size.height));
    shares.front () -= shares.back ();
  }
  return joined (whole, std::move (parts), shares);
}

} // namespace

Result<Prediction>
predict (const std::optional<Schedule> &schedule, const Conditions &conditions)
{
  RETURN_IF_ERROR (conditions.scene.check ());
  return schedule && !schedule->regions ().empty ()
             ? predict_regions (*schedule, conditions)
             : predict_part (schedule, conditions);
}

std::vector<Schedule>
usual_schedules (Nanoseconds switching, Nanoseconds readout)
{
  std::string times;
  if (switching > 0)
    times += ",switching=" + time_text (switching);
  if (readout > 0)
    times += ",readout=" + time_text (readout);
  std::vector<Schedule> schedules;
  for (const char *preset : kUsual)
    if (auto schedule = Schedule::from_preset (preset + times))
      schedules.push_back (*std::move (schedule));
  return schedules;
}

const Prediction *
recommend (std::span<const Prediction> predictions, double min_rate)
{
  const Prediction *best = nullptr;
  for (const Prediction &prediction : predictions)
    if (!prediction.overexposed && prediction.frame_rate >= min_rate &&
        (!best || prediction.psnr > best->psnr))
      best = &prediction;
  return best;
}

} // namespace codedexposure
