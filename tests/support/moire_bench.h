/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera that looks at calibration patterns. */
#pragma once

#include <utility>

#include "moire/gratings.h"
#include "optics/lens.h"
#include "optics/sensor.h"

namespace cexp
{

/** A white target behind the mirrors, through the optical model. */
class MoireBench
{
public:
  /** As many mirrors as pixels; @p light of a mirror that is on, 1 being what
   * the sensor can hold. */
  MoireBench (const Alignment &alignment, double psf_sigma, Extent size,
      double light = 200.0 / 255.0)
      : size_ (size), on_ (float (light)),
        lens_ (alignment, psf_sigma, size.width, size.height),
        mirrors_ (size.width, size.height), light_ (size.width, size.height),
        seen_ (size.width, size.height)
  {
    sensor.full_well = 10000.0;
    sensor.read_noise = 5.0;
    sensor.bits = 8;
  }

  /** Noise of frame @p number. */
  Image<std::uint8_t> frame (const Pattern &pattern, std::uint64_t number)
  {
    Image<std::uint8_t> numbers (size_.width, size_.height);
    sensor.read_out<std::uint8_t> (
        std::as_const (light (pattern)).view (), 1.0, number, numbers.view ());
    return numbers;
  }

  /** What the sensor gets, before noise. */
  Image<float> &light (const Pattern &pattern)
  {
    render_pattern (pattern, mirrors_.view ());
    for (int y = 0; y < size_.height; y++)
      for (int x = 0; x < size_.width; x++)
        light_.at (x, y) = mirrors_.at (x, y) != 0 ? on_ : off;
    lens_.image (std::as_const (light_).view (), seen_.view ());
    return seen_;
  }

  Sensor sensor;
  float off = 0.0f; ///< light of a mirror that is off

private:
  Extent size_;
  float on_;
  Lens lens_;
  Image<std::uint8_t> mirrors_;
  Image<float> light_, seen_;
};

} // namespace cexp
