/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The only source that uses OpenCV. */
#include "doctor/chessboard.h"

#include <algorithm>

#ifdef HAVE_OPENCV
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#endif

namespace codedexposure
{

bool
Chessboard::on (int x, int y) const
{
  const int dx = x - first.x, dy = y - first.y;
  const bool inside =
      dx >= 0 && dy >= 0 && dx < columns * square && dy < rows * square;
  return !inside || (dx / square + dy / square) % 2 != 0;
}

Position
Chessboard::corner (int i, int j) const
{
  return {first.x + (i + 1) * square - 0.5, first.y + (j + 1) * square - 0.5};
}

StillMask
Chessboard::mask () const
{
  return {.name = "chessboard",
      .on = [board = *this] (int x, int y) { return board.on (x, y); }};
}

#ifdef HAVE_OPENCV

bool
has_chessboard ()
{
  return true;
}

Result<std::vector<Position>>
find_corners (ImageView<const std::uint8_t> picture, int columns, int rows)
try {
  const cv::Mat mat (picture.height, picture.width, CV_8UC1,
      const_cast<std::uint8_t *> (picture.data), std::size_t (picture.stride));
  std::vector<cv::Point2f> corners;
  const bool found = cv::findChessboardCornersSB (mat,
      cv::Size (columns - 1, rows - 1), corners,
      cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY |
          cv::CALIB_CB_NORMALIZE_IMAGE);
  if (!found)
    return Error{"the chessboard is not seen as a whole"};
  /* Half the side of the window that refines a corner, pixels. */
  const int half = std::clamp (
      std::min (picture.width / columns, picture.height / rows) / 3, 2, 8);
  cv::cornerSubPix (mat, corners, cv::Size (half, half), cv::Size (-1, -1),
      {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-4});
  std::vector<Position> places;
  for (const cv::Point2f &corner : corners)
    places.push_back ({double (corner.x), double (corner.y)});
  return places;
} catch (const cv::Exception &failure) {
  return Error{"OpenCV: " + std::string (failure.what ())};
}

std::vector<PlacePair>
without_outliers (const std::vector<PlacePair> &pairs, double tolerance)
try {
  std::vector<cv::Point2d> from, to;
  for (const PlacePair &pair : pairs) {
    from.emplace_back (pair.pixel.x, pair.pixel.y);
    to.emplace_back (pair.mirror.x, pair.mirror.y);
  }
  std::vector<std::uint8_t> used;
  cv::findHomography (from, to, cv::RANSAC, tolerance, used);
  std::vector<PlacePair> kept;
  for (std::size_t i = 0; i < pairs.size () && i < used.size (); i++)
    if (used[i] != 0)
      kept.push_back (pairs[i]);
  return kept;
} catch (const cv::Exception &) {
  return {};
}

#else

bool
has_chessboard ()
{
  return false;
}

Result<std::vector<Position>>
find_corners (ImageView<const std::uint8_t>, int, int)
{
  return Error{"this build has no OpenCV; install libopencv-calib3d-dev and "
               "build again",
      ErrorCode::unsupported};
}

std::vector<PlacePair>
without_outliers (const std::vector<PlacePair> &pairs, double)
{
  return pairs;
}

#endif

} // namespace codedexposure
