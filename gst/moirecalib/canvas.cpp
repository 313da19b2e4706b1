/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Cairo draws on a surface of its own whose alpha is the grey: its strides are
 * its own business. */
#include "canvas.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace codedexposure
{

Canvas::Canvas (ImageView<std::uint8_t> image)
    : image_ (image), surface_ (cairo_image_surface_create (
                          CAIRO_FORMAT_A8, image.width, image.height)),
      cairo_ (cairo_create (surface_.get ()))
{
  unsigned char *data = cairo_image_surface_get_data (surface_.get ());
  const int stride = cairo_image_surface_get_stride (surface_.get ());
  for (int y = 0; data && y < image.height; y++)
    std::memcpy (data + std::ptrdiff_t (y) * stride, image.row (y),
        std::size_t (image.width));
  cairo_surface_mark_dirty (surface_.get ());
}

Canvas::~Canvas ()
{
  cairo_surface_flush (surface_.get ());
  const unsigned char *data = cairo_image_surface_get_data (surface_.get ());
  const int stride = cairo_image_surface_get_stride (surface_.get ());
  for (int y = 0; data && y < image_.height; y++)
    std::memcpy (image_.row (y), data + std::ptrdiff_t (y) * stride,
        std::size_t (image_.width));
}

void
Canvas::ink (bool filled)
{
  cairo_set_source_rgba (cairo_.get (), 1, 1, 1, level_);
  if (filled) {
    cairo_fill (cairo_.get ());
    return;
  }
  cairo_set_line_width (cairo_.get (), std::max (1.5, image_.height / 200.0));
  cairo_stroke (cairo_.get ());
}

void
Canvas::font (double size)
{
  cairo_select_font_face (cairo_.get (), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
      CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size (cairo_.get (), size);
}

cairo_text_extents_t
Canvas::extents_of (double size, const std::string &words)
{
  font (size);
  cairo_text_extents_t extents;
  cairo_text_extents (cairo_.get (), words.c_str (), &extents);
  return extents;
}

void
Canvas::text (Position at, double size, const std::string &words)
{
  font (size);
  cairo_set_source_rgba (cairo_.get (), 1, 1, 1, level_);
  cairo_move_to (cairo_.get (), at.x, at.y);
  cairo_show_text (cairo_.get (), words.c_str ());
}

void
Canvas::text_centred (Position at, double size, const std::string &words)
{
  const cairo_text_extents_t extents = extents_of (size, words);
  text ({at.x - extents.width / 2 - extents.x_bearing,
            at.y - extents.height / 2 - extents.y_bearing},
      size, words);
}

void
Canvas::text_within (
    Position at, double size, double width, const std::string &words)
{
  const cairo_text_extents_t extents = extents_of (size, words);
  text (
      at, size * std::min (1.0, width / std::max (1.0, extents.width)), words);
}

void
Canvas::label (Position at, double size, const std::string &words)
{
  const cairo_text_extents_t extents = extents_of (size, words);
  cairo_save (cairo_.get ());
  cairo_set_operator (cairo_.get (), CAIRO_OPERATOR_CLEAR);
  cairo_rectangle (cairo_.get (), at.x - size / 3, at.y - size,
      extents.x_advance + size * 2 / 3, size * 1.35);
  cairo_fill (cairo_.get ());
  cairo_restore (cairo_.get ());
  grey (1.0);
  text (at, size, words);
}

void
Canvas::head (Position at, double angle)
{
  const double size = std::max (5.0, image_.height / 45.0);
  cairo_move_to (cairo_.get (), at.x + size * 0.5 * std::cos (angle),
      at.y + size * 0.5 * std::sin (angle));
  for (const double side : {2.6, -2.6})
    cairo_line_to (cairo_.get (), at.x + size * std::cos (angle + side),
        at.y + size * std::sin (angle + side));
  cairo_close_path (cairo_.get ());
  ink (true);
}

void
Canvas::arrow (Position from, Position to)
{
  cairo_move_to (cairo_.get (), from.x, from.y);
  cairo_line_to (cairo_.get (), to.x, to.y);
  ink (false);
  head (to, std::atan2 (to.y - from.y, to.x - from.x));
}

void
Canvas::ring (
    Position centre, double radius, double from, double to, bool with_head)
{
  cairo_new_path (cairo_.get ());
  if (to >= from)
    cairo_arc (cairo_.get (), centre.x, centre.y, radius, from, to);
  else
    cairo_arc_negative (cairo_.get (), centre.x, centre.y, radius, from, to);
  ink (false);
  if (with_head)
    head (
        {centre.x + radius * std::cos (to), centre.y + radius * std::sin (to)},
        to + (to >= from ? 1 : -1) * 1.5708);
}

void
Canvas::box (double x, double y, double width, double height, bool filled)
{
  cairo_rectangle (cairo_.get (), x, y, width, height);
  ink (filled);
}

} // namespace codedexposure
