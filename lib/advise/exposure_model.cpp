/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/exposure_model.h"

#include <cmath>
#include <vector>

#include "base/pixels.h"
#include "base/range.h"
#include "base/try.h"

namespace codedexposure
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

} // namespace

Result<ExposureModel>
ExposureModel::make (
    const std::optional<Schedule> &schedule, const Camera &camera, double light)
{
  RETURN_IF_ERROR (check (camera, light));
  const double period = double (camera.rate.den) / camera.rate.num;
  double active = period, pitch = period, on_slots = 1.0;
  if (schedule) {
    const int n = schedule->slots ();
    ASSIGN_OR_RETURN (
        const auto plan, SlotPlan::fit (schedule->timing (), n, camera.rate));
    active = 1e-9 * double (plan.active ());
    pitch = 1e-9 * double (plan.start (1) - plan.start (0));
    on_slots = 0.0;
    for (int e = 0; e < n; e++)
      on_slots += double (schedule->code ().on_slots (e)) / n;
  }
  const double full_well = camera.noise.full_well;
  ExposureModel model (schedule, camera, full_well * light * active / period);
  model.active_ = active;
  model.pitch_ = pitch;
  model.hold_ = period / model.slots ();
  model.efficiency_ = on_slots * active / period;
  model.overexposed_ =
      model.white_slots_ * model.slot_electrons_ > full_well * (1.0 + 1e-9);
  return model;
}

ExposureModel::ExposureModel (const std::optional<Schedule> &schedule,
    const Camera &camera, double slot_electrons)
    : schedule_ (schedule),
      white_slots_ (schedule ? schedule->white_slots () : 1.0),
      slot_electrons_ (slot_electrons),
      observation_ (schedule, camera.noise, white_slots_ * slot_electrons,
          double (largest_pixel (camera.bits)))
{
}

double
ExposureModel::light (int element) const
{
  return schedule_ ? schedule_->light (element) : 1.0;
}

double
ExposureModel::variance (int element, double level) const
{
  const double light_squared = light (element) * light (element);
  return light_squared * observation_.variance (element, level);
}

Result<double>
ExposureModel::snr (double level) const
{
  std::vector<double> factors{1.0};
  if (schedule_) {
    ASSIGN_OR_RETURN (factors, schedule_->code ().inverse (schedule_->leak ()));
  }
  double noise = 0.0;
  const int n = slots ();
  for (int s = 0; s < n; s++)
    for (int e = 0; e < n; e++) {
      const double factor = factors[std::size_t (s * n + e)];
      noise += factor * factor * variance (e, level) / n;
    }
  return 10.0 * std::log10 (level * level / noise);
}

} // namespace codedexposure
