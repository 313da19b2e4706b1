/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "extract/beam_sum.h"

#include <algorithm>
#include <utility>

namespace codedexposure
{

namespace
{

/* Mirrors along a side that tell of all; a tile repeats. */
constexpr int kMostMirrors = 1024;
constexpr double kLeast = 1e-3, kMost = 1e3; // of a ratio

/* Of the light of a scene that is even. */
double
share_of (const Schedule &schedule, Extent mirrors)
{
  double on = 0.0, all = 0.0;
  for (int y = 0; y < std::min (mirrors.height, kMostMirrors); y++)
    for (int x = 0; x < std::min (mirrors.width, kMostMirrors); x++)
      for (int slot = 0; slot < schedule.slots (); slot++) {
        on += schedule.on (x, y, slot) ? 1.0 : schedule.leak ();
        all += 1.0 + schedule.leak ();
      }
  return on / all;
}

/* Light of the second camera over that of the first, of pixels that saturate
 * neither; 0: there is none. */
template <typename Pixel>
double
ratio_between (ImageView<const Pixel> on, ImageView<const Pixel> off,
    ImageView<const std::uint8_t> seen, const BeamLevels &levels,
    ImageView<Pixel> sum)
{
  double first = 0.0, second = 0.0;
  for (int y = 0; y < sum.height; y++) {
    const Pixel *a = on.row (y), *b = off.row (y);
    const std::uint8_t *both = seen.row (y);
    std::uint32_t of_first = 0, of_second = 0, pixels = 0;
    for (int x = 0; x < sum.width; x++) {
      const bool counts =
          both[x] && a[x] < levels.on_white && b[x] < levels.off_white;
      of_first += counts ? a[x] : 0u;
      of_second += counts ? b[x] : 0u;
      pixels += counts;
    }
    first += of_first;
    second += of_second - levels.off_black * pixels;
  }
  return first > 0.0 ? std::max (0.0, second / first) : 0.0;
}

} // namespace

BeamSum::BeamSum (const Schedule &schedule, Extent mirrors, double ratio,
    Image<std::uint8_t> seen)
    : share_ (share_of (schedule, mirrors)), ratio_ (ratio),
      seen_ (std::move (seen))
{
  if (seen_.width () > 0)
    return;
  seen_ = Image<std::uint8_t> (mirrors.width, mirrors.height);
  for (int y = 0; y < mirrors.height; y++)
    std::fill_n (seen_.view ().row (y), mirrors.width, std::uint8_t (1));
}

template <typename Pixel>
double
BeamSum::add (ImageView<const Pixel> on, ImageView<const Pixel> off,
    const BeamLevels &levels, ImageView<Pixel> sum) const
{
  double ratio = ratio_;
  if (ratio <= 0.0) {
    const double measured =
        ratio_between (on, off, seen_.view (), levels, sum) * share_ /
        (1.0 - share_);
    ratio = measured > 0.0 ? std::clamp (measured, kLeast, kMost) : 1.0;
  }
  const double white = std::min (levels.on_white / share_,
      (levels.off_white - levels.off_black) / (ratio * (1.0 - share_)));
  const float part = float (levels.sum_white / white);
  const float other = part / float (ratio);
  const float black = float (levels.off_black), full = float (levels.sum_white);
  for (int y = 0; y < sum.height; y++) {
    const Pixel *a = on.row (y), *b = off.row (y);
    const std::uint8_t *both = seen_.view ().row (y);
    Pixel *out = sum.row (y);
    for (int x = 0; x < sum.width; x++) {
      const float light = part * float (a[x]) +
                          other * std::max (0.0f, float (b[x]) - black) + 0.5f;
      const bool is_full = a[x] >= levels.on_white || b[x] >= levels.off_white;
      out[x] = Pixel (!both[x]  ? 0.0f
                      : is_full ? full
                                : std::min (light, full));
    }
  }
  return ratio;
}

template double BeamSum::add (ImageView<const std::uint8_t>,
    ImageView<const std::uint8_t>, const BeamLevels &,
    ImageView<std::uint8_t>) const;
template double BeamSum::add (ImageView<const std::uint16_t>,
    ImageView<const std::uint16_t>, const BeamLevels &,
    ImageView<std::uint16_t>) const;

} // namespace codedexposure
