/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The instruction sets that the kernels were compiled for. */
#pragma once

#include <span>
#include <string_view>

#include "extract/kernels.h"

namespace codedexposure
{

struct Target {
  std::string_view name;
  const Kernels<std::uint8_t> *u8;
  const Kernels<std::uint16_t> *u16;

  template <typename Pixel>
  const Kernels<Pixel> &kernels () const
  {
    if constexpr (sizeof (Pixel) == 1)
      return *u8;
    else
      return *u16;
  }
};

/** Those that this processor can run, widest first; found out once. None on a
 * processor without SSE4.1. */
std::span<const Target> supported_targets ();

} // namespace codedexposure
