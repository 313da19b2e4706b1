/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How a person looks at the pictures of a window: at which part of them, and
 * how bright. It knows nothing of GStreamer. */
#pragma once

#include <algorithm>
#include <cmath>

#include "base/geometry.h"

namespace codedexposure::app
{

/** Which pixel values become black and white. */
struct Tones {
  int black = 0;
  int white = 255; ///< more than black
  bool operator== (const Tones &) const = default;
};

/** Positions are in parts of a pane, 0 to 1 from its left edge to the right and
 * from its top downwards. Panes beside each other show the same part. */
class Look
{
public:
  static constexpr int kMostZoom = 64;

  /** How much larger than the whole the pictures are shown. */
  int zoom () const { return zoom_; }
  /** What is seen at that place of a pane, as a place of the whole. */
  Position whole (Position seen) const
  {
    return {corner_.x + seen.x / zoom_, corner_.y + seen.y / zoom_};
  }

  /** What is seen at @p seen stays there. */
  void zoom_in (Position seen) { set_zoom (seen, zoom_ * 2); }
  void zoom_out (Position seen) { set_zoom (seen, zoom_ / 2); }
  void show_whole () { set_zoom ({}, 1); }
  /** Moves the picture by parts of the pane. */
  void move (Position by)
  {
    set_corner ({corner_.x - by.x / zoom_, corner_.y - by.y / zoom_});
  }

  /** @p largest  value of the pixels. */
  Tones tones (int largest) const
  {
    const int black = std::clamp (
        int (std::lround (black_ * largest)), 0, std::max (0, largest - 1));
    return {black, std::clamp (int (std::floor (white_ * largest + 1e-9)),
                       black + 1, std::max (black + 1, largest))};
  }
  void set_tones (Tones tones, int largest)
  {
    black_ = double (tones.black) / largest;
    white_ = double (tones.white) / largest;
  }
  void show_all_tones () { black_ = 0, white_ = 1; }
  /** Whether the whole range of values is shown. */
  bool has_all_tones () const { return black_ == 0 && white_ == 1; }
  /** Twice, or half, as bright. */
  void brighten (bool more, int largest)
  {
    const double least = 1.0 / largest;
    white_ = std::clamp (
        black_ + (white_ - black_) * (more ? 0.5 : 2), black_ + least, 1.0);
  }
  /** To the right: black and white are closer; upwards: both are lower. */
  void drag_tones (Position by)
  {
    const double range = (white_ - black_) * std::exp2 (-4 * by.x);
    const double middle = (black_ + white_) / 2 + by.y * (white_ - black_);
    black_ = std::clamp (middle - range / 2, 0.0, 1.0);
    white_ = std::clamp (middle + range / 2, black_, 1.0);
  }

  /** Whether saturated pixels are marked. */
  bool marks () const { return marks_; }
  void set_marks (bool marks) { marks_ = marks; }

  /** Whether pictures are shown as they are. */
  bool is_plain () const { return zoom_ == 1 && has_all_tones () && !marks_; }
  bool operator== (const Look &) const = default;

private:
  void set_zoom (Position seen, int zoom)
  {
    const Position kept = whole (seen);
    zoom_ = std::clamp (zoom, 1, kMostZoom);
    set_corner ({kept.x - seen.x / zoom_, kept.y - seen.y / zoom_});
  }
  void set_corner (Position corner)
  {
    const double most = 1 - 1.0 / zoom_;
    corner_ = {
        std::clamp (corner.x, 0.0, most), std::clamp (corner.y, 0.0, most)};
  }

  int zoom_ = 1;
  Position corner_;              // of the part, in the whole
  double black_ = 0, white_ = 1; // parts of the largest value
  bool marks_ = false;
};

} // namespace codedexposure::app
