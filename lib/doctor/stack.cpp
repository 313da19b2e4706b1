/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/stack.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

/* Parts of a common change of light that pixels get; their mean is 1. */
Image<float>
weights_of (const Image<float> &mean, const Image<float> *dark, int largest)
{
  Image<float> weights (mean.width (), mean.height ());
  const double light =
      dark ? mean_of (mean.view ()) - mean_of (dark->view ()) : 0.0;
  const bool lit = light > 0.02 * largest;
  each_pixel (mean, [&] (int x, int y) {
    weights.at (x, y) =
        lit ? float (
                  (double (mean.at (x, y)) - double (dark->at (x, y))) / light)
            : 1.0f;
  });
  return weights;
}

} // namespace

Stack
stack_of (
    const std::vector<SeenFrame> &frames, int largest, const Image<float> *dark)
{
  if (frames.empty ())
    return {};
  const int width = frames[0].picture.width ();
  const int height = frames[0].picture.height ();
  Stack stack = {int (frames.size ()), frames[0].time, {width, height},
      {width, height}, {width, height}, {width, height}};
  for (const SeenFrame &frame : frames) {
    stack.time += (frame.time - frames[0].time) / stack.frames;
    each_pixel (frame.picture, [&] (int x, int y) {
      const std::uint16_t value = frame.picture.at (x, y);
      stack.mean.at (x, y) += float (value);
      if (value == 0)
        stack.zeros.at (x, y)++;
      if (value >= largest)
        stack.full.at (x, y)++;
      stack.bits_seen |= value;
    });
  }
  each_pixel (stack.mean,
      [&] (int x, int y) { stack.mean.at (x, y) /= float (stack.frames); });

  const Image<float> weights = weights_of (stack.mean, dark, largest);
  const double middle = mean_of (stack.mean.view ());
  const int freedom = std::max (1, stack.frames - 1);
  for (const SeenFrame &frame : frames) {
    const double more = mean_of (frame.picture.view ()) - middle;
    stack.scatter += more * more / freedom;
    each_pixel (frame.picture, [&] (int x, int y) {
      const float rest = float (frame.picture.at (x, y)) -
                         stack.mean.at (x, y) -
                         float (more) * weights.at (x, y);
      stack.variance.at (x, y) += rest * rest / float (freedom);
    });
  }
  stack.scatter = std::sqrt (stack.scatter);
  return stack;
}

Result<std::vector<SeenFrame>>
look_for_whole_frames (
    Examination &examination, const StillMask &mask, int slots, int frames)
{
  constexpr int kTries = 5;
  std::vector<SeenFrame> whole;
  ASSIGN_OR_RETURN (auto seen, look (examination, mask, slots, frames));
  for (int more = 1;; more++) {
    for (SeenFrame &frame : seen)
      if (!frame.damaged && int (whole.size ()) < frames &&
          (whole.empty () || same_size (std::as_const (frame.picture).view (),
                                 std::as_const (whole[0].picture).view ())))
        whole.push_back (std::move (frame));
    if (int (whole.size ()) == frames || seen.empty () || more == kTries)
      break;
    ASSIGN_OR_RETURN (seen, examination.rig.watch (frames));
  }
  if (int (whole.size ()) < std::max (1, frames / 2))
    return Error{"only " + std::to_string (whole.size ()) + " of " +
                     std::to_string (frames) + " frames came complete",
        ErrorCode::timeout};
  return whole;
}

Result<Stack>
look_at_light (Examination &examination, const StillMask &mask, int slots,
    int frames, const Image<float> *dark)
{
  ASSIGN_OR_RETURN (const auto seen,
      look_for_whole_frames (examination, mask, slots, std::max (4, frames)));
  if (dark && !same_size (seen[0].picture.view (), dark->view ()))
    return Error{"the size of the frames has changed", ErrorCode::device};
  return stack_of (seen, examination.rig.parts ().largest (), dark);
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
