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
 * frame, a DISCONT, a seek and a new segment reset this history. At a negative
 * rate there is none: each coded frame is fused alone.
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
 * `quality=fast` runs in real time: 768x576 from 25 to 100 frames/s take less
 * than half of a core of a fast processor. `balanced` and `best` look for the
 * motion around each pixel, take a hundred times as long, and are for decoding
 * of recordings; #codedexposure-fuse:threads share their work.
 * `learned`, and #codedexposure-fuse:refine with the others, corrects the
 * result by a small network that learned from photographs; nothing else learns
 * from pictures. Schedules and noise that it was not trained for post a
 * WARNING, and the result stays as it was.
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
 * neighbours are predicted and on how the picture changes there. It is not
 * computed unless the pad is linked.
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

#include <cmath>
#include <utility>

#include "base/workers.h"
#include "common/element.h"
#include "common/elements.h"
#include "common/tag.h"
#include "extract/saturation.h"

GST_DEBUG_CATEGORY_STATIC (codedexposure_fuse_debug);
#define GST_CAT_DEFAULT codedexposure_fuse_debug

using namespace codedexposure;
using namespace codedexposure::gst;

struct _GstCodedExposureFuse {
  GstCodedFilter parent;
};

G_DEFINE_TYPE_WITH_CODE (GstCodedExposureFuse, gst_coded_exposure_fuse,
    GST_TYPE_CODED_FILTER,
    GST_DEBUG_CATEGORY_INIT (codedexposure_fuse_debug, "codedexposure-fuse", 0,
        "coded frames to full-resolution frames"))
GST_ELEMENT_REGISTER_DEFINE (codedexposure_fuse, "codedexposure-fuse",
    GST_RANK_NONE, gst_coded_exposure_fuse_get_type ())

static void
gst_coded_exposure_fuse_class_init (GstCodedExposureFuseClass *klass)
{
  gst::fuse::Fuse::set_up_class (klass);
}

static void
gst_coded_exposure_fuse_init (GstCodedExposureFuse *element)
{
  adopt_filter (
      GST_CODED_FILTER (element), std::make_unique<gst::fuse::Fuse> (element));
}

namespace codedexposure::gst::fuse
{

G_DEFINE_ENUM_TYPE (GstCodedExposureQuality, gst_coded_exposure_quality,
    {int (FuseQuality::kFast), "one linear filter a pixel, in real time",
        "fast"},
    {int (FuseQuality::kBalanced),
        "the filter of the motion that fits around each pixel", "balanced"},
    {int (FuseQuality::kBest),
        "more motions, and collaborative filtering of similar blocks; for "
        "recordings",
        "best"},
    {int (FuseQuality::kLearned),
        "best, then refined by a network that learned from pictures",
        "learned"});

const PropertyTable<Settings> &
Fuse::properties ()
{
  static const PropertyTable<Settings> table{
      {"quality", "Quality",
          "Quality against speed; all but fast are for up to 16 slots",
          kReadWrite, &FuseOptions::quality,
          gst_coded_exposure_quality_get_type ()},
      {"refine", "Refine",
          "Refine the result by a network that learned from pictures, as "
          "quality=learned does with best; for one-hot codes of 2 to 16 slots, "
          "others stay as they are, with a warning",
          kReadWrite, &FuseOptions::refine},
      {"lookahead", "Lookahead",
          "Coded frames to wait for before one is fused; static pixels are "
          "then known from the first frame on; each adds a frame period to the "
          "latency",
          kReadWrite, &FuseOptions::lookahead, 0u,
          guint (Fuser<std::uint8_t>::kMaxLookahead)},
      {"threads", "Threads",
          "Threads, which do not change pixels; 0: one for each processor, and "
          "for quality fast without refine, the streaming thread only",
          kReadWrite, &FuseOptions::threads, 0u, guint (Workers::kMost)},
      {"full-well", "Full well",
          "Electrons at white in a pixel that is on for the whole exposure, as "
          "in codedexposure-sim; determines the shot noise; 0: the frames are "
          "noise-free; -1: by the bench profile, or noise-free",
          kReadWrite, within (&FuseOptions::noise, &SensorNoise::full_well),
          Settings::kUnset, SensorNoise::kMaxFullWell},
      {"read-noise", "Read noise",
          "Noise of the camera's electronics in electrons rms; counts only "
          "with a full-well; -1: that of the bench profile, or none",
          kReadWrite, within (&FuseOptions::noise, &SensorNoise::read_noise),
          Settings::kUnset, SensorNoise::kMaxReadNoise},
  };
  return table;
}

Settings &
Fuse::settings_of (GObject *object)
{
  return static_cast<Fuse &> (filter_of (object)).settings_;
}

void
Fuse::set_up_class (gpointer klass)
{
  install_properties<properties, settings_of, settings_changed> (
      G_OBJECT_CLASS (klass));
  describe_element (klass, "Coded exposure fusion", "Filter/Effect/Video",
      "Reconstructs full-resolution frames at a multiple of the frame rate "
      "from the frames of a camera behind a micromirror device",
      {});
  add_pad_template (klass, "uncertainty",
      {.presence = GST_PAD_REQUEST,
          .type = GST_TYPE_CODED_PAD,
          .caps = GST_VIDEO_CAPS_MAKE ("GRAY16_LE")});
  auto *element = GST_ELEMENT_CLASS (klass);
  element->request_new_pad = [] (GstElement *self, GstPadTemplate *,
                                 const gchar *, const GstCaps *) noexcept {
    return static_cast<Fuse &> (filter_of (self)).request_pad ();
  };
  element->release_pad = [] (GstElement *self, GstPad *pad) noexcept {
    static_cast<Fuse &> (filter_of (self)).release_pad (pad);
  };
}

namespace
{

/* Flags of frames that others cannot be compared with. */
constexpr guint kUnfit = GST_BUFFER_FLAG_CORRUPTED | GST_BUFFER_FLAG_GAP;

} // namespace

Fuse::Fuse (GstCodedExposureFuse *element)
    : CodedFilter (GST_CODED_FILTER (element),
          {"application/x-codedexposure-fuse-stats", "frames-out", nullptr}),
      srcpad_ (new_source_pad ("src", "src", PadKind::all)),
      uncertainty_ (GST_ELEMENT (element))
{
  gst_flow_combiner_add_pad (combiner_.get (), GST_PAD (srcpad_.get ()));
  gst_element_add_pad (this->element (), GST_PAD (srcpad_.get ()));
}

/* A coded frame is fused when enough of those after it have come. The fuser
 * compares each with earlier ones, which come later at a negative rate. */
GstFlowReturn
Fuse::process (CodedFrame frame)
{
  serve_requested ();
  const bool alone = frame.has_flags (kUnfit) || backwards ();
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
  while (flow == GST_FLOW_OK && int (waiting_.size ()) > plan_->lookahead)
    flow = push_oldest ();
  return flow;
}

/* Returns the number of saturated pixels. */
template <typename Pixel>
Result<guint64>
Fuse::take_pixels (MappedFrame &coded)
{
  const auto view = view_of<const Pixel> (coded);
  const guint64 saturated = count_saturated (view, significant_bits ());
  const auto rectified = rectify (view);
  if (!rectified)
    return rectified.error ();
  if (const auto taken =
          std::get<Fuser<Pixel>> (plan_->fuser).take (*rectified);
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
                               ? take_pixels<std::uint16_t> (coded)
                               : take_pixels<std::uint8_t> (coded);
    if (!saturated)
      return post_decode_error (saturated.error ());
    frame.meta.saturated = *saturated;
  }
  note_saturation (frame);

  BufferPtr description (gst_buffer_new ());
  gst_buffer_copy_into (description.get (), buffer,
      GstBufferCopyFlags (GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS),
      0, -1);
  copy_metas (buffer, format ().info, description.get (), format ().info);
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
  const std::stop_token stop = [this] {
    const ObjectLock lock (element ());
    return stop_.get_token ();
  }();
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
  return done.error ().code == ErrorCode::cancelled
             ? GST_FLOW_FLUSHING
             : post_decode_error (done.error ());
}

GstFlowReturn
Fuse::push_one (Pictures &pictures, const CodedFrame &coded, int k)
{
  const SlotPlan &slots = format ().slots;
  const GstClockTime pts = coded.pts () + boundary (k);
  const GstClockTime duration = boundary (k + 1) - boundary (k);
  if (!is_within (pts, duration))
    return GST_FLOW_OK;
  BufferPtr &outbuf = pictures.buffers[std::size_t (k)];
  describe (outbuf.get (), coded.buffer.get (), coded.meta,
      {pictures.info, k, pts, coded.pts () + GstClockTime (slots.start (k)),
          GstClockTime (slots.active ())});
  const GstFlowReturn flow =
      pictures.pad == srcpad_.get ()
          ? push (pictures.pad, std::move (outbuf), duration)
          : push_picture (pictures.pad, std::move (outbuf), duration);
  return combine_flow (pictures.pad, flow);
}

/* Buffers are pushed one by one, because a sink would show a whole list at the
 * time of its first buffer. */
GstFlowReturn
Fuse::push_oldest ()
{
  const ObjectPtr<GstCodedPad> pad = uncertainty_pad ();
  Pictures fused{srcpad_.get (), plan_->fused};
  Pictures uncertainty{pad.get (), plan_->uncertainty};
  const bool wanted = pad && is_wanted (GST_PAD (pad.get ()));
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

/* ------------------------------------------------------------------ pads -- */

GstPad *
Fuse::request_pad ()
{
  GstPad *pad = uncertainty_.add (GST_PAD (
      new_source_pad ("uncertainty", "uncertainty", PadKind::uncertainty)
          .release ()));
  if (!pad)
    GST_WARNING_OBJECT (element (),
        "pad uncertainty exists; put a tee after it to use it twice");
  return pad;
}

void
Fuse::release_pad (GstPad *pad)
{
  {
    const ObjectLock lock (element ());
    CodedPad &coded = GST_CODED_PAD (pad)->coded;
    if (std::exchange (coded.served, false))
      gst_flow_combiner_remove_pad (combiner_.get (), pad);
    coded.released = true;
  }
  uncertainty_.release (pad);
}

/* The pad, if it was requested and has the events that came before. */
ObjectPtr<GstCodedPad>
Fuse::uncertainty_pad () const
{
  ObjectPtr<GstPad> pad = uncertainty_.get ();
  const ObjectLock lock (element ());
  return ObjectPtr<GstCodedPad> (pad && GST_CODED_PAD (pad.get ())->coded.served
                                     ? GST_CODED_PAD (pad.release ())
                                     : nullptr);
}

void
Fuse::each_pad (const PadVisitor &visit) const
{
  visit (srcpad_.get ());
  if (const auto pad = uncertainty_pad ())
    visit (pad.get ());
}

/* A pad that was requested since the last event or frame gets the events of the
 * other one. On the streaming thread, which is the only one that sends them. */
void
Fuse::serve_requested ()
{
  const ObjectPtr<GstPad> pad = uncertainty_.get ();
  if (!pad || uncertainty_pad ())
    return;
  GstCodedPad *coded = GST_CODED_PAD (pad.get ());
  std::vector<EventPtr> events;
  gst_pad_sticky_events_foreach (
      GST_PAD (srcpad_.get ()),
      [] (GstPad *, GstEvent **event, gpointer to) noexcept -> gboolean {
        static_cast<std::vector<EventPtr> *> (to)->emplace_back (
            gst_event_ref (*event));
        return TRUE;
      },
      &events);
  for (EventPtr &event : events) {
    const GstEventType type = GST_EVENT_TYPE (event.get ());
    if (type == GST_EVENT_STREAM_START)
      event = stream_start_for (coded, event.get ());
    else if (type == GST_EVENT_CAPS)
      event.reset (gst_event_new_caps (caps_for (coded).get ()));
    else if (type == GST_EVENT_TAG && why_not_coded (event.get ()))
      event.reset (
          provenance_to_event (provenance_for (coded, *provenance ())));
    gst_pad_push_event (pad.get (), event.release ());
  }
  const ObjectLock lock (element ());
  if (coded->coded.released)
    return;
  coded->coded.served = true;
  gst_flow_combiner_add_pad (combiner_.get (), pad.get ());
}

GstFlowReturn
Fuse::combine_flow (GstCodedPad *pad, GstFlowReturn flow)
{
  const ObjectLock lock (element ());
  if (pad->coded.released)
    return GST_FLOW_OK;
  return gst_flow_combiner_update_pad_flow (
      combiner_.get (), GST_PAD (pad), flow);
}

void
Fuse::flushed ()
{
  const ObjectLock lock (element ());
  gst_flow_combiner_reset (combiner_.get ());
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

/* ------------------------------------------------------------------ plan -- */

std::string
Fuse::method_name () const
{
  auto *qualities =
      G_ENUM_CLASS (g_type_class_peek (gst_coded_exposure_quality_get_type ()));
  const bool learned = in_force_.quality == FuseQuality::kLearned;
  const auto quality = learned ? FuseQuality::kBest : in_force_.quality;
  std::string name = std::string ("fuse ") +
                     g_enum_get_value (qualities, int (quality))->value_nick;
  if ((learned || in_force_.refine) && unrefined ().empty ())
    name += ", learned " + refinement_hash ();
  return name;
}

/* Why the result is not refined although it should be. */
std::string
Fuse::unrefined () const
{
  return plan_ ? std::visit (
                     [] (const auto &fuser) { return fuser.unrefined (); },
                     plan_->fuser)
               : std::string ();
}

/* A pixel at the largest value has seen the light of white_slots () slots. */
SensorNoise
Fuse::noise (const Schedule &schedule) const
{
  SensorNoise noise = in_force_.noise;
  const BenchProfile *known = bench ();
  if (noise.full_well == Settings::kUnset) {
    const auto electrons =
        known ? known->electrons_per_number () : std::nullopt;
    noise.full_well = electrons.value_or (0.0) *
                      (known ? known->largest () : 0) * schedule.slots () /
                      schedule.white_slots ();
  }
  if (noise.read_noise == Settings::kUnset)
    noise.read_noise =
        known && known->read_noise ? known->read_noise->value : 0.0;
  return noise;
}

/* Relative noise of a plain exposure at typical light, if the camera is
 * described. */
RectifyOptions
Fuse::rectify_options (const Schedule &schedule) const
{
  constexpr double kTypicalLight = 0.4;
  const SensorNoise noise = this->noise (schedule);
  RectifyOptions options;
  if (noise.full_well > 0.0)
    options.noise = std::clamp (
        std::sqrt (noise.variance (kTypicalLight * noise.full_well, 0.0)) /
            noise.full_well,
        RectifyOptions::kMinNoise, RectifyOptions::kMaxNoise);
  return options;
}

namespace
{

template <typename Pixel>
Result<AnyFuser>
make_fuser (const CodedFormat &format, const FuseOptions &options)
{
  auto made = Fuser<Pixel>::make (
      format.schedule, format.size.width, format.size.height, options);
  if (!made)
    return made.error ();
  return AnyFuser (std::move (*made));
}

/* Rate times N, and the pilot's rows cropped. */
CapsScale
coded_to_fused (const Schedule &schedule)
{
  return {.rate = {schedule.slots ()}, .crop_rows = schedule.pilot_rows ()};
}

CapsPtr
of_sixteen_bits (GstCaps *caps)
{
  CapsPtr wide (gst_caps_copy (caps));
  gst_caps_set_simple (
      wide.get (), "format", G_TYPE_STRING, "GRAY16_LE", nullptr);
  return wide;
}

} // namespace

bool
Fuse::plan (const CodedFormat &format)
{
  FuseOptions options = in_force_;
  options.bits = significant_bits ();
  options.noise = noise (format.schedule);
  auto fuser = format.wide () ? make_fuser<std::uint16_t> (format, options)
                              : make_fuser<std::uint8_t> (format, options);
  if (!fuser) {
    post_error (fuser.error ().message);
    return false;
  }
  const CapsPtr rectified = format.rectifier
                                ? format.resized (format.size)
                                : CapsPtr (gst_caps_ref (format.caps.get ()));
  CapsPtr caps (
      scale_caps (rectified.get (), coded_to_fused (format.schedule)));
  Plan made{std::move (*fuser), {}, {}, options.lookahead};
  gst_video_info_from_caps (&made.fused, caps.get ());
  gst_video_info_from_caps (
      &made.uncertainty, of_sixteen_bits (caps.get ()).get ());
  plan_ = std::move (made);
  if (const std::string reason = unrefined (); !reason.empty ())
    POST_WARNING (element (), STREAM, FORMAT,
        "The result is not refined: " + reason + ".");
  const ObjectLock lock (element ());
  caps_ = std::move (caps);
  return true;
}

void
Fuse::planned (bool)
{
  const GstClockTime latency =
      GstClockTime (plan_->lookahead) * boundary (format ().schedule.slots ());
  bool changed;
  {
    const ObjectLock lock (element ());
    changed = std::exchange (shared_.latency, latency) != latency;
  }
  if (changed)
    post_latency (element ());
}

GstClockTime
Fuse::boundary (int k) const
{
  const CodedFormat &now = format ();
  return GstClockTime (now.rate.time_of (0, k, now.schedule.slots ()));
}

void
Fuse::forget ()
{
  waiting_.clear ();
  plan_.reset ();
  const ObjectLock lock (element ());
  caps_.reset ();
}

gboolean
Fuse::forward (EventPtr event)
{
  if (GST_EVENT_IS_SERIALIZED (event.get ()))
    serve_requested ();
  const auto made = provenance ();
  if (const auto pad = uncertainty_pad ()) {
    const bool start = GST_EVENT_TYPE (event.get ()) == GST_EVENT_STREAM_START;
    EventPtr own = start ? stream_start_for (pad.get (), event.get ())
                         : EventPtr (event_for (pad.get (),
                               gst_event_ref (event.get ()), made.get ()));
    gst_pad_push_event (GST_PAD (pad.get ()), own.release ());
  }
  return gst_pad_push_event (GST_PAD (srcpad_.get ()),
      event_for (srcpad_.get (), event.release (), made.get ()));
}

CapsPtr
Fuse::caps_for (const GstCodedPad *pad) const
{
  const ObjectLock lock (element ());
  if (caps_ && pad->coded.kind == PadKind::uncertainty)
    return of_sixteen_bits (caps_.get ());
  return CapsPtr (caps_ ? gst_caps_ref (caps_.get ()) : nullptr);
}

/* The uncertainty has 16 bits, whatever the coded frames have. */
CapsPtr
Fuse::convert_caps (const CapsContext &context, const GstCodedPad *pad,
    GstCaps *caps, bool to_coded) const
{
  CapsPtr converted = CodedFilter::convert_caps (context, pad, caps, to_coded);
  if (pad->coded.kind != PadKind::uncertainty ||
      gst_caps_is_any (converted.get ()))
    return converted;
  if (!to_coded)
    return of_sixteen_bits (converted.get ());
  CapsPtr any (gst_caps_make_writable (converted.release ()));
  for (guint i = 0; i < gst_caps_get_size (any.get ()); i++)
    gst_structure_remove_field (
        gst_caps_get_structure (any.get (), i), "format");
  return any;
}

CapsScale
Fuse::scale_for (const Schedule &schedule, const GstCodedPad *) const
{
  return coded_to_fused (schedule);
}

} // namespace codedexposure::gst::fuse
