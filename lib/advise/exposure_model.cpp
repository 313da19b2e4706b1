/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/exposure_model.h"

#include <cmath>

#include "base/range.h"

namespace cexp
{

namespace
{

Result<void>
check (const Camera &camera, double light)
{
  return check_ranges ({
      {"full well (electrons)", camera.noise.full_well, 1.0,
          SensorNoise::kMaxFullWell},
      {"read noise (electrons)", camera.noise.read_noise, 0.0,
          SensorNoise::kMaxReadNoise},
      {"bits", double (camera.bits), 1.0, 16.0},
      {"width", double (camera.size.width), 1.0, 65536.0},
      {"height", double (camera.size.height), 1.0, 65536.0},
      {"light (parts of the full well)", light, 1e-6, 1000.0},
  });
}

/* What an element collects when its light is white in every slot. */
double
white_of (const ExposureModel &model, int element)
{
  double sum = 0.0;
  for (int s = 0; s < model.slots (); s++)
    sum += model.open (element, s);
  return sum;
}

} // namespace

Result<ExposureModel>
ExposureModel::make (
    const std::optional<Schedule> &schedule, const Camera &camera, double light)
{
  if (const auto good = check (camera, light); !good)
    return good.error ();
  ExposureModel model;
  const double period = double (camera.rate.den) / camera.rate.num;
  model.schedule_ = schedule;
  model.noise_ = camera.noise;
  model.active_ = model.pitch_ = model.hold_ = period;
  model.open_ = {1.0};
  double open_slots = 1.0, white_slots = 1.0;
  if (schedule) {
    const int n = model.n_ = schedule->slots ();
    const auto plan = SlotPlan::fit (schedule->timing (), n, camera.rate);
    if (!plan)
      return plan.error ();
    model.active_ = 1e-9 * double (plan->active ());
    model.pitch_ = 1e-9 * double (plan->start (1) - plan->start (0));
    model.hold_ = period / n;
    model.open_.clear ();
    open_slots = 0.0;
    white_slots = schedule->white_slots ();
    for (int e = 0; e < n; e++) {
      open_slots += double (schedule->code ().open_slots (e)) / n;
      for (int s = 0; s < n; s++)
        model.open_.push_back (
            schedule->code ().open (e, s) ? 1.0 : schedule->leak ());
    }
  }
  model.slot_electrons_ =
      camera.noise.full_well * light * model.active_ / period;
  model.efficiency_ = open_slots * model.active_ / period;

  const double white = white_slots * model.slot_electrons_;
  model.overexposed_ = white > camera.noise.full_well * (1.0 + 1e-9);
  model.step_ = white / double ((1 << camera.bits) - 1);
  return model;
}

double
ExposureModel::variance (int element, double level) const
{
  const double photons = white_of (*this, element) * level * slot_electrons_;
  return noise_.variance (photons, step_) / (slot_electrons_ * slot_electrons_);
}

Result<double>
ExposureModel::snr (double level) const
{
  std::vector<double> factors{1.0};
  if (schedule_) {
    auto inverse = schedule_->code ().inverse (schedule_->leak ());
    if (!inverse)
      return inverse.error ();
    factors = *std::move (inverse);
  }
  double noise = 0.0;
  for (int s = 0; s < n_; s++)
    for (int e = 0; e < n_; e++) {
      const double factor = factors[std::size_t (s * n_ + e)];
      noise += factor * factor * variance (e, level) / n_;
    }
  return 10.0 * std::log10 (level * level / noise);
}

} // namespace cexp
