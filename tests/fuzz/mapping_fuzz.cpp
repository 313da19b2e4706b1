/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Any bytes as the JSON form of a mapping: what is accepted has finite places
 * everywhere in its frame. */
#include <cmath>

#include "fuzz_check.h"
#include "mapping/mapping.h"

using namespace codedexposure;
using namespace codedexposure::test;

extern "C" int
LLVMFuzzerTestOneInput (const std::uint8_t *data, std::size_t size)
{
  const std::string_view text = text_of (data, size);
  const auto mapping = Mapping::from_json (text);
  check_json (mapping);
  if (!mapping)
    return 0;
  const Extent camera = mapping->camera ();
  for (const double part : {0.0, 0.3, 1.0}) {
    const Position at = mapping->mirror_at (
        part * (camera.width - 1), part * (camera.height - 1));
    require (std::isfinite (at.x) && std::isfinite (at.y),
        "a pixel looks at no place", text);
    const Position back = mapping->camera_at (at);
    require (!std::isnan (back.x) && !std::isnan (back.y),
        "a mirror is seen at no place", text);
  }
  (void)mapping->pose ();
  (void)mapping->pose_sigma ();
  return 0;
}
