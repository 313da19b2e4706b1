/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>

#include "base/statistics.h"
#include "canvas.h"

namespace codedexposure
{

namespace
{

/* The sheet: two rows of three pictures, and text below them. */
constexpr int kWidth = 1240, kHeight = 940, kMargin = 20, kGap = 16;
constexpr int kTop = 92, kPicture = 390, kCaption = 28;
constexpr double kLetters = 15.0, kLine = kLetters * 1.4;

using Colour = std::array<std::uint8_t, 3>;

constexpr Colour kBlack{20, 20, 20};
constexpr Colour kNothing{30, 30, 30};
constexpr Colour kWithin{40, 120, 60}, kAbove{190, 50, 40};
constexpr Colour kQualityColours[] = {
    {70, 130, 90}, {30, 30, 30}, {200, 160, 60}, {220, 80, 60}, {160, 80, 190}};
constexpr const char *kQualityNames[] = {"good", "uncovered: sees no mirror",
    "low contrast: out of focus", "saturated", "outlier: dust, stuck mirror"};

int
left_of (int column)
{
  return kMargin + column * (kPicture + kGap);
}

int
top_of (int row)
{
  return kTop + row * (kPicture * 3 / 4 + kCaption + kGap);
}

class Sheet
{
public:
  /** @p camera  size of the frames, pixels. */
  explicit Sheet (Extent camera)
      : surface_ (
            cairo_image_surface_create (CAIRO_FORMAT_RGB24, kWidth, kHeight)),
        cairo_ (cairo_create (surface_.get ())), camera_ (camera)
  {
    cairo_set_source_rgb (cairo_.get (), 1, 1, 1);
    cairo_paint (cairo_.get ());
    cairo_select_font_face (cairo_.get (), "sans-serif",
        CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  }

  void text (double x, double y, const std::string &words,
      double size = kLetters, Colour colour = kBlack)
  {
    cairo_set_font_size (cairo_.get (), size);
    ink (colour);
    cairo_move_to (cairo_.get (), x, y);
    cairo_show_text (cairo_.get (), words.c_str ());
  }
  void box (double x, double y, double width, double height, Colour colour)
  {
    ink (colour);
    cairo_rectangle (cairo_.get (), x, y, width, height);
    cairo_fill (cairo_.get ());
  }
  /** A picture of the frame, with @p size sites, over its caption and a bar
   * that shows a number of camera pixels. */
  void picture (int column, int row, Extent size, const std::string &caption,
      const std::function<Colour (int x, int y)> &colour)
  {
    const double scale = std::min (double (kPicture) / size.width,
        double (kPicture) * 3 / 4 / size.height);
    const int width = int (size.width * scale);
    const int height = int (size.height * scale);
    const int left = left_of (column), top = top_of (row);
    paint (left, top, {width, height}, [&] (int x, int y) {
      return colour (x * size.width / width, y * size.height / height);
    });
    text (left, top + height + kCaption * 0.7, caption);
    scale_bar (left + width, top + height + 8, double (width) / camera_.width);
  }
  /** Sets each pixel of a rectangle. */
  void paint (int left, int top, Extent size,
      const std::function<std::optional<Colour> (int x, int y)> &colour)
  {
    cairo_surface_flush (surface_.get ());
    unsigned char *data = cairo_image_surface_get_data (surface_.get ());
    const int stride = cairo_image_surface_get_stride (surface_.get ());
    for (int y = 0; data && y < size.height; y++) {
      auto *row = reinterpret_cast<std::uint32_t *> (
          data + std::ptrdiff_t (top + y) * stride);
      for (int x = 0; x < size.width; x++)
        if (const auto c = colour (x, y))
          row[left + x] = std::uint32_t ((*c)[0]) << 16 |
                          std::uint32_t ((*c)[1]) << 8 | (*c)[2];
    }
    cairo_surface_mark_dirty (surface_.get ());
  }
  bool save (const std::string &path)
  {
    return cairo_surface_write_to_png (surface_.get (), path.c_str ()) ==
           CAIRO_STATUS_SUCCESS;
  }

private:
  void ink (Colour colour)
  {
    cairo_set_source_rgb (
        cairo_.get (), colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
  }
  /** Ends at @p right; a camera pixel is @p unit long. */
  void scale_bar (double right, double y, double unit)
  {
    double pixels = 1;
    for (int step = 0; pixels * unit < 40; step++)
      pixels *= step % 3 == 1 ? 2.5 : 2; // 1, 2, 5, 10 ...
    const double length = pixels * unit;
    box (right - length, y, length, 3, kBlack);
    char words[32];
    std::snprintf (words, sizeof words, "%.0f pixels", pixels);
    text (right - length - 72, y + 7, words, 12.0);
  }

  SurfacePtr surface_;
  CairoPtr cairo_;
  Extent camera_;
};

void
add_fringes (Sheet &sheet, int row, const std::optional<FringePair> &pair)
{
  if (!pair) {
    sheet.text (left_of (0), top_of (row) + 2 * kLine,
        row == 0 ? "Before: no fringes were read"
                 : "After: no fringes were read");
    return;
  }
  int column = 0;
  for (const Fringes *fringes : {&pair->x, &pair->y}) {
    const float full = fringes->full_amplitude ();
    sheet.picture (column, row,
        {fringes->phase.width (), fringes->phase.height ()},
        pair->caption + (column == 0 ? ": fringes in x" : ": fringes in y"),
        [&] (int x, int y) {
          const std::uint8_t level = fringes->grey (x, y, full);
          return Colour{level, level, level};
        });
    column++;
  }
}

/** The length that nine of ten blocks keep below. */
float
usual (const Image<float> &dx, const Image<float> &dy)
{
  std::vector<float> lengths;
  each_pixel (dx, [&] (int x, int y) {
    if (const float length = std::hypot (dx.at (x, y), dy.at (x, y));
        length > 0.0f)
      lengths.push_back (length);
  });
  return lengths.empty () ? 1e-6f : quantile (std::move (lengths), 0.9);
}

/** Direction as hue, length as brightness. */
Colour
residual_colour (float dx, float dy, float full)
{
  if (dx == 0.0f && dy == 0.0f)
    return kNothing;
  const double much = std::min (1.0, double (std::hypot (dx, dy) / full));
  const double angle = std::atan2 (dy, dx);
  const auto part = [&] (double turn) {
    const double wave = 0.5 + 0.5 * std::cos (angle - turn);
    return std::uint8_t (60 + 195 * much * wave);
  };
  constexpr double kThird = 2 * std::numbers::pi / 3;
  return {part (0.0), part (kThird), part (2 * kThird)};
}

/** What the colours of the residuals mean: from the centre to the edge, they
 * grow to @p full mirrors. */
void
add_wheel (Sheet &sheet, int left, int top, float full)
{
  constexpr int kRadius = 48;
  sheet.paint (left, top, {2 * kRadius + 1, 2 * kRadius + 1},
      [full] (int x, int y) -> std::optional<Colour> {
        const float dx = float (x - kRadius) / kRadius;
        const float dy = float (y - kRadius) / kRadius;
        if (std::hypot (dx, dy) > 1.0f)
          return std::nullopt;
        return residual_colour (dx * full, dy * full, full);
      });
  sheet.text (left + 2 * kRadius + 6, top + kRadius + 5, "+x");
  sheet.text (left + kRadius - 8, top + 2 * kRadius + 16, "+y");
  char edge[64];
  std::snprintf (edge, sizeof edge, "edge: %.1e mirrors", double (full));
  sheet.text (left - 20, top + 2 * kRadius + 36, edge, 13.0);
}

void
add_residuals (Sheet &sheet, const CalibrationResult &result, int below)
{
  const Image<float> &dx = result.residual_x, &dy = result.residual_y;
  if (dx.width () == 0 || dx.height () == 0)
    return;
  const float full = usual (dx, dy);
  sheet.picture (2, 0, {dx.width (), dx.height ()}, "Residuals of the mapping",
      [&] (int x, int y) {
        return residual_colour (dx.at (x, y), dy.at (x, y), full);
      });
  add_wheel (sheet, left_of (2) + 262, below, full);
}

void
add_quality (Sheet &sheet, const CalibrationResult &result, int below)
{
  const Image<PixelQuality> &quality = result.quality;
  sheet.picture (2, 1, {quality.width (), quality.height ()},
      "Use of each pixel", [&] (int x, int y) {
        return kQualityColours[std::size_t (quality.at (x, y))];
      });
  for (std::size_t what = 0; what < std::size (kQualityNames); what++) {
    const double y = below + double (what) * kLine * 1.3;
    sheet.box (left_of (2), y, 12, 12, kQualityColours[what]);
    const auto count = result.pixels (PixelQuality (what));
    sheet.text (left_of (2) + 20, y + 11,
        std::to_string (count) + " " + kQualityNames[what], 13.0);
  }
}

} // namespace

Result<void>
write_report (const std::string &path, const CalibrationReport &report)
{
  const CalibrationResult &result = *report.result;
  Sheet sheet ({result.quality.width (), result.quality.height ()});
  sheet.text (kMargin, 36, report.title, 22.0);
  const Colour verdict = report.within ? kWithin : kAbove;
  sheet.box (kMargin, 54, 16, 16, verdict);
  sheet.text (kMargin + 26, 68, report.verdict, 17.0, verdict);
  add_fringes (sheet, 0, report.before);
  add_fringes (sheet, 1, report.after);
  const int below = top_of (2);
  add_residuals (sheet, result, below);
  add_quality (sheet, result, below);
  double y = below + kLetters;
  for (const std::string &line : report.lines) {
    sheet.text (kMargin, y, line);
    y += kLine;
  }
  if (sheet.save (path))
    return {};
  /* A part of a picture is none. */
  std::error_code ignored;
  std::filesystem::resize_file (path, 0, ignored);
  return Error{"cannot write the report " + path +
               "; check that its folder exists, and that the disk has room"};
}

} // namespace codedexposure
