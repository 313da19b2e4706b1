/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/dither.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/statistics.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/* The short exposure, of the frame period. */
constexpr int kShorter = 5;
/* Lengths of the light, of the shortest that mirrors can make. */
constexpr std::array kLengths = {1.0, 1.25, 1.6, 2.4};
constexpr int kBrightFrames = 8, kShortFrames = 16, kLongFrames = 8;
/* Looks are repeated until read noise is known to this part, or as long as its
 * error shrinks to that part of what it was: more looks do not help where the
 * model is what is wrong. */
constexpr double kAim = 0.02, kHelps = 0.85;
constexpr int kMostRounds = 5;
/* Groups are that wide and go that far, DN; fewer pixels are no group. */
constexpr double kWidth = 1.0 / 24, kMost = 2.0;
constexpr double kFewPixels = 30;

/* All rows are the same: controllers take minutes for masks that are random in
 * x and y, which cannot be compressed. */
StillMask
random_columns (int first, int count)
{
  const auto on = [] (int x, int) {
    std::uint32_t z = std::uint32_t (x) * 0x9E3779B1u;
    z = (z ^ (z >> 15)) * 0x2C1B3C6Du;
    z = (z ^ (z >> 12)) * 0x297A2D39u;
    return ((z ^ (z >> 15)) & 1u) != 0;
  };
  return {.name = "random columns", .on = on, .slots = count, .first = first};
}

/** The looks, and what they give. */
class DitherRun
{
public:
  DitherRun (Examination &examination, const Examination::Lit &fine,
      ImageView<const std::uint8_t> good, const PhotonTransfer &transfer)
      : examination_ (examination), fine_ (fine), good_ (good),
        transfer_ (transfer), step_ (thinning_of ({good.width, good.height}))
  {
    const double period = double (examination.rig.parts ().rate.period ());
    part_ = period / kShorter / value_or (examination.profile.exposure, period);
  }

  Result<void> see_light (
      int top, const Image<float> &dark, const Image<float> &bright)
  {
    ASSIGN_OR_RETURN (const Stack seen,
        look_at_light (examination_, random_columns (fine_.first, top),
            fine_.of, kBrightFrames, &dark));
    light_ = field_ = thinned (dark, step_);
    double mean = 0.0, pixels = 0.0;
    each_pixel (light_, [&] (int x, int y) {
      const Offset at = {x * step_, y * step_};
      const double none = transfer_.light_of (double (dark.at (at.x, at.y)));
      const auto of = [&] (const Image<float> &image) {
        const double light =
            transfer_.light_of (double (image.at (at.x, at.y)));
        return transfer_.slope * (light - none);
      };
      light_.at (x, y) = float (of (seen.mean) / top);
      field_.at (x, y) = float (of (bright));
      const bool counts = good_.at (at.x, at.y) != 0;
      mean += counts ? double (field_.at (x, y)) : 0.0;
      pixels += counts;
    });
    const float scale = float (pixels / std::max (1e-3, mean));
    each_pixel (field_, [&] (int x, int y) { field_.at (x, y) *= scale; });
    return {};
  }

  /* The mirrors are on a while after the exposure has begun. */
  Result<void> look (bool longer)
  {
    for (const double length : kLengths) {
      const int of = std::max (1, int (fine_.of / length));
      const int first = of * fine_.first / fine_.of + of / (4 * kShorter);
      ASSIGN_OR_RETURN (
          Stack stack, look_at_light (examination_, random_columns (first, 1),
                           of, longer ? kLongFrames : kShortFrames));
      shorter_ = means_of (stack, good_);
      looks_.push_back ({stack.frames, thinned (stack.mean, step_),
          thinned (stack.variance, step_), double (fine_.of) / of, longer});
    }
    return {};
  }

  /* Which pixels get the same light depends on the off light. */
  std::optional<Dark> fit () const
  {
    std::optional<Dark> dark;
    for (int round = 0; round < 3; round++) {
      const double off = dark ? std::max (0.0, dark->off.value) : 0.0;
      std::vector<DitherGroup> groups;
      for (std::size_t look = 0; look < looks_.size (); look++)
        add_groups (look, off, groups);
      const auto next = fit_dither (groups, part_, transfer_.conversion_gain,
          dark ? std::optional<double> (off) : std::nullopt);
      if (!next)
        break;
      dark = next;
    }
    return dark;
  }

  const StackMeans &shorter () const { return shorter_; }

private:
  struct Look {
    int frames;
    Image<float> mean, variance; // thinned
    double length;               // of the light
    bool longer;
  };

  void add_groups (
      std::size_t look, double off, std::vector<DitherGroup> &all) const
  {
    const Look &seen = looks_[look];
    std::vector<DitherGroup> groups (std::size_t (kMost / kWidth) + 1);
    each_pixel (light_, [&] (int x, int y) {
      const double light = seen.length * double (light_.at (x, y));
      const double field = double (field_.at (x, y));
      const double more =
          light + (seen.longer ? 1.0 : part_) * off * (field - 1.0);
      if (good_.at (x * step_, y * step_) == 0 || more >= kMost ||
          more < -kWidth / 2)
        return;
      DitherGroup &group =
          groups[std::size_t (std::max (0.0, more / kWidth + 0.5))];
      const double mean = double (seen.mean.at (x, y));
      group.pixels++;
      group.light += light;
      group.field += field;
      group.mean += mean;
      group.spread += mean * mean;
      group.variance += double (seen.variance.at (x, y));
    });
    for (DitherGroup &group : groups) {
      if (group.pixels < kFewPixels)
        continue;
      group.look = int (look);
      group.longer = seen.longer;
      group.frames = seen.frames;
      group.field -= 1.0; // where the sum began
      for (double *sum : {&group.light, &group.field, &group.mean,
               &group.spread, &group.variance})
        *sum /= group.pixels;
      group.spread = std::max (0.0, group.spread - group.mean * group.mean);
      all.push_back (group);
    }
  }

  Examination &examination_;
  const Examination::Lit fine_;
  const ImageView<const std::uint8_t> good_;
  const PhotonTransfer &transfer_;
  double part_;
  /* Of each pixel: light of the mask in the shortest time, DN; and that of all
   * mirrors, as part of the mean. */
  Image<float> light_, field_; // thinned
  int step_;                   // of thinning
  StackMeans shorter_;         // of the last look
  std::vector<Look> looks_;
};

/** Looks again until more frames would not help. */
Result<void>
look_until_known (DitherRun &run, std::optional<Dark> &found)
{
  double error = std::numeric_limits<double>::infinity (); // of the variance
  for (int round = 0; round < kMostRounds; round++) {
    RETURN_IF_ERROR (run.look (false));
    found = run.fit ();
    if (!found || found->variance.sigma < 2 * kAim * found->variance.value ||
        found->variance.sigma > kHelps * error)
      break;
    error = found->variance.sigma;
  }
  return {};
}

} // namespace

Result<std::optional<DitherSight>>
measure_dither (Examination &examination, const Examination::Lit &fine, int top,
    const Image<float> &dark, const Image<float> &bright,
    ImageView<const std::uint8_t> good, const PhotonTransfer &transfer)
{
  DitherRun run (examination, fine, good, transfer);
  RETURN_IF_ERROR (run.see_light (top, dark, bright));
  RETURN_IF_ERROR (run.look (true));
  std::optional<Dark> found;
  RETURN_IF_ERROR (with_exposure (examination,
      examination.rig.parts ().rate.period () / kShorter,
      [&] { return look_until_known (run, found); }));
  if (!found)
    return std::optional<DitherSight> ();
  return std::optional<DitherSight> ({*found, run.shorter ()});
}

} // namespace codedexposure
