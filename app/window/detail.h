/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pictures of a stream as a person looks at them: a part, in chosen tones. */
#pragma once

#include <memory>
#include <optional>

#include "common/raii.h"
#include "window/look.h"
#include "window/paint.h"

namespace codedexposure::app
{

/** A picture of a stream, with all of its pixels and bits. */
struct FullPicture {
  gst::BufferPtr frame;
  GstVideoInfo info;
  int bits = 8; ///< significant

  int largest () const { return (1 << bits) - 1; }
  Extent size () const { return {info.width, info.height}; }
};

/** Where a picture is seen: in a pane, the whole of which is @p size large. */
struct DetailPlace {
  Offset corner; ///< of the pane, in the window
  Extent pane;
  Extent size; ///< in which the whole picture is shown

  /** The pixel of a picture of @p of pixels that is seen at @p seen of the
   * pane; none: there is no picture. */
  std::optional<Offset> pixel (
      const Look &look, Position seen, Extent of) const;
  bool operator== (const DetailPlace &) const = default;
};

/** Paints the part of a picture that is seen, and remembers it until another
 * one is asked for. */
class Detail
{
public:
  void paint (cairo_t *window,
      const std::shared_ptr<const FullPicture> &picture,
      const DetailPlace &place, const Look &look);

private:
  void render (const DetailPlace &place, const Look &look);

  std::shared_ptr<const FullPicture> picture_;
  Look look_;
  DetailPlace place_ = {};
  Rect part_;         // of the picture, in pixels
  int reduction_ = 1; // pixels of the picture along one of the surface
  Surface surface_;
};

/** The value of a pixel; none: the picture cannot be read. */
std::optional<int> value_of (const FullPicture &picture, Offset pixel);
/** Tones for what is seen of the picture: all but the darkest and the brightest
 * 0.2 % of its pixels differ. None: the picture cannot be read. */
std::optional<Tones> tones_of (
    const FullPicture &picture, const DetailPlace &place, const Look &look);

} // namespace codedexposure::app
