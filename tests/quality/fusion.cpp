/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fusion.h"
#include "must.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

namespace codedexposure::quality
{

namespace
{

/* Sums over squares of kWindow x kWindow, from the sums over a corner. */
class Sums
{
public:
  template <typename F>
  Sums (int width, int height, F &&value)
      : width_ (width + 1), sums_ (std::size_t ((width + 1) * (height + 1)))
  {
    for (int y = 0; y < height; y++)
      for (int x = 0; x < width; x++)
        at (x + 1, y + 1) =
            value (x, y) + at (x, y + 1) + at (x + 1, y) - at (x, y);
  }
  double over (int x, int y, int size)
  {
    return at (x + size, y + size) - at (x, y + size) - at (x + size, y) +
           at (x, y);
  }

private:
  double &at (int x, int y) { return sums_[std::size_t (y * width_ + x)]; }
  int width_;
  std::vector<double> sums_;
};

/* Root mean square error of the change from @p i to the next frame. */
double
change_error (const std::vector<Picture> &frames,
    const std::vector<Picture> &truth, std::size_t i)
{
  double sum = 0.0;
  for (int y = 0; y < truth[i].height (); y++)
    for (int x = 0; x < truth[i].width (); x++) {
      const auto change = [&] (const std::vector<Picture> &of) {
        return of[i + 1].at (x, y) - of[i].at (x, y);
      };
      const double error = change (frames) - change (truth);
      sum += error * error;
    }
  return std::sqrt (sum / (truth[i].width () * truth[i].height ()));
}

int
laplacian (const Picture &picture, int x, int y)
{
  return 4 * picture.at (x, y) - picture.at (x - 1, y) - picture.at (x + 1, y) -
         picture.at (x, y - 1) - picture.at (x, y + 1);
}

/* Adds 1 / @p frames of a frame's detail and likeness to their means. */
void
add_texture (
    const Picture &frame, const Picture &truth, double frames, FrameMean &mean)
{
  double own = 0.0, true_one = 0.0, both = 0.0;
  for (int y = 1; y + 1 < truth.height (); y++)
    for (int x = 1; x + 1 < truth.width (); x++) {
      const double a = laplacian (frame, x, y), b = laplacian (truth, x, y);
      own += a * a;
      true_one += b * b;
      both += a * b;
    }
  mean.detail += own / true_one / frames;
  mean.likeness += both / std::sqrt (own * true_one) / frames;
}

} // namespace

double
ssim (ImageView<const std::uint8_t> a, ImageView<const std::uint8_t> b)
{
  constexpr int kWindow = 7;
  constexpr double kArea = kWindow * kWindow;
  constexpr double kC1 = 0.01 * 255 * 0.01 * 255, kC2 = 0.03 * 255 * 0.03 * 255;
  const auto sums = [&] (auto value) {
    return Sums (a.width, a.height, [&] (int x, int y) {
      return value (double (a.at (x, y)), double (b.at (x, y)));
    });
  };
  Sums sum_a = sums ([] (double p, double) { return p; });
  Sums sum_b = sums ([] (double, double q) { return q; });
  Sums sum_aa = sums ([] (double p, double) { return p * p; });
  Sums sum_bb = sums ([] (double, double q) { return q * q; });
  Sums sum_ab = sums ([] (double p, double q) { return p * q; });

  double total = 0.0;
  for (int y = 0; y + kWindow <= a.height; y++) {
    for (int x = 0; x + kWindow <= a.width; x++) {
      const auto mean = [&] (
                            Sums &s) { return s.over (x, y, kWindow) / kArea; };
      const double ma = mean (sum_a), mb = mean (sum_b);
      const double unbiased = kArea / (kArea - 1);
      const double va = unbiased * (mean (sum_aa) - ma * ma);
      const double vb = unbiased * (mean (sum_bb) - mb * mb);
      const double vab = unbiased * (mean (sum_ab) - ma * mb);
      total += (2 * ma * mb + kC1) * (2 * vab + kC2) /
               ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
    }
  }
  return total / ((a.width - kWindow + 1) * (a.height - kWindow + 1));
}

double
psnr (const Picture &frame, const Picture &truth)
{
  PooledError error;
  for (int y = 0; y < truth.height (); y++)
    for (int x = 0; x < truth.width (); x++)
      error.add (frame.at (x, y), truth.at (x, y));
  return std::min (error.psnr (), 99.0);
}

FrameMean
compare (const std::vector<Picture> &frames, const std::vector<Picture> &truth)
{
  FrameMean mean;
  const auto count = double (frames.size ());
  for (std::size_t i = 0; i < frames.size (); i++) {
    mean.psnr += psnr (frames[i], truth[i]) / count;
    mean.ssim += ssim (frames[i].view (), truth[i].view ()) / count;
    add_texture (frames[i], truth[i], count, mean);
    if (i + 1 < frames.size ())
      mean.flicker += change_error (frames, truth, i) / (count - 1);
  }
  return mean;
}

std::vector<Picture>
fuse (const std::vector<Picture> &coded, const Schedule &schedule,
    const FuseOptions &options, const std::vector<Picture> &partners)
{
  auto fuser = Fuser<std::uint8_t>::make (
      schedule, coded[0].width (), coded[0].height (), options);
  if (!fuser) {
    std::cerr << fuser.error ().message << '\n';
    std::abort ();
  }
  std::vector<Picture> frames;
  const auto fuse_one = [&] {
    std::vector<Picture> slots (std::size_t (fuser->slots ()),
        Picture (coded[0].width (), coded[0].height ()));
    std::vector<ImageView<std::uint8_t>> views;
    for (Picture &slot : slots)
      views.push_back (slot.view ());
    must (fuser->fuse (views));
    std::ranges::move (slots, std::back_inserter (frames));
  };
  for (std::size_t i = 0; i < coded.size (); i++) {
    std::optional<ImageView<const std::uint8_t>> partner;
    if (!partners.empty ())
      partner = partners[i].view ();
    must (fuser->take (coded[i].view (), partner));
    if (fuser->pending () > options.lookahead)
      fuse_one ();
  }
  while (fuser->pending () > 0)
    fuse_one ();
  return frames;
}

} // namespace codedexposure::quality
