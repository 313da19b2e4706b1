/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/advice.h"

#include "advise/linear_estimate.h"

namespace cexp
{

namespace
{

/* Codes with one open slot for every kind of tile; and the others with cells
 * that lie close together. */
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

Result<Prediction>
predict (const std::optional<Schedule> &schedule, const Conditions &conditions)
{
  if (const auto good = conditions.scene.check (); !good)
    return good.error ();
  if (const auto checked =
          check_one_part (schedule.value_or (Schedule ()), "a prediction");
      !checked)
    return checked.error ();
  if (schedule && schedule->elements () > LinearEstimate::kMaxElements)
    return Error{"it has " + std::to_string (schedule->elements ()) +
                 " elements; predictions go up to " +
                 std::to_string (LinearEstimate::kMaxElements)};
  const auto model =
      ExposureModel::make (schedule, conditions.camera, conditions.light);
  if (!model)
    return model.error ();
  const auto white = model->snr (1.0), grey = model->snr (Prediction::kGrey);
  if (!white || !grey)
    return white ? grey.error () : white.error ();
  const Extent cell = schedule ? schedule->cell () : Extent{};
  const Camera &camera = conditions.camera;
  Prediction prediction;
  prediction.schedule = schedule;
  prediction.frame_rate =
      double (model->slots ()) * camera.rate.num / camera.rate.den;
  prediction.subframe = {
      camera.size.width / cell.width, camera.size.height / cell.height};
  prediction.efficiency = model->efficiency ();
  prediction.slot_electrons = model->slot_electrons ();
  prediction.snr_white = *white;
  prediction.snr_grey = *grey;
  prediction.psnr = LinearEstimate (*model, conditions.scene).psnr ();
  prediction.overexposed = model->overexposed ();
  return prediction;
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
recommend (std::span<const Prediction> predictions, double least_rate)
{
  const Prediction *best = nullptr;
  for (const Prediction &prediction : predictions)
    if (!prediction.overexposed && prediction.frame_rate >= least_rate &&
        (!best || prediction.psnr > best->psnr))
      best = &prediction;
  return best;
}

} // namespace cexp
