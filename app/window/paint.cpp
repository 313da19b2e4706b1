/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "paint.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace codedexposure::app
{

namespace
{

using Cairo = std::unique_ptr<cairo_t, FreeWith<cairo_destroy>>;

struct Colour {
  double red, green, blue;
};
constexpr Colour kGround{0.13, 0.13, 0.14};
constexpr Colour kText{0.92, 0.92, 0.92};
constexpr Colour kFaint{0.62, 0.64, 0.68};
constexpr Colour kAlarm{1.0, 0.42, 0.35};

constexpr int kMargin = 8;
constexpr int kFont = 14;
constexpr int kLine = 19; // distance of lines

void
use (cairo_t *cairo, const Colour &colour)
{
  cairo_set_source_rgb (cairo, colour.red, colour.green, colour.blue);
}

Surface
strip (int width, int height)
{
  return Surface (
      cairo_image_surface_create (CAIRO_FORMAT_RGB24, width, height));
}

/* Letters of a reduced text are reduced with it. */
void
scale_letters (cairo_t *cairo)
{
  cairo_font_options_t *options = cairo_font_options_create ();
  cairo_font_options_set_hint_metrics (options, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options (cairo, options);
  cairo_font_options_destroy (options);
}

/* A context of @p surface, which it fills with the ground. */
Cairo
begin (cairo_surface_t *surface)
{
  Cairo cairo (cairo_create (surface));
  use (cairo.get (), kGround);
  cairo_paint (cairo.get ());
  cairo_select_font_face (
      cairo.get (), "sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size (cairo.get (), kFont);
  scale_letters (cairo.get ());
  return cairo;
}

void
write (cairo_t *cairo, double x, double y, const std::string &text,
    const Colour &colour)
{
  use (cairo, colour);
  cairo_move_to (cairo, x, y);
  cairo_show_text (cairo, text.c_str ());
}

/* With narrower letters if @text is wider than @room. */
void
write_in (cairo_t *cairo, double room, double x, double y,
    const std::string &text, const Colour &colour)
{
  cairo_text_extents_t size;
  cairo_text_extents (cairo, text.c_str (), &size);
  cairo_save (cairo);
  cairo_translate (cairo, x, y);
  cairo_scale (
      cairo, std::min (1.0, room / std::max (room, size.x_advance)), 1);
  write (cairo, 0, 0, text, colour);
  cairo_restore (cairo);
}

/* On a logarithmic scale, so that few saturated pixels are seen, too; they are
 * the last bar. */
void
draw_histogram (cairo_t *cairo, double left, const Exposure &exposure)
{
  constexpr double kTop = 26, kHeight = 54;
  const auto &bins = exposure.histogram;
  const double wide = 2.0 * double (bins.size ());
  const auto most = *std::max_element (bins.begin (), bins.end ());
  const auto height = [most] (double count) {
    return kHeight * std::log1p (count) / std::log1p (double (most));
  };
  const bool clipped = exposure.saturated > 0;
  char text[64];
  std::snprintf (text, sizeof text, "exposure: %.*f %% of pixels saturated",
      clipped && exposure.saturated < 0.001 ? 3 : 1, 100 * exposure.saturated);
  write_in (cairo, wide, left, 18, text, clipped ? kAlarm : kText);
  use (cairo, {0.05, 0.05, 0.05});
  cairo_rectangle (cairo, left, kTop, wide, kHeight);
  cairo_fill (cairo);
  for (std::size_t k = 0; k < bins.size (); k++) {
    use (cairo, clipped && k + 1 == bins.size () ? kAlarm : kFaint);
    const double tall = most > 0 ? height (double (bins[k])) : 0;
    cairo_rectangle (
        cairo, left + 2.0 * double (k), kTop + kHeight - tall, 2, tall);
    cairo_fill (cairo);
  }
}

} // namespace

Surface
paint_captions (
    const WindowLayout &layout, const std::vector<std::string> &captions)
{
  Surface surface = strip (layout.size ().width, WindowLayout::kCaption);
  const Cairo cairo = begin (surface.get ());
  for (int k = 0; k < int (captions.size ()); k++) {
    cairo_reset_clip (cairo.get ());
    if (k + 1 < int (captions.size ())) {
      cairo_rectangle (
          cairo.get (), 0, 0, layout.left (k + 1), WindowLayout::kCaption);
      cairo_clip (cairo.get ());
    }
    write (cairo.get (), layout.left (k) + kMargin, 17,
        captions[std::size_t (k)], kText);
  }
  return surface;
}

Surface
paint_panel (const WindowLayout &layout, const std::vector<PanelLine> &lines,
    const Exposure *exposure, const char *keys)
{
  const int width = layout.size ().width;
  Surface surface = strip (width, WindowLayout::kPanel);
  const Cairo cairo = begin (surface.get ());
  const double room = width - 2 * kMargin;
  double right = width;
  if (exposure && !exposure->histogram.empty ()) {
    right -= kMargin + 2.0 * double (exposure->histogram.size ());
    draw_histogram (cairo.get (), right, *exposure);
  }
  for (int k = 0; k < int (lines.size ()); k++) {
    const PanelLine &line = lines[std::size_t (k)];
    write_in (cairo.get (), right - 2 * kMargin, kMargin, 18 + k * kLine,
        line.text, line.alarm ? kAlarm : kText);
  }
  write_in (
      cairo.get (), room, kMargin, WindowLayout::kPanel - 9, keys, kFaint);
  return surface;
}

Surface
paint_sheet (const std::string &text, Extent most)
{
  constexpr double kLetter = 7.3, kRow = 16; // pixels, of the font below
  std::vector<std::string> rows;
  std::istringstream lines (text);
  std::size_t longest = 1;
  for (std::string row; std::getline (lines, row);) {
    longest = std::max (longest, row.size ());
    rows.push_back (row);
  }
  const double width = kLetter * double (longest) + 2 * kMargin;
  const double height = kRow * double (rows.size ()) + 2 * kMargin;
  const double scale =
      std::min ({1.0, most.width / width, most.height / height});
  Surface surface (cairo_image_surface_create (CAIRO_FORMAT_ARGB32,
      int (std::ceil (width * scale)), int (std::ceil (height * scale))));
  const Cairo cairo (cairo_create (surface.get ()));
  cairo_set_source_rgba (cairo.get (), 0, 0, 0, 0.8);
  cairo_paint (cairo.get ());
  cairo_scale (cairo.get (), scale, scale);
  cairo_select_font_face (cairo.get (), "monospace", CAIRO_FONT_SLANT_NORMAL,
      CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size (cairo.get (), 12);
  scale_letters (cairo.get ());
  for (std::size_t k = 0; k < rows.size (); k++)
    write (cairo.get (), kMargin, kMargin + kRow * (double (k) + 0.75), rows[k],
        kText);
  return surface;
}

void
paint_over (cairo_t *window, cairo_surface_t *sheet)
{
  cairo_save (window);
  cairo_set_source_surface (window, sheet, 0, WindowLayout::kCaption);
  cairo_paint (window);
  cairo_restore (window);
}

void
paint_strip (cairo_t *window, cairo_surface_t *strip, int top)
{
  cairo_save (window);
  cairo_set_operator (window, CAIRO_OPERATOR_SOURCE);
  cairo_set_source_surface (window, strip, 0, top);
  cairo_rectangle (window, 0, top, cairo_image_surface_get_width (strip),
      cairo_image_surface_get_height (strip));
  cairo_fill (window);
  cairo_restore (window);
}

Surface
copy_window (cairo_t *window, const WindowLayout &layout)
{
  Surface copy =
      strip (layout.size ().width, layout.size ().height - WindowLayout::kKeys);
  const Cairo cairo (cairo_create (copy.get ()));
  cairo_set_source_surface (cairo.get (), cairo_get_target (window), 0, 0);
  cairo_paint (cairo.get ());
  return copy;
}

} // namespace codedexposure::app
