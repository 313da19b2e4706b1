/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The small convolutional network that refines fused frames. */
#pragma once

#include <algorithm>
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

/** The file of the weights that are part of the library. */
std::span<const std::byte> refine_weights ();

/**
 * 3x3 convolutions, one after the other, of values beyond the border that are
 * 0. All but the last have kChannels outputs and make negative results 0; every
 * second hidden layer adds its input. Values of a pixel are neighbours in
 * memory. tests/quality/train trains it in floating point; here, inputs, hidden
 * values and weights are integers of 16 bits, of which processors multiply
 * twice as many at a time.
 */
class RefineNetwork
{
public:
  static constexpr int kPlanes = 15; ///< inputs of a picture, before folding
  static constexpr int kFold = 2; ///< pixels per pixel of the network, x and y
  static constexpr int kInputs = kPlanes * kFold * kFold;
  /** Of a pixel: the correction, and the logarithm of its deviation. */
  static constexpr int kResults = 2;
  static constexpr int kOutputs = kResults * kFold * kFold;
  static constexpr int kChannels = 32;
  static constexpr int kHidden = 6;
  static constexpr int kLayers = kHidden + 2;
  /** Pixels from a result to the furthest values that it depends on. */
  static constexpr int kReach = kLayers;
  /** Steps per 1 of the inputs, which reach 4 without leakage. */
  static constexpr float kInputScale = 4096.0f;
  /** Steps per 1 of hidden values. The largest of 30 scenes of the training is
   * 36, 0.3 of what 16 bits hold; other pictures may have larger ones.
   * With 1024 steps, results are closer to those in floating point by less than
   * 0.004 grey levels rms. */
  static constexpr float kHiddenScale = 256.0f;

  /** The convolution of a layer in floating point. */
  struct Convolution {
    int inputs, outputs;
    std::vector<float> weights; ///< by tap, input and output
    std::vector<float> bias;
  };
  /** Of each layer; @p file  as tests/quality/train writes it. */
  static Result<std::vector<Convolution>> read (
      std::span<const std::byte> file);
  static Result<RefineNetwork> parse (std::span<const std::byte> file);
  /** That of refine_weights (). */
  static const RefineNetwork &trained ();

  /** Of the file, XXH3 with 16 hexadecimal digits, as `xxhsum -H3` has it. */
  const std::string &hash () const { return hash_; }

  static int padded (int outputs)
  {
    return (outputs + kConvolveLanes - 1) / kConvolveLanes * kConvolveLanes;
  }
  /** Whether a layer adds its input to its result. */
  static bool adds_input (int layer)
  {
    return layer < kLayers - 1 && layer > 0 && layer % 2 == 0;
  }

  /** An input in steps; those beyond 16 bits become the nearest. */
  static std::int16_t steps (float input)
  {
    const float steps = input * kInputScale + 32768.5f;
    return std::int16_t (int (std::clamp (steps, 0.0f, 65535.0f)) - 32768);
  }
  /** Writes row @p y of the inputs: width x kInputs values in steps. */
  using Source = std::function<void (int y, std::int16_t *row)>;
  /** Row @p y of the results: width x padded (kOutputs) values. */
  using Sink = std::function<void (int y, const float *row)>;
  /** From the first row to the last. */
  void run (const Kernels &kernels, int width, int height, const Source &source,
      const Sink &sink) const;

private:
  /** As ConvolveRow has it, with outputs padded with 0. */
  struct Layer {
    int inputs, outputs;
    std::vector<std::int16_t> weights;
    std::vector<std::int32_t> bias;
    std::vector<float> scale;
  };
  static Layer quantised (
      const Convolution &from, double input_scale, double output_scale);

  std::vector<Layer> layers_;
  std::string hash_;
};

} // namespace codedexposure::fuse
