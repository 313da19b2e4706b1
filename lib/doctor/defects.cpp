/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/defects.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "doctor/statistics.h"

namespace codedexposure
{

namespace
{

/* Pixels with less than this part of the bright ones' light see no mirrors. */
constexpr double kCovered = 0.1;
/* Part of the light by which a pixel differs that has a defect, and how many
 * times more than the others, up to half of the light. */
constexpr double kDiffers = 0.12, kOutlier = 5.0;
/* A dead pixel has less than this part of the light. */
constexpr double kDead = 0.1;
/* Light of a stuck mirror, in mirrors; more is dust. */
constexpr double kMirrorMin = 0.3, kMirrorMax = 2.6;
/* A line has at most so many mirrors across, and so many times that along; a
 * block fills that part of a rectangle, where dust would fill 0.79. */
constexpr double kLine = 3.0, kLong = 8.0, kFilled = 0.88;
constexpr double kThick = 6.0; // of a block, mirrors
/* Part of the pixels without light where no lens blurs the border. */
constexpr double kSharp = 0.9;
/* Pixels of a spot that mirrors make, in mirrors. */
constexpr double kSpot = 30.0;

/* Of the pixels around one, beyond what a mirror lights. */
double
ring_median (const Image<float> &image, Offset at)
{
  constexpr int kNear = 3, kFar = 5;
  std::vector<float> values;
  each_near (image, at, kFar, [&] (int x, int y) {
    if (std::max (std::abs (x - at.x), std::abs (y - at.y)) >= kNear)
      values.push_back (image.at (x, y));
  });
  return double (median (std::move (values)));
}

/* Pixels that touch, also at corners. */
struct Group {
  std::vector<Offset> pixels;
  bool at_border = false;
};

/* The group of @p first; its pixels are 0 in @p marked afterwards. */
Group
take_group (Image<std::uint8_t> &marked, Offset first)
{
  Group group = {{first}};
  marked.at (first.x, first.y) = 0;
  for (std::size_t i = 0; i < group.pixels.size (); i++) {
    const Offset at = group.pixels[i];
    group.at_border |= at.x == 0 || at.y == 0 || at.x == marked.width () - 1 ||
                       at.y == marked.height () - 1;
    each_near (marked, at, 1, [&] (int x, int y) {
      if (marked.at (x, y) != 0)
        group.pixels.push_back ({x, y});
      marked.at (x, y) = 0;
    });
  }
  return group;
}

std::vector<Group>
groups_of (Image<std::uint8_t> marked)
{
  std::vector<Group> groups;
  each_pixel (marked, [&] (int x, int y) {
    if (marked.at (x, y) != 0)
      groups.push_back (take_group (marked, {x, y}));
  });
  return groups;
}

class Search
{
public:
  Search (const Image<float> &off, const Image<float> &on, int largest,
      double mirror)
      : off_ (off), on_ (on), light_ (difference (on, off)),
        dark_ (smooth (off)), field_ (smooth (light_)), largest_ (largest),
        mirror_ (std::max (1.0, mirror))
  {
    found_.good = Image<std::uint8_t> (off.width (), off.height ());
    covered_ = found_.good;
    known_ = found_.good;
    part_ = Image<float> (off.width (), off.height ());
  }

  Defects run ()
  {
    bright_ = quantile (field_, 0.9);
    const float least =
        std::max (float (kCovered) * bright_, 0.005f * float (largest_));
    each_pixel (off_,
        [&] (int x, int y) { covered_.at (x, y) = field_.at (x, y) > least; });
    find_spread ();
    find_bright ();
    find_dim ();
    each_pixel (off_, [&] (int x, int y) {
      found_.good.at (x, y) = covered_.at (x, y) != 0 && known_.at (x, y) == 0;
    });
    return std::move (found_);
  }

private:
  /* The median does not see defects. */
  void find_spread ()
  {
    constexpr double kSigmas = 1.4826; // of a median
    std::vector<float> values;
    each_pixel (light_, [&] (int x, int y) {
      if (covered_.at (x, y) != 0)
        values.push_back (
            std::abs (1.0f - light_.at (x, y) / field_.at (x, y)));
    });
    if (!values.empty ())
      found_.spread = kSigmas * double (median (std::move (values)));
  }

  void find_bright ()
  {
    Image<std::uint8_t> marked (off_.width (), off_.height ());
    each_pixel (off_, [&] (int x, int y) {
      const float unit = std::max (
          {0.1f * float (largest_), 0.5f * bright_, field_.at (x, y)});
      part_.at (x, y) = (off_.at (x, y) - dark_.at (x, y)) / unit;
      marked.at (x, y) = part_.at (x, y) > 0.5f * float (kDiffers);
    });
    for (const Group &group : groups_of (marked)) {
      const Offset peak = *std::ranges::max_element (group.pixels, {},
          [&] (const Offset &at) { return off_.at (at.x, at.y); });
      const double more =
          double (off_.at (peak.x, peak.y)) - ring_median (off_, peak);
      const double usual = ring_median (on_, peak);
      const double brighter = double (on_.at (peak.x, peak.y)) - usual;
      if (brighter > 0.5 * std::min (more, largest_ - usual)) {
        for (const Offset &at : group.pixels)
          found_.hot.push_back (at);
        know (group, 0);
        continue;
      }
      const DefectSpot spot = spot_of (group);
      know (group, 2);
      /* Larger ones are the border of what leaks past the mirrors. */
      if (spot.light > kMirrorMin * mirror_ && spot.pixels < kSpot * mirror_)
        found_.stuck_on.push_back (spot);
    }
  }

  void find_dim ()
  {
    Image<std::uint8_t> marked (off_.width (), off_.height ());
    const double differs = std::clamp (kOutlier * found_.spread, kDiffers, 0.5);
    each_pixel (off_, [&] (int x, int y) {
      const bool open = covered_.at (x, y) != 0 && known_.at (x, y) == 0;
      part_.at (x, y) =
          open ? 1.0f - light_.at (x, y) / field_.at (x, y) : 0.0f;
      marked.at (x, y) = part_.at (x, y) > float (differs);
    });
    for (const Group &group : groups_of (marked))
      add_dim (group);
  }

  void add_dim (const Group &group)
  {
    const Offset first = group.pixels[0];
    know (group, group.pixels.size () == 1 ? 0 : 2);
    if (group.pixels.size () <= 2 &&
        double (part_.at (first.x, first.y)) > 1.0 - kDead) {
      for (const Offset &at : group.pixels)
        found_.dead.push_back (at);
      return;
    }
    const DefectSpot spot = spot_of (group);
    if (const Shape shape = shape_of (group); shape != Shape::other) {
      if (shape == Shape::pixels)
        found_.dead.insert (
            found_.dead.end (), group.pixels.begin (), group.pixels.end ());
      else
        found_.stuck_off.push_back (spot);
      return;
    }
    if (group.at_border && spot.light > kMirrorMax * mirror_) {
      for (const Offset &at : group.pixels)
        if (double (part_.at (at.x, at.y)) > 0.5)
          covered_.at (at.x, at.y) = 0;
      return;
    }
    if (spot.light > kMirrorMax * mirror_)
      found_.dust.push_back (spot);
    else if (spot.light > kMirrorMin * mirror_)
      found_.stuck_off.push_back (spot);
  }

  DefectSpot spot_of (const Group &group) const
  {
    DefectSpot spot;
    spot.pixels = int (group.pixels.size ());
    for (const Offset &at : group.pixels) {
      const double part = double (part_.at (at.x, at.y));
      spot.centre.x += part * at.x;
      spot.centre.y += part * at.y;
      spot.light += part;
    }
    spot.centre.x /= spot.light;
    spot.centre.y /= spot.light;
    return spot;
  }

  enum class Shape { pixels, mirrors, other };

  /** Lines and blocks along the axes do not come from dust: those with sharp
   * borders are of pixels, those that the lens blurs are of mirrors. */
  Shape shape_of (const Group &group) const
  {
    int left = off_.width (), top = off_.height (), right = 0, bottom = 0;
    int dark = 0, darkest = 0;
    double part_of_dark = 0.0;
    for (const Offset &at : group.pixels) {
      const double part = double (part_.at (at.x, at.y));
      darkest += part > 1.0 - kDead;
      if (part < 0.5)
        continue;
      dark++;
      part_of_dark += part;
      left = std::min (left, at.x);
      right = std::max (right, at.x + 1);
      top = std::min (top, at.y);
      bottom = std::max (bottom, at.y + 1);
    }
    const int width = right - left, height = bottom - top;
    const double mirror = std::sqrt (mirror_);
    const double thick = std::min (width, height),
                 length = std::max (width, height);
    const bool line = thick <= kLine * mirror && length >= kLong * thick;
    const bool block = thick >= kThick * mirror &&
                       dark > kFilled * width * height &&
                       part_of_dark > kFilled * dark;
    /* A block at the border may be where no mirrors are. */
    if (!line && (!block || group.at_border))
      return Shape::other;
    return darkest > kSharp * double (group.pixels.size ()) ? Shape::pixels
                                                            : Shape::mirrors;
  }

  void know (const Group &group, int margin)
  {
    for (const Offset &at : group.pixels)
      each_near (
          known_, at, margin, [&] (int x, int y) { known_.at (x, y) = 1; });
  }

  const Image<float> &off_, &on_;
  Image<float> light_, dark_, field_;
  float bright_ = 0.0f; // light of bright pixels
  int largest_;
  double mirror_;
  Image<float> part_; // of its light that a pixel has too much or lacks
  Image<std::uint8_t> covered_; // gets light of mirrors, or should
  Image<std::uint8_t> known_;   // pixels of defects, and those beside them
  Defects found_;
};

} // namespace

Defects
find_defects (
    const Image<float> &off, const Image<float> &on, int largest, double mirror)
{
  return Search (off, on, largest, mirror).run ();
}

} // namespace codedexposure
