/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The overlay of the picture, and the report. */
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>

#include "calibrate/session.h"
#include "moirecalib/canvas.h"
#include "moirecalib/panel.h"
#include "moirecalib/report.h"

using namespace codedexposure;

namespace
{

Fringes
ramp (int width, int height, double turns)
{
  Fringes fringes{Image<float> (width, height), Image<float> (width, height)};
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++) {
      fringes.phase.at (x, y) =
          float (2 * std::numbers::pi * turns * x / width);
      fringes.amplitude.at (x, y) = 50.0f;
    }
  return fringes;
}

CalibrationResult
small_result ()
{
  CalibrationResult result{.mapping = Mapping (Extent{64, 48}),
      .quality = Image<PixelQuality> (64, 48),
      .contrast = {},
      .residual_x = Image<float> (4, 3),
      .residual_y = Image<float> (4, 3)};
  return result;
}

} // namespace

TEST (Panel, ShowsFringesAsTheyAre)
{
  const Fringes fringes = ramp (192, 144, 2.0);
  PanelContent content{.title = "coarse"};
  content.fringes_x = &fringes;
  const Panel panel = draw_panel ({768, 576}, content);
  ASSERT_EQ (panel.opaque.size (), 2u); // the fringes, and the text
  const Rect at = panel.opaque[1];
  /* Two whole fringes: bright at the borders and in the middle. */
  EXPECT_GT (panel.grey.at (at.x, at.y), 250);
  EXPECT_LT (panel.grey.at (at.x + at.width / 4, at.y), 5);
  EXPECT_GT (panel.grey.at (at.x + at.width / 2, at.y), 250);
}

TEST (Panel, WritesItsTitle)
{
  const Panel empty = draw_panel ({768, 576}, {});
  const Panel titled = draw_panel ({768, 576}, {.title = "aligned"});
  EXPECT_FALSE (empty.grey == titled.grey);
}

/* The travel of the stage is read from beside the stage. */
TEST (Panel, WritesItsHeadlineInLargeLetters)
{
  /* Rows with bright pixels, of one line of capital letters. */
  const auto height = [] (const PanelContent &content) {
    const Panel panel = draw_panel ({768, 576}, content);
    int rows = 0;
    for (int y = 0; y < panel.grey.height (); y++) {
      bool bright = false;
      for (int x = 0; x < panel.grey.width (); x++)
        bright |= panel.grey.at (x, y) > 128;
      rows += bright;
    }
    return rows;
  };
  const int line = height ({.lines = {"HHH"}});
  EXPECT_GT (line, 4);
  EXPECT_GT (height ({.headline = "HHH"}), 2 * line);
}

TEST (Panel, HidesItsPartsOfThePictureAndLeavesTheRest)
{
  for (const Extent size : {Extent{768, 576}, Extent{160, 120}}) {
    const Panel panel = draw_panel (size, {.title = "fine"});
    Image<std::uint8_t> narrow (size.width, size.height);
    Image<std::uint16_t> wide (size.width, size.height);
    for (int y = 0; y < size.height; y++)
      for (int x = 0; x < size.width; x++) {
        narrow.at (x, y) = 77;
        wide.at (x, y) = 7777;
      }
    Image<std::uint16_t> ten_bits (size.width, size.height);
    lay_over (panel, narrow.view ());
    lay_over (panel, wide.view ());
    lay_over (panel, ten_bits.view (), 10);
    for (int y = 0; y < size.height; y++)
      for (int x = 0; x < size.width; x++) {
        bool hidden = false;
        for (const Rect &at : panel.opaque)
          hidden = hidden || (x >= at.x && x < at.x + at.width && y >= at.y &&
                                 y < at.y + at.height);
        const int level = panel.grey.at (x, y);
        ASSERT_EQ (narrow.at (x, y), hidden ? level : 77);
        ASSERT_EQ (wide.at (x, y), hidden ? level * 257 : 7777);
        ASSERT_EQ (ten_bits.at (x, y), hidden ? level * 1023 / 255 : 0);
      }
  }
}

TEST (Report, IsAPicture)
{
  const CalibrationResult result = small_result ();
  const auto path = std::filesystem::temp_directory_path () /
                    ("cexp-report-" + std::to_string (getpid ()) + ".png");
  CalibrationReport report{.title = "report", .result = &result};
  report.before = FringePair{ramp (16, 12, 3), ramp (16, 12, 1), "first look"};
  ASSERT_TRUE (write_report (path.string (), report).ok ());
  std::ifstream file (path, std::ios::binary);
  std::string head (8, '\0');
  file.read (head.data (), 8);
  EXPECT_EQ (head, "\x89PNG\r\n\x1a\n");
  std::filesystem::remove (path);
}

namespace
{

/** The sheet of @p report, as it is read from its file. */
class Written
{
public:
  explicit Written (const CalibrationReport &report)
  {
    const auto path = std::filesystem::temp_directory_path () /
                      ("cexp-sheet-" + std::to_string (getpid ()) + ".png");
    EXPECT_TRUE (write_report (path.string (), report).ok ());
    surface_.reset (cairo_image_surface_create_from_png (path.c_str ()));
    std::filesystem::remove (path);
    EXPECT_EQ (cairo_surface_status (surface_.get ()), CAIRO_STATUS_SUCCESS);
  }

  /** 0xrrggbb. */
  std::uint32_t at (int x, int y) const
  {
    const unsigned char *row =
        cairo_image_surface_get_data (surface_.get ()) +
        std::ptrdiff_t (y) * cairo_image_surface_get_stride (surface_.get ());
    return reinterpret_cast<const std::uint32_t *> (row)[x] & 0xffffff;
  }

private:
  SurfacePtr surface_;
};

} // namespace

TEST (Report, ColoursTheVerdict)
{
  const CalibrationResult result = small_result ();
  const auto square = [&] (bool within) {
    return Written (
        {.title = "report", .verdict = "", .within = within, .result = &result})
        .at (28, 62);
  };
  EXPECT_EQ (square (true), 0x28783cu);
  EXPECT_EQ (square (false), 0xbe3228u);
}

TEST (Report, TheWheelHasTheColoursOfTheResiduals)
{
  constexpr int kX = 1142, kY = 812,
                kRadius = 46; // the wheel, and nearly its edge
  constexpr int kPictureX = 900, kPictureY = 200;
  for (const auto &[dx, dy] : {std::pair (1, 0), std::pair (-1, 0),
           std::pair (0, 1), std::pair (0, -1)}) {
    CalibrationResult result = small_result ();
    for (int y = 0; y < 3; y++)
      for (int x = 0; x < 4; x++) {
        result.residual_x.at (x, y) = 1e-3f * float (dx);
        result.residual_y.at (x, y) = 1e-3f * float (dy);
      }
    const Written sheet ({.title = "report", .result = &result});
    for (const int shift : {16, 8, 0}) {
      const auto part = [shift] (std::uint32_t pixel) {
        return int (pixel >> shift & 0xff);
      };
      EXPECT_NEAR (part (sheet.at (kPictureX, kPictureY)),
          part (sheet.at (kX + dx * kRadius, kY + dy * kRadius)), 10)
          << dx << " " << dy;
    }
    EXPECT_EQ (sheet.at (kX, kY), 0x1e1e1eu); // no residual
  }
}

TEST (Report, TheVerdictComparesWithTheTolerance)
{
  StageCorrection correction;
  correction.deviation = 0.0443;
  EXPECT_EQ (alignment_verdict (correction, 0.05),
      "Aligned: the worst corner is off by 0.044 mirrors, within the tolerance "
      "of 0.05 mirrors");
  correction.deviation = 1.25;
  EXPECT_EQ (alignment_verdict (correction, 0.05),
      "Not aligned: the worst corner is off by 1.250 mirrors, above the "
      "tolerance of 0.05 mirrors. Decode with the mapping, or align again");
}

TEST (Report, SaysThatItCannotBeWritten)
{
  const CalibrationResult result = small_result ();
  const auto written = write_report (
      "/nowhere/at/all.png", {.title = "report", .result = &result});
  ASSERT_FALSE (written.ok ());
  EXPECT_NE (
      written.error ().message.find ("/nowhere/at/all.png"), std::string::npos);
}
