/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Drawing in grey: fringes, arrows and text of the alignment. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "calibrate/fringes.h"
#include "calibrate/stage.h"

namespace codedexposure
{

/** The content of a panel. */
struct PanelContent {
  std::string title = {};
  std::string headline = {}; ///< to be read from afar; empty: none
  std::vector<std::string> lines = {};
  std::optional<double> progress = {};            ///< 0..1
  std::optional<StageCorrection> correction = {}; ///< arrows
  StageOptions stage = {};                        ///< that they are of
  const Fringes *fringes_x = nullptr;             ///< null: none
  const Fringes *fringes_y = nullptr;
};

/** A drawing of the size of a picture, and the parts of it that hide that. */
struct Panel {
  Image<std::uint8_t> grey;
  std::vector<Rect> opaque;
};

/** @p size  of the picture, 160x120 at least. */
Panel draw_panel (Extent size, const PanelContent &content);

/** Copies the opaque parts to @p out, of the panel's size, 255 becoming the
 * largest value of @p bits bits; 0: of the pixel type. */
template <typename Pixel>
void lay_over (const Panel &panel, ImageView<Pixel> out, int bits = 0);

} // namespace codedexposure
