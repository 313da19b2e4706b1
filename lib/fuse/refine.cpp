/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/refine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "base/text.h"

namespace codedexposure::fuse
{

namespace
{

using Net = RefineNetwork;

constexpr float kWhite = 255.0f;
/* What tests/quality/train draws, and how it scales its inputs and outputs. */
constexpr int kMinSlots = 2, kMaxSlots = 16;
constexpr double kMaxNoise = 0.08 * kWhite;
constexpr float kChangeScale = 4.0f / kWhite;
constexpr float kSlotScale = 0.25f;
constexpr float kNoiseScale = 8.0f / kWhite;
constexpr float kStep = 0.25f * kWhite;

int
half (int pixels)
{
  return (pixels + Net::kFold - 1) / Net::kFold;
}

} // namespace

std::string
Refiner::why_not (
    const Schedule &schedule, const Observation &observation, double noise)
{
  const std::string text = schedule.text ();
  if (schedule.slots () < kMinSlots || schedule.slots () > kMaxSlots)
    return text + " has " + std::to_string (schedule.slots ()) +
           " slots; the refinement was trained for " +
           std::to_string (kMinSlots) + " to " + std::to_string (kMaxSlots);
  if (!schedule.code ().one_hot () || observation.gains ())
    return text + " has pixels that see more or less than one slot; the "
                  "refinement was trained for one-hot codes";
  if (schedule.leak () > kMaxLeak)
    return text + ": mirrors that are off pass " +
           real_text (std::round (1000.0 * schedule.leak ()) / 10.0) +
           " % of the light; the refinement is for up to " +
           real_text (100.0 * kMaxLeak) + " %";
  if (!observation.noise_free () && schedule.slots () == 2)
    return text + " has two slots, which hide little; with noise, the "
                  "refinement loses more there than it gains";
  if (noise > kMaxNoise)
    return "the noise of a coded pixel is " +
           real_text (std::round (1000.0 * noise / kWhite) / 10.0) +
           " % of white; the refinement was trained for up to " +
           real_text (std::round (100.0 * kMaxNoise / kWhite)) + " %";
  return {};
}

Refiner::Refiner (const Kernels &kernels, const Schedule &schedule,
    const Observation &observation, int width, int height, double noise)
    : kernels_ (kernels), slots_ (schedule.slots ()), width_ (width),
      height_ (height), noise_free_ (observation.noise_free ()),
      leak_ (float (schedule.leak ())), whole_ (float (schedule.light (0))),
      noise_ (float (noise) * whole_), slot_of_ (width, height),
      mean_ (width, height),
      refined_ (std::size_t (slots_), Field (width, height))
{
  if (leak_ > 0.0f)
    own_.fill (Field (width, height));
  std::vector<std::uint8_t> slot_of_element;
  for (int e = 0; e < slots_; e++) {
    int slot = 0;
    while (schedule.light (e, slot) < 1.0)
      slot++;
    slot_of_element.push_back (std::uint8_t (slot));
  }
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      slot_of_.row (y)[x] =
          slot_of_element[std::size_t (schedule.element_at (x, y))];
}

void
Refiner::find_mean (const std::vector<Field> &light)
{
  const float part = 1.0f / float (slots_);
  for (int y = 0; y < height_; y++) {
    float *to = mean_.row (y);
    std::fill_n (to, width_, 0.0f);
    for (const Field &slot : light)
      for (int x = 0; x < width_; x++)
        to[x] += part * slot.row (y)[x];
  }
}

/* A coded pixel is a mean over the slots: its own has the weight 1, the others
 * have that of the leakage. */
void
Refiner::undo_leakage (
    const Field &coded, const std::vector<Field> &light, Field &undone) const
{
  for (int y = 0; y < height_; y++) {
    float *own = undone.row (y);
    for (int x = 0; x < width_; x++)
      own[x] = whole_ * coded.row (y)[x];
    for (int s = 0; s < slots_; s++) {
      const float *other = light[std::size_t (s)].row (y);
      const std::uint8_t *slots = slot_of_.row (y);
      for (int x = 0; x < width_; x++)
        own[x] -= slots[x] == s ? 0.0f : leak_ * other[x];
    }
  }
}

/* Row @y of each plane of the network's inputs, one after the other. */
void
Refiner::set_planes (
    const Frame &frame, int slot, int y, std::int16_t *to) const
{
  const auto light = [&] (int s) {
    return frame.light[std::size_t (std::clamp (s, 0, slots_ - 1))].row (y);
  };
  const float *own = light (slot);
  const std::uint8_t *slots = slot_of_.row (y);
  const auto put = [&] (auto &&input_at) {
    for (int x = 0; x < width_; x++)
      to[x] = Net::steps (input_at (x));
    to += width_;
  };
  const auto put_light = [&] (const float *other) {
    put ([=] (int x) { return kChangeScale * (other[x] - own[x]); });
  };
  const auto put_time = [&] (int later) {
    const int from = slot - later;
    put ([=] (int x) { return 1.0f / float (1 + std::abs (slots[x] - from)); });
  };
  const auto put_value = [&] (float value) {
    put ([=] (int) { return value; });
  };
  put ([=] (int x) { return own[x] * (1.0f / kWhite) - 0.5f; });
  for (const int step : {1, -1, 2, -2})
    put_light (light (slot + step));
  put_light (frame.seen[0]->row (y));
  put ([=] (int x) { return kSlotScale * float (slots[x] - slot); });
  put_time (0);
  put_value (noise_free_ ? 0.0f : kNoiseScale * noise_);
  for (int i = 1; i <= 2; i++)
    if (const Field *seen = frame.seen[std::size_t (i)]) {
      put_light (seen->row (y));
      put_time (i == 1 ? -slots_ : slots_);
    } else {
      put_value (0.0f);
      put_value (0.0f);
    }
  put_light (mean_.row (y));
  put_value (frame.pair ? 1.0f : 0.0f);
}

/* One row of the network's inputs, of pixels that begin kReach before the frame
 * and mirror it at its borders. @planes: room for a row of each plane. */
void
Refiner::fold_row (const Frame &frame, int slot, int row, std::int16_t *planes,
    std::int16_t *to) const
{
  constexpr int kFolded = Net::kFold * Net::kFold;
  for (int dy = 0; dy < Net::kFold; dy++) {
    set_planes (frame, slot, mirrored (Net::kFold * row + dy, height_), planes);
    std::int16_t *value = to + dy * Net::kFold;
    for (int column = -Net::kReach; column < half (width_) + Net::kReach;
         column++, value += Net::kInputs)
      for (int dx = 0; dx < Net::kFold; dx++) {
        const int x = mirrored (Net::kFold * column + dx, width_);
        for (int plane = 0; plane < Net::kPlanes; plane++)
          value[plane * kFolded + dx] = planes[plane * width_ + x];
      }
  }
}

/* @results: of the row's pixels, from kReach before the frame; @part: row of
 * them in a pixel of the network. */
void
Refiner::correct_row (
    const Frame &frame, const float *results, int slot, int y, int part)
{
  const float *from = frame.light[std::size_t (slot)].row (y);
  const float *is_static = frame.is_static.row (y);
  const std::uint8_t *slots = slot_of_.row (y);
  float *to = refined_[std::size_t (slot)].row (y);
  float *deviation = frame.deviations
                         ? (*frame.deviations)[std::size_t (slot)].row (y)
                         : nullptr;
  const int padded = Net::padded (Net::kOutputs);
  for (int x = 0; x < width_; x++) {
    const bool keep = noise_free_ && slots[x] == slot;
    const float step = keep ? 0.0f : kStep * (1.0f - is_static[x]);
    const float *result = results + (x / Net::kFold + Net::kReach) * padded +
                          part * Net::kFold + x % Net::kFold;
    to[x] = from[x] + step * result[0];
    if (deviation)
      deviation[x] = result[Net::kFold * Net::kFold];
  }
}

/* Rows from .. to - 1 of the network. What lies beyond them is computed as
 * well, as far as they depend on it, so that the parts do not change the
 * result. */
void
Refiner::refine_part (const Frame &frame, int slot, int from, int to)
{
  const int first = from - Net::kReach;
  std::vector<std::int16_t> planes (std::size_t (Net::kPlanes * width_));
  Net::trained ().run (
      kernels_, half (width_) + 2 * Net::kReach, to - from + 2 * Net::kReach,
      [&] (int y, std::int16_t *row) {
        fold_row (frame, slot, first + y, planes.data (), row);
      },
      [&] (int y, const float *results) {
        const int row = first + y;
        if (row < from || row >= to)
          return;
        for (int part = 0; part < Net::kFold; part++)
          if (const int line = Net::kFold * row + part; line < height_)
            correct_row (frame, results, slot, line, part);
      });
}

void
Refiner::run (const CodedFrames &frames, const Field &is_static,
    std::vector<Field> &light, std::vector<Field> *deviations, const Task &task)
{
  if (deviations)
    deviations->resize (light.size (), Field (width_, height_));
  for (Field &slot : light)
    for (int y = 0; y < height_; y++)
      for (int x = 0; x < width_; x++)
        slot.row (y)[x] = std::clamp (slot.row (y)[x], 0.0f, kWhite);
  find_mean (light);
  Frame frame{{}, frames.has_partner (), is_static, light, deviations};
  const CodedFrame *const coded[] = {frames.now, frames.before, frames.after};
  for (std::size_t i = 0; i < frame.seen.size (); i++) {
    if (!coded[i])
      continue;
    if (leak_ > 0.0f)
      undo_leakage (coded[i]->light, light, own_[i]);
    frame.seen[i] = leak_ > 0.0f ? &own_[i] : &coded[i]->light;
  }
  const int rows = half (height_);
  const int threads = task.workers.count ();
  const int parts = slots_ % threads == 0 ? 1 : threads;
  const auto refine = [&] (int number, int) {
    const int part = number % parts;
    refine_part (
        frame, number / parts, rows * part / parts, rows * (part + 1) / parts);
  };
  task.run (slots_ * parts, refine);
  light.swap (refined_);
}

} // namespace codedexposure::fuse
