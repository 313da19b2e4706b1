/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/response.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

#include "base/statistics.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/* Tiles of the frame period, of which a part is lit. */
constexpr int kTiles = 8;
/** Tiles that lie in any exposure, the largest part first; each has two halves,
 * and the next one lies in its middle. */
struct Part {
  int first, count;
};
constexpr std::array<Part, 3> kParts = {{{1, 6}, {2, 4}, {3, 2}}};
/* Frames of a look: those that follow the light have done so at the end. */
constexpr int kFrames = 9, kSettled = 4, kRounds = 3;
/* Light that can be judged, and pixels that may be full; parts. */
constexpr double kFaint = 0.08, kFull = 0.001;
/* By how much the halves may differ from the whole: less is left to the check
 * of the sensor. Few rounds tell their own error badly. */
constexpr double kBent = 0.03, kBowed = 0.2, kSigmas = 4.0;
/* A level that lies that far, as a part of the step, beyond both levels that it
 * leads from and to. */
constexpr double kOvershoot = 0.1;
/* Noise of a gain that has grown, against that of the same gain. */
constexpr double kNoisier = 1.35;

/** The frames of one mask. */
struct Look {
  int tiles = 0;
  double level = 0.0;     ///< of the last ones, DN
  double full = 0.0;      ///< part of their pixels with the largest DN
  double noise = 0.0;     ///< variance of a pixel over time, DN squared
  bool still = true;      ///< all of them are equal
  std::uint16_t most = 0; ///< bits that a pixel value has
  std::vector<double> levels = {};
};

/** Of a pixel over time, beyond what all of them have in common. */
double
variance_between (const SeenFrame &a, const SeenFrame &b)
{
  double sum = 0.0, squares = 0.0;
  each_pixel (a.picture, [&] (int x, int y) {
    const double step =
        double (a.picture.at (x, y)) - double (b.picture.at (x, y));
    sum += step;
    squares += step * step;
  });
  const double pixels =
      std::max (1.0, double (a.picture.width ()) * a.picture.height ());
  return 0.5 * (squares - sum * sum / pixels) / pixels;
}

class ResponseRun
{
public:
  ResponseRun (Examination &examination, Finding &finding)
      : examination_ (examination), finding_ (finding),
        largest_ (examination.rig.parts ().largest ())
  {
  }

  Result<void> run ()
  {
    ASSIGN_OR_RETURN (const bool found, find_part ());
    const bool still = std::ranges::all_of (looks_, &Look::still);
    if (looks_.size () > 1 && still && looks_[0].level > 0.0 &&
        std::abs (light (looks_.size () - 1)) < 1.0) {
      finding_.blame ("test-image",
          "no pixel value changes, neither with the light nor from frame to "
          "frame");
      return {};
    }
    judge_bits ();
    if (!found || !finding_.diagnoses.empty ())
      return {};
    /* A curve may be even about its middle, but not about two places. */
    for (std::size_t i = part_; i < std::min (part_ + 2, kParts.size ()); i++) {
      ASSIGN_OR_RETURN (excess_, compare (kParts[i]));
      if (std::abs (excess_.value) - kSigmas * excess_.sigma > kBent)
        break;
    }
    if (!(std::abs (excess_.value) - kSigmas * excess_.sigma > kBent))
      return {};
    ASSIGN_OR_RETURN (const bool steady, is_steady ());
    if (!steady)
      return {};
    const bool follows_light = follows ();
    if (!follows_light)
      return name_bend ();
    /* A gain multiplies noise, too; more light for a longer time does not. */
    const Look &half = looks_.back ();
    const Look &whole = *std::ranges::find_if (looks_.rbegin (), looks_.rend (),
        [&half] (const Look &look) { return look.tiles == 2 * half.tiles; });
    const double noisier =
        (half.noise / std::max (1.0, half.level)) /
        std::max (1e-9, whole.noise / std::max (1.0, whole.level));
    const bool by_gain = noisier > kNoisier;
    finding_.blame (by_gain ? "auto-gain" : "auto-exposure",
        std::string ("after a change of the light, the camera changes its ") +
            (by_gain ? "gain" : "exposure") + " by itself");
    return {};
  }

private:
  /** Adds a look at tiles [@p first, @p first + @p count); false: frames lack.
   */
  Result<bool> look_at (int first, int count)
  {
    RETURN_IF_ERROR (examination_.rig.show (
        count > 0 ? lit (first, count) : no_light (), kTiles));
    ASSIGN_OR_RETURN (auto seen, examination_.rig.watch (kFrames));
    std::erase_if (seen, &SeenFrame::damaged);
    if (int (seen.size ()) < kSettled)
      return false;
    Look look{.tiles = count};
    for (const SeenFrame &frame : seen)
      look.levels.push_back (mean_of (std::as_const (frame.picture).view ()));
    for (std::size_t i = seen.size () - kSettled; i < seen.size (); i++) {
      look.level += look.levels[i] / kSettled;
      const Level level = level_of (seen[i].picture.view (), largest_);
      look.full += level.saturated / kSettled;
      look.most = std::uint16_t (look.most | level.bits_seen);
    }
    look.noise = variance_between (seen[seen.size () - 2], seen.back ());
    look.still = look.noise == 0.0;
    looks_.push_back (std::move (look));
    return true;
  }

  /** The largest part of the period that does not saturate pixels. */
  Result<bool> find_part ()
  {
    ASSIGN_OR_RETURN (bool known, look_at (0, 0));
    for (; known && part_ < kParts.size (); part_++) {
      ASSIGN_OR_RETURN (
          known, look_at (kParts[part_].first, kParts[part_].count));
      if (known && looks_.back ().full < kFull)
        return true;
    }
    return false;
  }

  /** By how much the two halves of @p part exceed the whole, as a part of it.
   */
  Result<Measured> compare (const Part &part)
  {
    const int half = part.count / 2;
    const Part shown[] = {{part.first, half}, part, {part.first + half, half}};
    std::array<std::vector<double>, 3> lights;
    for (int round = 0; round < kRounds; round++)
      for (std::size_t i = 0; i < 3; i++) {
        ASSIGN_OR_RETURN (
            const bool known, look_at (shown[i].first, shown[i].count));
        if (!known || looks_.back ().full >= kFull)
          return kNotMeasured;
        lights[i].push_back (light (looks_.size () - 1));
      }
    const Measured first = spread_of (lights[0]);
    const Measured whole = spread_of (lights[1]);
    const Measured second = spread_of (lights[2]);
    if (whole.value < kFaint * largest_)
      return kNotMeasured;
    /* Of light that flickers, few looks tell the mean badly, and the halves
     * differ. */
    const double sigma = std::hypot (first.sigma, whole.sigma, second.sigma);
    return Measured{(first.value + second.value) / whole.value - 1.0,
        std::hypot (sigma, first.value - second.value) / whole.value};
  }

  /* Values that do not use the highest bits may be few electrons; but these
   * have more noise. */
  void judge_bits ()
  {
    constexpr double kLargestWell = 60e3; // electrons
    if (looks_.size () < 2 || looks_[1].most == 0)
      return;
    const int used = std::bit_width (looks_[1].most);
    const double light_seen = light (1);
    const double full_well =
        light_seen * largest_ / std::max (looks_[1].noise, 1.0 / 6.0);
    if (largest_ > 255 && (largest_ >> used) >= 3 && light_seen > 16.0 &&
        full_well > kLargestWell)
      finding_.blame ("low-bits",
          "pixel values stay below " + std::to_string (1 << used) + " of " +
              std::to_string (largest_ + 1) +
              ", and have the noise of a well that is nearly full: they are in "
              "the lowest bits");
  }

  /** Whether the same light comes again and again: flicker that is nearly in
   * step with the looks also makes halves that are no halves. */
  Result<bool> is_steady ()
  {
    constexpr int kAgain = 5;
    const auto [first, count] = kParts[part_];
    std::vector<double> lights;
    for (int i = 0; i < kAgain; i++) {
      ASSIGN_OR_RETURN (const bool known, look_at (first, count / 2));
      if (!known)
        return false;
      lights.push_back (light (looks_.size () - 1));
    }
    const Measured again = spread_of (lights);
    return again.sigma < std::abs (excess_.value) / kSigmas * again.value;
  }

  /** Whether frames with more light than those before were brighter at first
   * than later. With less light, a frame that is cut short may be darker. */
  bool follows () const
  {
    int beyond = 0, steps = 0;
    for (std::size_t i = 1; i < looks_.size (); i++) {
      if (looks_[i].tiles <= looks_[i - 1].tiles)
        continue;
      const double from = looks_[i - 1].level, to = looks_[i].level;
      const double high = *std::ranges::max_element (looks_[i].levels);
      const double size = std::max (std::abs (to - from), kFaint * largest_);
      steps++;
      beyond += high > std::max (from, to) + kOvershoot * size;
    }
    return beyond > steps / 2;
  }

  Result<void> name_bend ()
  {
    std::vector<ResponsePoint> points;
    const auto [first, most] = kParts[part_];
    for (int count = 1; count <= most; count++) {
      ASSIGN_OR_RETURN (
          const bool known, look_at (first + (most - count) / 2, count));
      if (known)
        points.push_back ({double (count), light (looks_.size () - 1)});
    }
    const Bend bend = bend_of (points);
    /* The check of the sensor measures a slight bow better. */
    if (std::string_view (bend.id) == "nonlinear" &&
        std::abs (excess_.value) < kBowed)
      return {};
    finding_.blame (
        bend.id, "two halves of the light make " +
                     fixed (100.0 * (1.0 + excess_.value), 0) +
                     " % of the pixel value that both make together" +
                     (std::string_view (bend.id) == "gamma"
                             ? ", as with a gamma of " + fixed (bend.gamma, 2)
                             : ": values are not proportional to light"));
    return {};
  }

  double light (std::size_t look) const
  {
    return looks_[look].level - looks_[0].level;
  }

  Examination &examination_;
  Finding &finding_;
  int largest_;
  std::size_t part_ = 0;           // of kParts that is the whole
  std::vector<Look> looks_;        // the first one: of the dark
  Measured excess_ = kNotMeasured; // of the halves over the whole, parts of it
};

/** The squares that remain if @p shape gives the values of 0..1. */
template <typename Shape>
double
rest_of (const std::vector<ResponsePoint> &points, Shape shape)
{
  double most = 0.0;
  for (const ResponsePoint &point : points)
    most = std::max (most, point.light);
  /* The factor is that of least squares. */
  double both = 0.0, own = 0.0, squares = 0.0;
  for (const ResponsePoint &point : points) {
    const double value = shape (point.light / most);
    both += value * point.value;
    own += value * value;
    squares += point.value * point.value;
  }
  return (squares - both * both / std::max (own, 1e-12)) /
         std::max (squares, 1e-12);
}

} // namespace

Bend
bend_of (const std::vector<ResponsePoint> &points)
{
  constexpr double kExplained = 0.03; // of the squares of a straight line
  Bend bend;
  double power = 1e9, parabola = 1e9;
  /* A camera bends its black level, too. */
  for (const double black : {0.0, 0.02, 0.05, 0.1})
    for (double gamma = 0.1; gamma < 4.0; gamma *= 1.01) {
      const double rest = rest_of (points, [gamma, black] (double x) {
        return std::pow (x + black, gamma) - std::pow (black, gamma);
      });
      if (rest < power)
        bend.gamma = gamma;
      power = std::min (power, rest);
    }
  for (double bow = -0.24; bow <= 0.2401; bow += 0.002)
    parabola = std::min (parabola, rest_of (points, [bow] (double x) {
      return x + 4.0 * bow * x * (1.0 - x);
    }));
  const double line = rest_of (points, [] (double x) { return x; });
  bend.id = std::min (power, parabola) > kExplained * line ? "lut"
            : power < parabola                             ? "gamma"
                                                           : "nonlinear";
  return bend;
}

Result<void>
check_response (Examination &examination, Finding &finding)
{
  return ResponseRun (examination, finding).run ();
}

std::optional<Measured>
row_delay (
    const std::map<double, std::vector<BorderLight>> &tiles, double period)
{
  using std::numbers::pi;
  std::size_t frames = 1000;
  for (const auto &[start, tile] : tiles)
    frames = std::min (frames, tile.size ());
  if (tiles.size () < 3 || frames < 2)
    return std::nullopt;
  /* Of each look at the tiles, the angle by which the light comes later. */
  std::vector<double> angles;
  for (std::size_t k = 0; k < frames; k++) {
    std::complex<double> first, last;
    for (const auto &[start, tile] : tiles) {
      const auto turn = std::polar (1.0, 2.0 * pi * start / period);
      first += turn * tile[k].first;
      last += turn * tile[k].last;
    }
    angles.push_back (std::arg (last * std::conj (first)));
  }
  Measured angle = spread_of (angles);
  angle.sigma /= std::sqrt (double (frames));
  /* The middles of the quarters are 3/4 of the frame apart. */
  return scaled (angle, period / (2.0 * pi) / 0.75);
}

} // namespace codedexposure
