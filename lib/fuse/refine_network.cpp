/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/refine_network.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include <xxhash.h>

#include "record/json.h"

namespace codedexposure::fuse
{

static_assert (std::endian::native == std::endian::little);

namespace
{

constexpr std::uint32_t kMagic = 0x4e584543; // "CEXN"

/** The next floats of a file that has enough of them. */
std::vector<float>
next_floats (const std::byte *&from, int count)
{
  auto values = std::vector<float> (std::size_t (count));
  std::memcpy (values.data (), from, 4 * values.size ());
  from += 4 * values.size ();
  return values;
}

/** The largest scale of an output's weights with which no weight needs more
 * than 16 bits and no sum more than 32, whatever the inputs. */
double
weight_scale (const RefineNetwork::Convolution &from, double input_scale, int k)
{
  double largest = 0.0, sum = 0.0;
  for (std::size_t at = std::size_t (k); at < from.weights.size ();
       at += std::size_t (from.outputs)) {
    const double weight = std::abs (double (from.weights[at]));
    largest = std::max (largest, weight);
    sum += weight;
  }
  const double most =
      32768.0 * sum +
      input_scale * std::abs (double (from.bias[std::size_t (k)]));
  if (largest == 0.0 && most == 0.0)
    return 1.0;
  /* Rounding adds up to half a step to each weight and to the bias. */
  const double rounding = 32768.0 * 0.5 * 9.0 * from.inputs + 1.0;
  return std::min (32767.0 / largest, (2147483647.0 - rounding) / most);
}

/** Three rows of what goes into a layer, with a pixel of 0 at both ends. */
class Rows
{
public:
  Rows (int width, int values)
      : width_ (width), values_ (values),
        rows_ (4 * std::size_t (width + 2) * std::size_t (values))
  {
  }

  /** Pixel 0 of row @p y, which replaces row y - 3. */
  std::int16_t *row (int y) { return start (y % 3) + values_; }
  /** Rows y - 1 to y + 1 from pixel -1, those beyond the border 0. */
  std::array<const std::int16_t *, 3> around (int y, int height)
  {
    return {start (y > 0 ? (y - 1) % 3 : kZero), start (y % 3),
        start (y + 1 < height ? (y + 1) % 3 : kZero)};
  }

private:
  static constexpr int kZero = 3;
  std::int16_t *start (int row)
  {
    return rows_.data () + std::ptrdiff_t (row) * (width_ + 2) * values_;
  }

  int width_, values_;
  std::vector<std::int16_t> rows_;
};

} // namespace

const RefineNetwork &
RefineNetwork::trained ()
{
  static const RefineNetwork network = [] {
    auto parsed = parse (refine_weights ());
    if (!parsed)
      std::abort ();
    return std::move (*parsed);
  }();
  return network;
}

Result<std::vector<RefineNetwork::Convolution>>
RefineNetwork::read (std::span<const std::byte> file)
{
  std::array<int, kLayers + 1> widths;
  widths.fill (kChannels);
  widths.front () = kInputs;
  widths.back () = kOutputs;
  std::size_t words = 4;
  for (std::size_t l = 0; l < kLayers; l++)
    words += std::size_t (9 * widths[l] + 1) * std::size_t (widths[l + 1]);
  const std::array<std::uint32_t, 4> head{kMagic, kChannels, kHidden, kPlanes};
  if (file.size () != 4 * words ||
      std::memcmp (file.data (), head.data (), sizeof head) != 0)
    return Error{"weights of " + std::to_string (file.size ()) +
                 " bytes are not those of this network, " +
                 std::to_string (4 * words) +
                 " bytes; write them with tests/quality/train"};
  const std::byte *from = file.data () + sizeof head;
  std::vector<Convolution> convolutions;
  for (std::size_t l = 0; l < kLayers; l++) {
    auto &to = convolutions.emplace_back (widths[l], widths[l + 1]);
    to.weights = next_floats (from, 9 * to.inputs * to.outputs);
    to.bias = next_floats (from, to.outputs);
  }
  return convolutions;
}

RefineNetwork::Layer
RefineNetwork::quantised (
    const Convolution &from, double input_scale, double output_scale)
{
  static_assert (kInputs % 2 == 0 && kChannels % 2 == 0);
  const int outputs = padded (from.outputs);
  Layer layer{from.inputs, outputs,
      std::vector<std::int16_t> (std::size_t (9 * from.inputs * outputs)),
      std::vector<std::int32_t> (std::size_t (outputs)),
      std::vector<float> (std::size_t (outputs))};
  for (int k = 0; k < from.outputs; k++) {
    const double scale = weight_scale (from, input_scale, k);
    for (int i = 0; i < 9 * from.inputs; i++) {
      const float weight = from.weights[std::size_t (i * from.outputs + k)];
      layer.weights[std::size_t ((i / 2 * outputs + k) * 2 + i % 2)] =
          std::int16_t (std::lrint (scale * double (weight)));
    }
    const auto at = std::size_t (k);
    layer.bias[at] = std::int32_t (
        std::lrint (scale * input_scale * double (from.bias[at])));
    layer.scale[at] = float (output_scale / (scale * input_scale));
  }
  return layer;
}

Result<RefineNetwork>
RefineNetwork::parse (std::span<const std::byte> file)
{
  const auto convolutions = read (file);
  if (!convolutions)
    return convolutions.error ();
  RefineNetwork network;
  for (int l = 0; l < kLayers; l++)
    network.layers_.push_back (quantised ((*convolutions)[std::size_t (l)],
        l == 0 ? kInputScale : kHiddenScale,
        l == kLayers - 1 ? 1.0 : kHiddenScale));
  network.hash_ = hex_text (XXH3_64bits (file.data (), file.size ()), 16);
  return network;
}

/* Layers follow each other at a distance of one row, so that three rows of each
 * are enough, which stay in the cache. */
void
RefineNetwork::run (const Kernels &kernels, int width, int height,
    const Source &source, const Sink &sink) const
{
  std::vector<Rows> into;
  for (const Layer &layer : layers_)
    into.emplace_back (width, layer.inputs);
  std::vector<float> result (
      std::size_t (width) * std::size_t (padded (kOutputs)));
  for (int step = 0; step < height + kLayers; step++) {
    if (step < height)
      source (step, into[0].row (step));
    for (int l = 0; l < kLayers; l++) {
      const int y = step - 1 - l;
      if (y < 0 || y >= height)
        continue;
      const Layer &layer = layers_[std::size_t (l)];
      Rows &rows = into[std::size_t (l)];
      const bool last = l == kLayers - 1;
      kernels.convolve ({rows.around (y, height).data (), layer.inputs,
          layer.weights.data (), layer.bias.data (), layer.scale.data (),
          layer.outputs, width, adds_input (l) ? rows.row (y) : nullptr,
          last ? nullptr : into[std::size_t (l + 1)].row (y), result.data ()});
      if (last)
        sink (y, result.data ());
    }
  }
}

} // namespace codedexposure::fuse
