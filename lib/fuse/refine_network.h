/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The small convolutional network that refines fused frames. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "fuse/kernels.h"

namespace codedexposure::fuse
{

/**
 * 3x3 convolutions, one after the other, of values beyond the border that are
 * 0. All but the last have kChannels outputs and make negative results 0; every
 * second hidden layer adds its input. Values of a pixel are neighbours in
 * memory. tests/quality/train trains it.
 */
class RefineNetwork
{
public:
  static constexpr int kPlanes = 9; ///< inputs of a picture, before folding
  static constexpr int kFold = 2; ///< pixels per pixel of the network, x and y
  static constexpr int kInputs = kPlanes * kFold * kFold;
  static constexpr int kOutputs = kFold * kFold;
  static constexpr int kChannels = 32;
  static constexpr int kHidden = 4;
  static constexpr int kLayers = kHidden + 2;
  /** Pixels from a result to the furthest values that it depends on. */
  static constexpr int kReach = kLayers;

  /** The weights that are part of the library. */
  static const RefineNetwork &trained ();
  /** @p file  as tests/quality/train writes it. */
  static Result<RefineNetwork> parse (std::span<const std::byte> file);

  /** Of the file, XXH3 with 16 hexadecimal digits, as `xxhsum -H3` has it. */
  const std::string &hash () const { return hash_; }

  struct Layer {
    int inputs, outputs;
    std::vector<float> weights; ///< by tap, input and output
    std::vector<float> bias;
  };
  /** Outputs padded with 0 to a multiple of kConvolveLanes. */
  const std::vector<Layer> &layers () const { return layers_; }
  static int padded (int outputs)
  {
    return (outputs + kConvolveLanes - 1) / kConvolveLanes * kConvolveLanes;
  }
  /** Whether a layer adds its input to its result. */
  static bool adds_input (int layer)
  {
    return layer < kLayers - 1 && layer > 0 && layer % 2 == 0;
  }

  /** Writes row @p y of the inputs: width x kInputs values. */
  using Source = std::function<void (int y, float *row)>;
  /** Row @p y of the results: width x padded (kOutputs) values. */
  using Sink = std::function<void (int y, const float *row)>;
  /** From the first row to the last. */
  void run (const Kernels &kernels, int width, int height, const Source &source,
      const Sink &sink) const;

private:
  std::vector<Layer> layers_;
  std::string hash_;
};

} // namespace codedexposure::fuse
