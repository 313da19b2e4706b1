/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include <algorithm>
#include <array>
#include <cmath>

#include "page.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

namespace
{

constexpr int kWide = 560, kHigh = 300;
constexpr int kLeft = 76, kRight = 26, kTop = 34, kBottom = 62;
constexpr int kTicks = 5;
/* More points are not seen. */
constexpr std::size_t kMostPoints = 2000;

struct Scale {
  double low = 0.0, high = 1.0, step = 1.0;

  double part (double value) const { return (value - low) / (high - low); }
};

bool
is_finite (const Position &point)
{
  return std::isfinite (point.x) && std::isfinite (point.y);
}

/** Round numbers around @p low and @p high. */
Scale
scale_of (double low, double high)
{
  if (!(high > low)) {
    const double margin = std::max (std::abs (low) * 0.01, 1e-9);
    low -= margin;
    high += margin;
  }
  const double rough = (high - low) / kTicks;
  const double ten = std::pow (10.0, std::floor (std::log10 (rough)));
  double step = 10 * ten;
  for (const double nice : {5.0, 2.0, 1.0})
    if (nice * ten >= rough)
      step = nice * ten;
  return {std::floor (low / step) * step, std::ceil (high / step) * step, step};
}

Scale
scale_of (const Chart &chart, double Position::*axis)
{
  double low = INFINITY, high = -INFINITY;
  for (const Curve &curve : chart.curves)
    for (const Position &point : curve.points)
      if (is_finite (point)) {
        low = std::min (low, point.*axis);
        high = std::max (high, point.*axis);
      }
  if (!(high >= low))
    low = high = 0;
  if (axis == &Position::y && chart.from_zero)
    low = std::min (low, 0.0);
  if (axis == &Position::x && !chart.ticks.empty ())
    return {low - 0.6, high + 0.6, 1.0};
  return scale_of (low, high);
}

/** The lowest and the highest of neighbours, where there are too many. */
std::vector<Position>
thinned (const std::vector<Position> &points)
{
  if (points.size () <= kMostPoints)
    return points;
  std::vector<Position> few;
  const std::size_t step = 2 * points.size () / kMostPoints + 1;
  for (std::size_t i = 0; i < points.size (); i += step) {
    const auto begin = points.begin () + std::ptrdiff_t (i);
    const auto end =
        begin + std::ptrdiff_t (std::min (step, points.size () - i));
    const auto [low, high] = std::minmax_element (begin, end,
        [] (const Position &a, const Position &b) { return a.y < b.y; });
    few.push_back (std::min (low, high)[0]);
    few.push_back (std::max (low, high)[0]);
  }
  return few;
}

/** Draws a chart; its parts in their order. */
class Drawing
{
public:
  explicit Drawing (const Chart &chart)
      : chart_ (chart), x_ (scale_of (chart, &Position::x)),
        y_ (scale_of (chart, &Position::y))
  {
  }

  std::string text () const
  {
    std::string all = format (
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" "
        "role=\"img\" aria-label=\"%s\" font-family=\"sans-serif\" "
        "font-size=\"11\" fill=\"#555\">",
        kWide, kHigh, escaped (chart_.title).c_str ());
    if (chart_.marked)
      all += format ("<rect x=\"%.1f\" y=\"%d\" width=\"%.1f\" height=\"%d\" "
                     "fill=\"#f4c13c\" fill-opacity=\"0.4\"/>",
          at_x (chart_.marked->first), kTop,
          std::max (
              at_x (chart_.marked->second) - at_x (chart_.marked->first), 1.0),
          kHigh - kBottom - kTop);
    all += grid ();
    for (const Curve &curve : chart_.curves)
      all += drawn (curve);
    return all + words () + legend () + "</svg>";
  }

private:
  double at_x (double value) const
  {
    return kLeft + x_.part (value) * (kWide - kLeft - kRight);
  }
  double at_y (double value) const
  {
    return kHigh - kBottom - y_.part (value) * (kHigh - kTop - kBottom);
  }

  static std::string tick_text (double value, double step)
  {
    return format ("%.6g", std::abs (value) < step / 2 ? 0.0 : value);
  }

  std::string below (double at, const std::string &text) const
  {
    return format ("<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%s</text>",
        at_x (at), kHigh - kBottom + 16, text.c_str ());
  }

  std::string grid () const
  {
    std::string text;
    for (const auto &[at, word] : chart_.ticks)
      text += below (at, word);
    for (double at = x_.low;
         chart_.ticks.empty () && at <= x_.high + x_.step / 2; at += x_.step)
      text += format ("<path stroke=\"#ddd\" d=\"M%.1f %dV%d\"/>", at_x (at),
                  kTop, kHigh - kBottom) +
              below (at, tick_text (at, x_.step));
    for (double at = y_.low; at <= y_.high + y_.step / 2; at += y_.step)
      text += format ("<path stroke=\"#ddd\" d=\"M%d %.1fH%d\"/><text "
                      "x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%s</text>",
          kLeft, at_y (at), kWide - kRight, kLeft - 6, at_y (at) + 4,
          tick_text (at, y_.step).c_str ());
    return text;
  }

  std::string drawn (const Curve &curve) const
  {
    const char *colour = curve.colour.c_str ();
    std::string text;
    if (curve.kind == Curve::Kind::line)
      text = format ("<polyline fill=\"none\" stroke=\"%s\" "
                     "stroke-width=\"%.1f\" points=\"",
          colour, curve.width);
    for (const Position &point : thinned (curve.points)) {
      if (!is_finite (point))
        continue;
      const double x = at_x (point.x), y = at_y (point.y);
      switch (curve.kind) {
      case Curve::Kind::line:
        text += format ("%.1f,%.1f ", x, y);
        break;
      case Curve::Kind::dots:
        text += format ("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3\" fill=\"%s\"/>",
            x, y, colour);
        break;
      case Curve::Kind::bars: {
        const double half = 0.35 * (at_x (1) - at_x (0));
        text += format ("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" "
                        "height=\"%.1f\" fill=\"%s\"><title>%.4g</title>"
                        "</rect>",
            x - half, y, 2 * half, std::max (at_y (0) - y, 0.0), colour,
            point.y);
        if (half > 15)
          text += format ("<text x=\"%.1f\" y=\"%.1f\" "
                          "text-anchor=\"middle\">%.4g</text>",
              x, y - 5, point.y);
      }
      }
    }
    return curve.kind == Curve::Kind::line ? text + "\"/>" : text;
  }

  std::string words () const
  {
    return format ("<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>",
               (kLeft + kWide - kRight) / 2, kHigh - 26,
               escaped (chart_.x_axis).c_str ()) +
           format ("<text x=\"6\" y=\"14\">%s</text>",
               escaped (chart_.y_axis).c_str ()) +
           format ("<text x=\"%d\" y=\"14\" text-anchor=\"end\" "
                   "font-weight=\"bold\">%s</text>",
               kWide - kRight, escaped (chart_.title).c_str ());
  }

  std::string legend () const
  {
    std::string text;
    int x = kLeft;
    for (const Curve &curve : chart_.curves) {
      if (curve.name.empty ())
        continue;
      text += format ("<rect x=\"%d\" y=\"%d\" width=\"12\" height=\"8\" "
                      "fill=\"%s\"/><text x=\"%d\" y=\"%d\">%s</text>",
          x, kHigh - 14, curve.colour.c_str (), x + 16, kHigh - 6,
          escaped (curve.name).c_str ());
      x += 34 + 7 * int (curve.name.size ());
    }
    return text;
  }

  const Chart &chart_;
  const Scale x_, y_;
};

} // namespace

std::string
shade (double part)
{
  struct Stop {
    double at;
    std::array<int, 3> colour;
  };
  static constexpr Stop kStops[] = {{0, {0x2c, 0x11, 0x5f}},
      {0.35, {0x93, 0x26, 0x67}}, {0.7, {0xed, 0x69, 0x25}},
      {1, {0xf4, 0xc1, 0x3c}}};
  const Stop *to = kStops + 1;
  while (to->at < part && to->at < 1)
    to++;
  const double share = (part - to[-1].at) / (to->at - to[-1].at);
  std::array<int, 3> mixed{};
  for (std::size_t i = 0; i < 3; i++)
    mixed[i] = int (std::lerp (
        to[-1].colour[i], to->colour[i], std::clamp (share, 0., 1.)));
  return format ("#%02x%02x%02x", mixed[0], mixed[1], mixed[2]);
}

std::string
Chart::svg () const
{
  return Drawing (*this).text ();
}

} // namespace codedexposure::app
