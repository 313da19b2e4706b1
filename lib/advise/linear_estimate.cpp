/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "advise/linear_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>

#include "estimate/kriging.h"

namespace codedexposure
{

namespace
{

/* The differences between the times of two stretches with the same middle, each
 * stretch taken at @samples even times. Lengths are in slots. Covariances made
 * of the same samples are those of a process that can exist, so that no error
 * comes out negative. */
std::vector<TimeStep>
time_steps (double first_length, double second_length, int samples)
{
  const auto time = [samples] (double length, int i) {
    return length * ((i + 0.5) / samples - 0.5);
  };
  std::map<long, TimeStep> merged; // by 1e-9 of a slot
  for (int i = 0; i < samples; i++)
    for (int j = 0; j < samples; j++) {
      const double slots = time (second_length, j) - time (first_length, i);
      TimeStep &step = merged[std::lround (slots * 1e9)];
      step.slots = slots;
      step.part += 1.0 / (samples * samples);
    }
  std::vector<TimeStep> steps;
  for (const auto &[key, step] : merged)
    steps.push_back (step);
  return steps;
}

SlotTimes
slot_times (const ExposureModel &model, const SceneStatistics &scene)
{
  /* A quarter of a detail apart, within bounds for the run time. */
  const double path = scene.speed * model.hold () / scene.detail;
  const int samples = int (std::clamp (4.0 * path, 6.0, 12.0));
  const double active = model.active () / model.pitch ();
  const double hold = model.hold () / model.pitch ();
  return {
      time_steps (active, active, samples), time_steps (active, hold, samples)};
}

/* One pixel of every element: in named tiles, all pixels of an element have the
 * same neighbourhood. */
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
    : places (disc (std::max (5.0, 1.6 * std::sqrt (model.elements ()))))
{
  const Observation &observation = model.observation ();
  const CodedCovariance covariance (scene.patch (model.pitch ()),
      observation.shares (), model.slots (), 2 * std::abs (places.front ().y),
      slot_times (model, scene));
  const double scene_variance = scene.contrast * scene.contrast;
  std::vector<double> noise;
  for (int e = 0; e < model.elements (); e++)
    noise.push_back (observation.variance (e, scene.level) / scene_variance);
  const std::size_t n = places.size (), slots = std::size_t (model.slots ());
  weights.resize (std::size_t (model.elements ()) * slots * n);
  double found = 0.0;
  for (const auto &[element, at] : representatives (model)) {
    std::vector<int> elements;
    for (const Offset place : places)
      elements.push_back (model.element_at (at.x + place.x, at.y + place.y));
    const KrigingSystem system =
        slot_equations (covariance, places, elements, noise);
    const std::vector<double> solved = solve_kriging (system);
    found += std::inner_product (
        solved.begin (), solved.end (), system.targets.begin (), 0.0);
    double *to = weights.data () + std::size_t (element) * slots * n;
    for (std::size_t i = 0; i < slots * n; i++)
      to[i] = solved[i] / model.light (elements[i % n]);
  }
  error = scene_variance * (1.0 - found / (model.elements () * model.slots ()));
}

} // namespace codedexposure
