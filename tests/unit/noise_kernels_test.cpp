/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Kernels of the sensor's noise: every instruction set of the processor,
 * compared bit for bit with the same code, whose loops are compiled as they
 * are, and its random words with those of Philox. */
#include <array>
#include <bit>
#include <cstdint>
#include <random>
#include <string>

#include <gtest/gtest.h>

#define CODEDEXPOSURE_TARGET scalar_reference
#define CODEDEXPOSURE_VECTOR_BYTES 16
#include "bench/noise_kernel.h"

namespace
{

using namespace codedexposure;
using bench::kBlock;
using Block = std::array<float, kBlock>;

/** Of pixels that are dark, have few electrons, many, and both. */
Block
light_with (float most, std::uint32_t seed)
{
  std::mt19937 random{seed};
  Block light;
  for (float &pixel : light)
    pixel = random () % 8 == 0 ? 0.0f : most * float (random ()) * 0x1p-32f;
  return light;
}

std::array<std::uint32_t, kBlock>
bits_of (const Block &numbers)
{
  return std::bit_cast<std::array<std::uint32_t, kBlock>> (numbers);
}

TEST (NoiseKernels, ReferenceDrawsTheWordsOfPhilox)
{
  const bench::Exposed exposed{
      0x123456789abcdef0u, 0xfedcba9876543210u, 77, 1, 1, 1, 1};
  scalar_reference::Draws draws;
  scalar_reference::draw (exposed, scalar_reference::kFewElectrons, draws);
  for (std::uint32_t i = 0; i < bench::kDraws; i++) {
    const Philox::Words expected =
        Philox::draw ({77 * bench::kDraws + i, scalar_reference::kFewElectrons,
                          0x76543210u, 0xfedcba98u},
            {0x9abcdef0u, 0x12345678u});
    for (std::size_t word = 0; word < 4; word++)
      ASSERT_EQ (draws.word[word][i], expected[word]) << i << ' ' << word;
  }
}

TEST (NoiseKernels, AreBitIdenticalToTheReference)
{
  for (const bench::Kernels &kernels : bench::supported_kernels ())
    for (const float most : {2.0f, 15.9f, 40.0f, 3000.0f, 70000.0f})
      for (std::uint32_t block = 0; block < 50; block++) {
        const bench::Exposed exposed{0x123456789abcdef0u + block,
            0xfedcba9876u * block, block, 0.7f, 0.6f * most, 2.5f, 0.3f};
        const Block light = light_with (most, block);
        Block expected, got;
        scalar_reference::expose (exposed, light.data (), expected.data ());
        kernels.expose (exposed, light.data (), got.data ());
        ASSERT_EQ (bits_of (got), bits_of (expected))
            << kernels.name << ", up to " << most << " electrons, block "
            << block;
      }
}

} // namespace
