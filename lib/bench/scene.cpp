/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/scene.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "bench/scene_parts.h"

namespace codedexposure
{

std::unique_ptr<SyntheticScene>
SyntheticScene::make (SceneKind kind, Extent size)
{
  switch (kind) {
  case SceneKind::kBlownOut:
    return make_candle (size, true);
  case SceneKind::kPour:
    return make_pour (size);
  default:
    return make_candle (size, false);
  }
}

template <typename Pixel>
void
expose (ImageView<const float> light, ImageView<Pixel> out)
{
  constexpr float kWhite = std::numeric_limits<Pixel>::max ();
  for (int y = 0; y < out.height; y++)
    std::transform (
        light.row (y), light.row (y) + out.width, out.row (y), [] (float l) {
          return Pixel (std::int32_t (
              std::min (std::max (l, 0.0f), 1.0f) * kWhite + 0.5f));
        });
}

template void expose (ImageView<const float>, ImageView<std::uint8_t>);
template void expose (ImageView<const float>, ImageView<std::uint16_t>);

} // namespace codedexposure
