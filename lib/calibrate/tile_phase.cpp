/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "calibrate/tile_phase.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace codedexposure
{

namespace
{

/* Parts of the frame along a side, by which the scene's contribution is
 * estimated. */
constexpr int kZones = 8;

/* Neighbouring zones of a scene are correlated, which raises the variance of
 * their mean. */
constexpr double kCorrelated = 2.0;

/* Light of the places of one period, relative to their mean, minus 1. */
using Levels = Eigen::VectorXd;

Levels
centred (const Levels &light)
{
  const double mean = light.mean ();
  return mean > 0.0 ? Levels (light.array () / mean - 1.0)
                    : Levels::Zero (light.size ());
}

/* The light of a flat scene through the code, with the tile at @phase. */
Levels
pattern_at (const Schedule &schedule, Offset phase)
{
  const Tile &tile = schedule.tile ();
  Levels pattern (tile.period_x () * tile.period_y ());
  Eigen::Index place = 0;
  for (int y = 0; y < tile.period_y (); y++)
    for (int x = 0; x < tile.period_x (); x++) {
      const int label = tile.label (x + phase.x, y + phase.y);
      pattern[place++] =
          schedule.light (schedule.order ()[std::size_t (label)]);
    }
  return centred (pattern);
}

/* The light of each zone of a frame. Zones have whole periods, so that a slope
 * of brightness has a small effect, the same in all zones. */
template <typename Pixel>
std::vector<Levels>
zones_of (ImageView<const Pixel> frame, Extent period)
{
  const int across = frame.width / period.width;
  const int down = frame.height / period.height;
  std::vector<Levels> zones;
  for (int j = 0; j < kZones; j++)
    for (int i = 0; i < kZones; i++) {
      Levels sums = Levels::Zero (period.width * period.height);
      const int x0 = across * i / kZones * period.width;
      const int x1 = across * (i + 1) / kZones * period.width;
      const int y0 = down * j / kZones * period.height;
      const int y1 = down * (j + 1) / kZones * period.height;
      for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++)
          sums[y % period.height * period.width + x % period.width] +=
              double (frame.at (x, y));
      zones.push_back (centred (sums));
    }
  return zones;
}

/* Mean of the zones, and its variance. */
struct Seen {
  Levels mean;
  double variance = 0.0;
};

Seen
seen_in (const std::vector<Levels> &zones)
{
  const double n = double (zones.size ());
  Seen seen = {Levels::Zero (zones.front ().size ()), 0.0};
  for (const Levels &zone : zones)
    seen.mean += zone / n;
  for (const Levels &zone : zones)
    seen.variance += (zone - seen.mean).squaredNorm ();
  /* Rounding adds to the variance even if the zones do not differ. */
  seen.variance = kCorrelated * seen.variance /
                      (n * (n - 1.0) * double (seen.mean.size ())) +
                  1e-8;
  return seen;
}

} // namespace

template <typename Pixel>
Result<TilePhase>
find_tile_phase (ImageView<const Pixel> frame, const Schedule &schedule)
{
  if (!schedule.regions ().empty ())
    return Error{schedule.text () +
                 " has regions, and the phase can be found for one tile and "
                 "one code only; show its background alone, or calibrate"};
  const Extent period = {
      schedule.tile ().period_x (), schedule.tile ().period_y ()};
  if (frame.width < kZones * period.width ||
      frame.height < kZones * period.height)
    return Error{"a frame of " + size_text ({frame.width, frame.height}) +
                 " pixels holds less than " + size_text ({kZones, kZones}) +
                 " periods of the tile; use a smaller tile or larger frames"};
  const Levels flat = pattern_at (schedule, {});
  if (flat.squaredNorm () < 1e-9)
    return Error{"all elements of the code " + schedule.code ().name () +
                 " get the same light, which does not show the phase of the "
                 "tile; use a frame of a staircase, or calibrate"};

  const Seen seen = seen_in (zones_of (frame, period));
  TilePhase best;
  double best_likelihood = -1.0;
  std::vector<double> likelihoods;
  std::set<std::vector<double>> known;
  for (int y = 0; y < period.height; y++)
    for (int x = 0; x < period.width; x++) {
      const Levels expected = pattern_at (schedule, {x, y});
      if (!known.insert ({expected.begin (), expected.end ()}).second)
        continue;
      const double power = expected.squaredNorm ();
      const double contrast = std::max (0.0, seen.mean.dot (expected) / power);
      const double likelihood =
          contrast * contrast * power / (2.0 * seen.variance);
      likelihoods.push_back (likelihood);
      if (likelihood > best_likelihood) {
        best_likelihood = likelihood;
        best.phase = {x, y};
        best.contrast = contrast;
      }
    }
  double all = 0.0;
  for (const double likelihood : likelihoods)
    all += std::exp (likelihood - best_likelihood);
  best.confidence = 1.0 / all;
  return best;
}

template Result<TilePhase> find_tile_phase (
    ImageView<const std::uint8_t>, const Schedule &);
template Result<TilePhase> find_tile_phase (
    ImageView<const std::uint16_t>, const Schedule &);

} // namespace codedexposure
