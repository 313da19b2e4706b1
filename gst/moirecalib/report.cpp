/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "canvas.h"

namespace codedexposure
{

namespace
{

/* The sheet: two rows of three pictures, and text beside them. */
constexpr int kWidth = 1240, kHeight = 900, kMargin = 20, kGap = 16;
constexpr int kPicture = 390, kCaption = 24;
constexpr double kLetters = 15.0;

using Colour = std::array<std::uint8_t, 3>;

constexpr Colour kNothing{30, 30, 30};
constexpr Colour kQualityColours[] = {
    {70, 130, 90}, {30, 30, 30}, {200, 160, 60}, {220, 80, 60}, {160, 80, 190}};
constexpr const char *kQualityNames[] = {
    "good", "uncovered", "low contrast", "saturated", "outlier"};

class Sheet
{
public:
  Sheet ()
      : surface_ (
            cairo_image_surface_create (CAIRO_FORMAT_RGB24, kWidth, kHeight)),
        cairo_ (cairo_create (surface_.get ()))
  {
    cairo_set_source_rgb (cairo_.get (), 1, 1, 1);
    cairo_paint (cairo_.get ());
    cairo_select_font_face (cairo_.get (), "sans-serif",
        CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  }

  void text (double x, double y, const std::string &words,
      double size = kLetters, Colour colour = {20, 20, 20})
  {
    cairo_set_font_size (cairo_.get (), size);
    cairo_set_source_rgb (
        cairo_.get (), colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
    cairo_move_to (cairo_.get (), x, y);
    cairo_show_text (cairo_.get (), words.c_str ());
  }
  /** A picture of @p size sites under its caption. */
  void picture (int column, int row, Extent size, const std::string &caption,
      const std::function<Colour (int x, int y)> &colour)
  {
    const double scale = std::min (double (kPicture) / size.width,
        double (kPicture) * 3 / 4 / size.height);
    const int width = int (size.width * scale);
    const int height = int (size.height * scale);
    const int left = kMargin + column * (kPicture + kGap);
    const int top = 60 + row * (kPicture * 3 / 4 + kCaption + kGap);
    cairo_surface_flush (surface_.get ());
    unsigned char *data = cairo_image_surface_get_data (surface_.get ());
    const int stride = cairo_image_surface_get_stride (surface_.get ());
    for (int y = 0; data && y < height; y++) {
      auto *row_data = reinterpret_cast<std::uint32_t *> (
          data + std::ptrdiff_t (top + y) * stride);
      for (int x = 0; x < width; x++) {
        const Colour c =
            colour (x * size.width / width, y * size.height / height);
        row_data[left + x] = std::uint32_t (c[0]) << 16 |
                             std::uint32_t (c[1]) << 8 | std::uint32_t (c[2]);
      }
    }
    cairo_surface_mark_dirty (surface_.get ());
    text (left, top + height + kCaption * 0.75, caption);
  }
  bool save (const std::string &path)
  {
    return cairo_surface_write_to_png (surface_.get (), path.c_str ()) ==
           CAIRO_STATUS_SUCCESS;
  }

private:
  SurfacePtr surface_;
  CairoPtr cairo_;
};

void
add_fringes (Sheet &sheet, int row, const std::optional<FringePair> &pair)
{
  if (!pair)
    return;
  int column = 0;
  for (const Fringes *fringes : {&pair->x, &pair->y}) {
    const float full = fringes->full_amplitude ();
    sheet.picture (column, row,
        {fringes->phase.width (), fringes->phase.height ()},
        pair->caption + (column == 0 ? ", x fringes" : ", y fringes"),
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
  for (int y = 0; y < dx.height (); y++)
    for (int x = 0; x < dx.width (); x++)
      if (const float length = std::hypot (dx.at (x, y), dy.at (x, y));
          length > 0.0f)
        lengths.push_back (length);
  if (lengths.empty ())
    return 1e-6f;
  const auto place =
      lengths.begin () + std::ptrdiff_t (lengths.size () * 9 / 10);
  std::nth_element (lengths.begin (), place, lengths.end ());
  return *place;
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
  return {part (0.0), part (2.0944), part (4.18879)};
}

void
add_result (Sheet &sheet, const CalibrationResult &result)
{
  const Image<float> &dx = result.residual_x, &dy = result.residual_y;
  const float full = usual (dx, dy);
  char caption[96];
  std::snprintf (caption, sizeof caption,
      "residuals by direction, bright: %.0e mirrors", double (full));
  if (dx.width () > 0 && dx.height () > 0)
    sheet.picture (
        2, 0, {dx.width (), dx.height ()}, caption, [&] (int x, int y) {
          return residual_colour (dx.at (x, y), dy.at (x, y), full);
        });
  const Image<PixelQuality> &quality = result.quality;
  sheet.picture (2, 1, {quality.width (), quality.height ()},
      "what each pixel is good for", [&] (int x, int y) {
        return kQualityColours[std::size_t (quality.at (x, y))];
      });
}

void
add_legend (Sheet &sheet, const CalibrationResult &result, double y)
{
  double x = kMargin + 2 * (kPicture + kGap);
  for (std::size_t what = 0; what < std::size (kQualityNames); what++) {
    const auto count = result.pixels (PixelQuality (what));
    sheet.text (x, y + double (what) * kLetters * 1.4,
        std::string (kQualityNames[what]) + ": " + std::to_string (count) +
            " pixels",
        kLetters, kQualityColours[what]);
  }
}

} // namespace

Result<void>
write_report (const std::string &path, const CalibrationReport &report)
{
  Sheet sheet;
  sheet.text (kMargin, 36, report.title, 22.0);
  add_fringes (sheet, 0, report.before);
  add_fringes (sheet, 1, report.after);
  add_result (sheet, *report.result);
  const double below =
      60 + 2.0 * (kPicture * 3 / 4 + kCaption + kGap) + kLetters;
  double y = below;
  for (const std::string &line : report.lines) {
    sheet.text (kMargin, y, line);
    y += kLetters * 1.4;
  }
  add_legend (sheet, *report.result, below);
  if (!sheet.save (path))
    return Error{"cannot write the report " + path +
                 "; is there such a folder, and room?"};
  return {};
}

} // namespace codedexposure
