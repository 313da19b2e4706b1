/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera that sees calibration patterns. */
#pragma once

#include <utility>

#include "bench/lens.h"
#include "bench/sensor.h"
#include "calibrate/gratings.h"

namespace codedexposure
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
        light_ (size.width, size.height), seen_ (size.width, size.height)
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

  /** The light on the sensor, without noise. */
  Image<float> &light (const Pattern &pattern)
  {
    for (int y = 0; y < size_.height; y++)
      for (int x = 0; x < size_.width; x++)
        light_.at (x, y) = pattern.on (x, y) ? on_ : off;
    lens_.image (std::as_const (light_).view (), seen_.view ());
    return seen_;
  }

  Sensor sensor;
  float off = 0.0f; ///< light of a mirror that is off

private:
  Extent size_;
  float on_;
  Lens lens_;
  Image<float> light_, seen_;
};

} // namespace codedexposure
