/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-sum
 * @title: codedexposure-sum
 * @short_description: The whole light of both beams
 *
 * A mirror sends the light of every moment to one of two cameras. Their sum is
 * the picture of an ordinary exposure, with all of the light, at the rate of
 * coded frames and in full resolution, whatever the masks were; light that
 * leaks from one beam into the other is in it, too. This element adds each
 * coded frame and the partner that codedexposure-pair gave it.
 *
 * Before the cameras are added, the second one is made as bright as the first:
 * by #codedexposure-sum:ratio, or so that both saw a scene of the same mean,
 * which is measured in each pair and changes by some parts in a thousand where
 * the scene moves. The brightest pixel that saturates neither camera becomes
 * white, and so do pixels that are saturated in either. Black levels are those
 * of the bench profiles in the streams. Frames with a mapping have one pixel a
 * mirror, and the rows of the pilot are left out, as in fused frames.
 *
 * A coded frame without a partner has no sum: a GAP event takes its place, and
 * #codedexposure-sum:frames-alone counts it, until the next run starts.
 * codedexposure-pair posts why.
 *
 * ## Example pipelines
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! tee name=light \
 *     light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 \
 *     ! pair.on \
 *     light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 \
 *     beam=off seed=1 ! pair.off \
 *     codedexposure-pair name=pair ! codedexposure-sum \
 *     ! queue ! videoconvert ! autovideosink
 * ]| An ordinary camera of 25 frames/s.
 *
 * Since: 0.2
 */
#include <optional>

#include "base/pixels.h"
#include "base/try.h"
#include "common/coded_filter.h"
#include "common/element.h"
#include "common/elements.h"
#include "common/events.h"
#include "common/partner_reader.h"
#include "extract/beam_sum.h"
#include "extract/saturation.h"

GST_DEBUG_CATEGORY_STATIC (codedexposure_sum_debug);
#define GST_CAT_DEFAULT codedexposure_sum_debug

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

struct Settings {
  double ratio = 0.0;
  double measured = 0.0; ///< read only
  guint64 alone = 0;     ///< read only
};

/** Everything that follows from the format and the settings. */
struct Plan {
  PartnerReader partners;
  BeamSum sum;
  BeamLevels levels;
  GstVideoInfo info;
};

class Sum final : public CodedFilter
{
public:
  explicit Sum (GstElement *element)
      : CodedFilter (element,
            {"application/x-codedexposure-sum-stats", "pictures-out", nullptr})
  {
  }

  static void set_up_class (gpointer klass);

private:
  static PropertyTable<Settings> properties ();
  static Settings &settings_of (GObject *object)
  {
    return static_cast<Sum &> (filter_of (object)).settings_;
  }

  GstFlowReturn process (CodedFrame frame) override;
  Reach reach () const override { return {}; }
  bool plan (const CodedFormat &format, PadCaps &caps) override;
  void reset_counters () override { settings_.alone = 0; }
  void forget () override { plan_.reset (); }
  CapsScale scale_for (
      const Schedule &schedule, const GstCodedPad *) const override
  {
    return {.crop_rows = schedule.pilot_rows ()};
  }
  int pictures_a_frame (const GstCodedPad *) const override { return 1; }
  std::string method_name () const override { return "sum of both beams"; }

  Result<Plan> make_plan (const CodedFormat &format);
  /** False if @p frame has no partner. */
  template <typename Pixel>
  Result<bool> add (CodedFrame &frame, MappedFrame &coded, MappedFrame &sum);
  GstFlowReturn pass_gap (GstCodedPad *pad, GstClockTime pts);
  bool waits_for_partners () const;

  Settings settings_; ///< object lock

  /** Sink pad's stream lock. None: frames have no partners yet. */
  std::optional<Plan> plan_;
};

PropertyTable<Settings>
Sum::properties ()
{
  return {
      {"ratio", "Ratio",
          "Light of a pixel of the second camera where a pixel of the first "
          "gets 1 in the same time, such as 0.25 with a grey filter; 0: "
          "measured in each pair",
          kReadWrite, &Settings::ratio, 0.0, 1000.0},
      {"measured-ratio", "Measured ratio", "The ratio of the last pair",
          kReadOnly, &Settings::measured, 0.0, 1000.0},
      {"frames-alone", "Frames alone",
          "Coded frames without a partner, which have no sum", kReadOnly,
          &Settings::alone, guint64 (0), guint64 (G_MAXINT64)},
  };
}

void
Sum::set_up_class (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_sum_debug, "codedexposure-sum", 0,
      "the whole light of both beams");
  install_properties<properties, settings_of, settings_changed> (
      G_OBJECT_CLASS (klass));
  describe_element (klass, "Coded exposure sum", "Filter/Effect/Video",
      "Adds coded frames and the frames of a second camera, in the beam of the "
      "mirrors that are off, to the picture of an ordinary exposure",
      {});
}

bool
sees (const Rectifier *camera, int x, int y)
{
  return !camera || camera->sees (x, y);
}

Result<Plan>
Sum::make_plan (const CodedFormat &format)
{
  const std::optional<PartnerSetup> &partner = tagged ().partner;
  if (!partner)
    return Error{"Coded frames have no partners to be added to: put "
                 "codedexposure-pair before this element."};
  auto partners = PartnerReader::make (*partner, format, {});
  if (!partners)
    return Error{"The frames of the second camera cannot be added: " +
                 partners.error ().message + "."};
  const int bits = significant_bits ();
  const double white = largest_pixel (
      bits > 0 ? bits : int (GST_VIDEO_INFO_COMP_DEPTH (&format.info, 0)));
  const double black = bench () ? bench ()->black () : 0;
  const double ratio = locked (element (), [this] { return settings_.ratio; });
  Image<std::uint8_t> seen (format.size.width, format.size.height);
  for (int y = 0; y < seen.height (); y++)
    for (int x = 0; x < seen.width (); x++)
      seen.at (x, y) = sees (format.rectifier.get (), x, y) &&
                       sees (partners->rectifier (), x, y);
  return Plan{*std::move (partners),
      BeamSum (format.schedule, format.size, ratio, std::move (seen)),
      {.on_white = white - black,
          .off_black = double (partner->black),
          .off_white = white,
          .sum_white = white},
      {}};
}

/* Behind codedexposure-pair, whose second camera has sent nothing yet. */
bool
Sum::waits_for_partners () const
{
  const QueryPtr query (new_query<PairsAnswer> ());
  return !tagged ().partner && gst_pad_peer_query (sinkpad (), query.get ());
}

bool
Sum::plan (const CodedFormat &format, PadCaps &caps)
{
  const CapsPtr rectified = format.rectifier
                                ? format.resized (format.size)
                                : CapsPtr (gst_caps_ref (format.caps.get ()));
  CapsPtr &sum = caps.of (PadKind::all);
  sum.reset (
      scale_caps (rectified.get (), scale_for (format.schedule, nullptr)));
  plan_.reset ();
  if (waits_for_partners ())
    return true;
  auto made = make_plan (format);
  if (!made)
    return post_error (made.error ().message);
  gst_video_info_from_caps (&made->info, sum.get ());
  plan_ = *std::move (made);
  return true;
}

template <typename Pixel>
Result<bool>
Sum::add (CodedFrame &frame, MappedFrame &coded, MappedFrame &sum)
{
  const int bits = significant_bits ();
  ASSIGN_OR_RETURN (const auto other,
      plan_->partners.read<Pixel> (frame.buffer.get (), bits,
          plan_->partners.rectifier () ? &rectify_workers () : nullptr));
  if (!other)
    return false;
  ASSIGN_OR_RETURN (const auto own, light_of (view_of<const Pixel> (coded)));
  const auto view = view_of<Pixel> (sum);
  const double ratio = plan_->sum.add (own, *other, plan_->levels, view);
  frame.meta.saturated = count_saturated (ImageView<const Pixel> (view), bits);
  const ObjectLock lock (element ());
  settings_.measured = ratio;
  return true;
}

GstFlowReturn
Sum::pass_gap (GstCodedPad *pad, GstClockTime pts)
{
  locked (element (), [this] { return ++settings_.alone; });
  pad->state.discont = true;
  gst_pad_push_event (
      GST_PAD (pad), gst_event_new_gap (pts, format ().period ()));
  return GST_FLOW_OK;
}

GstFlowReturn
Sum::process (CodedFrame frame)
{
  const auto served = pads ();
  GstCodedPad *pad = find_pad (*served, PadKind::all);
  if (frame.place != Place::inside)
    return GST_FLOW_OK;
  if (!plan_)
    return pass_gap (pad, frame.pts ());
  MappedFrame coded = map_coded (frame.buffer.get ());
  if (!coded)
    return GST_FLOW_ERROR;
  prepare_allocation (pad, caps_for (pad).get (), 1);
  BufferPtr outbuf;
  MappedFrame sum;
  const GstFlowReturn flow =
      acquire_picture (pad, plan_->info, true, outbuf, sum);
  if (flow != GST_FLOW_OK)
    return flow;
  const auto added = format ().wide () ? add<std::uint16_t> (frame, coded, sum)
                                       : add<std::uint8_t> (frame, coded, sum);
  sum.reset ();
  if (!added)
    return post_decode_error (added.error ());
  if (!*added)
    return pass_gap (pad, frame.pts ());
  note_saturation (frame);
  const SlotPlan &slots = format ().slots;
  const int last = slots.slots () - 1;
  const GstClockTime begin = GstClockTime (slots.start (0));
  describe (outbuf.get (), frame.buffer.get (), frame.meta,
      {plan_->info, -1, frame.pts (), frame.pts () + begin,
          GstClockTime (slots.start (last)) + slots.active () - begin});
  return combine_flow (
      pad, push (pad, std::move (outbuf), format ().period ()));
}

} // namespace

struct GstCodedExposureSum : Instance<GstCodedFilter, Sum> {
};
GST_ELEMENT_REGISTER_DEFINE (codedexposure_sum, "codedexposure-sum",
    GST_RANK_NONE,
    (type_of<GstCodedExposureSum, Sum::set_up_class> (
        "GstCodedExposureSum", coded_filter_type ())))
