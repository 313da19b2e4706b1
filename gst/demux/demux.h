/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: one coded frame in, n timed subframes out. */
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "common/coded_filter.h"
#include "extract/split_plan.h"

namespace codedexposure::gst::demux
{

/** Properties. */
struct Settings {
  ExtractOptions extract;
  bool qos = false;
  Method method_in_force = Method::kAuto;
};

/** Everything that follows from the format and the settings. */
struct Plan {
  std::vector<SplitPart> parts;    ///< the background, then the regions
  std::vector<GstVideoInfo> infos; ///< of the subframes of each part
  /** The order of all subframes, forwards and backwards. */
  std::array<std::vector<SplitTurn>, 2> turns;

  const SplitPart &background () const { return parts.front (); }
};

class Demux final : public CodedFilter
{
public:
  explicit Demux (GstElement *element);

  static void set_up_class (gpointer klass);

private:
  /** The pads that a subframe goes to; null where it does not. */
  struct Target {
    GstCodedPad *all = nullptr;
    GstCodedPad *one = nullptr;
    BufferPtr buffer = nullptr;
    GstCodedPad *owner () const { return all ? all : one; }
  };
  /** Of each subframe of a part. */
  using Targets = std::vector<Target>;

  GstFlowReturn process (CodedFrame frame) override;
  bool plan (const CodedFormat &format, PadCaps &caps) override;
  void planned (bool schedule_changed) override;
  void flushed () override { live_.reset (); }
  void take_settings () override { in_force_ = settings_; }
  void forget () override;
  static PropertyTable<Settings> properties ();
  static Settings &settings_of (GObject *object);
  CapsScale scale_for (
      const Schedule &schedule, const GstCodedPad *pad) const override;
  CapsPtr convert_caps (const CapsContext &context, const GstCodedPad *pad,
      GstCaps *caps, bool to_coded) const override;
  int pictures_a_frame (const GstCodedPad *pad) const override;
  bool allows_pad (PadKind kind, int index) const override;
  EventPtr gap_for (const GstCodedPad *pad, GstEvent *gap) const override;
  std::string method_name () const override;

  bool check_pads (const PadMap &pads) const;

  /* Frames. */
  bool is_live ();
  bool is_late (GstCodedPad *pad, GstClockTime pts, GstClockTime duration);
  void skip (GstCodedPad *pad, GstClockTime pts, GstClockTime duration);
  bool prepare_pad (GstCodedPad *pad, guint at_once, GstFlowReturn &flow);
  Targets find_targets (const CodedFrame &frame, const PadMap &pads,
      const SplitPart &part, GstFlowReturn &flow);
  template <typename Pixel>
  ImageView<Pixel> scratch_view (std::size_t part, std::size_t k);
  GstFlowReturn map_subframes (
      std::size_t part, Targets &targets, std::vector<MappedFrame> &subframes);
  template <typename Pixel>
  GstFlowReturn render_part (CodedFrame &frame, std::size_t part,
      Targets &targets, ImageView<const Pixel> light);
  template <typename Pixel>
  GstFlowReturn render (CodedFrame &frame, std::vector<Targets> &parts);
  GstFlowReturn push_subframes (CodedFrame &frame, const PadMap &pads);
  GstFlowReturn push_subframe (
      const CodedFrame &frame, SplitTurn turn, Target target);
  BufferPtr share (
      const GstVideoInfo &info, const GstCodedPad *pad, GstBuffer *outbuf);

  /* Object lock. */
  Settings settings_;

  /* Sink pad's stream lock. */
  Settings in_force_;
  std::optional<Plan> plan_;
  std::optional<bool> live_;       ///< queried at first use
  std::vector<std::byte> scratch_; ///< subframes that no pad wants
};

} // namespace codedexposure::gst::demux
