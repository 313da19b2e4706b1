/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Which mirror each camera pixel looks at. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "mapping/homography.h"

namespace codedexposure
{

/** What is added to the homography, in mirrors, on a grid of camera places:
 * node (i, j) stands at (i (w - 1) / (columns - 1), j (h - 1) / (rows - 1)), so
 * that the grid's corners are those of the frame. Between nodes it is bilinear,
 * beyond the frame that of the border. */
struct Displacement {
  int columns = 0;
  int rows = 0;
  std::vector<double> x; ///< columns x rows, row after row
  std::vector<double> y;

  bool operator== (const Displacement &) const = default;
};

/** How a camera stands against the mirrors, at the centre of its frame. */
struct Pose {
  /** Mirrors from the centre of the array to where the centre of the camera
   * looks, to the right and downwards. */
  double shift_x = 0.0;
  double shift_y = 0.0;
  double rotation = 0.0;      ///< degrees, from x to y, clockwise on a screen
  double magnification = 1.0; ///< pixels a mirror
  /** Part by which the mapping is no similarity there: ratio of the larger to
   * the smaller of the two magnifications, less 1. */
  double stretch = 0.0;
  bool flipped = false; ///< the image is mirrored
};

/**
 * Camera pixel to mirror coordinates: a homography and, where that does not
 * suffice, a displacement on top of it.
 *
 *   (X, Y, Z) = H (x, y, 1), mirror = (X / Z, Y / Z) + displacement (x, y)
 *
 * An immutable value: make () is the only way in.
 */
class Mapping
{
public:
  static constexpr int kParameters = 8;
  /** Bounds on sizes, on nodes along one side of the grid, and on the JSON
   * form in bytes. */
  static constexpr int kMaxSize = 16384;
  static constexpr int kMaxNodes = 257;
  static constexpr std::size_t kMaxJsonSize = std::size_t (1) << 23;
  static constexpr double kMaxPsfSigma = 16.0;
  /** Bound on a displacement, in mirrors, and on a number of a homography whose
   * Z is 1 at the centre of the frame: places stay finite. */
  static constexpr double kMaxNumber = 1e9;

  /** Symmetric, row by row, in mirrors squared: of the first eight numbers of
   * centred (). */
  using Covariance = std::array<double, kParameters * kParameters>;

  struct Parts {
    Extent camera;
    Extent mirrors;
    /** Scaled to any number but 0. */
    Homography homography = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    std::optional<Covariance> covariance = {};
    std::optional<Displacement> displacement = {};
    /** Blur between mirrors and pixels: standard deviation of a Gaussian, in
     * pixels; 0 where it is not known. */
    double psf_sigma = 0.0;

    bool operator== (const Parts &) const = default;
  };

  /** Pixel (x, y) looks at mirror (x, y). */
  explicit Mapping (Extent both);
  /** Error when a size or a number is out of its range or not finite, the
   * homography has no inverse or its horizon crosses the frame, a variance is
   * negative, a blur is out of its range, or a grid has not as many numbers as
   * nodes. */
  static Result<Mapping> make (Parts parts);

  /** The strict, versioned text form: see docs/formats.md. */
  static Result<Mapping> from_json (std::string_view json);
  /** One line; equal mappings have equal texts. */
  std::string to_json () const;
  /** from_json () of a file. */
  static Result<Mapping> load (const std::string &path);
  /** to_json () into a file, which gets its name when it is complete. */
  Result<void> save (const std::string &path) const;

  Extent camera () const { return parts_.camera; }
  Extent mirrors () const { return parts_.mirrors; }
  /** Scaled so that the centre of the frame has Z = 1. */
  const Homography &homography () const { return parts_.homography; }
  const std::optional<Covariance> &covariance () const
  {
    return parts_.covariance;
  }
  const std::optional<Displacement> &displacement () const
  {
    return parts_.displacement;
  }

  double psf_sigma () const { return parts_.psf_sigma; }

  /** Where camera place @p x, @p y looks at, among the mirrors. */
  Position mirror_at (double x, double y) const;
  /** The camera place that looks at @p mirror; the inverse of mirror_at () to
   * 1e-9 pixels. */
  Position camera_at (Position mirror) const;
  /** camera_at () of mirrors (0, @p y), (1, @p y) ..., in less time: to 1e-3
   * pixels, where the displacement changes by less than 0.1 a pixel. */
  void camera_row (int y, std::span<Position> seen) const;
  /** d mirror / d camera: xx, xy, yx, yy. */
  std::array<double, 4> slope_at (double x, double y) const;
  /** Whether that place is a mirror of the array, to half a mirror. */
  bool covers (Position mirror) const;
  /** Whether that camera place is in the frame, to half a pixel. */
  bool in_frame (Position place) const;

  /** The homography on ((x - cx) / r, (y - cy) / r, 1), with (cx, cy) the
   * centre of the frame, r half its longer side, less one, and the last number
   * 1. These are the parameters of the covariance. */
  Homography centred () const;
  static Result<Mapping> from_centred (
      Extent camera, Extent mirrors, const Homography &centred);

  Pose pose () const;
  /** Standard deviations of pose (), of its numbers in the same units; zero
   * without a covariance. */
  Pose pose_sigma () const;

  /** Of the pixels of the frame, without looking at others: pixels and mirrors
   * are one to one to within @p tolerance mirrors. */
  bool one_to_one (double tolerance = 0.05) const;

  bool operator== (const Mapping &other) const
  {
    return parts_ == other.parts_;
  }

private:
  explicit Mapping (Parts parts) : parts_ (std::move (parts)) {}
  Position displaced (double x, double y) const;

  Parts parts_;
};

} // namespace codedexposure
