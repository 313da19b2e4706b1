/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "sync/phase_reading.h"

#include <algorithm>
#include <vector>

namespace codedexposure
{

namespace
{

/* Min contrast of lit masks, in digital numbers and as a part of the level. */
constexpr double kMinContrast = 2.0;
constexpr double kMinContrastPart = 0.1;
/* A mask is lit if it has this part of the contrast and of the light of its
 * neighbours: more than the blur of a lens brings from there. */
constexpr double kLit = 0.35;

struct Mask {
  int index;
  double light; // mean of its columns
  int columns;
  bool lit;
};

/** Masks in the order of their columns, which ascends. */
std::vector<Mask>
masks_of (int slots, const std::array<double, kPilotColumns> &means)
{
  std::vector<Mask> masks;
  for (int column = 0; column < kPilotColumns; column++) {
    const int index = pilot_mask (column, slots);
    if (masks.empty () || masks.back ().index != index)
      masks.push_back ({index, 0.0, 0, false});
    masks.back ().light += means[std::size_t (column)];
    masks.back ().columns++;
  }
  for (Mask &mask : masks)
    mask.light /= mask.columns;
  return masks;
}

/** False if none has enough contrast. */
bool
find_lit (std::vector<Mask> &masks)
{
  const std::size_t count = masks.size ();
  std::vector<double> sorted;
  for (const Mask &mask : masks)
    sorted.push_back (mask.light);
  std::sort (sorted.begin (), sorted.end ());
  const double dark = sorted[count / 8];
  const double contrast = sorted[count * 3 / 4] - dark;
  if (contrast < std::max (kMinContrast, kMinContrastPart * dark))
    return false;

  for (std::size_t i = 0; i < count; i++) {
    const double beside = std::max (
        masks[(i + 1) % count].light, masks[(i + count - 1) % count].light);
    masks[i].lit =
        masks[i].light - dark > kLit * std::max (contrast, beside - dark);
  }
  return true;
}

} // namespace

PhaseReading
read_pilot (int slots, const std::array<double, kPilotColumns> &means)
{
  std::vector<Mask> masks = masks_of (slots, means);
  if (!find_lit (masks))
    return {};

  std::size_t lit[2] = {}; // masks of each frame
  int early[2] = {};       // how far a frame is lit from its start
  int late[2] = {};        // and back from its end
  for (const Mask &mask : masks) {
    const int frame = mask.index / slots;
    const int place = mask.index % slots;
    if (!mask.lit)
      continue;
    lit[frame]++;
    if (2 * place < slots - 1)
      early[frame] = std::max (early[frame], place + 1);
    else
      late[frame] = std::max (late[frame], slots - place);
  }

  const int own = lit[1] > lit[0] ? 1 : 0;
  const int other = 1 - own;
  if (lit[own] < masks.size () / 4 || (early[other] > 0 && late[other] > 0))
    return {};
  if (lit[other] == 0)
    return {
        PhaseReading::Kind::in_phase, 0, lit[own] == masks.size () / 2, own};

  /* A slip between the masks of two columns lights the nearer one only: the
   * mask at distance d from the border is followed by that at 2 d + 1. */
  const int seen = std::max (early[other], late[other]);
  const int farthest = std::min (2 * seen - 1, slots / 2);
  return {PhaseReading::Kind::slipped, late[other] > 0 ? seen : -seen,
      seen >= farthest && lit[own] != lit[other], std::nullopt};
}

} // namespace codedexposure
