/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Drawn scenes that move as fast as those of the paper's figures. */
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
 * Light in front of the bench as a function of time, and of nothing else: the
 * same time gives the same picture, in any order. Lengths go with the height of
 * the picture, so that every size shows the same scene.
 */
class SyntheticScene
{
public:
  /** @p size: any. */
  static std::unique_ptr<SyntheticScene> make (SceneKind kind, Extent size);
  virtual ~SyntheticScene () = default;

  /**
   * @p seconds  since the beginning of the scene.
   * @p light    of the size that was given, fully overwritten: 0 is no light,
   *             1 the brightest spot that the scene ever has; linear.
   */
  virtual void draw (double seconds, ImageView<float> light) = 0;
};

} // namespace codedexposure
