/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/uncertainty.h"

#include <algorithm>
#include <cmath>

#include "estimate/kriging.h"
#include "fuse/box_filter.h"
#include "fuse/uncertainty_factors.h"

namespace codedexposure::fuse
{

namespace
{

constexpr int kAround = 1; // of D and L, px
constexpr float kFloor = 0.25f;
/* V is that of a typical moving scene without noise. */
constexpr double kRadius = 5.5, kNoise = 1e-3;

/* Of the slots at the middle of @taps, from all of them. */
std::vector<double>
kriging_variances (const CodedCovariance &covariance,
    std::span<const Offset> taps, std::span<const int> elements,
    std::span<const double> noise)
{
  KrigingSystem system = slot_equations (covariance, taps, elements, noise);
  const std::size_t m = taps.size (), n = std::size_t (covariance.slots ());
  system.flat.assign (m, 1.0);
  system.flat_targets.assign (n, 1.0);
  const std::vector<double> weights = solve_kriging (system);
  std::vector<double> variances;
  for (std::size_t s = 0; s < n; s++) {
    const double *w = weights.data () + s * m;
    double variance = 1.0;
    for (std::size_t i = 0; i < m; i++) {
      variance +=
          w[i] * (w[i] * system.noise[i] - 2.0 * system.targets[s * m + i]);
      for (std::size_t j = i; j < m; j++)
        variance +=
            (i == j ? 1.0 : 2.0) * w[i] * w[j] * system.covariance[i * m + j];
    }
    variances.push_back (std::max (variance, kNoise));
  }
  return variances;
}

} // namespace

Uncertainty::Uncertainty (const Schedule &schedule, const Phases &phases,
    const Observation &observation, FuseQuality quality,
    const SceneClass &scene, Extent size, double depth)
    : phases_ (phases), slots_ (observation.slots ()), width_ (size.width),
      height_ (size.height), quality_ (quality),
      noise_free_ (observation.noise_free ()),
      rounding_ (float (255.0 * 255.0 / (12.0 * depth * depth))),
      misfit_ (size.width, size.height),
      light_ (std::size_t (slots_), Field (size.width, size.height))
{
  for (int y = 0; y < height_; y++)
    for (int x = 0; x < width_; x++) {
      const SlotShares &shares =
          observation.shares (schedule.element_at (x, y));
      slot_of_.push_back (
          observation.exact () ? std::int8_t (shares[0].slot) : -1);
    }
  find_geometry (observation, scene);
}

void
Uncertainty::find_geometry (
    const Observation &observation, const SceneClass &scene)
{
  const std::vector<Offset> places = disc (kRadius);
  const std::vector<Tap> taps = taps_within (kRadius);
  const CodedCovariance covariance (
      scene, observation.shares (), slots_, 2 * int (kRadius));
  const std::vector<double> noise (observation.shares ().size (), kNoise);
  for (int row = 0; row < phases_.rows (); row++)
    for (int x = 0; x < phases_.period (); x++)
      for (const double variance : kriging_variances (
               covariance, places, phases_.elements (row, x, taps), noise))
        geometry_.push_back (float (std::log2 (variance)));
}

void
Uncertainty::set_row (int y, const float *const *slots)
{
  for (int s = 0; s < slots_; s++)
    std::copy_n (slots[s], width_, light_[std::size_t (s)].row (y));
}

void
Uncertainty::differences (
    const Field &coded, int slot, int y, float *change, float *rough) const
{
  const Field &light = light_[std::size_t (slot)];
  const float *own = light.row (y), *seen = coded.row (y);
  const float *above = light.row (mirrored (y - 1, height_));
  const float *below = light.row (mirrored (y + 1, height_));
  for (int x = 0; x < width_; x++) {
    const float left = own[mirrored (x - 1, width_)];
    const float right = own[mirrored (x + 1, width_)];
    const float apart = own[x] - seen[x];
    const float bent =
        own[x] - 0.25f * ((left + right) + (above[x] + below[x]));
    change[x] = apart * apart;
    rough[x] = bent * bent;
  }
}

void
Uncertainty::visit_slot (
    const Kernels &kernels, const Frame &frame, int slot, const Use &use) const
{
  constexpr float kArea = (2 * kAround + 1) * (2 * kAround + 1);
  BoxFilter changes (width_, height_, kAround), roughs (changes);
  Field rows (width_, 2, kAround);
  std::vector<Pixel> pixels;
  pixels.resize (std::size_t (width_));
  for (int y = 0; y < height_ + kAround; y++) {
    if (y < height_) {
      differences (frame.coded, slot, y, rows.row (0), rows.row (1));
      for (int i = 0; i < 2; i++) {
        BoxFilter &box = i ? roughs : changes;
        box.extend (rows.row (i));
        box.add_row (kernels.sum, y, rows.row (i));
      }
    }
    const int out = y - kAround;
    if (out < 0)
      continue;
    const float *change = changes.result (kernels.sum, out);
    const float *rough = roughs.result (kernels.sum, out);
    const float *light = light_[std::size_t (slot)].row (out);
    const float *misfit = misfit_.row (out);
    const int noise_row = out % frame.noise.slope.height ();
    const float *slope = frame.noise.slope.row (noise_row);
    const float *offset = frame.noise.offset.row (noise_row);
    const std::int8_t *slots = slot_of_.data () + std::ptrdiff_t (out) * width_;
    const int period = phases_.period ();
    const float *geometry =
        geometry_.data () +
        std::ptrdiff_t (phases_.row_of (out)) * period * slots_ + slot;
    for (int x = 0; x < width_; x++) {
      const float noise = slope[x] * std::max (light[x], 0.0f) + offset[x];
      const auto log_of = [] (float square) {
        return std::log2 (std::max (square, 0.0f) + kFloor);
      };
      pixels[std::size_t (x)] = {log_of (misfit[x] - noise),
          log_of (change[x] / kArea - noise), log_of (rough[x] / kArea),
          geometry[std::ptrdiff_t ((x + phases_.shift (out)) % period) *
                   slots_],
          noise, slots[x] == slot};
    }
    use (slot, out, pixels.data ());
  }
}

bool
Uncertainty::each_row (const Kernels &kernels, const Frame &frame,
    const Use &use, Workers &workers, std::stop_token stop) const
{
  return workers.run (
      slots_, [&] (int slot, int) { visit_slot (kernels, frame, slot, use); },
      std::move (stop));
}

/* A measured pixel without noise is the light. */
float
Uncertainty::deviation (const Pixel &pixel) const
{
  if (pixel.measured && noise_free_)
    return 0.0f;
  const UncertaintyFactors &by =
      (pixel.measured ? kMeasured : kEstimated)[int (quality_)];
  const float estimated = std::exp2 (
      by.offset + by.misfit * pixel.misfit + by.change * pixel.change +
      by.roughness * pixel.roughness + by.geometry * pixel.geometry);
  return std::sqrt (estimated * estimated + by.noise * pixel.noise);
}

bool
Uncertainty::run (const Kernels &kernels, const Frame &frame, const Sink &sink,
    Workers &workers, std::stop_token stop) const
{
  const auto use = [&] (int slot, int y, const Pixel *pixels) {
    const float *weight = frame.still.weight (y);
    std::vector<float> deviations;
    for (int x = 0; x < width_; x++) {
      const float still = weight[x], moving = 1.0f - still;
      const float estimated = moving > 0.0f ? deviation (pixels[x]) : 0.0f;
      const float mean =
          noise_free_ ? 0.0f : pixels[x].noise / frame.still.frames (x, y);
      deviations.push_back (
          std::sqrt (still * still * mean +
                     moving * moving * estimated * estimated + rounding_));
    }
    sink (slot, y, deviations.data ());
  };
  return each_row (kernels, frame, use, workers, std::move (stop));
}

} // namespace codedexposure::fuse
