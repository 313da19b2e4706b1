/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse: one coded frame in, n full-resolution frames out. */
#pragma once

#include <deque>
#include <optional>
#include <stop_token>
#include <variant>
#include <vector>

#include <gst/gst.h>

#include "common/coded_filter.h"
#include "common/partner_reader.h"
#include "fuse/fuser.h"
#include "fuse/partner_correction.h"

namespace codedexposure::gst::fuse
{

using AnyFuser = std::variant<Fuser<std::uint8_t>, Fuser<std::uint16_t>>;
using AnyCorrection = std::variant<PartnerCorrection<std::uint8_t>,
    PartnerCorrection<std::uint16_t>>;

/** Everything that follows from the format and the settings. */
struct Plan {
  AnyFuser fuser;
  std::optional<PartnerReader> partners;   ///< none: they are not used
  std::optional<AnyCorrection> correction; ///< of partners; none: not worth it
  GstVideoInfo fused, uncertainty;
  Reach reach;
  std::string gap; ///< that keeps exposures from overlapping; empty: none
};

/** Properties; noise that was not set is that of the bench profile. */
struct Settings : FuseOptions {
  static constexpr double kUnset = -1.0;
  Settings () { noise = {kUnset, kUnset}; }

  SensorNoise of_second{kUnset, kUnset}; ///< camera
};

class Fuse final : public CodedFilter
{
public:
  explicit Fuse (GstElement *element);

  static void set_up_class (gpointer klass);

private:
  static PropertyTable<Settings> properties ();
  static Settings &settings_of (GObject *object);

  GstFlowReturn process (CodedFrame frame) override;
  Reach reach () const override;
  GstFlowReturn learn (CodedFrame frame) override;
  bool plan (const CodedFormat &format, PadCaps &caps) override;
  void planned (bool schedule_changed) override;
  GstFlowReturn drain () override;
  void break_history () override;
  void take_settings () override { in_force_ = settings_; }
  void forget () override;
  void cancel () override;
  void resume () override;
  CapsPtr convert_caps (const CapsContext &context, const GstCodedPad *pad,
      GstCaps *caps, bool to_coded) const override;
  CapsScale scale_for (
      const Schedule &schedule, const GstCodedPad *pad) const override;
  int pictures_a_frame (const GstCodedPad *) const override
  {
    return shared_.schedule->slots ();
  }
  RectifyOptions rectify_options (const Schedule &schedule) const override;
  int threads () const override { return in_force_.threads; }
  SensorNoise noise (const Schedule &schedule) const;
  SensorNoise partner_noise (const CodedFormat &format) const;
  std::string method_name () const override;
  std::string unrefined () const;
  std::string unoverlapped () const;

  /** None, with a warning if there are any, when partners cannot be used. */
  std::optional<PartnerReader> plan_partners (const CodedFormat &format) const;
  bool plan_correction (
      Plan &plan, const CodedFormat &format, const FuseOptions &options) const;
  template <typename Pixel>
  Result<guint64> take_pixels (GstBuffer *buffer, MappedFrame &coded);
  GstFlowReturn take (CodedFrame frame);
  /** The pictures of a pad for one coded frame. */
  struct Pictures {
    GstCodedPad *pad;
    const GstVideoInfo &info;
    std::vector<BufferPtr> buffers = {};
    std::vector<MappedFrame> mapped = {};
  };
  GstFlowReturn acquire_all (Pictures &pictures) const;
  std::stop_token stop_token () const;
  GstFlowReturn render (Pictures &fused, Pictures *uncertainty);
  GstFlowReturn push_one (Pictures &pictures, const CodedFrame &coded, int k);
  GstFlowReturn push_oldest ();
  GstFlowReturn pass_oldest ();
  /** Start of slot @p k by even steps, from the frame's PTS. */
  GstClockTime boundary (int k) const;

  /* Object lock. */
  Settings settings_;
  std::stop_source stop_; ///< of what is under way

  /* Sink pad's stream lock. */
  Settings in_force_;
  std::optional<Plan> plan_;
  /** Coded frames that were taken, without their pixels; as many as the
   * fuser's pending (). */
  std::deque<CodedFrame> waiting_;
};

} // namespace codedexposure::gst::fuse
