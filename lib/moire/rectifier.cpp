/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/rectifier.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <new>
#include <string>
#include <vector>

#include "moire/rectify_filters.h"
#include "moire/rectify_window.h"

namespace cexp
{

namespace
{

/* Pixels along a side of the window, for up to so many pixels a mirror. */
constexpr struct {
  double magnification;
  int taps;
} kWindows[] = {{1.3, 5}, {2.3, 7}, {3.5, 9}};
constexpr double kLeastMagnification = 0.75;

/* A mirror is mixed if no pixel gets this part of what one that looks straight
 * at it gets. */
constexpr double kMixed = 0.6;

constexpr std::int32_t kLookup = -1;
constexpr std::int32_t kUnseen = -2;

/* Where a mirror's light is: the first pixel of its window, or the pixel. */
struct Place {
  std::int16_t x = 0, y = 0;
  std::int32_t filter = kUnseen;
};

/* Of the scene's variance by that of noise: where one is exceeded, filters for
 * so much noise are taken, else those for more. */
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
  std::vector<float> weights; // as FilterBank has them
  std::vector<FilterBank::Look> looks;
  float noise = 0.0f; // of white

  template <typename Pixel>
  void run (ImageView<const Pixel> from, ImageView<Pixel> to, int first,
      int rows, int largest) const;
  template <int kTaps, typename Pixel>
  void filter_row (ImageView<const Pixel> from, const Place *places, Pixel *to,
      float largest) const;
};

namespace
{

/* Makes a plan, row by row. */
class Planner
{
public:
  Planner (const Mapping &mapping, const Schedule &schedule,
      const RectifyOptions &options, int taps)
      : mapping_ (mapping), tolerance_ (options.tolerance),
        coded_rows_ (mapping.mirrors ().height - schedule.pilot_rows ()),
        elements_ (schedule, mapping.mirrors (), options.persistence),
        bank_ (view_of (mapping, taps), elements_, options.correlation_length),
        whole_ (mapping.one_to_one (options.tolerance)),
        single_ (taps == kWindows[0].taps),
        straight_ (bank_.solver ().own_share (0.0, 0.0)),
        seen_ (std::size_t (mapping.mirrors ().width)), around_ (seen_.size ())
  {
  }

  void place_row (int y, Place *row, RectifyReport &report);
  std::vector<float> weights () && { return std::move (bank_).weights (); }
  std::vector<FilterBank::Look> looks () &&
  {
    return std::move (bank_).looks ();
  }

private:
  static PixelView view_of (const Mapping &mapping, int taps)
  {
    const Extent camera = mapping.camera ();
    return {
        mapping.slope_at (0.5 * (camera.width - 1), 0.5 * (camera.height - 1)),
        mapping.psf_sigma (), taps};
  }
  Place place (Position seen, int around, bool coded, RectifyReport &report);

  const Mapping &mapping_;
  double tolerance_;
  int coded_rows_;
  Elements elements_;
  FilterBank bank_;
  bool whole_;
  bool single_; // pixel a mirror; of several, all are of use
  double straight_;
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
  /* So written that not-a-number is outside, too. */
  if (!(seen.x > -0.5 && seen.x < camera.width - 0.5 && seen.y > -0.5 &&
          seen.y < camera.height - 0.5)) {
    report.unseen++;
    return {};
  }
  const int px = int (seen.x + 0.5), py = int (seen.y + 0.5);
  const double fx = seen.x - px, fy = seen.y - py;
  const double share = bank_.solver ().own_share (-fx, -fy);
  const Place pixel = {std::int16_t (px), std::int16_t (py), kLookup};
  if (whole_ || (single_ && share > 1.0 - 2.0 * tolerance_)) {
    report.exact++;
    return pixel;
  }
  report.weighted++;
  report.mixed += share < kMixed * straight_;
  const int half = bank_.solver ().taps () / 2;
  if (px < half || py < half || px + half >= camera.width ||
      py + half >= camera.height || !coded)
    return pixel;
  return {std::int16_t (px - half), std::int16_t (py - half),
      bank_.filter (around, fx, fy)};
}

Result<void>
check (const RectifyOptions &o)
{
  const struct {
    const char *what;
    double value, low, high;
  } ranges[] = {{"tolerance (mirrors)", o.tolerance, 0.0, 0.5},
      {"noise (of white)", o.noise, o.kLeastNoise, o.kMostNoise},
      {"correlation length (mirrors)", o.correlation_length, 0.1, 1000.0},
      {"persistence", o.persistence, 0.0, 0.9999}};
  for (const auto &range : ranges)
    if (!(range.value >= range.low && range.value <= range.high))
      return Error{std::string ("the rectifier's ") + range.what + " of " +
                   std::to_string (range.value) + " is outside " +
                   std::to_string (range.low) + ".." +
                   std::to_string (range.high)};
  return {};
}

/* 0 where there are none. */
int
taps_for (double magnification)
{
  if (magnification >= kLeastMagnification)
    for (const auto &window : kWindows)
      if (magnification <= window.magnification)
        return window.taps;
  return 0;
}

} // namespace

Result<Rectifier>
Rectifier::make (const Mapping &mapping, const Schedule &schedule,
    const RectifyOptions &options)
{
  if (const auto checked = check (options); !checked)
    return checked.error ();
  const Extent mirrors = mapping.mirrors ();
  if (const auto within = schedule.check_size (mirrors.width, mirrors.height);
      !within)
    return within.error ();
  const double magnification = mapping.stance ().magnification;
  auto plan = std::make_unique<Plan> ();
  plan->taps = taps_for (magnification);
  if (plan->taps == 0)
    return Error{"a mapping with " + std::to_string (magnification) +
                 " pixels a mirror cannot be corrected; 0.75 to 3.5 can"};
  plan->camera = mapping.camera ();
  plan->mirrors = mirrors;
  plan->noise = float (
      options.noise * std::sqrt (schedule.slots () / schedule.white_slots ()));
  try {
    Planner planner (mapping, schedule, options, plan->taps);
    plan->places = Image<Place> (plan->mirrors.width, plan->mirrors.height);
    for (int y = 0; y < plan->mirrors.height; y++)
      planner.place_row (y, plan->places.view ().row (y), plan->report);
    plan->looks = std::move (planner).looks ();
    plan->weights = std::move (planner).weights ();
  } catch (const std::bad_alloc &) {
    return Error{"there is no memory for the weights of a mapping"};
  }
  if (plan->report.exact + plan->report.weighted == 0)
    return Error{"the camera sees none of the mirrors by this mapping; is it "
                 "of this bench?"};
  return Rectifier (std::move (plan));
}

Rectifier::Rectifier (std::unique_ptr<const Plan> plan)
    : plan_ (std::move (plan))
{
}

Rectifier::Rectifier (Rectifier &&) noexcept = default;
Rectifier &Rectifier::operator= (Rectifier &&) noexcept = default;
Rectifier::~Rectifier () = default;

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
    /* What differs by more than noise is the scene. */
    const FilterBank::Look &look = looks[std::size_t (place.filter)];
    const float scene =
        (window.roughness () * to_noise * look.darkness - 1.0f) *
        look.smoothness;
    std::ptrdiff_t filter = std::ptrdiff_t (place.filter) * kNoises;
    for (const float limit : kLimits)
      filter += scene <= limit;
    const float sum =
        window.filtered (weights.data () + filter * kTaps * Seen::kLength);
    to[x] = Pixel (std::int32_t (std::clamp (sum + 0.5f, 0.0f, largest)));
  }
}

template <typename Pixel>
void
Rectifier::Plan::run (ImageView<const Pixel> from, ImageView<Pixel> to,
    int first, int rows, int largest) const
{
  assert (from.width == camera.width && from.height == camera.height);
  assert (to.width == mirrors.width && to.height == mirrors.height);
  if (largest <= 0)
    largest = std::numeric_limits<Pixel>::max ();
  for (int y = first; y < first + rows; y++) {
    const Place *row = places.view ().row (y);
    const float most = float (largest);
    if (taps == 5)
      filter_row<5> (from, row, to.row (y), most);
    else if (taps == 7)
      filter_row<7> (from, row, to.row (y), most);
    else
      filter_row<9> (from, row, to.row (y), most);
  }
}

void
Rectifier::run (ImageView<const std::uint8_t> camera,
    ImageView<std::uint8_t> mirrors, int largest) const
{
  plan_->run (camera, mirrors, 0, mirrors.height, largest);
}

void
Rectifier::run (ImageView<const std::uint16_t> camera,
    ImageView<std::uint16_t> mirrors, int largest) const
{
  plan_->run (camera, mirrors, 0, mirrors.height, largest);
}

void
Rectifier::run_rows (ImageView<const std::uint8_t> camera,
    ImageView<std::uint8_t> mirrors, int first_row, int rows, int largest) const
{
  plan_->run (camera, mirrors, first_row, rows, largest);
}

void
Rectifier::run_rows (ImageView<const std::uint16_t> camera,
    ImageView<std::uint16_t> mirrors, int first_row, int rows,
    int largest) const
{
  plan_->run (camera, mirrors, first_row, rows, largest);
}

} // namespace cexp
