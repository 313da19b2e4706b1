/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Synthetic scenes as fast as those of the paper's figures. */
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"

namespace codedexposure
{

enum class SceneKind {
  kCandle,   ///< a candle that flickers at 11 Hz (paper, Fig. 9)
  kBlownOut, ///< the same, blown out after half a second (paper, Fig. 10)
  kPour,     ///< dark liquid poured into clear one, and mixing (paper, Fig. 11)
};

/**
 * Light in front of the bench as a function of time only: the same time gives
 * the same picture, in any order. Lengths are relative to the height of the
 * picture, so that every size shows the same scene.
 */
class SyntheticScene
{
public:
  /** @p size: any. */
  static std::unique_ptr<SyntheticScene> make (SceneKind kind, Extent size);
  virtual ~SyntheticScene () = default;

  /**
   * @p seconds  since the beginning of the scene.
   * @p light    of the given size, fully overwritten: linear, from 0 for no
   *             light to 1 for the brightest spot of the scene at any time.
   */
  virtual void draw (double seconds, ImageView<float> light) = 0;
};

/** Light from 0 to 1 as pixels of the whole range of their type, rounded. */
template <typename Pixel>
void expose (ImageView<const float> light, ImageView<Pixel> out);

} // namespace codedexposure
