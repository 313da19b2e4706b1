/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "fuse/refine_network.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>

#include <xxhash.h>

namespace codedexposure::fuse
{

/** refine_weights.bin, which embed.py makes part of the library. */
std::span<const std::byte> refine_weights ();

namespace
{

constexpr std::uint32_t kMagic = 0x4e584543; // "CEXN"

std::uint32_t
word_at (const std::byte *from)
{
  std::uint32_t word = 0;
  for (int i = 3; i >= 0; i--)
    word = word << 8 | std::uint32_t (from[i]);
  return word;
}

/** Reads the floats of a file that has enough of them. */
class Reader
{
public:
  explicit Reader (const std::byte *from) : from_ (from) {}
  float next ()
  {
    const float value = std::bit_cast<float> (word_at (from_));
    from_ += 4;
    return value;
  }

private:
  const std::byte *from_;
};

RefineNetwork::Layer
read_layer (Reader &reader, int inputs, int outputs)
{
  const int padded = RefineNetwork::padded (outputs);
  RefineNetwork::Layer layer{inputs, padded,
      std::vector<float> (std::size_t (9 * inputs * padded)),
      std::vector<float> (std::size_t (padded))};
  for (int row = 0; row < 9 * inputs; row++)
    for (int k = 0; k < outputs; k++)
      layer.weights[std::size_t (row * padded + k)] = reader.next ();
  for (int k = 0; k < outputs; k++)
    layer.bias[std::size_t (k)] = reader.next ();
  return layer;
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
  float *row (int y) { return start (y % 3) + values_; }
  /** Rows y - 1 to y + 1 from pixel -1, those beyond the border 0. */
  std::array<const float *, 3> around (int y, int height)
  {
    return {start (y > 0 ? (y - 1) % 3 : kZero), start (y % 3),
        start (y + 1 < height ? (y + 1) % 3 : kZero)};
  }

private:
  static constexpr int kZero = 3;
  float *start (int row)
  {
    return rows_.data () + std::ptrdiff_t (row) * (width_ + 2) * values_;
  }

  int width_, values_;
  std::vector<float> rows_;
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

Result<RefineNetwork>
RefineNetwork::parse (std::span<const std::byte> file)
{
  std::array<int, kLayers + 1> widths;
  widths.fill (kChannels);
  widths.front () = kInputs;
  widths.back () = kOutputs;
  std::size_t words = 4;
  for (std::size_t l = 0; l < kLayers; l++)
    words += std::size_t (9 * widths[l] + 1) * std::size_t (widths[l + 1]);
  const std::array<std::uint32_t, 4> head{kMagic, kChannels, kHidden, kPlanes};
  bool fits = file.size () == 4 * words;
  for (std::size_t i = 0; fits && i < head.size (); i++)
    fits = word_at (file.data () + 4 * i) == head[i];
  if (!fits)
    return Error{"weights of " + std::to_string (file.size ()) +
                 " bytes are not those of this network, " +
                 std::to_string (4 * words) +
                 " bytes; write them with tests/quality/train"};
  RefineNetwork network;
  Reader reader (file.data () + 4 * head.size ());
  for (std::size_t l = 0; l < kLayers; l++)
    network.layers_.push_back (read_layer (reader, widths[l], widths[l + 1]));
  char hash[17];
  std::snprintf (hash, sizeof hash, "%016llx",
      (unsigned long long)XXH3_64bits (file.data (), file.size ()));
  network.hash_ = hash;
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
      float *to = last ? result.data () : into[std::size_t (l + 1)].row (y);
      kernels.convolve ({rows.around (y, height).data (), layer.inputs,
          layer.weights.data (), layer.bias.data (), layer.outputs, width,
          !last, adds_input (l) ? rows.row (y) : nullptr, to});
      if (last)
        sink (y, to);
    }
  }
}

} // namespace codedexposure::fuse
