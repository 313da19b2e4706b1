/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The light in front of the bench, one picture for each slot. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/image.h"

namespace codedexposure::quality
{

using Picture = Image<std::uint8_t>;

/** The picture of a perfect fast camera, one linear frame for each slot. */
struct Scene {
  std::string name;
  std::vector<Picture> frames;
};

/**
 * Edges and texture that move in known ways, drawn with the exact coverage of
 * each pixel's edge: a still background of two gratings, a bar (3 px a slot to
 * the right), a disc (2 px right and 1 px down a slot), and a patch of fine
 * stripes that drifts by a quarter of its period a slot.
 */
Scene synthetic_scene (int width, int height, int frames);

/**
 * Textured discs of all sizes, one over the other, as things lie in pictures:
 * their radii have the density r^-3. Half of them move with the camera, the
 * others past it, at speeds spread evenly on a logarithmic scale from 0.03 to
 * 2.5 px a slot.
 */
Scene leaves_scene (unsigned seed, int size, int frames);

/** One static picture for that many slots. */
Scene still_scene (std::string name, const Picture &picture, int frames);

/** The same grey everywhere, always. */
Scene flat_scene (int width, int height, int frames, std::uint8_t level);

} // namespace codedexposure::quality
