/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "tools/board_kinds.h"

#include <array>

#include "base/text.h"

namespace codedexposure::tool
{

Result<DmdInfo>
find_kind (const std::string &name)
{
  struct Kind {
    const char *name;
    Extent size;
    Array array;
    int masks;
    Nanoseconds minimum_active, minimum_switching;
  };
  static constexpr std::array<Kind, 4> kKinds{{
      {"dlp3000", {608, 684}, Array::diamond, 96, 250'000, 250'000},
      {"dlp4500", {912, 1140}, Array::diamond, 48, 235'000, 0},
      {"dlp6500", {1920, 1080}, Array::orthogonal, 400, 105'000, 0},
      {"dlp9000", {2560, 1600}, Array::orthogonal, 400, 105'000, 0},
  }};
  for (const Kind &kind : kKinds)
    if (name == kind.name)
      return DmdInfo{.name = kind.name,
          .size = kind.size,
          .minimum_active = kind.minimum_active,
          .minimum_switching = kind.minimum_switching,
          .resident_masks = kind.masks,
          .array = kind.array};
  return Error{"unknown DMD " + in_quotes (name) +
               "; use dlp3000, dlp4500, dlp6500 or dlp9000"};
}

} // namespace codedexposure::tool
