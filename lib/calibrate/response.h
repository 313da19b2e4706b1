/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light that a pixel gets from a grating, by its place. */
#pragma once

#include <cstddef>
#include <vector>

namespace codedexposure
{

/**
 * A square grating seen by a square pixel without gaps through a Gaussian blur,
 * in closed form. The model has all harmonics, so that it contains the aliasing
 * at one pixel per mirror.
 */
class GratingResponse
{
public:
  /** Light of a grating of phase 0 in 0..1, at one place. */
  struct Value {
    float light = 0.0f;
    float slope = 0.0f; ///< d light / d place, 1 / mirrors
    float blur = 0.0f;  ///< d light / d variance of the blur, 1 / mirrors^2
    float unused = 0.0f;
  };
  /** Where a place lies in the table. */
  struct Entry {
    std::size_t low;
    float part; ///< of the way to the next one
  };

  /** @p period in mirrors; @p side of a pixel and @p sigma of the blur in
   * mirrors. */
  GratingResponse (int period, double side, double sigma);

  int period () const { return period_; }
  /** @p place  in mirrors. */
  Entry entry (double place) const;
  /** Of the grating of @p phase. */
  Value at (const Entry &entry, int phase = 0) const
  {
    const Value *v = table_.data () + entry.low + std::size_t (phase * kSteps);
    return {v[0].light + entry.part * (v[1].light - v[0].light),
        v[0].slope + entry.part * (v[1].slope - v[0].slope),
        v[0].blur + entry.part * (v[1].blur - v[0].blur), 0.0f};
  }

private:
  static constexpr int kSteps = 128; // of the table, per mirror

  int period_;
  std::vector<Value> table_; // two periods and one step
};

} // namespace codedexposure
