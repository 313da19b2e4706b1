/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light that a pixel gets from mirrors through a blur. */
#pragma once

namespace codedexposure
{

/** An edge from dark to light, 0 to 1, and its derivatives. */
struct EdgeLight {
  double light;
  double slope; ///< d light / d place, 1 / mirrors
  double blur;  ///< d light / d variance of the blur, 1 / mirrors^2
};

/** The light of a square pixel without gaps whose centre is @p x mirrors beyond
 * the edge. @p side of the pixel and @p sigma of the Gaussian blur are in
 * mirrors; a smaller sigma than 0.03 counts as 0.03. */
EdgeLight edge_light (double x, double side, double sigma);

/** Part of a pixel's light that it gets from a mirror @p distance mirrors away
 * along one axis; @p side and @p sigma as above. */
double mirror_share (double distance, double side, double sigma);

} // namespace codedexposure
