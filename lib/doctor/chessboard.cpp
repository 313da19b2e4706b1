/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The only source that uses OpenCV. */
#include "doctor/chessboard.h"

#include <algorithm>
#include <cmath>
#include <optional>

#ifdef HAVE_OPENCV
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
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

namespace
{

/* A line: place = at + slope * along, by least squares. */
class EdgeLine
{
public:
  void add (double along, double place)
  {
    n_++;
    s_ += along;
    ss_ += along * along;
    p_ += place;
    sp_ += along * place;
  }
  bool known () const { return n_ >= 4.0 && n_ * ss_ - s_ * s_ > 0.0; }
  double slope () const { return (n_ * sp_ - s_ * p_) / (n_ * ss_ - s_ * s_); }
  double at () const { return (p_ - slope () * s_) / n_; }

private:
  double n_ = 0.0, s_ = 0.0, ss_ = 0.0, p_ = 0.0, sp_ = 0.0;
};

/* Where an edge crosses @count values, from the middle of the first one on, in
 * pixels. Pixels integrate light without gaps: the sum tells it exactly. */
template <typename Light>
std::optional<double>
edge_in (int count, Light light)
{
  const double first = 0.5 * (light (0) + light (1));
  const double last = 0.5 * (light (count - 1) + light (count - 2));
  if (std::abs (first - last) < 0.3)
    return std::nullopt;
  double sum = 0.0;
  for (int i = 0; i < count; i++)
    sum += light (i) - last;
  return sum / (first - last) - 0.5;
}

} // namespace

Position
refine_corner (const Image<float> &light, Position corner, double side)
{
  constexpr int kNear = 2; // where both edges mix
  const int half = std::clamp (int (0.5 * side) - 2, kNear + 1, 10);
  const int cx = int (std::lround (corner.x));
  const int cy = int (std::lround (corner.y));
  if (cx < half || cy < half || cx >= light.width () - half ||
      cy >= light.height () - half)
    return corner;
  EdgeLine upright, level; // x over y, and y over x, from (cx, cy) on
  for (int d = -half; d <= half; d++) {
    if (std::abs (d) < kNear)
      continue;
    if (const auto x = edge_in (2 * half + 1,
            [&] (int i) { return double (light.at (cx - half + i, cy + d)); }))
      upright.add (d, *x - half);
    if (const auto y = edge_in (2 * half + 1,
            [&] (int i) { return double (light.at (cx + d, cy - half + i)); }))
      level.add (d, *y - half);
  }
  if (!upright.known () || !level.known ())
    return corner;
  const double x = (upright.at () + upright.slope () * level.at ()) /
                   (1.0 - upright.slope () * level.slope ());
  const double y = level.at () + level.slope () * x;
  const bool near = std::hypot (cx + x - corner.x, cy + y - corner.y) < 1.5;
  return near ? Position{cx + x, cy + y} : corner;
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
