/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/sensor.h"

#include <algorithm>
#include <array>

#include "base/pixels.h"
#include "base/targets.h"
#include "bench/kernels.h"

namespace codedexposure
{

CODEDEXPOSURE_SUPPORTED (
    bench::supported_kernels, bench, bench::Kernels, baseline)

namespace
{

/* @number bent by a parabola that is 0 at 0 and at @range. */
inline float
bent (float number, float bow, float range)
{
  return number + 4.0f * bow * number * (1.0f - number / range);
}

/* Half up, then clamped; the sum is never negative, so truncation is floor. */
template <typename Pixel>
Pixel
quantise (float number, float largest)
{
  return Pixel (
      std::int32_t (std::min (std::max (number, 0.0f) + 0.5f, largest)));
}

} // namespace

template <typename Pixel>
void
Sensor::read_out (ImageView<const float> light, double unit,
    std::uint64_t frame, ImageView<Pixel> out) const
{
  const float largest = float (largest_pixel (bits));
  const float black = float (black_level);

  if (full_well <= 0.0) {
    /* A division, because the error of a rounded factor could change how a
     * value halfway between two numbers is rounded. */
    const float divisor = float (unit / (gain * largest));
    for (int y = 0; y < out.height; y++)
      std::transform (
          light.row (y), light.row (y) + out.width, out.row (y), [=] (float l) {
            return quantise<Pixel> (l / divisor + black, largest);
          });
    return;
  }

  const bench::Kernels &kernels = bench::supported_kernels ().front ();
  bench::Exposed exposed{seed, frame, 0, float (full_well / unit),
      float (well > 0.0 ? well : full_well), float (read_noise),
      float (gain * largest / full_well)};
  const int blocks = (out.width + bench::kBlock - 1) / bench::kBlock;
  for (int y = 0; y < out.height; y++)
    for (int b = 0; b < blocks; b++, exposed.block++) {
      const int x = b * bench::kBlock;
      const int count = std::min (bench::kBlock, out.width - x);
      std::array<float, bench::kBlock> seen = {}, numbers;
      std::copy_n (light.row (y) + x, count, seen.begin ());
      kernels.expose (exposed, seen.data (), numbers.data ());
      if (bow != 0.0)
        for (float &number : numbers)
          number = bent (number, float (bow), largest - black);
      std::transform (numbers.begin (), numbers.begin () + count,
          out.row (y) + x, [=] (float number) {
            return quantise<Pixel> (number + black, largest);
          });
    }
}

template void Sensor::read_out (ImageView<const float>, double, std::uint64_t,
    ImageView<std::uint8_t>) const;
template void Sensor::read_out (ImageView<const float>, double, std::uint64_t,
    ImageView<std::uint16_t>) const;

} // namespace codedexposure
