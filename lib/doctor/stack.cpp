/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/stack.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "base/try.h"

namespace codedexposure
{

void
StackSum::add (const SeenFrame &frame)
{
  const int width = frame.picture.width (), height = frame.picture.height ();
  const double level = mean_of (frame.picture.view ());
  if (stack_.frames++ == 0) {
    stack_.time = frame.time;
    stack_.zeros = stack_.full = Image<std::uint8_t> (width, height);
    first_ = frame.picture;
    level_ = level;
    sum_ = squares_ = products_ = Image<float> (width, height);
  }
  const float more = float (level - level_);
  times_ += frame.time - stack_.time;
  levels_ += level - level_;
  level_squares_ += (level - level_) * (level - level_);
  std::uint16_t bits = 0;
  /* Loops of few kinds of values become vectors. */
  for (int y = 0; y < height; y++) {
    const std::uint16_t *value = frame.picture.view ().row (y);
    const std::uint16_t *first = first_.view ().row (y);
    float *sum = sum_.view ().row (y), *squares = squares_.view ().row (y);
    float *products = products_.view ().row (y);
    for (int x = 0; x < width; x++) {
      const float step = float (value[x]) - float (first[x]);
      sum[x] += step;
      squares[x] += step * step;
      products[x] += step * more;
    }
    std::uint8_t *zeros = stack_.zeros.view ().row (y);
    std::uint8_t *full = stack_.full.view ().row (y);
    for (int x = 0; x < width; x++) {
      zeros[x] = std::uint8_t (zeros[x] + (value[x] == 0));
      full[x] = std::uint8_t (full[x] + (value[x] >= largest_));
    }
    for (int x = 0; x < width; x++)
      bits |= value[x];
  }
  stack_.bits_seen |= bits;
}

/* The mean of (step - mean step - (more - mean more) * weight) squared. */
Result<Stack>
StackSum::stack (const Image<float> *dark) &&
{
  if (dark && !same_size (first_.view (), dark->view ()))
    return Error{"the size of the frames has changed", ErrorCode::device};
  const double count = stack_.frames, freedom = std::max (1.0, count - 1.0);
  stack_.time += times_ / stack_.frames;
  const double of_levels =
      std::max (0.0, level_squares_ - levels_ * levels_ / count);
  stack_.scatter = std::sqrt (of_levels / freedom);
  each_pixel (sum_, [&] (int x, int y) {
    float &sum = sum_.at (x, y), &squares = squares_.at (x, y);
    squares -= sum * sum / float (count);
    products_.at (x, y) -= sum * float (levels_ / count);
    sum = float (first_.at (x, y)) + sum / float (count);
  });
  stack_.mean = std::move (sum_);
  first_ = {};
  const double light =
      dark ? mean_of (stack_.mean.view ()) - mean_of (dark->view ()) : 0.0;
  const bool is_lit = light > 0.02 * largest_;
  each_pixel (squares_, [&] (int x, int y) {
    /* The part of a common change of light that the pixel gets. */
    const float weight = is_lit ? float ((double (stack_.mean.at (x, y)) -
                                             double (dark->at (x, y))) /
                                         light)
                                : 1.0f;
    const float rest = squares_.at (x, y) -
                       2.0f * weight * products_.at (x, y) +
                       weight * weight * float (of_levels);
    squares_.at (x, y) = std::max (0.0f, rest / float (freedom));
  });
  stack_.variance = std::move (squares_);
  return std::move (stack_);
}

Result<void>
look_for_whole_frames (Examination &examination, const StillMask &mask,
    int slots, int frames, const std::function<void (const SeenFrame &)> &take)
{
  constexpr int kTries = 5;
  std::optional<Extent> size;
  int whole = 0;
  RETURN_IF_ERROR (look (examination, mask, slots, 0));
  for (int came = 0; whole < frames && came < kTries * frames;) {
    ASSIGN_OR_RETURN (const int more,
        watch_each (examination.rig, frames - whole, [&] (SeenFrame &frame) {
          const Extent own = {frame.picture.width (), frame.picture.height ()};
          if (frame.damaged || own != size.value_or (own))
            return;
          size = own;
          whole++;
          take (frame);
        }));
    if (more == 0)
      break;
    came += more;
  }
  if (whole < std::max (1, frames / 2))
    return Error{"only " + std::to_string (whole) + " of " +
                     std::to_string (frames) + " frames came complete",
        ErrorCode::timeout};
  return {};
}

Result<Stack>
look_at_light (Examination &examination, const StillMask &mask, int slots,
    int frames, const Image<float> *dark)
{
  StackSum sum (examination.rig.parts ().largest ());
  RETURN_IF_ERROR (look_for_whole_frames (examination, mask, slots,
      std::max (4, frames), [&] (const SeenFrame &frame) { sum.add (frame); }));
  return std::move (sum).stack (dark);
}

Image<float>
thinned (const Image<float> &image, int step)
{
  Image<float> result (
      (image.width () + step - 1) / step, (image.height () + step - 1) / step);
  each_pixel (result,
      [&] (int x, int y) { result.at (x, y) = image.at (x * step, y * step); });
  return result;
}

int
thinning_of (Extent picture)
{
  constexpr double kEnough = 1e6;
  const double pixels = double (picture.width) * picture.height;
  return std::max (1, int (std::sqrt (pixels / kEnough)));
}

Result<Finding>
or_no_frames (Result<Finding> finding, const std::string &name)
{
  if (finding || finding.error ().code != ErrorCode::timeout)
    return finding;
  Finding none{name, ""};
  none.blame ("no-frames", finding.error ().message);
  return none;
}

StackMeans
means_of (const Stack &stack, ImageView<const std::uint8_t> good)
{
  StackMeans sum;
  double pixels = 0.0, squares = 0.0;
  const double middle = mean_of (stack.mean.view ());
  each_pixel (good, [&] (int x, int y) {
    if (good.at (x, y) == 0)
      return;
    const double mean = double (stack.mean.at (x, y)) - middle;
    pixels++;
    sum.mean += mean;
    squares += mean * mean;
    sum.variance += double (stack.variance.at (x, y));
    sum.zeros += stack.zeros.at (x, y);
    sum.full += stack.full.at (x, y);
  });
  if (pixels < 1.0)
    return {};
  sum.values = pixels * stack.frames;
  sum.mean /= pixels;
  sum.variance /= pixels;
  sum.zeros /= sum.values;
  sum.full /= sum.values;
  const double spread = squares / pixels - sum.mean * sum.mean;
  sum.spread = std::sqrt (std::max (0.0, spread - sum.variance / stack.frames));
  sum.mean += middle;
  return sum;
}

std::vector<double>
light_parts (const Image<float> &dark, const Image<float> &bright,
    ImageView<const std::uint8_t> good)
{
  constexpr std::size_t kParts = 24;
  std::vector<double> light;
  each_pixel (good, [&] (int x, int y) {
    if (good.at (x, y) != 0)
      light.push_back (double (bright.at (x, y)) - double (dark.at (x, y)));
  });
  if (light.size () < kParts)
    return {};
  std::ranges::sort (light);
  std::vector<double> parts (kParts);
  double mean = 0.0;
  for (std::size_t i = 0; i < light.size (); i++) {
    parts[i * kParts / light.size ()] +=
        light[i] * double (kParts) / double (light.size ());
    mean += light[i] / double (light.size ());
  }
  for (double &part : parts)
    part /= mean;
  return parts;
}

Examination::Lit
fine_slots (const Examination &examination, Nanoseconds shortest)
{
  const RigParts &parts = examination.rig.parts ();
  const Examination::Lit &inside = examination.inside;
  const Nanoseconds slot = parts.rate.period () / std::max (1, inside.of);
  const int pieces = int (std::clamp<Nanoseconds> (
      slot / std::max ({shortest, parts.dmd.minimum_active, Nanoseconds (1)}),
      1, 4096));
  return {inside.first * pieces, inside.slots * pieces, inside.of * pieces};
}

Image<std::uint8_t>
picture_of (const Image<float> &image, double low, double high)
{
  Image<std::uint8_t> picture (image.width (), image.height ());
  const double scale = 255.0 / std::max (1e-9, high - low);
  each_pixel (image, [&] (int x, int y) {
    picture.at (x, y) = std::uint8_t (std::clamp (
        std::lround (scale * (double (image.at (x, y)) - low)), 0l, 255l));
  });
  return picture;
}

std::string
places_text (const std::vector<Position> &places)
{
  constexpr std::size_t kMost = 50;
  std::string text;
  for (std::size_t i = 0; i < std::min (places.size (), kMost); i++) {
    text.append (i > 0 ? " " : "");
    text.append (fixed (places[i].x, 0)).append (",");
    text.append (fixed (places[i].y, 0));
  }
  return text.append (places.size () > kMost ? " ..." : "");
}

} // namespace codedexposure
