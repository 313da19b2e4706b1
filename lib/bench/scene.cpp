/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "bench/scene.h"

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

} // namespace codedexposure
