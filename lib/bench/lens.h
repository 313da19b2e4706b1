/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* From the mirrors to the camera's pixels: misalignment and blur. */
#pragma once

#include <vector>

#include "base/image.h"
#include "mapping/mapping.h"

namespace codedexposure
{

/** Where the camera stands against the mirrors; see camera_to_mirrors (). */
struct Alignment {
  double shift_x = 0.0;  ///< mirrors, to the right
  double shift_y = 0.0;  ///< mirrors, downwards
  double rotation = 0.0; ///< degrees about the centre, from x to y
  double scale = 1.0;    ///< pixels a mirror
  /** Perspective: what Z of the homography grows by from the centre to the
   * right and to the lower border; the mirrors look smaller there. */
  double tilt_x = 0.0;
  double tilt_y = 0.0;
  /** Part by which a corner of the frame looks too far out, growing with the
   * cube of the distance from the centre. */
  double distortion = 0.0;

  /** Nothing but a shift, a turn and a scale. */
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
 * So with shift_x = 1 pixel (x, y) sees mirror (x + 1, y), and the picture of
 * the mirrors stands one pixel further left.
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
 * Mirrors and pixels are squares without gaps; between them the light is
 * blurred by a Gaussian. A pixel's share of a mirror's light is the integral of
 * the one over the other, in closed form: at no blur and a shift of half a
 * mirror, half of each of two. Where camera and mirrors are turned against each
 * other, the squares are taken as parallel; their turn matters in second order
 * only. Their sizes are those at the centre all over the frame. Beyond the
 * mirrors it is dark.
 */
class Lens
{
public:
  /** @p psf_sigma: standard deviation of the Gaussian, in pixels. */
  Lens (const Alignment &alignment, double psf_sigma, int width, int height);

  /** Every pixel sees its own mirror, and that only. */
  bool ideal () const { return ideal_; }
  /** @p camera is overwritten; both of the lens's size, without overlap. */
  void image (ImageView<const float> mirrors, ImageView<float> camera);

private:
  void make_windows (double scale, double sigma);
  void resample (ImageView<const float> mirrors, ImageView<float> camera) const;
  template <int kTaps>
  void resample (ImageView<const float> mirrors, ImageView<float> camera) const;
  void blur (ImageView<const float> from, ImageView<float> to);
  void blur_beyond (ImageView<float> to);

  bool ideal_ = false;
  /* The whole lens where it is a shift and a blur; else what is left of the
   * blur after resample (). */
  LensTaps horizontal_, vertical_;
  Image<float> between_; // after the horizontal pass
  /* Pixels with those around the frame, whose light a blur brings in. */
  Image<float> wide_;
  int margin_ = 0;
  std::vector<float> padded_;

  Alignment alignment_;
  int width_, height_;
  Homography to_mirrors_;
  int taps_ = 0;               // of a window, in x and in y; 0: shift only
  std::vector<float> windows_; // taps_ weights for each fraction of a mirror
};

} // namespace codedexposure
