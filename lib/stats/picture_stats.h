/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Statistics of a picture: intensity, entropy, histogram, line profile. */
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "stats/profile_line.h"

namespace codedexposure
{

/** What is measured; the default is everything but a profile. */
struct StatsOptions {
  /** Significant bits of a pixel, 1..8 or 1..16; 0: all bits of the type. */
  int bits = 0;
  /** Bins of the histogram, of equal width over all levels; 0: no histogram;
   * more than the number of levels: one per level. */
  int bins = 256;
  std::optional<ProfileLine> line = {};
};

/** The figures of a picture (paper, Figs. 9c, 10c and 11c). */
struct PictureStats {
  std::uint64_t pixels = 0;
  double mean = 0.0;           ///< DN
  unsigned minimum = 0;        ///< DN
  unsigned maximum = 0;        ///< DN
  double entropy = 0.0;        ///< of the grey levels (Shannon), bits per pixel
  std::uint64_t saturated = 0; ///< pixels at 2^bits - 1, or above
  std::vector<std::uint64_t> histogram; ///< pixels in each bin
  std::vector<double> profile;          ///< values along the line
};

/**
 * Measures pictures of one size. Everything but the profile is computed from
 * the counts of the grey levels, which take one pass.
 */
class StatsMeter
{
public:
  /** @p depth  bits of the pixels' type, 8 or 16.
   * Error when the picture is empty, a number is out of range, or the line
   * leaves the picture. */
  static Result<StatsMeter> make (
      Extent size, int depth, const StatsOptions &options);

  /** @p picture of the size and type that were given. Valid until the next
   * call. */
  template <typename Pixel> // std::uint8_t or std::uint16_t
  const PictureStats &measure (ImageView<const Pixel> picture);

private:
  StatsMeter () = default;
  void summarise ();
  void fill_histogram ();

  int bits_ = 0;
  std::vector<Position> points_;
  std::vector<std::uint32_t> levels_; ///< pixels of each level
  PictureStats stats_;
};

} // namespace codedexposure
