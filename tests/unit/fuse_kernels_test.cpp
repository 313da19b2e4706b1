/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Kernels of fusion: every instruction set of the processor, compared with the
 * reference. */
#include <vector>

#include <gtest/gtest.h>

#include "fuse/dct.h"
#include "fuse/kernels.h"
#include "fuse_reference.h"
#include "random_numbers.h"

namespace
{

using namespace codedexposure;
using test::kReference;
using test::random_numbers;

/* The outputs of a kernel for @row. */
std::vector<std::vector<float>>
outputs_of (const fuse::Kernels &kernels, const fuse::FilterRow &row,
    const std::vector<float> *scale)
{
  std::vector<std::vector<float>> outputs (
      std::size_t (row.outputs), random_numbers (256, 5));
  std::vector<float *> to;
  for (auto &output : outputs)
    to.push_back (output.data ());
  if (scale)
    kernels.filter_add (row, scale->data (), to.data ());
  else
    kernels.filter (row, to.data ());
  for (auto &output : outputs)
    output.resize (std::size_t (row.count));
  return outputs;
}

TEST (FuseKernels, FiltersEqualTheReference)
{
  const auto source = random_numbers (4096, 1);
  const std::vector<std::ptrdiff_t> offsets = {-300, -17, -1, 0, 2, 256, 301};
  for (const int period : {1, 3, 4, 8, 25}) {
    for (const int outputs : {1, 3, 4, 8, 13}) {
      const int width = period + 15;
      auto weights =
          random_numbers (offsets.size () * std::size_t (outputs * width), 2);
      for (std::size_t i = 0; i < weights.size (); i++)
        if (i % std::size_t (width) >= std::size_t (period))
          weights[i] = weights[i - std::size_t (period)];
      const fuse::FilterRow row{source.data () + 1000, 77, offsets.data (),
          int (offsets.size ()), weights.data (), width, outputs, period,
          period / 2};
      std::vector<float> scale (256, 0.0f);
      for (std::size_t x = 20; x < 60; x += 3)
        scale[x] = 0.25f * float (x % 5);
      for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
        SCOPED_TRACE (kernels.name);
        EXPECT_EQ (outputs_of (kernels, row, nullptr),
            outputs_of (kReference, row, nullptr));
        EXPECT_EQ (outputs_of (kernels, row, &scale),
            outputs_of (kReference, row, &scale));
      }
    }
  }
}

TEST (FuseKernels, JoinedRowsEqualTheReference)
{
  const auto numbers = random_numbers (4096, 4);
  for (const int rows_count : {1, 2, 7, 11}) {
    std::vector<const float *> rows;
    for (int i = 0; i < rows_count; i++)
      rows.push_back (numbers.data () + 301 * i);
    const auto joined = [&] (auto join) {
      std::vector<float> to (128);
      join (rows.data (), rows_count, 77, to.data ());
      to.resize (77);
      return to;
    };
    for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
      SCOPED_TRACE (kernels.name);
      EXPECT_EQ (joined (kernels.sum), joined (kReference.sum));
      EXPECT_EQ (joined (kernels.max), joined (kReference.max));
    }
  }
}

/* Sums and weights after shrinking blocks of @slots planes. */
std::vector<float>
shrunk (const fuse::Kernels &kernels, int slots, float threshold)
{
  constexpr std::ptrdiff_t kSplit = 64;
  constexpr std::ptrdiff_t kStride = kSplit * fuse::kBlockStep;
  constexpr std::size_t kPlane = std::size_t (kStride) * fuse::kBlock;
  const auto light = random_numbers (kPlane * std::size_t (slots), 3);
  std::vector<float> sums (kPlane * std::size_t (slots + 1));
  std::vector<const float *> source;
  std::vector<float *> sum;
  for (int s = 0; s < slots; s++) {
    source.push_back (light.data () + kPlane * std::size_t (s));
    sum.push_back (sums.data () + kPlane * std::size_t (s));
  }
  std::vector<float> scratch (
      std::size_t (slots * fuse::kBlock * fuse::kBlock * 16));
  const auto transform = fuse::dct_matrix (slots);
  kernels.shrink ({source.data (), sum.data (),
      sums.data () + kPlane * std::size_t (slots), kStride, kSplit, 3, slots,
      transform.data (), 32, threshold, scratch.data ()});
  return sums;
}

TEST (FuseKernels, ShrinkingEqualsTheReference)
{
  for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
    SCOPED_TRACE (kernels.name);
    for (const int slots : {2, 4, 5, 8, 16})
      EXPECT_EQ (
          shrunk (kernels, slots, 70.0f), shrunk (kReference, slots, 70.0f));
  }
}

TEST (FuseKernels, NothingIsLostBelowAThresholdOfNothing)
{
  /* All coefficients are kept, so the result is the blocks times their weight.
   */
  for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
    SCOPED_TRACE (kernels.name);
    const auto sums = shrunk (kernels, 4, -1.0f);
    const auto light = random_numbers (std::size_t (64 * 4 * 12 * 4), 3);
    const std::size_t plane = 64 * 4 * 12;
    for (std::size_t i = 0; i < 4 * plane; i++) {
      const float weight = sums[4 * plane + i % plane];
      if (weight > 0.0f) {
        ASSERT_NEAR (sums[i] / weight, light[i], 1e-3);
      }
    }
  }
}

} // namespace
