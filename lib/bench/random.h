/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Random words as a function of a counter and a key. */
#pragma once

#include <array>
#include <cstdint>

namespace codedexposure
{

/**
 * Philox4x32-10: 128 random bits for every value of a 128-bit counter, a
 * different sequence for every key. Without state, so that pixels may be drawn
 * in any order and by any thread.
 *
 * Source: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1,
 * 2, 3", SC 2011.
 */
struct Philox {
  using Words = std::array<std::uint32_t, 4>;
  using Key = std::array<std::uint32_t, 2>;

  static constexpr int kRounds = 10;
  static constexpr std::uint32_t kFirst = 0xD2511F53u, kSecond = 0xCD9E8D57u;
  static constexpr std::uint32_t kFirstStep = 0x9E3779B9u,
                                 kSecondStep = 0xBB67AE85u;

  static constexpr Words draw (Words counter, Key key)
  {
    for (int round = 0; round < kRounds; round++) {
      const std::uint64_t a = std::uint64_t (kFirst) * counter[0];
      const std::uint64_t b = std::uint64_t (kSecond) * counter[2];
      counter = {std::uint32_t (b >> 32) ^ counter[1] ^ key[0],
          std::uint32_t (b), std::uint32_t (a >> 32) ^ counter[3] ^ key[1],
          std::uint32_t (a)};
      key[0] += kFirstStep;
      key[1] += kSecondStep;
    }
    return counter;
  }
};

} // namespace codedexposure
