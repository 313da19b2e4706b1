/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/uncertainty.h"

#include <algorithm>
#include <cmath>

#include "fuse/box_filter.h"
#include "fuse/models.h"
#include "fuse/uncertainty_factors.h"

namespace codedexposure::fuse
{

namespace
{

constexpr int kAround = 1; // of D and L, px
constexpr float kFloor = 0.25f;
/* V is that of a typical moving scene without noise. */
constexpr double kRadius = 5.5, kNoise = 1e-3;

/* Logarithms to base 2 of V, by phase and slot. */
std::vector<float>
geometry_of (FilterPlan plan, bool with_partner)
{
  plan.noise.assign (plan.noise.size (), kNoise);
  plan.partner_noise.assign (plan.partner_noise.size (), kNoise);
  std::vector<float> geometry;
  for_each_phase (plan, kFastMotion,
      taps_around (kRadius, 0.0, {.partner = with_partner}),
      [&] (int, int, std::span<const Tap>, const PhaseWeights &weights) {
        for (const double variance : weights.slot_variances)
          geometry.push_back (float (std::log2 (std::max (variance, kNoise))));
      });
  return geometry;
}

float
log_of (float square)
{
  return std::log2 (std::max (square, 0.0f) + kFloor);
}

} // namespace

Uncertainty::Uncertainty (const Schedule &schedule, const FilterPlan &plan,
    FuseQuality quality, Extent size, double depth)
    : kernels_ (plan.kernels), phases_ (plan.phases),
      slots_ (plan.observation.slots ()), quality_ (quality),
      noise_free_ (plan.observation.noise_free ()),
      rounding_ (float (255.0 * 255.0 / (12.0 * depth * depth))),
      slot_of_ (size.width, size.height)
{
  geometry_[0] = geometry_of (plan, false);
  geometry_[1] = plan.partner ? geometry_of (plan, true) : geometry_[0];
  for (int y = 0; y < size.height; y++)
    for (int x = 0; x < size.width; x++) {
      const int element = schedule.element_at (x, y);
      slot_of_.row (y)[x] = std::int16_t (
          plan.observation.exact () ? plan.observation.shares (element)[0].slot
                                    : -1);
    }
}

void
Uncertainty::differences (
    const Frame &frame, int slot, int y, float *change, float *rough) const
{
  const Field &light = frame.light[std::size_t (slot)];
  const int width = light.width (), height = light.height ();
  const float *own = light.row (y), *seen = frame.frames.now->light.row (y);
  const float *above = light.row (mirrored (y - 1, height));
  const float *below = light.row (mirrored (y + 1, height));
  for (int x = 0; x < width; x++) {
    const float left = own[mirrored (x - 1, width)];
    const float right = own[mirrored (x + 1, width)];
    const float apart = own[x] - seen[x];
    const float bent =
        own[x] - 0.25f * ((left + right) + (above[x] + below[x]));
    change[x] = apart * apart;
    rough[x] = bent * bent;
  }
}

/* Row @y. @change, @rough: sums of differences () around its pixels. */
void
Uncertainty::set_pixels (const Frame &frame, int slot, int y,
    const float *change, const float *rough, std::vector<Pixel> &pixels) const
{
  constexpr float kArea = (2 * kAround + 1) * (2 * kAround + 1);
  const Field &blocks = frame.misfit;
  const float *light = frame.light[std::size_t (slot)].row (y);
  const float *misfit = blocks.row (std::min (y / 2, blocks.height () - 1));
  const float *slope = frame.noise.slopes (y);
  const float *offset = frame.noise.offsets (y);
  const std::int16_t *slots = slot_of_.row (y);
  const int *phases = phases_.of_row (y);
  const int period = phases_.period ();
  const float *geometries[] = {
      geometry_[0].data () + slot, geometry_[1].data () + slot};
  const CodedFrame &now = *frame.frames.now;
  const bool has_partner = frame.frames.has_partner ();
  const std::uint8_t *clipped =
      now.clipped.empty ()
          ? nullptr
          : now.clipped.data () + std::ptrdiff_t (y) * slot_of_.width ();
  for (int x = 0; x < slot_of_.width (); x++) {
    const float noise = slope[x] * std::max (light[x], 0.0f) + offset[x];
    const bool both = has_partner && !(clipped && clipped[x]);
    const float of_block = misfit[std::min (x / 2, blocks.width () - 1)];
    pixels[std::size_t (x)] = {log_of (of_block - noise),
        log_of (change[x] / kArea - noise), log_of (rough[x] / kArea),
        geometries[both][std::ptrdiff_t (phases[x % period]) * slots_], noise,
        slots[x] == slot, both};
  }
}

float
Uncertainty::deviation (const Pixel &pixel) const
{
  const UncertaintyFactors &by =
      (pixel.measured ? kMeasured : kEstimated)[pixel.both][int (quality_)];
  const float estimated = std::exp2 (
      by.offset + by.misfit * pixel.misfit + by.change * pixel.change +
      by.roughness * pixel.roughness + by.geometry * pixel.geometry);
  return std::sqrt (estimated * estimated + by.noise * pixel.noise);
}

/* Squared errors of row @y that are not estimated: rounding, and what
 * rectification makes. */
void
Uncertainty::add_known (const Frame &frame, int slot, int y,
    std::span<const Pixel> pixels, float *squares) const
{
  const int width = slot_of_.width ();
  const CodedFrame &now = *frame.frames.now;
  std::fill_n (squares, width, rounding_);
  for (int x = 0; !now.errors.empty () && x < width; x++)
    squares[x] += now.errors.row (y)[x];
  if (now.partner.errors.empty ())
    return;
  const float *still = frame.still.weight.row (y);
  std::vector<float> follows (std::size_t (width), 0.0f);
  frame.partner_fit->follow (y, slot, follows.data ());
  for (int x = 0; x < width; x++) {
    if (!pixels[std::size_t (x)].both)
      continue;
    const float part = (1.0f - still[x]) * follows[std::size_t (x)];
    squares[x] += part * part * now.partner.errors.row (y)[x];
  }
}

void
Uncertainty::run_slot (const Frame &frame, int slot, const Sink &sink) const
{
  const int width = slot_of_.width (), height = slot_of_.height ();
  BoxFilter changes (width, height, kAround), roughs (changes);
  Field rows (width, 2, kAround);
  Field deviations (width, 1), known (width, 1);
  std::vector<Pixel> pixels (std::size_t (slot_of_.width ()));
  for (int y = 0; y < height + kAround; y++) {
    if (y < height) {
      differences (frame, slot, y, rows.row (0), rows.row (1));
      for (int i = 0; i < 2; i++) {
        BoxFilter &box = i ? roughs : changes;
        box.extend (rows.row (i));
        box.add_row (kernels_.sum, y, rows.row (i));
      }
    }
    const int out = y - kAround;
    if (out < 0)
      continue;
    set_pixels (frame, slot, out, changes.result (kernels_.sum, out),
        roughs.result (kernels_.sum, out), pixels);
    const float *weight = frame.still.weight.row (out);
    const float *refined = frame.refined
                               ? (*frame.refined)[std::size_t (slot)].row (out)
                               : nullptr;
    add_known (frame, slot, out, pixels, known.row (0));
    for (int x = 0; x < width; x++) {
      const Pixel &seen = pixels[std::size_t (x)];
      const float still = weight[x], moving = 1.0f - still;
      /* A measured pixel without noise is the light. */
      const bool exact = seen.measured && noise_free_;
      const float estimated =
          exact || moving <= 0.0f ? 0.0f
          : !refined              ? deviation (seen)
                                  : std::exp2 (refined[x]) *
                           (seen.measured ? kRefinedMeasured : 1.0f);
      const float mean =
          noise_free_ ? 0.0f : seen.noise / frame.still.frames (x, out);
      deviations.row (0)[x] = std::sqrt (
          still * still * mean + moving * moving * estimated * estimated +
          known.row (0)[x]);
    }
    sink ({slot, out, deviations.row (0), pixels.data (), weight});
  }
}

void
Uncertainty::run (const Frame &frame, const Sink &sink, const Task &task) const
{
  task.run (slots_, [&] (int slot, int) { run_slot (frame, slot, sink); });
}

} // namespace codedexposure::fuse
