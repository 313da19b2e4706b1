/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* OpenCV's methods to measure the pose of a camera, on the same bench. */
#include "moire_rivals.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#ifdef HAVE_OPENCV
#include <chrono>
#include <random>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#endif

namespace codedexposure::quality
{

#ifdef HAVE_OPENCV

namespace
{

constexpr int kBlock = 4;   // of the random picture, mirrors
constexpr int kSquare = 24; // of the chessboard, mirrors

/* Error of the start value of a method. */
constexpr double kShiftOff = 0.3;
constexpr double kSlopeOff = 1e-3;

Image<std::uint8_t>
random_blocks ()
{
  std::mt19937 random (1);
  Image<std::uint8_t> mirrors (kMoireSize.width, kMoireSize.height);
  for (int y = 0; y < kMoireSize.height; y += kBlock)
    for (int x = 0; x < kMoireSize.width; x += kBlock) {
      const auto on = std::uint8_t (random () & 1);
      for (int j = y; j < y + kBlock; j++)
        for (int i = x; i < x + kBlock; i++)
          mirrors.at (i, j) = on;
    }
  return mirrors;
}

Image<std::uint8_t>
chessboard ()
{
  Image<std::uint8_t> mirrors (kMoireSize.width, kMoireSize.height);
  for (int y = 0; y < kMoireSize.height; y++)
    for (int x = 0; x < kMoireSize.width; x++)
      mirrors.at (x, y) = (x / kSquare + y / kSquare) & 1;
  return mirrors;
}

cv::Mat
as_floats (const Image<std::uint8_t> &image)
{
  cv::Mat mat (image.height (), image.width (), CV_8UC1,
      const_cast<std::uint8_t *> (image.view ().data));
  cv::Mat floats;
  mat.convertTo (floats, CV_32F);
  return floats;
}

/* Camera to mirrors, as 2 x 3. */
cv::Matx23d
truth_of (const Alignment &alignment)
{
  const Homography t =
      camera_to_mirrors (alignment, kMoireSize.width, kMoireSize.height);
  return {t[0], t[1], t[2], t[3], t[4], t[5]};
}

/* The start value of a method. */
cv::Matx23d
guess_of (const MoireTrial &trial)
{
  std::mt19937_64 random (trial.seed);
  std::normal_distribution<double> off;
  cv::Matx23d guess = truth_of (trial.alignment);
  const double cx = 0.5 * (kMoireSize.width - 1);
  const double cy = 0.5 * (kMoireSize.height - 1);
  for (int row = 0; row < 2; row++) {
    const double a = kSlopeOff * off (random), b = kSlopeOff * off (random);
    guess (row, 0) += a;
    guess (row, 1) += b;
    guess (row, 2) += kShiftOff * off (random) - a * cx - b * cy;
  }
  return guess;
}

double
field_of (const cv::Matx23d &m, const MoireTrial &trial)
{
  return deviation_of (
      [&] (double x, double y) {
        return Position{m (0, 0) * x + m (0, 1) * y + m (0, 2),
            m (1, 0) * x + m (1, 1) * y + m (1, 2)};
      },
      trial.alignment)
      .field;
}

double
phase_correlation (const MoireTrial &trial)
{
  const auto picture = random_blocks ();
  const auto frame = moire_frame (trial, picture.view (), 100);
  cv::Mat window;
  cv::createHanningWindow (
      window, {kMoireSize.width, kMoireSize.height}, CV_32F);
  const cv::Point2d shift =
      cv::phaseCorrelate (as_floats (picture), as_floats (frame), window);
  return field_of ({1, 0, -shift.x, 0, 1, -shift.y}, trial);
}

double
ecc (const MoireTrial &trial)
{
  const auto picture = random_blocks ();
  const auto frame = moire_frame (trial, picture.view (), 100);
  /* The inverse: from positions in the picture to those in the frame. */
  cv::Mat warp, back;
  cv::invertAffineTransform (cv::Mat (guess_of (trial)), back);
  back.convertTo (warp, CV_32F);
  const cv::TermCriteria stop (
      cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-8);
  try {
    cv::findTransformECC (as_floats (picture), as_floats (frame), warp,
        cv::MOTION_AFFINE, stop, cv::noArray (), 1);
  } catch (const cv::Exception &) {
    return NAN;
  }
  cv::Mat found;
  cv::invertAffineTransform (warp, found);
  found.convertTo (back, CV_64F);
  return field_of (cv::Matx23d (back.ptr<double> ()), trial);
}

double
chessboard_corners (const MoireTrial &trial)
{
  const auto picture = chessboard ();
  const auto frame = moire_frame (trial, picture.view (), 101);
  cv::Mat back;
  cv::invertAffineTransform (cv::Mat (guess_of (trial)), back);
  const cv::Matx23d to_camera (back.ptr<double> ());
  std::vector<cv::Point2f> corners;
  std::vector<cv::Point2d> mirrors;
  for (int y = kSquare; y < kMoireSize.height; y += kSquare)
    for (int x = kSquare; x < kMoireSize.width; x += kSquare) {
      const cv::Vec3d at (x - 0.5, y - 0.5, 1.0);
      const cv::Vec2d p = to_camera * at;
      if (p[0] < 20 || p[1] < 20 || p[0] > kMoireSize.width - 21 ||
          p[1] > kMoireSize.height - 21)
        continue;
      corners.emplace_back (float (p[0]), float (p[1]));
      mirrors.emplace_back (at[0], at[1]);
    }
  cv::cornerSubPix (as_floats (frame), corners, {7, 7}, {-1, -1},
      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 60, 1e-4});
  cv::Mat design (int (corners.size ()), 3, CV_64F);
  cv::Mat wanted (int (corners.size ()), 2, CV_64F), solution;
  for (int i = 0; i < design.rows; i++) {
    design.at<double> (i, 0) = double (corners[std::size_t (i)].x);
    design.at<double> (i, 1) = double (corners[std::size_t (i)].y);
    design.at<double> (i, 2) = 1.0;
    wanted.at<double> (i, 0) = mirrors[std::size_t (i)].x;
    wanted.at<double> (i, 1) = mirrors[std::size_t (i)].y;
  }
  cv::solve (design, wanted, solution, cv::DECOMP_SVD);
  cv::Mat rows = solution.t ();
  return field_of (cv::Matx23d (rows.ptr<double> ()), trial);
}

void
print_rival (const char *name, double (*method) (const MoireTrial &),
    const std::vector<MoireTrial> &trials)
{
  double squares = 0.0, most = 0.0, seconds = 0.0;
  int failed = 0;
  for (const MoireTrial &trial : trials) {
    const auto start = std::chrono::steady_clock::now ();
    const double field = method (trial);
    seconds += std::chrono::duration<double> (
        std::chrono::steady_clock::now () - start)
                   .count ();
    if (!std::isfinite (field)) {
      failed++;
      continue;
    }
    squares += field * field;
    most = std::max (most, field);
  }
  const double n = double (trials.size ());
  std::printf ("  %-44s rms %.1e px, largest %.1e px, %d failed, %.2f s\n",
      name, std::sqrt (squares / std::max (1.0, n - failed)), most, failed,
      seconds / n);
}

double
calibration (const MoireTrial &trial)
{
  const MoireOutcome outcome = run_moire (trial);
  return outcome.failure.empty () ? outcome.error.field : NAN;
}

} // namespace

void
print_rivals (const std::vector<MoireTrial> &trials)
{
  if (trials.empty ())
    return;
  cv::setNumThreads (1);
  std::printf ("the same benches, %zu of them, field error by method (time "
               "with rendering):\n",
      trials.size ());
  print_rival ("calibration, 54 frames", calibration, trials);
  print_rival (
      "phase correlation of random blocks, 1 frame", phase_correlation, trials);
  print_rival ("ECC of random blocks from nearby, 1 frame", ecc, trials);
  print_rival (
      "chessboard corners from nearby, 1 frame", chessboard_corners, trials);
}

#else

void
print_rivals (const std::vector<MoireTrial> &trials)
{
  if (!trials.empty ())
    std::puts ("built without OpenCV: its methods are not measured");
}

#endif

} // namespace codedexposure::quality
