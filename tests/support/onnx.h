/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The refinement's network as an ONNX file, for other programs that run it. */
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "fuse/refine_network.h"

namespace codedexposure::test
{

/** A message of protocol buffers, field by field. */
class Message
{
public:
  Message &number (int field, std::uint64_t value)
  {
    key (field, 0);
    varint (value);
    return *this;
  }
  Message &text (int field, const std::string &value)
  {
    key (field, 2);
    varint (value.size ());
    bytes_ += value;
    return *this;
  }
  Message &part (int field, const Message &value)
  {
    return text (field, value.bytes_);
  }
  const std::string &bytes () const { return bytes_; }

private:
  void key (int field, int kind) { varint (std::uint64_t (field * 8 + kind)); }
  void varint (std::uint64_t value)
  {
    for (; value >= 0x80; value >>= 7)
      bytes_ += char ((value & 0x7f) | 0x80);
    bytes_ += char (value);
  }

  std::string bytes_;
};

/** The numbers are the fields of onnx.proto. */
class OnnxGraph
{
public:
  void tensor (const std::string &name, const std::vector<int> &shape,
      const std::vector<float> &values)
  {
    Message tensor;
    for (const int side : shape)
      tensor.number (1, std::uint64_t (side));
    tensor.number (2, 1).text (8, name); // float
    std::string raw (values.size () * sizeof (float), '\0');
    std::memcpy (raw.data (), values.data (), raw.size ());
    graph_.part (5, tensor.text (9, raw));
  }
  void node (const std::string &kind, const std::vector<std::string> &inputs,
      const std::string &output, bool convolution = false)
  {
    Message node;
    for (const std::string &input : inputs)
      node.text (1, input);
    node.text (2, output).text (3, output).text (4, kind);
    if (convolution)
      node.part (5, whole_numbers ("kernel_shape", {3, 3}))
          .part (5, whole_numbers ("pads", {1, 1, 1, 1}))
          .part (5, whole_numbers ("strides", {1, 1}));
    graph_.part (1, node);
  }
  std::string file (const std::string &input, const std::vector<int> &shape,
      const std::string &output)
  {
    graph_.text (2, "refine").part (11, value (input, shape));
    graph_.part (12,
        value (output, {1, fuse::RefineNetwork::kOutputs, shape[2], shape[3]}));
    return Message ()
        .number (1, 7)
        .part (7, graph_)
        .part (8, Message ().text (1, "").number (2, 11))
        .bytes ();
  }

private:
  static Message whole_numbers (
      const std::string &name, const std::vector<int> &values)
  {
    Message attribute;
    attribute.text (1, name);
    for (const int value : values)
      attribute.number (8, std::uint64_t (value));
    return attribute.number (20, 7);
  }
  static Message value (const std::string &name, const std::vector<int> &shape)
  {
    Message sides;
    for (const int side : shape)
      sides.part (1, Message ().number (1, std::uint64_t (side)));
    return Message ().text (1, name).part (
        2, Message ().part (1, Message ().number (1, 1).part (2, sides)));
  }

  Message graph_;
};

/** The network of these layers for inputs of 1 x kInputs x @p height x @p
 * width.
 */
inline std::string
onnx_of (const std::vector<fuse::RefineNetwork::Convolution> &layers, int width,
    int height)
{
  using Net = fuse::RefineNetwork;
  OnnxGraph graph;
  std::string from = "planes";
  for (int l = 0; l < Net::kLayers; l++) {
    const auto &layer = layers[std::size_t (l)];
    const int outputs = layer.outputs;
    std::vector<float> weights;
    for (int k = 0; k < outputs; k++)
      for (int i = 0; i < layer.inputs; i++)
        for (int t = 0; t < 9; t++)
          weights.push_back (
              layer
                  .weights[std::size_t ((t * layer.inputs + i) * outputs + k)]);
    const std::string n = std::to_string (l);
    graph.tensor ("weights" + n, {outputs, layer.inputs, 3, 3}, weights);
    graph.tensor ("bias" + n, {outputs}, layer.bias);
    graph.node ("Conv", {from, "weights" + n, "bias" + n}, "conv" + n, true);
    std::string to = "conv" + n;
    if (l < Net::kLayers - 1) {
      graph.node ("Relu", {to}, "relu" + n);
      to = "relu" + n;
    }
    if (Net::adds_input (l)) {
      graph.node ("Add", {from, to}, "sum" + n);
      to = "sum" + n;
    }
    from = to;
  }
  return graph.file ("planes", {1, Net::kInputs, height, width}, from);
}

} // namespace codedexposure::test
