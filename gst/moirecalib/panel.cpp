/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "panel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/pixels.h"
#include "canvas.h"

namespace codedexposure
{

namespace
{

/* Levels of grey, as parts of white. */
constexpr double kFrame = 0.45, kBody = 0.8, kBright = 1.0;

/* Height of the headline, in lines of text: it is read from the stage. */
constexpr double kHeadline = 2.2;

struct Layout {
  double unit; // height of a line of text
  int top;     // height of the row of pictures
  int picture; // width of each of the three
  int strip;   // first row of the text at the bottom
};

Layout
lay_out (Extent size, const PanelContent &content)
{
  Layout layout;
  layout.unit = std::clamp (size.height / 30.0, 8.0, 26.0);
  layout.picture = size.width / 3;
  layout.top = std::min (layout.picture * 3 / 4, size.height * 2 / 5);
  const double lines = double (content.lines.size ()) + 2.4 +
                       (content.headline.empty () ? 0.0 : kHeadline);
  const int text = int (std::lround (layout.unit * lines));
  layout.strip = std::max (layout.top, size.height - text);
  return layout;
}

void
draw_fringes (
    const Fringes &fringes, const Rect &at, ImageView<std::uint8_t> out)
{
  const float full = fringes.full_amplitude ();
  for (int y = 0; y < at.height; y++)
    for (int x = 0; x < at.width; x++)
      out.at (at.x + x, at.y + y) =
          fringes.grey (x * fringes.phase.width () / at.width,
              y * fringes.phase.height () / at.height, full);
}

/** An arrow along a stage's axis, longer for more to do, by its logarithm. */
void
draw_move (Canvas &canvas, Position centre, double radius, double way,
    double least, Position direction)
{
  const double much =
      std::abs (way) < least ? 0.0 : std::log10 (std::abs (way) / least) / 3.0;
  if (much <= 0.0)
    return;
  const double length =
      radius * std::clamp (0.35 + much, 0.35, 1.0) * (way > 0 ? 1.0 : -1.0);
  canvas.arrow (centre,
      {centre.x + direction.x * length, centre.y + direction.y * length});
}

/** Directions are those of the picture: flips of the stage are in the numbers
 * only. */
void
draw_stage (
    Canvas &canvas, const Rect &at, const PanelContent &content, double unit)
{
  const StageCorrection &todo = *content.correction;
  const StageOptions &stage = content.stage;
  const Position centre{
      at.x + at.width / 2.0, at.y + (at.height - unit) / 2.0 + unit / 4};
  const double radius = std::min (at.width, at.height) / 2.0 - 1.7 * unit;
  canvas.grey (kFrame);
  canvas.ring (centre, radius * 1.12, 0.0, 2 * std::numbers::pi, false);
  if (todo.state == CalibrationStage::aligned) {
    canvas.grey (kBright);
    canvas.text_centred (centre, unit * 1.3, "aligned");
    return;
  }
  canvas.grey (kBright);
  draw_move (canvas, centre, radius, todo.stage_x * (stage.flip_x ? -1 : 1),
      stage.mirror_pitch * 0.02, {1, 0});
  draw_move (canvas, centre, radius, todo.stage_y * (stage.flip_y ? -1 : 1),
      stage.mirror_pitch * 0.02, {0, 1});
  const double turn = todo.stage_theta * (stage.flip_theta ? -1 : 1);
  if (std::abs (turn) >= 1.0) {
    const double arc =
        std::clamp (0.25 + std::log10 (std::abs (turn)) / 5.0, 0.25, 0.9);
    const double top = -std::numbers::pi / 2;
    canvas.ring (centre, radius * 1.12, top,
        top + (turn > 0 ? arc : -arc) * std::numbers::pi, true);
  }
}

void
draw_progress (Canvas &canvas, const Rect &strip, double unit, double part)
{
  const double left = strip.x + unit, width = strip.width - 2 * unit;
  const double top = strip.y + strip.height - unit * 0.75;
  canvas.grey (kFrame);
  canvas.box (left, top, width, unit * 0.4, false);
  canvas.grey (kBright);
  canvas.box (left, top, width * std::clamp (part, 0.0, 1.0), unit * 0.4, true);
}

} // namespace

Panel
draw_panel (Extent size, const PanelContent &content)
{
  const Layout layout = lay_out (size, content);
  const Rect strip{0, layout.strip, size.width, size.height - layout.strip};
  Panel panel{Image<std::uint8_t> (size.width, size.height), {strip}};
  const auto picture = [&] (int place) {
    return Rect{place * layout.picture, 0, layout.picture - 1, layout.top};
  };

  const std::pair<const Fringes *, const char *> both[] = {
      {content.fringes_x, "x fringes"}, {content.fringes_y, "y fringes"}};
  for (int i = 0; i < 2; i++)
    if (const Fringes *fringes = both[i].first) {
      panel.opaque.push_back (picture (i));
      draw_fringes (*fringes, picture (i), panel.grey.view ());
    }
  Canvas canvas (panel.grey.view ());
  const double unit = layout.unit;
  if (content.correction) {
    panel.opaque.push_back (picture (2));
    draw_stage (canvas, picture (2), content, unit);
    canvas.grey (kBody);
    canvas.text ({picture (2).x + unit / 2, layout.top - unit * 0.5},
        unit * 0.8, "move the camera so");
  }
  for (int i = 0; i < 2; i++)
    if (both[i].first)
      canvas.label ({picture (i).x + unit / 2, layout.top - unit * 0.5},
          unit * 0.8, both[i].second);

  canvas.grey (kBright);
  canvas.text ({unit, strip.y + unit * 1.15}, unit * 1.1, content.title);
  double line = strip.y + unit * 2.2;
  if (!content.headline.empty ()) {
    canvas.text_within ({unit, line + unit * (kHeadline - 1.2)},
        unit * kHeadline * 0.8, size.width - 2 * unit, content.headline);
    line += unit * kHeadline;
  }
  canvas.grey (kBody);
  for (const std::string &text : content.lines) {
    canvas.text ({unit, line}, unit * 0.85, text);
    line += unit;
  }
  if (content.progress)
    draw_progress (canvas, strip, unit, *content.progress);
  return panel;
}

template <typename Pixel>
void
lay_over (const Panel &panel, ImageView<Pixel> out, int bits)
{
  const int white = largest_pixel_of<Pixel> (bits);
  const auto grey = panel.grey.view ();
  for (const Rect &at : panel.opaque)
    for (int y = at.y; y < at.y + at.height; y++)
      std::transform (grey.row (y) + at.x, grey.row (y) + at.x + at.width,
          out.row (y) + at.x,
          [white] (std::uint8_t level) { return Pixel (level * white / 255); });
}
template void lay_over (const Panel &, ImageView<std::uint8_t>, int);
template void lay_over (const Panel &, ImageView<std::uint16_t>, int);

} // namespace codedexposure
