/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "moire/rectifier.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <string>
#include <vector>

#include "moire/rectify_weights.h"

namespace cexp
{

namespace
{

/* Bound on the filters that are made, and on the parts into which a pixel is
 * divided for them. */
constexpr int kMaxFilters = 1 << 15;
constexpr int kMaxParts = 32;

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

/* Windows of mirrors that bear the same elements all around have one number.
 */
class Surroundings
{
public:
  Surroundings (const Schedule &schedule, int reach);

  int count () const { return int (first_.size ()); }
  int of (int x, int y) const
  {
    return number_[std::size_t (
        floor_mod (y, rows_) * columns_ + floor_mod (x, columns_))];
  }
  /* A mirror that has it. */
  Offset first (int number) const { return first_[std::size_t (number)]; }

private:
  int columns_, rows_;
  std::vector<int> number_;
  std::vector<Offset> first_;
};

Surroundings::Surroundings (const Schedule &schedule, int reach)
    : columns_ (schedule.tile ().period_x ()),
      rows_ (schedule.tile ().period_y ())
{
  std::map<std::vector<int>, int> known;
  for (int y = 0; y < rows_; y++)
    for (int x = 0; x < columns_; x++) {
      std::vector<int> elements;
      for (int j = -reach; j <= reach; j++)
        for (int i = -reach; i <= reach; i++)
          elements.push_back (schedule.element_at (x + i, y + j));
      const auto [at, made] = known.try_emplace (elements, count ());
      if (made)
        first_.push_back ({x, y});
      number_.push_back (at->second);
    }
}

} // namespace

struct Rectifier::Plan {
  Extent camera, mirrors;
  int taps = 1;
  RectifyReport report;
  Image<Place> places;
  std::vector<float> weights; // taps x taps for each filter

  template <typename Pixel>
  void run (ImageView<const Pixel> from, ImageView<Pixel> to, int first,
      int rows, int largest) const;
  template <int kTaps, typename Pixel>
  void filter_row (ImageView<const Pixel> from, const Place *places, Pixel *to,
      float largest) const;
};

namespace
{

/* Makes a plan, mirror by mirror; a filter is made when the first mirror needs
 * it. */
class Planner
{
public:
  Planner (const Mapping &mapping, const Schedule &schedule,
      const RectifyOptions &options, int taps)
      : mapping_ (mapping), schedule_ (schedule), options_ (options),
        view_ (view_of (mapping, taps)), reach_ (needed_reach (view_)),
        surroundings_ (schedule, reach_),
        elements_ (element_covariance (schedule, options.persistence)),
        whole_ (mapping.one_to_one (options.tolerance)),
        straight_ (own_share (view_, 0.0, 0.0))
  {
    while (parts_ > 4 && surroundings_.count () * parts_ * parts_ > kMaxFilters)
      parts_ /= 2;
    filters_.assign (
        std::size_t (surroundings_.count ()) * std::size_t (parts_ * parts_),
        kUnseen);
  }

  Place place (int x, int y, RectifyReport &report);
  std::vector<float> weights () && { return std::move (weights_); }

private:
  static PixelView view_of (const Mapping &mapping, int taps)
  {
    const Extent camera = mapping.camera ();
    return {
        mapping.slope_at (0.5 * (camera.width - 1), 0.5 * (camera.height - 1)),
        mapping.psf_sigma (), taps};
  }
  std::int32_t filter (int x, int y, double fx, double fy);

  const Mapping &mapping_;
  const Schedule &schedule_;
  const RectifyOptions &options_;
  PixelView view_;
  int reach_;
  Surroundings surroundings_;
  Matrix elements_;
  bool whole_;
  double straight_;
  int parts_ = kMaxParts;
  std::vector<std::int32_t> filters_;
  std::vector<float> weights_;
  std::map<int, Neighbourhood> neighbourhoods_;
};

std::int32_t
Planner::filter (int x, int y, double fx, double fy)
{
  const int around = surroundings_.of (x, y);
  const auto part_of = [this] (double f) {
    return std::clamp (int (std::floor ((f + 0.5) * parts_)), 0, parts_ - 1);
  };
  const int px = part_of (fx), py = part_of (fy);
  std::int32_t &known =
      filters_[std::size_t ((around * parts_ + py) * parts_ + px)];
  if (known >= 0)
    return known;

  const Offset first = surroundings_.first (around);
  const auto [at, made] = neighbourhoods_.try_emplace (around, schedule_,
      elements_, first.x, first.y, reach_, options_.correlation_length);
  const std::size_t size = std::size_t (view_.taps * view_.taps);
  known = std::int32_t (weights_.size () / size);
  weights_.resize (weights_.size () + size);
  solve_weights (at->second, view_, (px + 0.5) / parts_ - 0.5,
      (py + 0.5) / parts_ - 0.5, options_.noise,
      std::span (weights_).last (size));
  return known;
}

Place
Planner::place (int x, int y, RectifyReport &report)
{
  const Position seen = mapping_.camera_at ({double (x), double (y)});
  const Extent camera = mapping_.camera ();
  /* So written that not-a-number is outside, too. */
  if (!(seen.x > -0.5 && seen.x < camera.width - 0.5 && seen.y > -0.5 &&
          seen.y < camera.height - 0.5)) {
    report.unseen++;
    return {};
  }
  const int px = int (std::lround (seen.x)), py = int (std::lround (seen.y));
  const double fx = seen.x - px, fy = seen.y - py;
  const double share = own_share (view_, -fx, -fy);
  const Place pixel = {std::int16_t (px), std::int16_t (py), kLookup};
  if (whole_ || share > 1.0 - 2.0 * options_.tolerance) {
    report.exact++;
    return pixel;
  }
  report.weighted++;
  report.mixed += share < kMixed * straight_;
  const int half = view_.taps / 2;
  const int rows = mapping_.mirrors ().height - schedule_.pilot_rows ();
  if (px < half || py < half || px + half >= camera.width ||
      py + half >= camera.height || y >= rows)
    return pixel;
  return {std::int16_t (px - half), std::int16_t (py - half),
      filter (x, y, fx, fy)};
}

Result<void>
check (const RectifyOptions &o)
{
  const struct {
    const char *what;
    double value, low, high;
  } ranges[] = {{"tolerance (mirrors)", o.tolerance, 0.0, 0.5},
      {"noise", o.noise, 1e-3, 10.0},
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
  const double magnification = mapping.stance ().magnification;
  auto plan = std::make_unique<Plan> ();
  plan->taps = taps_for (magnification);
  if (plan->taps == 0)
    return Error{"a mapping with " + std::to_string (magnification) +
                 " pixels a mirror cannot be corrected; 0.75 to 3.5 can"};
  plan->camera = mapping.camera ();
  plan->mirrors = mapping.mirrors ();
  try {
    Planner planner (mapping, schedule, options, plan->taps);
    plan->places = Image<Place> (plan->mirrors.width, plan->mirrors.height);
    for (int y = 0; y < plan->mirrors.height; y++)
      for (int x = 0; x < plan->mirrors.width; x++)
        plan->places.at (x, y) = planner.place (x, y, plan->report);
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
  for (int x = 0; x < mirrors.width; x++) {
    const Place &place = row[x];
    if (place.filter < 0) {
      to[x] = place.filter == kLookup ? from.at (place.x, place.y) : Pixel (0);
      continue;
    }
    const float *weight =
        weights.data () + std::ptrdiff_t (place.filter) * kTaps * kTaps;
    const Pixel *pixel = from.row (place.y) + place.x;
    float sum = 0.5f;
    for (int j = 0; j < kTaps; j++) {
      for (int i = 0; i < kTaps; i++)
        sum += weight[i] * float (pixel[i]);
      weight += kTaps;
      pixel = reinterpret_cast<const Pixel *> (
          reinterpret_cast<const std::byte *> (pixel) + from.stride);
    }
    to[x] = Pixel (std::int32_t (std::clamp (sum, 0.0f, largest)));
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
