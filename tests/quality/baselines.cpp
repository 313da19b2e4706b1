/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "baselines.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "bench/sensor.h"
#include "extract/extractor.h"
#include "schedule/sample_grid.h"

namespace codedexposure::quality
{

namespace
{

using Plane = Image<float>;

std::uint8_t
to_grey (double value)
{
  return std::uint8_t (std::clamp (std::floor (value + 0.5), 0.0, 255.0));
}

/* Keys' cubic convolution kernel with a = -1/2. */
double
keys (double t)
{
  t = std::abs (t);
  if (t < 1.0)
    return (1.5 * t - 2.5) * t * t + 1.0;
  return t < 2.0 ? ((-0.5 * t + 2.5) * t - 4.0) * t + 2.0 : 0.0;
}

/* The pixels of one element: origin + i a + j b. */
struct Lattice {
  Offset origin, a, b;
};

Lattice
lattice_of (const Schedule &schedule, int element)
{
  const int reach =
      std::max (schedule.tile ().period_x (), schedule.tile ().period_y ());
  Lattice lattice;
  std::vector<Offset> found;
  for (int y = 0; y < reach; y++)
    for (int x = 0; x < reach; x++)
      if (schedule.element_at (x, y) == element)
        found.push_back ({x, y});
  lattice.origin = found[0];
  std::vector<Offset> steps;
  for (int y = 0; y <= reach; y++)
    for (int x = -reach; x <= reach; x++)
      if ((y > 0 || x > 0) && schedule.element_at (lattice.origin.x + x,
                                  lattice.origin.y + y) == element)
        steps.push_back ({x, y});
  std::ranges::stable_sort (steps, {},
      [] (const Offset &step) { return step.x * step.x + step.y * step.y; });
  lattice.a = steps[0];
  lattice.b = *std::ranges::find_if (steps, [&] (const Offset &step) {
    return step.x * lattice.a.y != step.y * lattice.a.x;
  });
  return lattice;
}

/* Near the border, where few samples are in the frame, the nearest sample is
 * used. */
double
cubic_at (const Picture &coded, const Lattice &lattice, int x, int y)
{
  const auto [o, a, b] = lattice;
  const double det = double (a.x) * b.y - double (a.y) * b.x;
  const double u = (double (x - o.x) * b.y - double (y - o.y) * b.x) / det;
  const double v = (double (y - o.y) * a.x - double (x - o.x) * a.y) / det;
  const int iu = int (std::floor (u)), iv = int (std::floor (v));
  double sum = 0.0, weights = 0.0, nearest = 1e9, value = 0.0;
  for (int j = iv - 1; j <= iv + 2; j++) {
    for (int i = iu - 1; i <= iu + 2; i++) {
      const int px = o.x + i * a.x + j * b.x, py = o.y + i * a.y + j * b.y;
      if (px < 0 || py < 0 || px >= coded.width () || py >= coded.height ())
        continue;
      const double weight = keys (u - i) * keys (v - j);
      sum += weight * coded.at (px, py);
      weights += weight;
      const double distance = std::hypot (px - x, py - y);
      if (distance < nearest) {
        nearest = distance;
        value = coded.at (px, py);
      }
    }
  }
  return weights > 0.5 ? sum / weights : value;
}

Plane
enlarge (const Picture &small, Extent cell, int width, int height)
{
  Plane large (width, height);
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++) {
      const double u = (x + 0.5) / cell.width - 0.5;
      const double v = (y + 0.5) / cell.height - 0.5;
      const int iu = int (std::floor (u)), iv = int (std::floor (v));
      double sum = 0.0;
      for (int j = iv - 1; j <= iv + 2; j++)
        for (int i = iu - 1; i <= iu + 2; i++)
          sum += keys (u - i) * keys (v - j) *
                 small.at (std::clamp (i, 0, small.width () - 1),
                     std::clamp (j, 0, small.height () - 1));
      large.at (x, y) = float (sum);
    }
  }
  return large;
}

/* ------------------------------------------------------------- GAP-TV -- */

/* min over u of |u - f|^2 / 2 + weight TV (u), in place, by projections of the
 * dual (Chambolle, 2004). */
void
smooth (Plane &f, float weight, int steps)
{
  constexpr float kTau = 1.0f / 8.0f;
  const int w = f.width (), h = f.height ();
  Plane px (w, h), py (w, h), u = f;
  for (int step = 0; step <= steps; step++) {
    for (int y = 0; y < h; y++)
      for (int x = 0; x < w; x++)
        u.at (x, y) = f.at (x, y) +
                      weight * (px.at (x, y) - (x ? px.at (x - 1, y) : 0) +
                                   py.at (x, y) - (y ? py.at (x, y - 1) : 0));
    if (step == steps)
      break;
    for (int y = 0; y < h; y++) {
      for (int x = 0; x < w; x++) {
        const float gx = x + 1 < w ? u.at (x + 1, y) - u.at (x, y) : 0.0f;
        const float gy = y + 1 < h ? u.at (x, y + 1) - u.at (x, y) : 0.0f;
        const float rate = kTau / weight;
        const float scale = 1.0f + rate * std::hypot (gx, gy);
        px.at (x, y) = (px.at (x, y) + rate * gx) / scale;
        py.at (x, y) = (py.at (x, y) + rate * gy) / scale;
      }
    }
  }
  f = u;
}

using Mask = Image<std::uint8_t>;

std::vector<Mask>
random_masks (int slots, int width, int height)
{
  std::mt19937 engine (1);
  std::vector<Mask> masks (std::size_t (slots), Mask (width, height));
  for (Mask &mask : masks)
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        mask.at (x, y) = std::uint8_t (engine () >> 31);
  return masks;
}

/* Sum over the slots through the masks, as the sensor reads it, in units of
 * white in one slot. */
Plane
snapshot (const Scene &scene, std::size_t first, const std::vector<Mask> &masks,
    const Condition &condition)
{
  const int w = masks[0].width (), h = masks[0].height ();
  const auto n = float (masks.size ());
  Plane light (w, h), taken (w, h);
  for (std::size_t s = 0; s < masks.size (); s++)
    for (int y = 0; y < h; y++)
      for (int x = 0; x < w; x++)
        light.at (x, y) += float (masks[s].at (x, y)) *
                           float (scene.frames[first + s].at (x, y)) / 255.0f /
                           n;
  Sensor sensor;
  sensor.full_well = condition.electrons;
  sensor.read_noise = condition.read_noise;
  Picture numbers (w, h);
  sensor.read_out<std::uint8_t> (light.view (), 1.0, first, numbers.view ());
  for (int y = 0; y < h; y++)
    for (int x = 0; x < w; x++)
      taken.at (x, y) = float (numbers.at (x, y)) * n / 255.0f;
  return taken;
}

std::vector<Picture>
gap_tv (const Plane &taken, const std::vector<Mask> &masks)
{
  constexpr int kIterations = 60, kSteps = 5;
  constexpr float kWeight = 0.1f;
  const int w = taken.width (), h = taken.height ();
  const auto at_each = [&] (auto work) {
    for (int y = 0; y < h; y++)
      for (int x = 0; x < w; x++) {
        float open = 0.0f;
        for (const Mask &mask : masks)
          open += float (mask.at (x, y));
        work (x, y, std::max (open, 1.0f));
      }
  };
  std::vector<Plane> light (masks.size (), Plane (w, h));
  Plane total (w, h);
  at_each ([&] (int x, int y, float open) {
    for (std::size_t s = 0; s < masks.size (); s++)
      light[s].at (x, y) = float (masks[s].at (x, y)) * taken.at (x, y) / open;
  });
  for (int i = 0; i < kIterations; i++) {
    at_each ([&] (int x, int y, float open) {
      float seen = 0.0f;
      for (std::size_t s = 0; s < masks.size (); s++)
        seen += float (masks[s].at (x, y)) * light[s].at (x, y);
      total.at (x, y) += taken.at (x, y) - seen;
      for (std::size_t s = 0; s < masks.size (); s++)
        light[s].at (x, y) +=
            float (masks[s].at (x, y)) * (total.at (x, y) - seen) / open;
    });
    for (Plane &plane : light)
      smooth (plane, kWeight, kSteps);
  }
  std::vector<Picture> frames;
  for (const Plane &plane : light) {
    Picture &frame = frames.emplace_back (w, h);
    for (int y = 0; y < h; y++)
      for (int x = 0; x < w; x++)
        frame.at (x, y) = to_grey (255.0 * plane.at (x, y));
  }
  return frames;
}

} // namespace

std::vector<Picture>
bicubic_frames (const std::vector<Picture> &coded, const Schedule &schedule)
{
  std::vector<Picture> frames;
  for (const Picture &picture : coded) {
    for (int slot = 0; slot < schedule.slots (); slot++) {
      const Lattice lattice = lattice_of (schedule, slot);
      Picture &frame =
          frames.emplace_back (picture.width (), picture.height ());
      for (int y = 0; y < frame.height (); y++)
        for (int x = 0; x < frame.width (); x++)
          frame.at (x, y) = to_grey (cubic_at (picture, lattice, x, y));
    }
  }
  return frames;
}

std::vector<Picture>
rank_frames (const std::vector<Picture> &coded, const Schedule &schedule,
    bool normalised)
{
  Way way;
  way.schedule = schedule;
  way.extract.method = Method::kRank;
  std::vector<Picture> frames;
  for (const Picture &picture : coded) {
    const auto ranks = split (picture, way);
    for (std::size_t k = 0; k < ranks.size (); k++) {
      const double gain =
          normalised ? double (ranks.size ()) / double (k + 1) : 1.0;
      const Plane large = enlarge (
          ranks[k], schedule.cell (), picture.width (), picture.height ());
      Picture &frame =
          frames.emplace_back (picture.width (), picture.height ());
      for (int y = 0; y < frame.height (); y++)
        for (int x = 0; x < frame.width (); x++)
          frame.at (x, y) = to_grey (gain * large.at (x, y));
    }
  }
  return frames;
}

std::vector<Picture>
gap_tv_frames (const Scene &scene, int slots, const Condition &condition)
{
  const auto n = std::size_t (slots);
  const auto masks =
      random_masks (slots, scene.frames[0].width (), scene.frames[0].height ());
  std::vector<Picture> frames;
  for (std::size_t first = 0; first + n <= scene.frames.size (); first += n)
    std::ranges::move (
        gap_tv (snapshot (scene, first, masks, condition), masks),
        std::back_inserter (frames));
  return frames;
}

} // namespace codedexposure::quality
