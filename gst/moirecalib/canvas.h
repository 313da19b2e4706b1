/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Lines and letters on an image of greys. */
#pragma once

#include <memory>
#include <string>

#include <cairo.h>

#include "base/free_with.h"
#include "base/image.h"
#include "mapping/mapping.h"

namespace codedexposure
{

using CairoPtr = std::unique_ptr<cairo_t, FreeWith<cairo_destroy>>;
using SurfacePtr =
    std::unique_ptr<cairo_surface_t, FreeWith<cairo_surface_destroy>>;

/** Draws in a grey on what is there. The image is complete when the canvas is
 * gone. */
class Canvas
{
public:
  explicit Canvas (ImageView<std::uint8_t> image);
  ~Canvas ();
  Canvas (const Canvas &) = delete;
  Canvas &operator= (const Canvas &) = delete;

  /** 0 black, 1 white; of all that follows. */
  void grey (double level) { level_ = level; }
  /** @p size  of a line; @p at is where its first letter stands. */
  void text (Position at, double size, const std::string &words);
  void text_centred (Position at, double size, const std::string &words);
  /** Smaller, if it would be wider than @p width. */
  void text_within (
      Position at, double size, double width, const std::string &words);
  /** White on a black ground. */
  void label (Position at, double size, const std::string &words);
  void arrow (Position from, Position to);
  /** Part of a circle, angles in radians from x to y; with a head at its end.
   */
  void ring (Position centre, double radius, double from, double to, bool head);
  void box (double x, double y, double width, double height, bool filled);

private:
  void head (Position at, double angle);
  void font (double size);
  cairo_text_extents_t extents_of (double size, const std::string &words);
  /** Draws what was outlined. */
  void ink (bool filled);

  ImageView<std::uint8_t> image_;
  SurfacePtr surface_;
  CairoPtr cairo_;
  double level_ = 1.0;
};

} // namespace codedexposure
