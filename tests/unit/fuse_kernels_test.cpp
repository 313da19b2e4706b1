/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Kernels of fusion: every instruction set of the processor, compared with the
 * reference. */
#include <cmath>
#include <random>
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

constexpr int kCount = 77;
const std::vector<std::ptrdiff_t> kOffsets = {-300, -17, -1, 0, 2, 256, 301};

/* Pairs of 16 bits, the most negative values among them; @largest at most if it
 * is not 0. */
std::vector<std::int32_t>
random_pairs (std::size_t count, int seed, int largest)
{
  std::mt19937 random{std::mt19937::result_type (seed)};
  std::vector<std::int32_t> pairs;
  const auto half = [&] {
    const int value = int (random () % 65536) - 32768;
    if (largest != 0)
      return std::uint32_t (value % (largest + 1)) & 0xffff;
    return std::uint32_t (random () % 4 == 0 ? -32768 : value) & 0xffff;
  };
  for (std::size_t i = 0; i < count; i++)
    pairs.push_back (std::int32_t (half () << 16 | half ()));
  return pairs;
}

TEST (FuseKernels, FiltersEqualTheReference)
{
  const auto source = random_pairs (4096, 1, 0);
  const auto share = random_numbers (512, 3);
  std::vector<const std::int32_t *> sources;
  for (const std::ptrdiff_t offset : kOffsets)
    sources.push_back (source.data () + 1000 + offset);
  /* All that a vector holds sums of, and what is left of it. */
  const std::vector<fuse::Run> runs{{0, 16}, {32, 15 * 16}, {288, 7 * 16}};
  for (const int outputs : {1, 2, 3, 4, 8, 13}) {
    const auto scales = random_numbers (std::size_t (outputs), 4);
    auto pairs =
        random_pairs (sources.size () * std::size_t (1 + outputs), 2, 4000);
    for (std::size_t t = 0; t < sources.size (); t++)
      pairs[t * std::size_t (1 + outputs)] = int (sources.size () - 1 - t);
    const fuse::FilterRow row{sources.data (), pairs.data (),
        int (sources.size ()), outputs, scales.data (), 127.5f, runs.data (),
        int (runs.size ())};
    for (const bool add : {false, true}) {
      const auto filtered = [&] (const fuse::Kernels &kernels) {
        std::vector rows (std::size_t (outputs), random_numbers (512, 5));
        std::vector<float *> to;
        for (auto &values : rows)
          to.push_back (values.data ());
        if (add)
          kernels.filter_add (row, share.data (), to.data ());
        else
          kernels.filter_squared (row, to.data ());
        return rows;
      };
      for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
        SCOPED_TRACE (kernels.name);
        EXPECT_EQ (filtered (kernels), filtered (kReference)) << outputs;
      }
    }
  }
}

TEST (FuseKernels, PartsOfRowsEqualTheReference)
{
  constexpr std::ptrdiff_t kStride = 320;
  const auto row = random_numbers (300, 1);
  const auto pairs = random_pairs (300, 2, 0);
  for (const int period : {1, 2, 4, 5, 8, 25})
    for (const int count : {3, 64, 300}) {
      SCOPED_TRACE (std::to_string (period) + ' ' + std::to_string (count));
      const fuse::Parts parts{period, kStride, count};
      const auto split = [&] (const fuse::Kernels &kernels) {
        std::vector<float> to (std::size_t (kStride * period));
        kernels.split (parts, row.data (), to.data ());
        return to;
      };
      const auto split_pairs = [&] (const fuse::Kernels &kernels) {
        std::vector<std::int32_t> to (std::size_t (kStride * period));
        kernels.split_pairs (parts, pairs.data (), to.data ());
        return to;
      };
      const auto joined = [&] (const fuse::Kernels &kernels, bool add) {
        std::vector<float> to (300);
        kernels.join (parts, split (kReference).data (),
            add ? row.data () : nullptr, to.data ());
        return to;
      };
      for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
        SCOPED_TRACE (kernels.name);
        EXPECT_EQ (split (kernels), split (kReference));
        EXPECT_EQ (split_pairs (kernels), split_pairs (kReference));
        for (const bool add : {false, true})
          EXPECT_EQ (joined (kernels, add), joined (kReference, add));
      }
      const auto again = joined (kReference, false);
      EXPECT_TRUE (
          std::equal (again.begin (), again.begin () + count, row.begin ()));
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

TEST (FuseKernels, BlursEqualTheReference)
{
  const auto numbers = random_numbers (4096, 4),
             weights = random_numbers (11, 5);
  for (const std::ptrdiff_t step : {1, 300}) {
    const auto blurred = [&] (const fuse::Kernels &kernels) {
      std::vector<float> to (kCount + 15);
      kernels.blur (
          numbers.data (), step, weights.data (), 11, kCount, to.data ());
      to.resize (kCount);
      return to;
    };
    for (const fuse::Kernels &kernels : fuse::supported_kernels ())
      EXPECT_EQ (blurred (kernels), blurred (kReference)) << kernels.name;
  }
}

/* Numbers in 0 .. 100. */
std::vector<float>
random_magnitudes (int seed)
{
  auto numbers = random_numbers (kCount + 16, seed);
  for (float &number : numbers)
    number = std::abs (number);
  return numbers;
}

/* Static pixels, and pixels that prefer one of three models: the first block
 * has all of them, the second one only some. */
void
add_shares (const fuse::Kernels &kernels, const std::vector<float> &light,
    std::vector<float> &all)
{
  constexpr int kBlock = 32, kModels = 3;
  std::vector<std::vector<float>> preferences (
      kModels, std::vector<float> (kCount + 16, 0.25f));
  std::vector<float> weight (kCount + 16);
  for (std::size_t x = 0; x < weight.size (); x++) {
    preferences[x < 16 ? x % kModels : x % 2][x] = 1.0f;
    weight[x] = x % 5 == 0 ? 1.0f : 0.01f * float (x % 7);
  }
  std::vector<float> base (kCount + 16);
  std::vector<std::vector<float>> shares (kModels, base);
  std::vector<std::uint8_t> kept (kModels * (kCount / kBlock + 1));
  const float *const from[] = {
      preferences[0].data (), preferences[1].data (), preferences[2].data ()};
  float *const to[] = {shares[0].data (), shares[1].data (), shares[2].data ()};
  for (const int models : {1, 2, 3}) {
    kernels.share ({weight.data (), light.data (), models > 1 ? from : nullptr,
                       models, kBlock, kCount},
        base.data (), to, kept.data ());
    all.insert (all.end (), kept.begin (), kept.end ());
    for (const auto &row : {base, shares[0], shares[1], shares[2]})
      all.insert (all.end (), row.begin (), row.begin () + kCount);
  }
}

/* All rows of light to @count values each, one after the other. */
std::vector<float>
rated (const fuse::Kernels &kernels)
{
  const auto light = random_numbers (kCount + 16, 1);
  const auto other = random_numbers (kCount + 16, 2);
  const auto slope = random_magnitudes (3), offset = random_magnitudes (4);
  const auto frames = random_magnitudes (5);
  std::vector<float> all;
  std::vector<float> to (kCount + 16), more (to), third (to);
  const auto add = [&] (const std::vector<float> &row) {
    all.insert (all.end (), row.begin (), row.begin () + kCount);
  };
  for (const float *of :
      {frames.data (), static_cast<const float *> (nullptr)}) {
    kernels.compare ({light.data (), other.data (), slope.data (),
                         offset.data (), of, 0.5f, kCount},
        to.data ());
    add (to);
  }
  kernels.rate ({slope.data (), offset.data (), frames.data (), 49.0f,
                    {0.8f, 1.5f}, {25.0f, 70.0f}, kCount},
      to.data ());
  add (to);
  kernels.fade_ratio (
      slope.data (), offset.data (), 3.0f, {1.3f, 1.8f}, kCount, to.data ());
  add (to);
  const float *const rows[] = {slope.data (), offset.data (), frames.data ()};
  float *const outputs[] = {to.data (), more.data (), third.data ()};
  for (const int models : {2, 3}) {
    kernels.prefer ({rows, models, 7.0f, 0.01f, kCount}, outputs);
    for (const auto &row : {to, more, third})
      add (row);
  }
  add_shares (kernels, light, all);
  return all;
}

TEST (FuseKernels, SumsOfBlocksEqualTheReference)
{
  const auto upper = random_numbers (2 * kCount + 30, 1);
  const auto lower = random_numbers (2 * kCount + 30, 2);
  const auto summed = [&] (const fuse::Kernels &kernels) {
    std::vector<float> to (kCount + 15);
    kernels.sum_blocks (upper.data (), lower.data (), kCount, to.data ());
    to.resize (kCount);
    return to;
  };
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    EXPECT_EQ (summed (kernels), summed (kReference)) << kernels.name;
}

TEST (FuseKernels, WeightsOfClassesEqualTheReference)
{
  constexpr int kClasses = 5;
  const std::vector<float> factors{1.0f, 0.7f, 1.3f, 0.9f, 1.1f};
  const auto weighed = [&] (const fuse::Kernels &kernels) {
    std::vector<std::vector<float>> rows;
    std::vector<float *> errors;
    for (int c = 0; c < kClasses; c++)
      rows.push_back (random_magnitudes (c));
    for (auto &row : rows)
      errors.push_back (row.data ());
    rows.emplace_back (kCount + 15);
    kernels.weigh (
        {errors.data (), factors.data (), kClasses, 1.0f, 0.01f, kCount},
        rows.back ().data ());
    for (auto &row : rows)
      row.resize (kCount);
    return rows;
  };
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    EXPECT_EQ (weighed (kernels), weighed (kReference)) << kernels.name;
  const auto rows = weighed (kReference);
  for (std::size_t x = 0; x < kCount; x++) {
    float sum = 0.0f;
    for (std::size_t c = 0; c < kClasses; c++)
      sum += rows[c][x];
    EXPECT_NEAR (sum, 1.0f, 1e-6f);
  }
}

/* The conversions of light to whole numbers, likewise. */
std::vector<int>
converted (const fuse::Kernels &kernels)
{
  const auto light = random_numbers (kCount + 16, 1);
  std::vector<std::int32_t> steps (kCount + 32);
  std::vector<std::uint8_t> bytes (kCount);
  std::vector<std::uint16_t> words (kCount);
  kernels.to_steps (light.data (), 900.0f, kCount, steps.data ());
  std::vector<int> all (steps.begin (), steps.begin () + kCount);
  kernels.pair (steps.data (), kCount);
  all.insert (all.end (), steps.begin (), steps.begin () + kCount);
  kernels.to_bytes (light.data (), 3.0f, 250.0f, kCount, bytes.data ());
  kernels.to_words (light.data (), 800.0f, 65535.0f, kCount, words.data ());
  all.insert (all.end (), bytes.begin (), bytes.end ());
  all.insert (all.end (), words.begin (), words.end ());
  return all;
}

TEST (FuseKernels, OperationsOnRowsEqualTheReference)
{
  for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
    SCOPED_TRACE (kernels.name);
    EXPECT_EQ (rated (kernels), rated (kReference));
    EXPECT_EQ (converted (kernels), converted (kReference));
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

/* By the definition of the transform. */
TEST (FuseKernels, TheReferenceIsACosineTransform)
{
  constexpr int kSize = fuse::kBlock;
  const auto numbers = random_numbers (kSize, 1);
  const auto matrix = fuse::dct_matrix (kSize);
  std::vector<float> transformed (numbers.begin (), numbers.begin () + kSize);
  test::dct (transformed.data (), 1);
  for (int k = 0; k < kSize; k++) {
    double expected = 0.0;
    for (int i = 0; i < kSize; i++)
      expected += double (matrix[std::size_t (k * kSize + i)]) *
                  double (numbers[std::size_t (i)]);
    EXPECT_NEAR (transformed[std::size_t (k)], expected, 1e-3) << k;
  }
  test::undo_dct (transformed.data (), 1);
  for (std::size_t i = 0; i < kSize; i++)
    EXPECT_NEAR (transformed[i], numbers[i], 1e-3) << i;
}

/* Light, sums and weights afterwards. */
std::vector<float>
settled (const fuse::Kernels &kernels)
{
  constexpr int kSlots = 3, kPixels = 64;
  auto light = random_numbers (kSlots * kPixels, 1);
  auto sum = random_numbers (kSlots * kPixels, 2);
  auto weight = random_numbers (kPixels, 3);
  const auto coded = random_numbers (kPixels, 4);
  std::vector<std::uint8_t> measured;
  for (std::size_t x = 0; x < kPixels; x++) {
    measured.push_back (x % 5 < kSlots ? std::uint8_t (x % 5) : 255);
    weight[x] = x % 7 == 0 ? 0.0f : std::abs (weight[x]);
  }
  std::vector<float *> lights, sums;
  for (int s = 0; s < kSlots; s++) {
    lights.push_back (light.data () + s * kPixels);
    sums.push_back (sum.data () + s * kPixels);
  }
  kernels.settle ({lights.data (), sums.data (), weight.data (), coded.data (),
      measured.data (), kSlots, kPixels, 1.5f});
  light.insert (light.end (), sum.begin (), sum.end ());
  light.insert (light.end (), weight.begin (), weight.end ());
  return light;
}

TEST (FuseKernels, SettlingEqualsTheReference)
{
  for (const fuse::Kernels &kernels : fuse::supported_kernels ())
    EXPECT_EQ (settled (kernels), settled (kReference)) << kernels.name;
}

/* Slots that move to what a partner saw of them, with noise and without. */
std::vector<float>
moved (const fuse::Kernels &kernels, float noise)
{
  constexpr int kSlots = 3;
  std::vector<std::vector<float>> light, responses;
  std::vector<const float *> of_slots, of_responses;
  std::vector<float *> to;
  for (int s = 0; s < kSlots; s++) {
    light.push_back (random_numbers (kCount + 16, 10 + s));
    responses.push_back (random_magnitudes (20 + s));
  }
  for (std::size_t s = 0; s < kSlots; s++) {
    of_slots.push_back (light[s].data ());
    of_responses.push_back (responses[s].data ());
    to.push_back (light[s].data ());
  }
  const auto partner = random_numbers (kCount + 16, 1);
  const auto sum = random_numbers (kCount + 16, 2);
  const auto squares = random_magnitudes (3), step = random_magnitudes (4);
  const auto slope = random_magnitudes (5), offset = random_magnitudes (6);
  std::vector<float> missed (kCount + 16), squared (missed);
  kernels.miss (
      {of_slots.data (), of_responses.data (), kSlots, partner.data (), kCount},
      missed.data (), squared.data ());
  kernels.move (
      {missed.data (), sum.data (), squares.data (), 25.0f, partner.data (),
          slope.data (), offset.data (), noise, 5000.0f, step.data (),
          of_responses.data (), kSlots, kCount},
      to.data ());
  std::vector<float> all;
  for (const auto &row : {missed, squared, light[0], light[1], light[2]})
    all.insert (all.end (), row.begin (), row.begin () + kCount);
  return all;
}

TEST (FuseKernels, MovesToAPartnerEqualTheReference)
{
  for (const float noise : {0.0f, 0.5f, 100.0f})
    for (const fuse::Kernels &kernels : fuse::supported_kernels ())
      EXPECT_EQ (moved (kernels, noise), moved (kReference, noise))
          << kernels.name;
}

/* Random values, or only the smallest and the largest ones, chosen by
 * @extreme. */
std::vector<std::int16_t>
random_shorts (std::size_t count, unsigned seed, bool extreme = false)
{
  std::mt19937 random (seed);
  std::vector<std::int16_t> values;
  for (std::size_t i = 0; i < count; i++) {
    const int value = int (random () % 65536) - 32768;
    values.push_back (std::int16_t (!extreme    ? value
                                    : value < 0 ? -32768
                                                : 32767));
  }
  return values;
}

/* A convolution whose sums need all of 32 bits. */
struct Convolution {
  static constexpr int kMaxPixels = 37;
  int inputs, outputs;
  std::vector<std::int16_t> light, weights, add;
  std::vector<std::int32_t> bias;
  std::vector<float> scale;

  Convolution (int some_inputs, int some_outputs, bool extreme)
      : inputs (some_inputs), outputs (some_outputs),
        light (random_shorts (std::size_t (3 * row_values ()), 6, extreme)),
        weights (random_shorts (std::size_t (9 * inputs * outputs), 7)),
        add (random_shorts (std::size_t (kMaxPixels * outputs), 8)),
        bias (std::size_t (outputs)), scale (std::size_t (outputs))
  {
    const int largest = 65500 / (9 * inputs);
    for (std::int16_t &weight : weights)
      weight = std::int16_t (weight % (largest + 1));
    for (std::size_t k = 0; k < bias.size (); k++) {
      bias[k] = 40000 * (int (k) - 8);
      scale[k] = k % 3 == 0 ? 1.0f : 0.00002f * float (k);
    }
  }
  int row_values () const { return (kMaxPixels + 2) * inputs; }

  /** The result of the last layer, or of a hidden one. */
  std::vector<float> result (
      const fuse::Kernels &kernels, int pixels, bool hidden, bool adds) const
  {
    const std::int16_t *source[] = {light.data () + row_values (),
        light.data () + 2 * row_values (), light.data ()};
    std::vector<float> to (std::size_t (pixels * outputs));
    std::vector<std::int16_t> shorts (to.size ());
    kernels.convolve ({source, inputs, weights.data (), bias.data (),
        scale.data (), outputs, pixels, adds ? add.data () : nullptr,
        hidden ? shorts.data () : nullptr, to.data ()});
    return hidden ? std::vector<float> (shorts.begin (), shorts.end ()) : to;
  }
};

TEST (FuseKernels, ConvolutionsEqualTheReference)
{
  for (const int inputs : {2, 32, 36})
    for (const int outputs : {fuse::kConvolveLanes, 2 * fuse::kConvolveLanes})
      for (const bool extreme : {false, true}) {
        const Convolution convolution (inputs, outputs, extreme);
        for (const auto &[hidden, adds] :
            {std::pair{false, false}, {true, false}, {true, true}})
          for (const int pixels : {1, 7, 16, Convolution::kMaxPixels}) {
            const auto expected =
                convolution.result (kReference, pixels, hidden, adds);
            for (const fuse::Kernels &kernels : fuse::supported_kernels ())
              EXPECT_EQ (
                  convolution.result (kernels, pixels, hidden, adds), expected)
                  << kernels.name << ' ' << inputs << ' ' << outputs << ' '
                  << pixels;
          }
      }
}

/* Each value against the weight of its sign: the largest sums there are. */
TEST (FuseKernels, TheLargestConvolutionsDoNotOverflow)
{
  constexpr int kInputs = 2, kOutputs = fuse::kConvolveLanes;
  const std::vector<float> scale (kOutputs, 1.0f);
  for (const int sign : {-1, 1}) {
    /* 18 products of up to 32768; the bias fills up the rest. */
    const int weight = sign * 3640;
    const std::vector<std::int16_t> weights (
        9 * kInputs * kOutputs, std::int16_t (weight));
    const std::vector<std::int16_t> light (3 * kInputs, -32768);
    const std::int32_t most = 18 * 3640 * 32768;
    const std::vector<std::int32_t> bias (
        kOutputs, -sign * (2147483647 - most));
    const std::int16_t *source[] = {
        light.data (), light.data (), light.data ()};
    for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
      std::vector<std::int16_t> hidden (kOutputs);
      std::vector<float> to (kOutputs);
      kernels.convolve ({source, kInputs, weights.data (), bias.data (),
          scale.data (), kOutputs, 1, nullptr, nullptr, to.data ()});
      EXPECT_EQ (
          to, std::vector<float> (kOutputs, -float (sign) * 2147483647.0f))
          << kernels.name;
      kernels.convolve ({source, kInputs, weights.data (), bias.data (),
          scale.data (), kOutputs, 1, nullptr, hidden.data (), nullptr});
      EXPECT_EQ (
          hidden, std::vector<std::int16_t> (kOutputs, sign < 0 ? 32767 : 0))
          << kernels.name;
    }
  }
}

TEST (FuseKernels, NothingIsLostBelowAThresholdOfNothing)
{
  /* All coefficients are kept, so the result is the blocks times their weight.
   */
  for (const fuse::Kernels &kernels : fuse::supported_kernels ()) {
    SCOPED_TRACE (kernels.name);
    const auto sums = shrunk (kernels, 4, -1.0f);
    constexpr std::size_t plane = 64 * fuse::kBlockStep * fuse::kBlock;
    const auto light = random_numbers (4 * plane, 3);
    for (std::size_t i = 0; i < 4 * plane; i++) {
      const float weight = sums[4 * plane + i % plane];
      if (weight > 0.0f) {
        ASSERT_NEAR (sums[i] / weight, light[i], 1e-3);
      }
    }
  }
}

} // namespace
