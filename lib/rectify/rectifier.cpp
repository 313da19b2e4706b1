/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "rectify/rectifier.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <numbers>
#include <string>
#include <vector>

#include "base/range.h"
#include "base/text.h"
#include "base/try.h"
#include "base/view_check.h"
#include "rectify/filters.h"
#include "rectify/window.h"

namespace codedexposure
{

namespace
{

/* Pixels along a side of the window, up to this number of pixels per mirror. */
constexpr struct {
  double magnification;
  int taps;
} kWindows[] = {{1.3, 5}, {2.3, 7}, {3.5, 9}};
constexpr double kMinMagnification = 0.75;

/* Distance in mirrors within which a pixel is aligned with its mirror. */
constexpr double kTolerance = 0.05;
/* Length over which a scene is correlated, mirrors; and its correlation with
 * itself one slot later. */
constexpr double kCorrelationLength = 2.0, kPersistence = 0.8;

/* A mirror is mixed if no pixel gets this part of the light that a pixel
 * centred on it gets. */
constexpr double kMixed = 0.6;

constexpr std::int32_t kLookup = -1;
constexpr std::int32_t kUnseen = -2;

/* The first pixel of a mirror's window, or the pixel to copy. */
struct Place {
  std::int16_t x = 0, y = 0;
  std::int32_t filter = kUnseen;
};

/* Ratios of the scene's variance and the noise's: below each limit, the filters
 * for the next larger noise are used. */
constexpr auto kLimits = [] {
  std::array<float, FilterBank::kNoises.size () - 1> limits = {};
  for (std::size_t i = 0; i < limits.size (); i++)
    limits[i] =
        float (1.0 / (FilterBank::kNoises[i] * FilterBank::kNoises[i + 1]));
  return limits;
}();

} // namespace

struct Rectifier::Plan {
  Extent camera, mirrors;
  int taps = 1;
  RectifyReport report;
  Image<Place> places;
  std::vector<float> weights; // from FilterBank::weights ()
  std::vector<FilterBank::WindowScale> scales;
  float noise = 0.0f; // rms, as a part of white

  template <typename Pixel>
  Result<void> run (
      ImageView<const Pixel> from, ImageView<Pixel> to, int largest) const;
  template <int kTaps, typename Pixel>
  void filter_row (ImageView<const Pixel> from, const Place *places, Pixel *to,
      float largest) const;
};

namespace
{

/* Makes a plan row by row. */
class Planner
{
public:
  Planner (const Mapping &mapping, const Schedule &schedule,
      const PixelView &view, bool whole)
      : mapping_ (mapping),
        coded_rows_ (mapping.mirrors ().height - schedule.pilot_rows ()),
        elements_ (schedule),
        bank_ (view, elements_, mapping.mirrors (), scene ()), whole_ (whole),
        single_ (view.taps == kWindows[0].taps),
        best_share_ (bank_.solver ().own_share (0.0, 0.0)),
        seen_ (std::size_t (mapping.mirrors ().width)), around_ (seen_.size ())
  {
  }

  /** To make all filters, as a part of what is allowed. */
  double effort () const { return whole_ ? 0.0 : bank_.effort (); }
  void place_row (int y, Place *row, RectifyReport &report);
  std::vector<float> weights () && { return std::move (bank_).weights (); }
  std::vector<FilterBank::WindowScale> scales () &&
  {
    return std::move (bank_).scales ();
  }

private:
  /* Persistence is that of the part with the shortest slots. */
  SceneClass scene () const
  {
    int most = 1;
    for (int i = 0; i < elements_.parts (); i++)
      most = std::max (most, elements_.part (i).slots ());
    return {.length = kCorrelationLength / std::numbers::sqrt3,
        .correlation = std::pow (
            kPersistence, double (most) / elements_.schedule ().slots ())};
  }
  Place place (Position seen, int around, bool coded, RectifyReport &report);

  const Mapping &mapping_;
  int coded_rows_;
  ElementMap elements_;
  FilterBank bank_;
  bool whole_;
  bool single_;       // pixel per mirror; of several, all are used
  double best_share_; // of a pixel centred on its mirror
  std::vector<Position> seen_;
  std::vector<int> around_;
};

void
Planner::place_row (int y, Place *row, RectifyReport &report)
{
  mapping_.camera_row (y, seen_);
  if (!whole_)
    bank_.surroundings ().find_row (y, around_);
  for (std::size_t x = 0; x < seen_.size (); x++)
    row[x] = place (seen_[x], around_[x], y < coded_rows_, report);
}

Place
Planner::place (Position seen, int around, bool coded, RectifyReport &report)
{
  const Extent camera = mapping_.camera ();
  /* NaN must count as outside, too. */
  if (!(seen.x > -0.5 && seen.x < camera.width - 0.5 && seen.y > -0.5 &&
          seen.y < camera.height - 0.5)) {
    report.unseen++;
    return {};
  }
  const int px = int (seen.x + 0.5), py = int (seen.y + 0.5);
  const double fx = seen.x - px, fy = seen.y - py;
  const double share = bank_.solver ().own_share (-fx, -fy);
  const Place pixel = {std::int16_t (px), std::int16_t (py), kLookup};
  if (whole_ || (single_ && share > 1.0 - 2.0 * kTolerance)) {
    report.exact++;
    return pixel;
  }
  report.weighted++;
  report.mixed += share < kMixed * best_share_;
  const int half = bank_.solver ().taps () / 2;
  if (px < half || py < half || px + half >= camera.width ||
      py + half >= camera.height || !coded)
    return pixel;
  return {std::int16_t (px - half), std::int16_t (py - half),
      bank_.filter (around, fx, fy)};
}

/* 0 for a magnification out of range. */
int
taps_for (double magnification)
{
  if (magnification >= kMinMagnification)
    for (const auto &window : kWindows)
      if (magnification <= window.magnification)
        return window.taps;
  return 0;
}

/* A camera may look at a small part of its mirrors, but the memory and the time
 * for the rest are bounded. */
Result<void>
check_mirrors (const Mapping &mapping)
{
  /* More than the largest DMD has, 2560x1600. */
  constexpr std::int64_t kAnyway = std::int64_t (1) << 22;
  constexpr std::int64_t kForEachPixel = 16;
  const auto area = [] (Extent size) {
    return std::int64_t (size.width) * size.height;
  };
  const auto text = [] (Extent size) {
    return std::to_string (size.width) + "x" + std::to_string (size.height);
  };
  const Extent camera = mapping.camera (), mirrors = mapping.mirrors ();
  if (area (mirrors) <= std::max (kAnyway, kForEachPixel * area (camera)))
    return {};
  return Error{"a mapping to " + text (mirrors) +
               " mirrors cannot be used for frames of " + text (camera) +
               " pixels, which see few of them; use the mapping of this bench"};
}

/* Displacements can take pixels far apart. */
Result<void>
check_slope (const PixelView &view)
{
  constexpr double kMaxSlope = 16.0;
  double slope = 0.0;
  for (const double along : view.slope)
    slope = std::max (slope, std::abs (along));
  if (slope <= kMaxSlope)
    return {};
  return Error{"a mapping with " + real_text (std::ceil (slope)) +
               " mirrors to a pixel at the centre of the frame cannot be "
               "corrected; use a displacement that changes by less than " +
               real_text (kMaxSlope) + " a pixel"};
}

/* @effort: to find the weights, as a part of what is allowed. */
Result<void>
check_effort (const PixelView &view, double effort)
{
  if (effort <= 1.0)
    return {};
  return Error{
      "with a blur of " + real_text (view.sigma) +
      " pixels (psf_sigma of the mapping) and this schedule, it takes " +
      real_text (std::ceil (effort)) +
      " times as long as allowed to find the weights of the pixels "
      "around each mirror; focus the camera, or use a schedule with a "
      "smaller tile or fewer regions"};
}

} // namespace

Result<Rectifier>
Rectifier::make (const Mapping &mapping, const Schedule &schedule,
    const RectifyOptions &options)
try {
  RETURN_IF_ERROR (check_ranges ({{"noise (of white)", options.noise,
      RectifyOptions::kMinNoise, RectifyOptions::kMaxNoise}}));
  const Extent mirrors = mapping.mirrors ();
  RETURN_IF_ERROR (schedule.check_size (mirrors.width, mirrors.height));
  const double magnification = mapping.pose ().magnification;
  auto plan = std::make_shared<Plan> ();
  plan->taps = taps_for (magnification);
  if (plan->taps == 0)
    return Error{
        "a mapping with " + std::to_string (magnification) +
        " pixels per mirror cannot be corrected; use one of 0.75 to 3.5"};
  RETURN_IF_ERROR (check_mirrors (mapping));
  plan->camera = mapping.camera ();
  plan->mirrors = mirrors;
  plan->noise = float (
      options.noise * std::sqrt (schedule.slots () / schedule.white_slots ()));
  PixelView view{mapping.slope_at (0.5 * (plan->camera.width - 1),
                     0.5 * (plan->camera.height - 1)),
      mapping.psf_sigma (), plan->taps};
  RETURN_IF_ERROR (check_slope (view));
  /* Pixels that are copied need no weights. */
  const bool whole = mapping.one_to_one (kTolerance);
  if (whole)
    view.sigma = 0.0;
  RETURN_IF_ERROR (check_effort (view, FilterBank::effort (view, schedule)));
  Planner planner (mapping, schedule, view, whole);
  RETURN_IF_ERROR (check_effort (view, planner.effort ()));
  plan->places = Image<Place> (plan->mirrors.width, plan->mirrors.height);
  for (int y = 0; y < plan->mirrors.height; y++)
    planner.place_row (y, plan->places.view ().row (y), plan->report);
  plan->scales = std::move (planner).scales ();
  plan->weights = std::move (planner).weights ();
  if (plan->report.exact + plan->report.weighted == 0)
    return Error{"with this mapping the camera sees none of the mirrors; use "
                 "the mapping of this bench"};
  return Rectifier (std::move (plan));
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

Extent
Rectifier::camera () const
{
  return plan_->camera;
}

Extent
Rectifier::mirrors () const
{
  return plan_->mirrors;
}

const RectifyReport &
Rectifier::report () const
{
  return plan_->report;
}

template <int kTaps, typename Pixel>
void
Rectifier::Plan::filter_row (ImageView<const Pixel> from, const Place *row,
    Pixel *to, float largest) const
{
  using Seen = Window<kTaps, Pixel>;
  constexpr int kNoises = int (FilterBank::kNoises.size ());
  const float to_noise = 0.5f / (noise * noise * largest * largest);
  Pixel copy[kTaps * Seen::kRead] = {};
  for (int x = 0; x < mirrors.width; x++) {
    const Place &place = row[x];
    if (place.filter < 0) {
      to[x] = place.filter == kLookup ? from.at (place.x, place.y) : Pixel (0);
      continue;
    }
    Seen window = {from.row (place.y) + place.x, from.stride};
    if (place.x + Seen::kRead > from.width) {
      for (int y = 0; y < kTaps; y++)
        std::copy_n (window.row (y), kTaps, copy + y * Seen::kRead);
      window = {copy, sizeof (Pixel) * Seen::kRead};
    }
    /* Differences beyond the noise are the scene's. */
    const FilterBank::WindowScale &scale = scales[std::size_t (place.filter)];
    const float scene =
        (window.roughness () * to_noise * scale.darkness - 1.0f) *
        scale.smoothness;
    std::ptrdiff_t filter = std::ptrdiff_t (place.filter) * kNoises;
    for (const float limit : kLimits)
      filter += scene <= limit;
    const float sum =
        window.filtered (weights.data () + filter * kTaps * Seen::kLength);
    to[x] = Pixel (std::int32_t (std::clamp (sum + 0.5f, 0.0f, largest)));
  }
}

template <typename Pixel>
Result<void>
Rectifier::Plan::run (
    ImageView<const Pixel> from, ImageView<Pixel> to, int largest) const
{
  const ViewBytes input = ViewBytes::of (from), output = ViewBytes::of (to);
  RETURN_IF_ERROR (
      check_view (input, "camera frame", camera.width, camera.height));
  RETURN_IF_ERROR (
      check_view (output, "output", mirrors.width, mirrors.height));
  RETURN_IF_ERROR (check_apart ({&output, 1}, &input));
  if (largest <= 0)
    largest = std::numeric_limits<Pixel>::max ();
  for (int y = 0; y < mirrors.height; y++) {
    const Place *row = places.view ().row (y);
    if (taps == 5)
      filter_row<5> (from, row, to.row (y), float (largest));
    else if (taps == 7)
      filter_row<7> (from, row, to.row (y), float (largest));
    else
      filter_row<9> (from, row, to.row (y), float (largest));
  }
  return {};
}

Result<void>
Rectifier::run (ImageView<const std::uint8_t> camera,
    ImageView<std::uint8_t> mirrors, int largest) const
{
  return plan_->run (camera, mirrors, largest);
}

Result<void>
Rectifier::run (ImageView<const std::uint16_t> camera,
    ImageView<std::uint16_t> mirrors, int largest) const
{
  return plan_->run (camera, mirrors, largest);
}

} // namespace codedexposure
