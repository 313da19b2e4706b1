/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From the mirrors to the camera's pixels: misalignment and blur. */
#pragma once

#include <optional>
#include <vector>

#include "base/image.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** Pose of the camera relative to the mirrors; see camera_to_mirrors (). */
struct Alignment {
  double shift_x = 0.0;  ///< mirrors, to the right
  double shift_y = 0.0;  ///< mirrors, downwards
  double rotation = 0.0; ///< degrees about the centre, from x to y
  double scale = 1.0;    ///< pixels a mirror
  /** Perspective: how much Z of the homography grows from the centre to the
   * right and to the lower border, where mirrors look smaller. */
  double tilt_x = 0.0;
  double tilt_y = 0.0;
  /** Relative radial shift of a corner of the frame; it grows with the cube of
   * the distance from the centre. */
  double distortion = 0.0;

  /** Only shift, rotation and scale. */
  bool affine () const
  {
    return tilt_x == 0.0 && tilt_y == 0.0 && distortion == 0.0;
  }
  bool operator== (const Alignment &) const = default;
};

/**
 * The mapping of a bench of @p width by @p height mirrors and as many pixels:
 * camera pixel p looks at mirror c + shift + R (p - c) / scale, where c = ((w -
 * 1) / 2, (h - 1) / 2) is the centre of both, centres of pixels and mirrors
 * have whole coordinates, and R turns x towards y, clockwise on a screen.
 *
 * With shift_x = 1, pixel (x, y) sees mirror (x + 1, y): the image of the
 * mirrors moves one pixel to the left.
 */
Homography camera_to_mirrors (
    const Alignment &alignment, int width, int height);

/**
 * The same with tilt and distortion: from q = (p - c) (1 + distortion |p - c|^2
 * / |c|^2), the mirror c + shift + (R q / scale) / (1 + tilt_x q_x / c_x +
 * tilt_y q_y / c_y).
 */
Position mirror_seen (
    const Alignment &alignment, int width, int height, Position pixel);

/** Weights of the neighbours at offsets first, first + 1, ... */
struct LensTaps {
  int first = 0;
  std::vector<float> weights = {1.0f};

  bool identity () const { return first == 0 && weights.size () == 1; }
};

/**
 * The light that each pixel gets from the mirrors.
 *
 * Mirrors and pixels are squares without gaps; the light between them is
 * blurred by a Gaussian. A pixel's part of a mirror's light is the integral
 * over their overlap, in closed form: without blur and with a shift of half a
 * mirror, half of each of two. If the camera is rotated, the squares are still
 * taken as parallel, because the rotation has an effect of second order only.
 * Their sizes are those at the centre of the frame. It is dark beyond the
 * mirrors.
 */
class Lens
{
public:
  /** @p psf_sigma: standard deviation of the Gaussian, in pixels. @p mapping,
   * if there is one, takes the place of the alignment; @p first is the mirror
   * at the corner of the picture of the mirrors. */
  Lens (const Alignment &alignment, double psf_sigma, int width, int height,
      const std::optional<Mapping> &mapping = {}, Offset first = {});

  /** Every pixel sees only its own mirror. */
  bool ideal () const { return ideal_; }
  /** @p camera is overwritten; both of the lens's size, without overlap. With a
   * mapping, the picture of the mirrors may have another size. */
  void image (ImageView<const float> mirrors, ImageView<float> camera);

private:
  Position place_of (int x, int y) const;
  void make_windows (double scale, double sigma);
  void resample (ImageView<const float> mirrors, ImageView<float> camera) const;
  template <int kTaps>
  void resample (ImageView<const float> mirrors, ImageView<float> camera) const;
  void blur (ImageView<const float> from, ImageView<float> to, int margin);

  bool ideal_ = false;
  /* The whole lens if it is a shift and a blur; else the blur that resample ()
   * leaves. */
  LensTaps horizontal_, vertical_;
  Image<float> between_; // after the horizontal pass
  /* The frame with a margin, from which a blur brings light in. */
  Image<float> wide_;
  int margin_ = 0;
  std::vector<float> padded_;

  Alignment alignment_;
  int width_, height_;
  Homography to_mirrors_;
  std::optional<Mapping> mapping_;
  Offset first_;
  int taps_ = 0;               // of a window, in x and in y; 0: shift only
  std::vector<float> windows_; // taps_ weights for each fraction of a mirror
};

} // namespace codedexposure
