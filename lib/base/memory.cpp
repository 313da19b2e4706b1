/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "base/memory.h"

#include <algorithm>
#include <fstream>
#include <string>

namespace codedexposure
{

std::uint64_t
room_in_memory ()
{
  constexpr std::uint64_t kMost = 4'000'000'000, kUnknown = 1'000'000'000;
  std::ifstream file ("/proc/meminfo");
  std::string name, unit;
  for (std::uint64_t kib = 0; file >> name >> kib;) {
    if (name == "MemAvailable:")
      return std::min (kMost, kib * 256);
    std::getline (file, unit);
  }
  return kUnknown;
}

} // namespace codedexposure
