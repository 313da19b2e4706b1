/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The kernels of the simulated bench, which are compiled once per instruction
 * set; for this folder only. */
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace codedexposure::bench
{

/** Noise is drawn for blocks of a row's pixels; one draw of four words serves
 * two pixels, half a block apart. */
constexpr int kDraws = 32;
constexpr int kBlock = 2 * kDraws;

/** What the pixels of a block are exposed with. */
struct Exposed {
  std::uint64_t seed, frame;
  std::uint32_t block; ///< its number in the frame
  float to_electrons;  ///< of light: their mean number
  float most;          ///< electrons that a pixel holds
  float read_noise;    ///< electrons rms
  float to_number;     ///< DN for an electron
};

struct Kernels {
  std::string_view name;
  /** DN of the electrons of kBlock pixels, with shot noise and read noise; see
   * Sensor::read_out (). */
  void (*expose) (const Exposed &exposed, const float *light, float *numbers);
};

/** Those that this machine can run, fastest first. */
std::span<const Kernels> supported_kernels ();

} // namespace codedexposure::bench
