/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-fuse
 * @title: codedexposure-fuse
 * @short_description: Full-resolution frames at N times the camera's rate
 *
 * Takes the frames of a camera behind a micromirror device, in which
 * neighbouring pixels saw different parts of the exposure, and gives n frames
 * for each: at n times the rate, and of the size of the coded frame. Where the
 * picture stands still it keeps the resolution of the whole coded frame; where
 * it moves, it follows the slots.
 *
 * codedexposure-demux gives what was measured, in n small pictures; this
 * element estimates what lies between.
 *
 * ## Time
 *
 * Frame k of a coded frame at time P, of a camera with frame period T, has PTS
 * P + floor (k T / n) and lasts until the next one; OFFSET counts frames. The
 * period comes from the caps, or from #GstCodedFilter:frame-rate where they
 * have none. A lost frame never stretches its neighbours.
 *
 * Without #codedexposure-fuse:lookahead a coded frame is fused as soon as it
 * comes and nothing is added to the latency. With it, a coded frame waits for
 * the next one, and T is added to the latency.
 *
 * Earlier frames help to find what stands still. A lost, corrupted or late
 * frame, a DISCONT and a new segment reset this history. At a negative rate
 * there is none: each coded frame is fused alone.
 *
 * A seek reads the frames on which the first and the last pictures depend, too,
 * so that they are those of the whole stream.
 *
 * ## Schedule and mapping
 *
 * Both are found as by codedexposure-demux. Any code and any tile can be used;
 * `sequential:lattice:4/2` and `sequential:lattice:8/3,order=bit-reversal` give
 * the most accurate pictures. The pilot's rows are cropped. With a mapping,
 * fused frames have the size of the mirrors.
 *
 * ## Quality and speed
 *
 * `quality=fast` runs in real time: 768x576 from 25 to 100 frames/s take a
 * seventh of a core of a fast processor. `balanced` and `best` look for the
 * motion around each pixel, take 30 to 90 times as long, and are for decoding
 * of recordings; #codedexposure-fuse:threads share their work.
 * `learned`, and #codedexposure-fuse:refine with the others, corrects the
 * result by a small network that learned from photographs; nothing else learns
 * from pictures. The network takes up to twice as long as `balanced`, and also
 * sees the coded frame before and, with #codedexposure-fuse:lookahead, the one
 * after.
 * Schedules and noise that it was not trained for post a WARNING, and the
 * result stays as it was.
 *
 * The first and the last slots of an exposure are less accurate than those in
 * its middle, which have others around them. With
 * #codedexposure-fuse:overlap, the last slots of each coded frame and the first
 * ones of the next are fused like more coded frames, in whose middle these
 * slots are, and the estimates are mixed. It takes as many times as long.
 *
 * Tell the element about the camera's noise (#codedexposure-fuse:full-well,
 * #codedexposure-fuse:read-noise), or give it a bench profile, which a
 * recording may carry: it filters more where the noise is larger, and tells
 * motion from noise.
 *
 * ## Uncertainty
 *
 * The request pad `uncertainty` gives a GRAY16_LE frame for each fused frame,
 * with the same time and flags: half the width of the interval that holds 68 %
 * of the errors of each pixel, in 1/65280 of white, which is 1/256 of a grey
 * level of 8 bits. Measured pixels have the noise of the camera, static ones
 * that of their mean, and estimated ones a value that depends on how well their
 * neighbours are predicted and on how the picture changes there, or, where the
 * network refines them, on what it says of its own correction. It is not
 * computed unless the pad is linked.
 *
 * ## Two cameras
 *
 * Coded frames that codedexposure-pair gave partners, frames of a second camera
 * in the beam of the mirrors that are off, are fused with them: light that one
 * camera misses is not lost, and pictures are 1 to 3 dB more accurate. Neither
 * gain nor black level of the second camera need be known. It must see the
 * mirrors as the first one does, or its mapping must be in its stream tag.
 * Where its pixels lie between mirrors, its frames are corrected by what the
 * first camera tells, which takes two to three times as long as `fast`. A
 * frame without a partner gives what one camera gives, and so do the
 * surroundings of saturated pixels of the second camera, which gets most of the
 * light: 16 px to all sides. Such frames take twice the time. Behind a grey
 * filter, the second camera shows highlights that saturate the first:
 * #codedexposure-fuse:range.
 *
 * ## Flags, metas and messages
 *
 * As those of codedexposure-demux: a lost, corrupted or saturated frame is
 * counted and posted, and CORRUPTED and GAP pass to all frames of a coded
 * frame. Frames that show a pattern are replaced by GAP events. Every frame has
 * the custom meta `CodedExposureFrame` with the number of its coded frame, its
 * slot and the time of its light. QoS events are not forwarded upstream,
 * because some camera sources stop their stream for them.
 *
 * ## Example pipelines
 *
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim schedule=sequential:lattice:4/2 full-well=10000 \
 *     ! codedexposure-fuse full-well=10000 \
 *     ! queue ! videoconvert ! autovideosink
 * ]| A simulated bench, shown at full resolution and the raised rate.
 *
 * Since: 0.1
 */
#include "fuse.h"

#include <algorithm>
#include <utility>

#include "base/pixels.h"
#include "base/try.h"
#include "common/element.h"
#include "common/elements.h"
#include "extract/saturation.h"

GST_DEBUG_CATEGORY (codedexposure_fuse_debug);
#define GST_CAT_DEFAULT codedexposure_fuse_debug

using namespace codedexposure;
using namespace codedexposure::gst;

namespace codedexposure::gst::fuse
{

void
Fuse::set_up_class (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_fuse_debug, "codedexposure-fuse", 0,
      "coded frames to full-resolution frames");
  install_properties<properties, settings_of, settings_changed> (
      G_OBJECT_CLASS (klass));
  describe_element (klass, "Coded exposure fusion", "Filter/Effect/Video",
      "Reconstructs full-resolution frames at a multiple of the frame rate "
      "from the frames of a camera behind a micromirror device",
      {});
  add_pad_template (klass, "uncertainty",
      {.presence = GST_PAD_REQUEST,
          .type = coded_pad_type (),
          .caps = GST_VIDEO_CAPS_MAKE ("GRAY16_LE")});
}

Fuse::Fuse (GstElement *element)
    : CodedFilter (element,
          {"application/x-codedexposure-fuse-stats", "frames-out", nullptr})
{
}

/* A coded frame is fused when enough of those after it have come. The fuser
 * compares each with earlier ones, which come later at a negative rate. */
GstFlowReturn
Fuse::process (CodedFrame frame)
{
  const bool alone = is_corrupted (frame.buffer.get ()) || backwards ();
  GstFlowReturn flow = GST_FLOW_OK;
  if (alone) {
    flow = drain ();
    break_history ();
  }
  if (flow == GST_FLOW_OK)
    flow = take (std::move (frame));
  if (flow == GST_FLOW_OK && alone) {
    flow = drain ();
    break_history ();
  }
  while (flow == GST_FLOW_OK && int (waiting_.size ()) > plan_->reach.lookahead)
    flow = push_oldest ();
  return flow;
}

/* Frames before those that are asked for are their history, the next one their
 * lookahead. */
GstFlowReturn
Fuse::learn (CodedFrame frame)
{
  const bool needed =
      frame.place == Place::early ||
      std::ranges::any_of (waiting_, [] (const CodedFrame &waiting) {
        return waiting.place == Place::inside;
      });
  if (needed && !backwards ())
    return process (std::move (frame));
  break_history ();
  return GST_FLOW_OK;
}

/* Returns the number of saturated pixels. */
template <typename Pixel>
Result<guint64>
Fuse::take_pixels (GstBuffer *buffer, MappedFrame &coded)
{
  /* Without a mapping, they stay empty. */
  Image<float> errors, errors_of_other;
  const bool wanted = find_pad (*pads (), PadKind::uncertainty) != nullptr;
  std::optional<ImageView<const Pixel>> other;
  if (plan_->partners) {
    ASSIGN_OR_RETURN (other,
        plan_->partners->read<Pixel> (buffer, significant_bits (),
            plan_->partners->rectifier () ? &rectify_workers () : nullptr,
            wanted ? &errors_of_other : nullptr));
  }
  const auto view = view_of<const Pixel> (coded);
  const guint64 saturated = count_saturated (view, significant_bits ());
  const auto rectified = light_of (view, wanted ? &errors : nullptr);
  if (!rectified)
    return rectified.error ();
  const auto view_of_known = [] (Image<float> &image) {
    return image.width () > 0 ? std::optional (image.view ()) : std::nullopt;
  };
  if (other && plan_->correction)
    RETURN_IF_ERROR (std::get<PartnerCorrection<Pixel>> (*plan_->correction)
                         .run (*rectified, plan_->partners->rectified<Pixel> (),
                             view_of_known (errors_of_other), stop_token ()));
  const CodedErrors known{
      view_of_known (errors), view_of_known (errors_of_other)};
  if (const auto taken =
          std::get<Fuser<Pixel>> (plan_->fuser).take (*rectified, other, known);
      !taken)
    return taken.error ();
  return saturated;
}

/* Gives the pixels of @frame to the fuser and keeps the rest. */
GstFlowReturn
Fuse::take (CodedFrame frame)
{
  GstBuffer *buffer = frame.buffer.get ();
  {
    MappedFrame coded = map_coded (buffer);
    if (!coded)
      return GST_FLOW_ERROR;
    const auto saturated = format ().wide ()
                               ? take_pixels<std::uint16_t> (buffer, coded)
                               : take_pixels<std::uint8_t> (buffer, coded);
    if (!saturated)
      return post_decode_error (saturated.error ());
    frame.meta.saturated = *saturated;
  }
  note_saturation (frame);

  BufferPtr description (gst_buffer_new ());
  copy_description (buffer, format ().info, description.get ());
  frame.buffer = std::move (description);
  waiting_.push_back (std::move (frame));
  return GST_FLOW_OK;
}

/* A buffer for each slot. */
GstFlowReturn
Fuse::acquire_all (Pictures &pictures) const
{
  const auto n = std::size_t (format ().schedule.slots ());
  prepare_allocation (pictures.pad, caps_for (pictures.pad).get (), guint (n));
  pictures.mapped = std::vector<MappedFrame> (n);
  pictures.buffers.resize (n);
  for (std::size_t k = 0; k < n; k++) {
    const GstFlowReturn flow = acquire_picture (pictures.pad, pictures.info,
        k == 0, pictures.buffers[k], pictures.mapped[k]);
    if (flow != GST_FLOW_OK)
      return flow;
  }
  return GST_FLOW_OK;
}

/* Fuses the oldest coded frame that waits; there are no buffers on an error,
 * which is posted unless it is a flush. */
GstFlowReturn
Fuse::render (Pictures &fused, Pictures *uncertainty)
{
  for (Pictures *pictures : {&fused, uncertainty})
    if (const GstFlowReturn flow =
            pictures ? acquire_all (*pictures) : GST_FLOW_OK;
        flow != GST_FLOW_OK) {
      fused.buffers.clear ();
      return flow;
    }
  const std::stop_token stop = stop_token ();
  const Result<void> done = std::visit (
      [&]<typename Pixel> (Fuser<Pixel> &fuser) {
        std::vector<ImageView<Pixel>> views;
        for (MappedFrame &frame : fused.mapped)
          views.push_back (view_of<Pixel> (frame));
        std::vector<ImageView<std::uint16_t>> deviations;
        if (uncertainty)
          for (MappedFrame &frame : uncertainty->mapped)
            deviations.push_back (view_of<std::uint16_t> (frame));
        return fuser.fuse (views, stop, deviations);
      },
      plan_->fuser);
  if (done)
    return GST_FLOW_OK;
  fused.buffers.clear ();
  return post_decode_error (done.error ());
}

GstFlowReturn
Fuse::push_one (Pictures &pictures, const CodedFrame &coded, int k)
{
  const SlotPlan &slots = format ().slots;
  const GstClockTime pts = coded.pts_of (k, slots.slots (), format ().rate);
  const GstClockTime duration = boundary (k + 1) - boundary (k);
  if (!is_within (pts, duration))
    return GST_FLOW_OK;
  BufferPtr &outbuf = pictures.buffers[std::size_t (k)];
  describe (outbuf.get (), coded.buffer.get (), coded.meta,
      {.info = pictures.info,
          .index = k,
          .pts = pts,
          .exposure_start = coded.pts () + GstClockTime (slots.start (k)),
          .exposure_duration = GstClockTime (slots.active ()),
          .has_all_bits = pictures.pad->state.kind == PadKind::uncertainty});
  const GstFlowReturn flow =
      pictures.pad->state.kind == PadKind::all
          ? push (pictures.pad, std::move (outbuf), duration)
          : push_picture (pictures.pad, std::move (outbuf), duration);
  return combine_flow (pictures.pad, flow);
}

/* The oldest frame that waits is not asked for: frames after it may be. */
GstFlowReturn
Fuse::pass_oldest ()
{
  const auto done =
      std::visit ([] (auto &fuser) { return fuser.pass (); }, plan_->fuser);
  waiting_.pop_front ();
  return done ? GST_FLOW_OK : post_decode_error (done.error ());
}

/* Buffers are pushed one by one, because a sink would show a whole list at the
 * time of its first buffer. */
GstFlowReturn
Fuse::push_oldest ()
{
  if (waiting_.front ().place != Place::inside)
    return pass_oldest ();
  const auto served = pads ();
  Pictures fused{find_pad (*served, PadKind::all), plan_->fused};
  Pictures uncertainty{
      find_pad (*served, PadKind::uncertainty), plan_->uncertainty};
  const bool wanted = uncertainty.pad && is_wanted (GST_PAD (uncertainty.pad));
  GstFlowReturn flow = render (fused, wanted ? &uncertainty : nullptr);
  for (Pictures *pictures : {&fused, &uncertainty})
    pictures->mapped.clear ();
  const CodedFrame coded = std::move (waiting_.front ());
  waiting_.pop_front ();
  if (flow == GST_FLOW_FLUSHING)
    break_history ();
  const int n = int (fused.buffers.size ());
  for (int i = 0; i < n && flow == GST_FLOW_OK; i++) {
    const int k = backwards () ? n - 1 - i : i;
    flow = push_one (fused, coded, k);
    if (flow == GST_FLOW_OK && wanted)
      flow = push_one (uncertainty, coded, k);
  }
  return flow;
}

GstFlowReturn
Fuse::drain ()
{
  GstFlowReturn flow = GST_FLOW_OK;
  while (!waiting_.empty () && flow == GST_FLOW_OK)
    flow = push_oldest ();
  return flow;
}

void
Fuse::break_history ()
{
  waiting_.clear ();
  if (plan_)
    std::visit ([] (auto &fuser) { fuser.forget (); }, plan_->fuser);
}

std::stop_token
Fuse::stop_token () const
{
  const ObjectLock lock (element ());
  return stop_.get_token ();
}

void
Fuse::cancel ()
{
  const ObjectLock lock (element ());
  stop_.request_stop ();
}

void
Fuse::resume ()
{
  const ObjectLock lock (element ());
  stop_ = std::stop_source ();
}

} // namespace codedexposure::gst::fuse

struct GstCodedExposureFuse : Instance<GstCodedFilter, gst::fuse::Fuse> {
};
GST_ELEMENT_REGISTER_DEFINE (codedexposure_fuse, "codedexposure-fuse",
    GST_RANK_NONE,
    (type_of<GstCodedExposureFuse, gst::fuse::Fuse::set_up_class> (
        "GstCodedExposureFuse", coded_filter_type ())))
