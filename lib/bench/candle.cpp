/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A candle, and its end. */
#include "bench/scene_parts.h"

namespace codedexposure
{

namespace
{

constexpr Position kWick{0.0, 0.66};
constexpr double kFlameHeight = 0.36;
constexpr double kFlameWidth = 0.055; // half of it, at the widest
constexpr double kCandleTop = 0.70;
constexpr double kCandleWidth = 0.085; // half of it
constexpr double kBlow = 0.5;          // seconds until somebody blows

/* What the flame does at one time. */
struct Flame {
  double height = kFlameHeight;
  double power = 1.0;  ///< of its light; 0 when it is out
  double lean = 0.0;   ///< of its tip to the right
  double sway = 0.0;   ///< of its middle
  double jitter = 0.0; ///< of its edge
  double ember = 0.0;  ///< light of the wick
  double smoke = 0.0;
};

Flame
burning (double t)
{
  Flame flame;
  flame.height *= 1.0 + 0.11 * swing (t, 11.0) + 0.05 * swing (t, 4.3, 0.2);
  flame.power = 0.88 + 0.09 * swing (t, 11.0, 0.1) + 0.03 * swing (t, 23.0);
  flame.lean = 0.02 * swing (t, 1.7) + 0.012 * swing (t, 6.1, 0.4);
  flame.sway = 0.006 * swing (t, 9.0, 0.3);
  flame.jitter = swing (t, 17.0);
  return flame;
}

/* The gust bends the flame in 50 ms, tears it for as long, and leaves an ember
 * and its smoke. */
Flame
blown (double t)
{
  Flame flame = burning (t);
  const double since = t - kBlow;
  if (since <= 0.0)
    return flame;
  const double gust = smooth_step (0.0, 0.05, since);
  const double left = std::exp (-std::max (0.0, since - 0.04) / 0.03);
  flame.lean += gust * (0.19 + 0.05 * swing (t, 31.0));
  flame.sway += gust * 0.02 * swing (t, 37.0);
  flame.jitter *= 1.0 + 2.0 * gust;
  flame.height *= (1.0 - 0.35 * gust) * (0.25 + 0.75 * left);
  flame.power *= left < 0.004 ? 0.0 : left;
  flame.ember = 0.6 * smooth_step (0.03, 0.1, since) * std::exp (-since / 0.9);
  flame.smoke = 0.10 * smooth_step (0.1, 0.35, since);
  return flame;
}

class Candle : public SyntheticScene
{
public:
  Candle (Extent size, bool blown_out)
      : frame_{size}, blown_out_ (blown_out), dark_ (size.width, size.height),
        lit_ (size.width, size.height)
  {
    for (int y = 0; y < size.height; y++)
      for (int x = 0; x < size.width; x++)
        furnish (x, y);
  }

  void draw (double seconds, ImageView<float> light) override
  {
    const Flame flame = blown_out_ ? blown (seconds) : burning (seconds);
    for (int y = 0; y < light.height; y++) {
      const float *dark = dark_.view ().row (y), *lit = lit_.view ().row (y);
      float *out = light.row (y);
      const auto power = float (flame.power);
      for (int x = 0; x < light.width; x++)
        out[x] = dark[x] + power * lit[x];
    }
    if (flame.power > 0.0)
      draw_flame (flame, light);
    if (flame.smoke > 0.0)
      draw_smoke (flame, seconds, light);
    draw_wick (flame, light);
  }

private:
  /* What there is without the flame, and what the flame lights. */
  void furnish (int x, int y)
  {
    const Position at = frame_.at (x, y);
    const double dx = at.x, dy = at.y - (kWick.y - 0.15);
    const double glow = 0.035 / (0.06 + dx * dx + dy * dy);
    const double wall = 0.8 + 0.2 * std::sin (at.x * 21.0) *
                                  std::sin (at.y * 17.0 + at.x * 5.0);
    double dark = 0.012, lit = 0.16 * glow * wall;
    const double across = at.x / kCandleWidth;
    if (at.y > kCandleTop && std::abs (across) < 1.0) {
      const double round = std::sqrt (1.0 - across * across);
      const double deep = (at.y - kCandleTop) / 0.12;
      dark = 0.02 + 0.02 * round;
      lit = (0.12 + 0.5 * std::exp (-deep)) * (0.35 + 0.65 * round);
    }
    dark_.at (x, y) = float (dark);
    lit_.at (x, y) = float (lit);
  }

  /* Widest at a fifth of its height, pointed at the top, dark at the wick. */
  void draw_flame (const Flame &flame, ImageView<float> light) const
  {
    const double reach = kFlameWidth * 2.5 + std::abs (flame.lean) + 0.03;
    const int first = frame_.column (-reach), last = frame_.column (reach);
    for (int y = frame_.row (kWick.y - flame.height);
         y < frame_.row (kWick.y + 0.01); y++) {
      const double up =
          (kWick.y + 0.01 - frame_.at (first, y).y) / (flame.height + 0.01);
      const double middle =
          flame.lean * up * up + flame.sway * std::sin (up * 6.0) * up;
      const double edge = 1.0 + 0.06 * flame.jitter * std::sin (up * 14.0) * up;
      const double width = kFlameWidth * edge * 1.9 *
                           std::pow (std::max (up, 0.0), 0.45) *
                           std::pow (std::max (1.0 - up, 0.0), 0.85);
      const double at_wick = 0.6 * std::exp (-up * up / 0.012);
      for (int x = first; x < last; x++) {
        const double out =
            std::abs (frame_.at (x, y).x - middle) / std::max (width, 1e-6);
        const double body = 1.0 - smooth_step (0.72, 1.08, out);
        if (body <= 0.0)
          continue;
        const double core = 1.0 - at_wick * std::exp (-out * out / 0.3);
        const double shade = 0.62 + 0.38 * std::exp (-out * out / 0.5);
        const double own = 0.97 * flame.power * body * core * shade;
        light.at (x, y) =
            float (std::lerp (double (light.at (x, y)), own, body * 0.95));
      }
    }
  }

  void draw_smoke (const Flame &flame, double t, ImageView<float> light) const
  {
    for (int y = 0; y < frame_.row (kWick.y); y++) {
      const double up = kWick.y - frame_.at (0, y).y;
      const double middle = 0.05 * up * swing (t, 1.9, -1.7 * up) +
                            0.09 * up * up * swing (t, 3.1, -2.9 * up) +
                            0.08 * up;
      const double width = 0.006 + 0.05 * up;
      const double density = flame.smoke * std::exp (-up / 0.5);
      for (int x = 0; x < light.width; x++) {
        const double out = (frame_.at (x, y).x - middle) / width;
        if (std::abs (out) < 3.5)
          light.at (x, y) += float (density * std::exp (-out * out));
      }
    }
  }

  void draw_wick (const Flame &flame, ImageView<float> light) const
  {
    for (int y = frame_.row (kWick.y - 0.012); y < frame_.row (kCandleTop); y++)
      for (int x = frame_.column (-0.005); x < frame_.column (0.005); x++)
        light.at (x, y) = float (0.04 + flame.ember);
  }

  SceneFrame frame_;
  bool blown_out_;
  Image<float> dark_, lit_;
};

} // namespace

std::unique_ptr<SyntheticScene>
make_candle (Extent size, bool blown_out)
{
  return std::make_unique<Candle> (size, blown_out);
}

} // namespace codedexposure
