/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "rectify/rectifier.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "base/range.h"
#include "base/targets.h"
#include "base/text.h"
#include "base/try.h"
#include "base/view_check.h"
#include "rectify/correction.h"
#include "rectify/filters.h"
#include "rectify/sight.h"

namespace codedexposure
{

CODEDEXPOSURE_SUPPORTED (
    rectify::supported_kernels, rectify, rectify::Kernels, baseline)

using rectify::Place;

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
/* A pixel that gets a larger part of its light than this from its own mirror is
 * copied: weights would make its error larger. */
constexpr double kOwn = 1.0 - 2.0 * kTolerance;
/* Length over which a scene is correlated, mirrors; and its correlation with
 * itself one slot later. */
constexpr double kCorrelationLength = 2.0, kPersistence = 0.8;

/* Where mirrors have a smaller mean share in their pixels than this part of
 * what they have in one that is centred on them, corrections pay. */
constexpr double kBetween = 0.9;
/* A mirror is mixed if no pixel gets this part of the light that a pixel
 * centred on it gets. */
constexpr double kMixed = 0.6;

/* Parts 0 .. parts - 1; null: on the caller's thread. */
template <typename Part>
void
run_parts (Workers *workers, int parts, const Part &part)
{
  if (workers)
    workers->run (parts, [&] (int i, int) { part (i); });
  for (int i = 0; !workers && i < parts; i++)
    part (i);
}

} // namespace

struct Rectifier::Plan {
  Extent camera, mirrors;
  int taps = 1;
  RectifyReport report;
  Image<Place> places;
  Rect windows; // first pixels of all of them
  FilterBank::Tables filters;
  rectify::Kernels kernels;
  float noise = 0.0f; // rms, as a part of white
  bool keep_unknown = false;
  std::optional<Sight> sight; // of correct ()
  int reach = 0;              // mirrors on which one depends, to each side
  /* Of measure (), for the next frame: a system takes long to give so much. */
  mutable std::atomic<float *> spare = nullptr;

  ~Plan () { delete[] spare.load (); }
  struct Keep {
    const Plan *plan;
    void operator() (float *memory) const
    {
      delete[] plan->spare.exchange (memory);
    }
  };
  using Measured = std::unique_ptr<float[], Keep>;

  template <typename Pixel>
  rectify::RectifyRow<Pixel> *run_row () const
  {
    return std::get<rectify::RectifyRow<Pixel> *const(&)[3]> (
        std::tie (kernels.bytes, kernels.words))[(taps - kWindows[0].taps) / 2];
  }

  /* How rough the scene is around the windows of all mirrors. */
  template <typename Pixel>
  Measured measure (ImageView<const Pixel> from, Workers *workers) const
  {
    const auto row_kernel = std::get<rectify::MeasureRow<Pixel> *const &> (
        std::tie (kernels.measure_bytes, kernels.measure_words));
    Measured roughness (spare.exchange (nullptr), {this});
    if (!roughness)
      roughness.reset (new float[std::size_t (windows.width) *
                                 std::size_t (windows.height)]);
    const int inside = (taps - 1 - rectify::kSteps) / 2;
    const int left = windows.x + inside, top = windows.y + inside;
    run_parts (workers, windows.height, [&] (int y) {
      row_kernel ({from.row (top + y) + left, from.stride, from.width - left},
          windows.width, roughness.get () + std::ptrdiff_t (y) * windows.width);
    });
    return roughness;
  }

  rectify::Filters filters_for (int largest, const Measured &roughness) const
  {
    rectify::Filters with{filters.weights.data (), filters.scales.data (),
        filters.errors.data (), {},
        noise * noise * float (largest) * float (largest), float (largest),
        {roughness.get (), windows.width, windows.x, windows.y}};
    for (std::size_t i = 0; i + 1 < FilterBank::kNoises.size (); i++)
      with.limits[i] =
          float (1.0 / (FilterBank::kNoises[i] * FilterBank::kNoises[i + 1]));
    return with;
  }

  /* Mirrors that are copied have what their pixel has. */
  template <typename Pixel>
  void mark_unknown (
      ImageView<const Pixel> from, ImageView<Pixel> to, Pixel largest) const
  {
    if (report.unseen > 0)
      for (int y = 0; y < mirrors.height; y++)
        for (int x = 0; x < mirrors.width; x++)
          if (places.at (x, y).filter == Place::kUnseen)
            to.at (x, y) = largest;
    const auto any_in = [&] (int y, int first, int count) {
      const Pixel *row = from.row (y) + first;
      return std::any_of (
          row, row + count, [=] (Pixel pixel) { return pixel >= largest; });
    };
    std::vector<char> rows;
    for (int y = 0; y < from.height; y++)
      rows.push_back (any_in (y, 0, from.width));
    if (std::find (rows.begin (), rows.end (), 1) == rows.end ())
      return;
    for (int y = 0; y < mirrors.height; y++)
      for (int x = 0; x < mirrors.width; x++) {
        const Place &place = places.at (x, y);
        for (int i = 0; place.filter >= 0 && i < taps; i++)
          if (rows[std::size_t (place.y + i)] &&
              any_in (place.y + i, place.x, taps))
            to.at (x, y) = largest;
      }
  }
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

  void place_row (int y, Place *row, RectifyReport &report)
  {
    mapping_.camera_row (y, seen_);
    if (!whole_)
      bank_.surroundings ().find_row (y, around_);
    for (std::size_t x = 0; x < seen_.size (); x++)
      row[x] = place (seen_[x], {int (x), y}, around_[x], report);
  }

  FilterBank::Tables filters () && { return std::move (bank_).tables (); }
  const WeightSolver &solver () const { return bank_.solver (); }
  /** Mean share of mirrors that are not copied in their best pixel, as a part
   * of that of a pixel centred on its mirror. */
  double mean_share (const RectifyReport &report) const
  {
    return shares_ / (double (report.weighted) * best_share_);
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
  Place place (Position seen, Offset mirror, int around, RectifyReport &report)
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
    const Place pixel = {std::int16_t (px), std::int16_t (py), Place::kLookup};
    if (whole_ || (single_ && share > kOwn)) {
      report.exact++;
      return pixel;
    }
    report.weighted++;
    shares_ += share;
    report.mixed += share < kMixed * best_share_;
    const int taps = bank_.solver ().taps ();
    if (mirror.y >= coded_rows_ || taps > camera.width || taps > camera.height)
      return pixel;
    const int left = std::clamp (px - taps / 2, 0, camera.width - taps);
    const int top = std::clamp (py - taps / 2, 0, camera.height - taps);
    const int x = left + taps / 2, y = top + taps / 2;
    if (x == px && y == py)
      return {std::int16_t (left), std::int16_t (top),
          bank_.filter (around, fx, fy)};
    if (share > kOwn || !bank_.has_border ())
      return pixel;
    return {std::int16_t (left), std::int16_t (top),
        bank_.border_filter (around, mirror, seen.x - x, seen.y - y)};
  }

  const Mapping &mapping_;
  int coded_rows_;
  ElementMap elements_;
  FilterBank bank_;
  bool whole_;
  bool single_;         // pixel per mirror; of several, all are used
  double best_share_;   // of a pixel centred on its mirror
  double shares_ = 0.0; // of all mirrors that are not copied
  std::vector<Position> seen_;
  std::vector<int> around_;
};

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
  const Extent camera = mapping.camera (), mirrors = mapping.mirrors ();
  if (area (mirrors) <= std::max (kAnyway, kForEachPixel * area (camera)))
    return {};
  return Error{"a mapping to " + size_text (mirrors) +
               " mirrors cannot be used for frames of " + size_text (camera) +
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

/* The first pixels of all windows. */
Rect
windows_of (ImageView<const Place> places)
{
  constexpr int kNone = std::numeric_limits<std::int16_t>::max ();
  int left = kNone, top = kNone, right = 0, bottom = 0;
  for (int y = 0; y < places.height; y++)
    for (int x = 0; x < places.width; x++)
      if (const Place &place = places.at (x, y); place.filter >= 0) {
        left = std::min<int> (left, place.x);
        top = std::min<int> (top, place.y);
        right = std::max (right, place.x + 1);
        bottom = std::max (bottom, place.y + 1);
      }
  return {left, top, std::max (right - left, 0), std::max (bottom - top, 0)};
}

/* @effort: to find the weights, as a part of what is allowed. */
Result<void>
check_effort (const PixelView &view, double effort)
{
  if (effort <= 1.0)
    return {};
  return Error{"with a blur of " + real_text (view.sigma) +
               " pixels (psf_sigma) and this schedule, it takes " +
               real_text (std::ceil (effort)) +
               " times as long as allowed to find the weights of the pixels "
               "around each mirror; focus the camera, use a schedule with a "
               "smaller tile or fewer regions, or leave psf_sigma out, and the "
               "blur uncorrected"};
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
  plan->keep_unknown = options.keep_unknown;
  plan->kernels = rectify::supported_kernels ().front ();
  plan->noise = float (
      options.noise * std::sqrt (schedule.slots () / schedule.white_slots ()));
  PixelView view{mapping.slope_at (0.5 * (plan->camera.width - 1),
                     0.5 * (plan->camera.height - 1)),
      mapping.psf_sigma (), plan->taps};
  RETURN_IF_ERROR (check_slope (view));
  /* Pixels that are copied need no weights. */
  const bool whole = mapping.one_to_one (kTolerance) &&
                     WeightSolver (view).own_share (0.0, 0.0) > kOwn;
  if (whole)
    view.sigma = 0.0;
  RETURN_IF_ERROR (check_effort (view, FilterBank::effort (view, schedule)));
  Planner planner (mapping, schedule, view, whole);
  RETURN_IF_ERROR (check_effort (view, planner.effort ()));
  plan->places = Image<Place> (plan->mirrors.width, plan->mirrors.height);
  for (int y = 0; y < plan->mirrors.height; y++)
    planner.place_row (y, plan->places.view ().row (y), plan->report);
  plan->windows = windows_of (plan->places.view ());
  if (options.correct && planner.mean_share (plan->report) < kBetween)
    plan->sight = Sight::make (mapping, planner.solver ());
  if (plan->sight)
    plan->reach =
        planner.solver ().reach (plan->taps / 2) + plan->sight->reach ();
  plan->filters = std::move (planner).filters ();
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

bool
Rectifier::sees (int x, int y) const
{
  return plan_->places.at (x, y).filter != Place::kUnseen;
}

const RectifyReport &
Rectifier::report () const
{
  return plan_->report;
}

template <typename Pixel>
Result<void>
Rectifier::run (ImageView<const std::type_identity_t<Pixel>> from,
    ImageView<Pixel> to, int largest,
    const std::optional<ImageView<float>> &errors, Workers *workers) const
try {
  const Plan &plan = *plan_;
  const ViewBytes input = ViewBytes::of (from), output = ViewBytes::of (to);
  RETURN_IF_ERROR (check_view (
      input, "camera frame", plan.camera.width, plan.camera.height));
  RETURN_IF_ERROR (
      check_view (output, "output", plan.mirrors.width, plan.mirrors.height));
  RETURN_IF_ERROR (check_apart ({&output, 1}, &input));
  if (errors)
    RETURN_IF_ERROR (check_view (ViewBytes::of (*errors), "errors",
        plan.mirrors.width, plan.mirrors.height));
  if (largest <= 0)
    largest = std::numeric_limits<Pixel>::max ();
  const auto roughness = plan.measure (from, workers);
  const rectify::Filters with = plan.filters_for (largest, roughness);
  const rectify::Source<Pixel> source{from.row (0), from.stride, from.width};
  run_parts (workers, plan.mirrors.height, [&] (int y) {
    plan.run_row<Pixel> () (source, plan.places.view ().row (y),
        plan.mirrors.width, with, to.row (y),
        errors ? errors->row (y) : nullptr);
  });
  if (plan.keep_unknown)
    plan.mark_unknown (from, to, Pixel (largest));
  return {};
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

template <typename Pixel>
Result<void>
Rectifier::correct (ImageView<Pixel> to,
    ImageView<const std::uint16_t> expected, Workers &workers,
    int largest) const
try {
  const Plan &plan = *plan_;
  if (!plan.sight)
    return Error{"nothing was prepared to correct frames; see corrects ()"};
  RETURN_IF_ERROR (check_view (
      ViewBytes::of (to), "mirrors", plan.mirrors.width, plan.mirrors.height));
  RETURN_IF_ERROR (check_view (ViewBytes::of (expected), "expected light",
      plan.mirrors.width, std::min (expected.height, plan.mirrors.height)));
  if (largest <= 0)
    largest = std::numeric_limits<Pixel>::max ();
  const auto light = rectify::scaled_light<Pixel> (
      expected, ImageView<const Pixel> (to), largest);
  Image<std::uint16_t> seen (plan.camera.width, plan.camera.height);
  plan.sight->run (plan.kernels, light.view (), seen.view (), workers);
  const ImageView<const std::uint16_t> view = std::as_const (seen).view ();
  const rectify::Source<std::uint16_t> source{
      view.row (0), view.stride, view.width};
  const auto roughness = plan.measure (view, &workers);
  const rectify::Filters with =
      plan.filters_for (int (rectify::kWideWhite), roughness);
  workers.run (
      std::max (expected.height - 2 * plan.reach, 0), [&] (int row, int) {
        const int y = plan.reach + row;
        std::vector<std::uint16_t> made (std::size_t (plan.mirrors.width));
        plan.run_row<std::uint16_t> () (source, plan.places.view ().row (y),
            plan.mirrors.width, with, made.data (), nullptr);
        rectify::take_off (made.data (), light.view ().row (y),
            plan.mirrors.width, plan.reach, largest, to.row (y));
      });
  return {};
} catch (const std::bad_alloc &) {
  return out_of_memory ();
}

bool
Rectifier::corrects () const
{
  return plan_->sight.has_value ();
}

#define INSTANTIATE(Pixel)                                                     \
  template Result<void> Rectifier::run (ImageView<const Pixel>,                \
      ImageView<Pixel>, int, const std::optional<ImageView<float>> &,          \
      Workers *) const;                                                        \
  template Result<void> Rectifier::correct (                                   \
      ImageView<Pixel>, ImageView<const std::uint16_t>, Workers &, int) const;
INSTANTIATE (std::uint8_t)
INSTANTIATE (std::uint16_t)

} // namespace codedexposure
