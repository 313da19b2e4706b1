/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/linear_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>

#include "base/cholesky.h"

namespace cexp
{

namespace
{

std::vector<Offset>
disc (double radius)
{
  std::vector<Offset> places;
  const int r = int (radius);
  for (int y = -r; y <= r; y++)
    for (int x = -r; x <= r; x++)
      if (std::hypot (x, y) <= radius)
        places.push_back ({x, y});
  return places;
}

/* Covariances of the light of two slots at two places, by |dx|, |dy| and the
 * slots between them, and of a slot with the truth of another. */
class Covariances
{
public:
  Covariances (
      const ExposureModel &model, const SceneStatistics &scene, int reach)
      : side_ (reach + 1), slots_ (model.slots ())
  {
    /* A quarter of a detail apart, as far as time allows. */
    const double path = scene.speed * model.hold () / scene.detail;
    const int samples = int (std::clamp (4.0 * path, 6.0, 12.0));
    const auto within = time_steps (model.active (), model.active (), samples);
    const auto towards = time_steps (model.active (), model.hold (), samples);
    for (int dy = 0; dy < side_; dy++)
      for (int dx = 0; dx < side_; dx++)
        for (int k = 0; k < slots_; k++) {
          const double between = k * model.pitch ();
          light_.push_back (light_covariance (scene, dx, dy, between, within));
          truth_.push_back (light_covariance (scene, dx, dy, between, towards));
        }
  }
  double light (int dx, int dy, int slots) const
  {
    return light_[index (dx, dy, slots)];
  }
  double truth (int dx, int dy, int slots) const
  {
    return truth_[index (dx, dy, slots)];
  }

private:
  std::size_t index (int dx, int dy, int slots) const
  {
    return std::size_t (
        (std::abs (dy) * side_ + std::abs (dx)) * slots_ + std::abs (slots));
  }
  int side_, slots_;
  std::vector<double> light_, truth_;
};

/* Slots whose light an element lets through. */
struct Share {
  int slot;
  double part;
};
std::vector<std::vector<Share>>
shares_of (const ExposureModel &model)
{
  std::vector<std::vector<Share>> shares (std::size_t (model.elements ()));
  for (int e = 0; e < model.elements (); e++)
    for (int s = 0; s < model.slots (); s++)
      if (model.open (e, s) > 0.0)
        shares[std::size_t (e)].push_back ({s, model.open (e, s)});
  return shares;
}

/* Covariances of coded pixels with each other and with the truth of a slot, by
 * |dx|, |dy| and their elements. */
class CodedCovariances
{
public:
  CodedCovariances (
      const ExposureModel &model, const SceneStatistics &scene, int reach)
      : side_ (reach + 1), elements_ (model.elements ()),
        slots_ (model.slots ())
  {
    const Covariances covariances (model, scene, reach);
    const auto shares = shares_of (model);
    for (int dy = 0; dy < side_; dy++)
      for (int dx = 0; dx < side_; dx++) {
        const auto light = [&] (int slots) {
          return covariances.light (dx, dy, slots);
        };
        const auto truth = [&] (int slots) {
          return covariances.truth (dx, dy, slots);
        };
        const std::vector<double> with_light = with_slots (shares, light);
        for (const auto &a : shares)
          for (std::size_t b = 0; b < shares.size (); b++)
            coded_.push_back (sum_of (a, [&] (int slot) {
              return with_light[b * std::size_t (slots_) + std::size_t (slot)];
            }));
        for (const double covariance : with_slots (shares, truth))
          truth_.push_back (covariance);
      }
  }
  double coded (Offset apart, int a, int b) const
  {
    return coded_[place (apart) * std::size_t (elements_ * elements_) +
                  std::size_t (a * elements_ + b)];
  }
  double truth (Offset apart, int element, int slot) const
  {
    return truth_[place (apart) * std::size_t (elements_ * slots_) +
                  std::size_t (element * slots_ + slot)];
  }

private:
  template <typename OfSlot>
  static double sum_of (const std::vector<Share> &shares, OfSlot of_slot)
  {
    double sum = 0.0;
    for (const auto &[slot, part] : shares)
      sum += part * of_slot (slot);
    return sum;
  }
  template <typename Between>
  std::vector<double> with_slots (
      const std::vector<std::vector<Share>> &shares, Between between) const
  {
    std::vector<double> result;
    for (const auto &element : shares)
      for (int slot = 0; slot < slots_; slot++)
        result.push_back (
            sum_of (element, [&] (int open) { return between (open - slot); }));
    return result;
  }
  std::size_t place (Offset apart) const
  {
    return std::size_t (std::abs (apart.y) * side_ + std::abs (apart.x));
  }
  int side_, elements_, slots_;
  std::vector<double> coded_, truth_;
};

/* What is known of the coded pixels at the places around a pixel. */
struct Estimator {
  const ExposureModel &model;
  const SceneStatistics &scene;
  CodedCovariances covariances;
  const std::vector<Offset> &places;

  /** Covariances of the coded pixels with each other, upper triangle. */
  std::vector<double> system (const std::vector<int> &elements) const
  {
    const std::size_t n = places.size ();
    std::vector<double> result (n * n);
    for (std::size_t i = 0; i < n; i++) {
      for (std::size_t j = i; j < n; j++)
        result[i * n + j] = covariances.coded (
            {places[i].x - places[j].x, places[i].y - places[j].y}, elements[i],
            elements[j]);
      result[i * n + i] += model.variance (elements[i], scene.level);
    }
    return result;
  }
  /** Covariances of the coded pixels with the truth, a column for each slot. */
  std::vector<double> sought (const std::vector<int> &elements) const
  {
    std::vector<double> result;
    for (std::size_t i = 0; i < places.size (); i++)
      for (int slot = 0; slot < model.slots (); slot++)
        result.push_back (covariances.truth (places[i], elements[i], slot));
    return result;
  }
};

/* A pixel of every element: the neighbourhood of others of that element is the
 * same, in tiles with a name. */
std::map<int, Offset>
representatives (const ExposureModel &model)
{
  std::map<int, Offset> found;
  for (int y = 0; int (found.size ()) < model.elements (); y++)
    for (int x = 0; x < Tile::kMaxPeriod; x++)
      found.try_emplace (model.element_at (x, y), Offset{x, y});
  return found;
}

} // namespace

LinearEstimate::LinearEstimate (
    const ExposureModel &model, const SceneStatistics &scene)
    : slots_ (model.slots ()),
      places_ (disc (std::max (5.0, 1.6 * std::sqrt (model.elements ()))))
{
  const int reach = 2 * std::abs (places_.front ().y) + 1;
  const Estimator estimator{model, scene, {model, scene, reach}, places_};
  const std::size_t n = places_.size ();
  weights_.resize (std::size_t (model.elements () * slots_) * n);
  for (const auto &[element, at] : representatives (model)) {
    std::vector<int> elements;
    for (const Offset place : places_)
      elements.push_back (model.element_at (at.x + place.x, at.y + place.y));
    const std::vector<double> sought = estimator.sought (elements);
    std::vector<double> solved = sought;
    Cholesky (estimator.system (elements), int (n)).solve (solved, slots_);
    for (std::size_t i = 0; i < n; i++)
      for (std::size_t s = 0; s < std::size_t (slots_); s++)
        weights_[(std::size_t (element * slots_) + s) * n + i] =
            solved[i * std::size_t (slots_) + s];
    const double found = std::inner_product (
        sought.begin (), sought.end (), solved.begin (), 0.0);
    error_ += (slots_ * scene.contrast * scene.contrast - found) /
              (model.elements () * slots_);
  }
}

double
LinearEstimate::psnr () const
{
  return -10.0 * std::log10 (error_);
}

std::vector<EstimateTap>
LinearEstimate::taps (int element, int slot) const
{
  std::vector<EstimateTap> taps;
  const std::size_t first =
      std::size_t (element * slots_ + slot) * places_.size ();
  for (std::size_t i = 0; i < places_.size (); i++)
    taps.push_back ({places_[i], weights_[first + i]});
  return taps;
}

} // namespace cexp
