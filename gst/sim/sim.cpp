/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-sim
 * @title: codedexposure-sim
 * @short_description: An optical bench in software
 *
 * Plays a camera behind a micromirror device: shows the input to mirrors that
 * step through the masks of a schedule, and gives what a slow camera would see
 * of it, coded frames. With it everything runs that runs on a bench, and the
 * truth is known.
 *
 * ## Rates
 *
 * A coded frame with N slots takes N m input frames, m a whole number: 100
 * frames/s and 4 slots make 25 coded frames/s, 200 frames/s make 50, or 25
 * if a caps filter downstream requires them. The largest rate that
 * downstream takes is chosen.
 *
 * |[
 *   input, m = 2   |0  |1  |2  |3  |4  |5  |6  |7  |8 ...
 *   slots          |0      |1      |2      |3      |0 ...
 *   coded frame    |PTS of input frame 0           |PTS of 8
 * ]|
 *
 * An input frame is constant light from its time until that of the next one,
 * in each pixel as much as its value.
 * Slots lie in the frame as the schedule's timing says (`active`, `switching`,
 * `readout`) and collect what falls into their active time; while mirrors
 * switch and while the camera reads out, light is lost.
 *
 * ## Optics
 *
 * Pixel p of the camera looks at mirror c + shift + R (p - c) / scale, where c
 * is the centre of the picture and R turns by #codedexposure-sim:rotation from
 * x to y, clockwise on the screen. The scene lies on the mirrors one pixel to
 * one mirror; beyond it there is no light. Between mirrors and pixels, which
 * are squares without gaps, light is blurred by a Gaussian of
 * #codedexposure-sim:psf-sigma.
 *
 * Settings are applied at the next coded frame; #codedexposure-sim:dmd and
 * #codedexposure-sim:bench are set before the start.
 *
 * ## Sensor
 *
 * White through all slots makes #codedexposure-sim:full-well electrons; a pixel
 * that is open in one slot of four gets a quarter of them, and as much less
 * signal to noise. Noise depends on #codedexposure-sim:seed, the frame's number
 * and the pixel, and on nothing else: the same seed gives the same bytes. With
 * #codedexposure-sim:gain at 0, white makes white for pixels that are open
 * longest, whatever code, leak and timing are. With no noise, no blur and no
 * misalignment, a `sequential` code gives each pixel its input's value exactly.
 *
 * ## Bench profile
 *
 * With #codedexposure-sim:bench, the bench is the one that was measured: what
 * its profile (docs/formats.md) says of noise, gain, well, black level, bits,
 * leakage, blur and mapping is simulated, unless a property or the schedule
 * says otherwise, and the tag has the profile. The light is such that white
 * fills the range of the camera. The scene lies on the mirrors in the middle of
 * the array. With #codedexposure-sim:dmd, frames come later by the trigger
 * delay, for which dmdsync makes up.
 *
 * ## DMD
 *
 * With #codedexposure-sim:dmd the masks are those of a simulated DMD that a
 * dmdsync with the same device drives, and its schedule is in force; before
 * the mirrors start, coded frames are dark. Without it, the masks step with the
 * frames.
 *
 * ## A second camera
 *
 * With #codedexposure-sim:beam off, the camera is in the beam of the mirrors
 * that are off: it sees the complement of every mask, and the light between
 * masks. Two such elements behind a tee, with the same schedule, are a bench
 * with two cameras, each with optics and noise of its own;
 * codedexposure-pair brings their frames together. Both can look at one
 * simulated DMD: then the second one waits for the first in each slot.
 *
 * ## Gaps, tags and messages
 *
 * A gap, DISCONT, a new segment, new caps, a flush or the end of the stream in
 * the middle of an exposure drops that coded frame: it is counted, and the
 * element message `codedexposure/frame-dropped` has `reason` ("gap",
 * "segment", "caps", "flush" or "eos"), `pts`, `inputs` (frames it had),
 * `needed` and `frames-dropped`. The next coded frame is DISCONT.
 *
 * The schedule goes downstream as the tag `comment=coded-exposure={...}`; such
 * a tag of the input, and one that says how it was decoded, are removed. A
 * coded frame is complete with its last input frame, and is stamped with the
 * first one: the difference is added to the latency.
 *
 * ## Example pipelines
 *
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim full-well=10000 read-noise=5 psf-sigma=0.5 \
 *     ! codedexposure-demux ! queue ! videoconvert ! autovideosink
 * ]| Coded at 25 frames/s, decoded to 100, with the noise of a real camera.
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=200/1 \
 *     ! codedexposure-sim schedule=staircase:2x2,active=9.8ms,switching=0.2ms \
 *     ! video/x-raw,framerate=25/1 ! avenc_ffv1 ! matroskamux \
 *     ! filesink location=staircase.mkv
 * ]| Two input frames a slot, mirrors that take time to switch, recorded.
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim dmd=sim:bench ! dmdsync device=sim:bench \
 *     ! codedexposure-demux ! queue ! videoconvert ! autovideosink
 * ]| The masks come from a simulated DMD, as on a bench.
 *
 * Since: 0.1
 */
#include "sim.h"

#include "common/elements.h"
#include "common/tag.h"

GST_DEBUG_CATEGORY (codedexposure_sim_debug);
#define GST_CAT_DEFAULT codedexposure_sim_debug

using namespace codedexposure;
using namespace codedexposure::gst;
using sim::GstCodedExposureSim;
using sim::SimState;

namespace
{

PropertyTable<SimState>
properties ()
{
  using Optics = BenchOptions;
  constexpr auto kAlignment = &Optics::alignment;
  static const auto optics = [] (auto... path) {
    return within (&SimState::settings, &sim::Settings::optics, path...);
  };
  return {
      {"schedule", "Schedule",
          "Schedule of the coded exposure: a preset such as "
          "\"sequential:2x2\" or \"staircase:2x2,active=9.8ms\", or the path "
          "of a JSON file, or its text; empty: sequential:2x2",
          kReadWrite, within (&SimState::settings, &sim::Settings::schedule)},
      {"dmd", "DMD",
          "Simulated DMD, \"sim:NAME\", whose masks are looked through as a "
          "dmdsync with the same device shows them; its schedule wins over "
          "the property; empty: masks step with the frames",
          kReadWriteReady, within (&SimState::settings, &sim::Settings::dmd)},
      {"bench", "Bench profile",
          "Profile of a bench to simulate, a JSON file or its text "
          "(docs/formats.md): noise, black level, bits, gain, leakage, blur, "
          "mapping and trigger delay, for which other properties and the "
          "schedule win, with beam=off those of its second camera; the tag has "
          "it",
          kReadWriteReady, within (&SimState::settings, &sim::Settings::bench)},
      {"beam", "Beam",
          "The mirrors whose light the camera gets: those that are on, or, as "
          "a second camera beside it, those that are off, which is the "
          "complement of every mask and the light between masks; needs an "
          "empty dmd",
          kReadWriteReady, within (&SimState::settings, &sim::Settings::beam),
          gst_coded_exposure_beam_get_type ()},
      {"psf-sigma", "PSF sigma",
          "Standard deviation of the lens's Gaussian blur in pixels; 0: none; "
          "-1: that of the bench profile, or none",
          kReadWrite, optics (&Optics::psf_sigma), Optics::kUnset,
          Optics::kMaxPsfSigma},
      {"full-well", "Full well",
          "Electrons that white makes in a pixel open in every slot, and the "
          "most it holds; gives shot noise; 0: no noise; -1: by the bench "
          "profile, or no noise",
          kReadWrite, optics (&Optics::full_well), Optics::kUnset,
          Optics::kMaxFullWell},
      {"read-noise", "Read noise",
          "Noise of each reading in electrons rms; needs full-well; -1: that "
          "of the bench profile, or none",
          kReadWrite, optics (&Optics::read_noise), Optics::kUnset,
          Optics::kMaxReadNoise},
      {"bits", "Bits",
          "Significant bits of a pixel, counted from the lowest, for example "
          "12 for a 12-bit camera in GRAY16_LE; 0: those of the bench profile, "
          "or all bits of the format",
          kReadWrite, optics (&Optics::bits), 0, 16},
      {"gain", "Gain",
          "Factor on the light; at 1, white makes white in a pixel open in "
          "every slot; 0: by the bench profile, or such that white makes white "
          "in the pixels that are open longest",
          kReadWrite, optics (&Optics::gain), 0.0, Optics::kMaxGain},
      {"seed", "Seed", "Start of the noise: the same seed gives the same bytes",
          kReadWrite, optics (&Optics::seed), guint64 (0),
          guint64 (G_MAXINT64)},
      {"shift-x", "Horizontal shift",
          "Mirrors by which the camera looks to the right of where it should",
          kReadWrite, optics (kAlignment, &Alignment::shift_x),
          -Optics::kMaxShift, Optics::kMaxShift},
      {"shift-y", "Vertical shift",
          "Mirrors by which the camera looks below where it should", kReadWrite,
          optics (kAlignment, &Alignment::shift_y), -Optics::kMaxShift,
          Optics::kMaxShift},
      {"rotation", "Rotation",
          "Degrees by which the camera is turned clockwise against the "
          "mirrors, about the centre of the picture",
          kReadWrite, optics (kAlignment, &Alignment::rotation), -180.0, 180.0},
      {"scale", "Scale", "Pixels that a mirror is wide in the camera's picture",
          kReadWrite, optics (kAlignment, &Alignment::scale), Optics::kMinScale,
          Optics::kMaxScale},
      {"frames-out", "Frames out", "Coded frames made since the stream started",
          kReadOnly, within (&SimState::counters, &sim::Counters::frames_out),
          guint64 (0), guint64 (G_MAXINT64)},
      {"frames-dropped", "Frames dropped",
          "Coded frames that were begun and not completed, because of a gap, "
          "a flush, new caps or the end of the stream; notifies",
          kReadOnly,
          within (&SimState::counters, &sim::Counters::frames_dropped),
          guint64 (0), guint64 (G_MAXINT64)},
  };
}

constexpr auto &parent = parent_class<GstBaseTransformClass>;

bool
begin_run (GstElement *element)
{
  auto *self = as<GstCodedExposureSim> (element);
  read_again (self, self->state.settings.schedule);
  read_again (self, self->state.settings.bench);
  return sim::begin_stream (self);
}

void
end_run (GstElement *element)
{
  SimState &st = sim::state (element);
  st.stream = sim::Stream ();
  const ObjectLock lock (element);
  st.schedule.reset ();
  st.latency = 0;
}

gboolean
take_caps (GstBaseTransform *trans, GstEvent *event)
{
  const EventPtr kept (gst_event_ref (event));
  if (parent (trans)->sink_event (trans, event))
    return TRUE;
  GstCaps *caps = caps_of (kept.get ());
  sim::explain_refusal (as<GstCodedExposureSim> (trans), caps);
  return FALSE;
}

/* The coded frames are new: what the tags of a scene say of coding ends here.
 * The last tags of a scope are those that a late link gets, so those of the
 * stream keep our schedule. */
gboolean
take_tags (GstBaseTransform *trans, GstEvent *event)
{
  const sim::Stream &stream = as<GstCodedExposureSim> (trans)->state.stream;
  GstTagList *tags = tags_of (event);
  const bool global = gst_tag_list_get_scope (tags) == GST_TAG_SCOPE_GLOBAL;
  if (global || stream.tag_due)
    event = remove_setup_and_provenance (event);
  else
    event =
        replace_setup (event, sim::own_setup (as<GstCodedExposureSim> (trans)));
  return !event || parent (trans)->sink_event (trans, event);
}

gboolean
sink_event (GstBaseTransform *trans, GstEvent *event)
{
  auto *self = as<GstCodedExposureSim> (trans);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_CAPS:
    return take_caps (trans, event);
  case GST_EVENT_TAG:
    return take_tags (trans, event);
  case GST_EVENT_STREAM_START:
    sim::restart (self, sim::Drop::kSegment);
    self->state.stream.tag_due = true;
    /* A dmdsync lets the start of a stream pass when the DMD has its masks. */
    return parent (trans)->sink_event (trans, event) &&
           sim::follow_schedule (self);
  case GST_EVENT_SEGMENT:
    sim::restart (self, sim::Drop::kSegment);
    if (!parent (trans)->sink_event (trans, event))
      return FALSE;
    /* At once, since it is what the caps of a demultiplexer wait for. */
    sim::push_tag (self);
    return TRUE;
  case GST_EVENT_EOS:
    sim::drop_exposure (self, sim::Drop::kEos);
    break;
  case GST_EVENT_FLUSH_STOP:
    sim::restart (self, sim::Drop::kFlush);
    break;
  default:
    break;
  }
  return parent (trans)->sink_event (trans, event);
}

/* A coded frame leaves with its last input frame, and is stamped with the
 * first. */
gboolean
query (GstBaseTransform *trans, GstPadDirection direction, GstQuery *query)
{
  if (!parent (trans)->query (trans, direction, query))
    return FALSE;
  if (direction == GST_PAD_SRC && GST_QUERY_TYPE (query) == GST_QUERY_LATENCY) {
    const ObjectLock lock (trans);
    add_latency (query, sim::state (trans).latency);
  }
  return TRUE;
}

constexpr StateHooks kRun{.begin = begin_run, .end = end_run};

void
set_up (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_sim_debug, "codedexposure-sim", 0,
      "optical bench in software");
  install_state<GstCodedExposureSim, properties,
      want_schedule<GstCodedExposureSim>> (klass);
  install_run<kRun> (klass);

  auto *transform = GST_BASE_TRANSFORM_CLASS (klass);
  /* A video filter works in place where it can; a coded frame needs a buffer
   * of its own while input frames come. */
  transform->transform_ip = nullptr;
  transform->transform_caps = GST_DEBUG_FUNCPTR (sim::transform_caps);
  transform->fixate_caps = GST_DEBUG_FUNCPTR (sim::fixate_caps);
  transform->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform->query = GST_DEBUG_FUNCPTR (query);
  transform->submit_input_buffer = GST_DEBUG_FUNCPTR (sim::submit_input_buffer);
  transform->generate_output = GST_DEBUG_FUNCPTR (sim::generate_output);
  GST_VIDEO_FILTER_CLASS (klass)->set_info = GST_DEBUG_FUNCPTR (sim::set_info);

  describe_element (klass, "Coded exposure simulator", "Filter/Effect/Video",
      "An optical bench in software: turns video into the coded frames of a "
      "slow camera behind a micromirror device");
}

void
set_up_instance (GstCodedExposureSim *self)
{
  auto *trans = GST_BASE_TRANSFORM (self);
  gst_base_transform_set_prefer_passthrough (trans, FALSE);
  /* An instrument drops nothing because it is late. */
  gst_base_transform_set_qos_enabled (trans, FALSE);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_sim, "codedexposure-sim",
    GST_RANK_NONE,
    (type_of<GstCodedExposureSim, set_up, set_up_instance> (
        "GstCodedExposureSim", GST_TYPE_VIDEO_FILTER)))
