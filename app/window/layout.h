/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Where things are in the window of live and receive. */
#pragma once

#include <algorithm>
#include <cmath>

#include "base/geometry.h"

namespace codedexposure::app
{

/** Equal panes beside each other, captions above and a panel below. */
struct WindowLayout {
  static constexpr int kCaption = 24;   ///< height of the captions, pixels
  static constexpr int kPanel = 114;    ///< height of the panel
  static constexpr int kKeys = 26;      ///< height of its line of keys
  static constexpr int kGap = 8;        ///< between panes
  static constexpr int kMinWidth = 640; ///< in which the texts can be read
  /** Where small pictures are enlarged to. */
  static constexpr Extent kLarge{768, 576};

  Extent pane;
  int panes = 1;

  int left (int index) const { return index * (pane.width + kGap); }
  Extent size () const
  {
    return {std::max (kMinWidth, left (panes) - kGap),
        kCaption + pane.height + kPanel};
  }

  /** The size of a picture in its pane, such that it lies on that of the
   * camera: its pixels are as large as their cells, and rows of a pilot, which
   * it lacks, stay free. A picture of the mirrors, which may be more than the
   * pixels of the camera, is reduced to fit. A pixel is @p aspect times as wide
   * as high, compared with one of the camera. */
  Extent size_of (Extent camera, Extent picture, double aspect) const
  {
    const double across =
        std::max (1.0, std::round (double (camera.width) / picture.width));
    const double down = std::max (1.0, across / std::clamp (aspect, 1e-3, 1e3));
    const double width = picture.width * across / camera.width;
    const double height = picture.height * down / camera.height;
    const double fit = std::max ({1.0, width, height});
    const auto part = [fit] (int length, double share) {
      return std::clamp (int (length * share / fit + 1e-6), 1, length);
    };
    return {part (pane.width, width), part (pane.height, height)};
  }

  /** Panes for pictures of the size @p camera: enlarged by a whole factor, or
   * reduced to 3/4 or to a whole fraction, so that all fit into @p room. */
  static WindowLayout fit (Extent camera, int panes, Extent room)
  {
    const Extent most{std::max (1, (room.width + kGap) / panes - kGap),
        std::max (1, room.height - kCaption - kPanel)};
    const auto scaled = [&] (int times, int parts) {
      return Extent{std::max (1, camera.width * times / parts),
          std::max (1, camera.height * times / parts)};
    };
    const auto fits = [] (Extent size, Extent limit) {
      return size.width <= limit.width && size.height <= limit.height;
    };
    int times = 1, parts = 1;
    while (fits (scaled (times + 1, 1), most) &&
           fits (scaled (times + 1, 1), kLarge))
      times++;
    if (times == 1 && !fits (camera, most) && fits (scaled (3, 4), most))
      times = 3, parts = 4;
    while (!fits (scaled (times, parts), most) && parts < camera.width)
      parts++;
    return {scaled (times, parts), panes};
  }
};

} // namespace codedexposure::app
