/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-dmdsync
 * @title: dmdsync
 * @short_description: Drives the DMD, and makes time and phase of coded frames
 * known
 *
 * Comes right after the camera. It programs and starts the micromirror device
 * (DMD), gives every coded frame the time and the number of its exposure, finds
 * lost, late and duplicate frames, and checks whether the masks are
 * synchronised with the exposure. Pixel values stay as they are.
 *
 * ## The DMD
 *
 * NULL to READY opens #dmdsync:device. READY to PAUSED sends the masks of
 * #dmdsync:schedule from a thread of its own, with PROGRESS messages named
 * `upload`; the stream begins when that is done, and a change of state cancels
 * it. The mirrors start when the caps, and with them the frame period, are
 * known, before caps go on: a camera that the DMD triggers waits for its first
 * trigger then. Slots that fit neither the frame period nor the device are an
 * error that names the numbers. PAUSED to READY parks the mirrors, always.
 *
 * Without a device, the element checks and stamps the frames of a DMD that
 * another program controls.
 *
 * ## Time
 *
 * The PTS of outgoing frames is the start of the exposure's first slot; see
 * #dmdsync:timestamp-at and #dmdsync:exposure-offset. What PTS are moved back
 * is latency, and answered as such. DURATION is the frame period of the caps,
 * OFFSET the number of the frame since the start of the stream, lost ones
 * counted. With `timestamp-at=device-clock` the stamps of the camera's own
 * clock are fitted to the pipeline's; both stay on the frame as reference
 * timestamps, `timestamp/x-camera-device` and `timestamp/x-arrival`.
 *
 * |[
 *   mirrors   | slot 0 | slot 1 | ... | slot N-1 | readout | slot 0
 *   PTS means ^ exposure-start                   ^         ^ arrival
 *                                   exposure-end |
 * ]|
 *
 * A step of more than one and a half periods is a loss; #dmdsync:on-loss
 * decides what replaces the lost frames. A frame at the time of the one before
 * is a duplicate and dropped; one at a time that was passed is late, and goes
 * on with DISCONT.
 *
 * A frame flagged RESYNC begins another stretch of the camera's time, as when
 * codedexposure-camerasrc has restarted its camera: its number and PTS follow
 * from when it arrives, and the frames in between are lost.
 *
 * ## Memory
 *
 * A frame that comes from no buffer pool is copied once, into a pool of the
 * element: its source may overwrite the memory, as aravissrc does. All others
 * pass untouched. So frames can be kept downstream as long as needed.
 *
 * ## Phase
 *
 * #dmdsync:slip-observable says whether a DMD that slips by whole slots can be
 * seen with the schedule: `never` for codes that open every element in one
 * slot, `in-the-frame` in which it happens for staircase and s-matrix, `always`
 * with a pilot (`pilot=16` in the schedule). A frame out of phase is CORRUPTED,
 * its meta has `locked` false; see #dmdsync:on-unlock. dmdsync restarts the
 * DMD; frames that show the restart are not flagged any more. `locked` is true
 * only on frames whose pilot shows all of their masks, and absent on frames of
 * which nothing shows whether they are synchronised.
 *
 * With #dmdsync:device external, another program shows the masks, as on a
 * ViALUX board (docs/dmd.md). Nothing is driven or restarted, and nothing that
 * this program says counts as synchronised: with a pilot, it is measured, and
 * without one, it stays unknown, with a warning.
 *
 * ## Two cameras
 *
 * With #dmdsync:beam off, the camera is a second one, in the beam of the
 * mirrors that are off. Its frames are stamped and numbered as those of the
 * first, and tagged for pad `off` of codedexposure-pair. No DMD is driven and
 * no phase watched: the dmdsync of the first camera does both.
 *
 * ## Patterns
 *
 * Any downstream element can request a grating or a code with an event
 * (docs/streams.md, "Patterns on request"). Frames that show it have its name
 * in their meta; they are not coded frames and never locked. The schedule is
 * shown again on request, or when the request expires.
 *
 * ## Metas, messages and tags
 *
 * Every frame has the custom meta `CodedExposureFrame`. Element messages are
 * `codedexposure/frames-lost`, `dmdsync/frame-late`, `dmdsync/frame-dropped`,
 * `dmdsync/slip`, `dmdsync/slip-over`, `dmdsync/locked`,
 * `dmdsync/time-uncertainty`, `dmdsync/pattern-shown` and
 * `dmdsync/pattern-over`. The schedule goes downstream as stream tag; another
 * one in the stream is replaced, with a warning. QoS events go no further
 * upstream: some camera sources stop their stream for them.
 *
 * ## Example pipelines
 *
 * |[
 * gst-launch-1.0 -m videotestsrc num-buffers=800 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim dmd=sim:bench \
 *     ! dmdsync device=sim:bench schedule=staircase:2x2 ! codedexposure-demux \
 *     ! queue ! videoconvert ! autovideosink
 * ]| A simulated bench whose mirrors dmdsync drives.
 * |[
 * gst-launch-1.0 -m videotestsrc num-buffers=800 pattern=ball \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim dmd=sim:bench \
 *     ! dmdsync device=sim:bench,slip-at=401 schedule=sequential:2x2,pilot=16 \
 *     ! fakesink
 * ]| The same with a DMD that misses a trigger in slot 401: `dmdsync/slip` and,
 * after the restart of the DMD, `dmdsync/locked` appear among the messages.
 *
 * Since: 0.1
 */
#include "dmdsync.h"

#include "common/elements.h"

GST_DEBUG_CATEGORY (dmdsync_debug);
#define GST_CAT_DEFAULT dmdsync_debug

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::gst::sync;

namespace
{

G_DEFINE_ENUM_TYPE (GstDmdSyncTimestampAt, gst_dmd_sync_timestamp_at,
    {int (TimestampAt::exposure_start), "Start of the first slot",
        "exposure-start"},
    {int (TimestampAt::exposure_end), "End of the last slot", "exposure-end"},
    {int (TimestampAt::arrival),
        "Arrival: one frame period after the start, exposure and readout",
        "arrival"},
    {int (TimestampAt::device_clock),
        "Some instant of each exposure by the camera's own clock, fitted to "
        "when frames arrive, then as arrival",
        "device-clock"});

G_DEFINE_ENUM_TYPE (GstDmdSyncOnLoss, gst_dmd_sync_on_loss,
    {int (OnLoss::gap), "A GAP event for the missing time", "gap"},
    {int (OnLoss::repeat),
        "The frame before, repeated with the flags GAP and DROPPABLE, up to "
        "100 times; a GAP event for a longer time",
        "repeat"},
    {int (OnLoss::error), "The stream stops with an error", "error"});

G_DEFINE_ENUM_TYPE (GstDmdSyncOnUnlock, gst_dmd_sync_on_unlock,
    {int (OnUnlock::keep), "It is flagged CORRUPTED", "keep"},
    {int (OnUnlock::skip), "It is dropped; a GAP event replaces it", "skip"},
    {int (OnUnlock::error), "The stream stops with an error", "error"});

G_DEFINE_ENUM_TYPE (GstDmdSyncSlipObservable, gst_dmd_sync_slip_observable,
    {int (SlipObservable::never), "In no frame", "never"},
    {int (SlipObservable::in_the_frame),
        "In the frame in which it happens, if it happens during the exposure",
        "in-the-frame"},
    {int (SlipObservable::always), "In every frame while it lasts", "always"});

/* Longer offsets are rejected as typing errors. */
constexpr gint64 kMaxOffset = 3600 * GST_SECOND;

StructurePtr
stats (const SyncState &st)
{
  StructurePtr stats (to_structure (st.counters));
  if (st.locked)
    gst_structure_set (
        stats.get (), "locked", G_TYPE_BOOLEAN, gboolean (*st.locked), nullptr);
  return stats;
}

SlipObservable
observable_slip (const SyncState &st)
{
  const auto &read = st.settings.schedule.read;
  return read && *read ? slip_observable (**read) : SlipObservable::never;
}

/* First those that users set. */
PropertyTable<SyncState>
properties ()
{
  static const auto set = [] (auto member) {
    return within (&SyncState::settings, member);
  };
  return {
      {"device", "Device",
          "DMD to control: usb: or lightcrafter: for a board (docs/dmd.md), "
          "sim:NAME[,key=value...] for a simulated one (docs/timing.md); "
          "external: another program shows the masks, as on a ViALUX board, "
          "and only a pilot can tell whether frames are synchronised; empty: "
          "none, frames are stamped and watched only; fixed above NULL",
          kReadWriteNull, set (&Settings::device)},
      {"schedule", "Schedule",
          "Tile, code and timing of the exposure: a preset such as "
          "staircase:2x2 or sequential:lattice:8/3,pilot=16, or a JSON file",
          kReadWriteReady, set (&Settings::schedule)},
      {"beam", "Beam",
          "The mirrors whose light the camera gets. A second camera, in the "
          "beam of those that are off, sees the complement of every mask: its "
          "frames are stamped and tagged so, and the first camera's dmdsync "
          "drives the DMD and watches the phase; needs an empty device",
          kReadWriteReady, set (&Settings::beam),
          gst_coded_exposure_beam_get_type ()},
      {"bench", "Bench profile",
          "What was measured of the bench, a JSON file or its text "
          "(docs/formats.md), which goes downstream in the tag, with beam=off "
          "that of its second camera; its trigger delay is the exposure-offset "
          "where that is 0; refused if it is of another DMD",
          kReadWriteReady, set (&Settings::bench)},
      {"timestamp-at", "Timestamp at",
          "The instant that PTS of incoming frames mean; outgoing ones mean "
          "the start of the exposure's first slot",
          kReadWrite, set (&Settings::timestamp_at),
          gst_dmd_sync_timestamp_at_get_type ()},
      {"exposure-offset", "Exposure offset",
          "Nanoseconds by which PTS are moved back beyond what timestamp-at "
          "says (negative: forward), at most an hour; adds to the latency; 0: "
          "the trigger delay of the bench profile, or none",
          kReadWrite, set (&Settings::exposure_offset), -kMaxOffset,
          kMaxOffset},
      {"on-loss", "On loss", "What replaces lost frames", kReadWrite,
          set (&Settings::on_loss), gst_dmd_sync_on_loss_get_type ()},
      {"on-unlock", "On unlock",
          "What happens to a frame whose masks are not synchronised with the "
          "exposure; where this is unknown, the frame passes",
          kReadWrite, set (&Settings::on_unlock),
          gst_dmd_sync_on_unlock_get_type ()},
      {"pixel-format", "Pixel format",
          "PixelFormat of the camera behind a plain aravissrc: Mono10, Mono12, "
          "Mono10Packed, Mono12Packed, Mono10p, Mono12p. Packed ones are "
          "unpacked, without a shift, and the frame's meta has the significant "
          "bits; empty: as the caps say",
          kReadWriteReady, set (&Settings::pixel_format)},
      {"locked", "Locked",
          "The masks are known to be synchronised with the exposure: the pilot "
          "of the last frame shows it",
          kReadOnly,
          [] (const SyncState &st) { return st.locked.value_or (false); }},
      {"slip-observable", "Slip observable",
          "In which frames a slip of the DMD by whole slots can be seen with "
          "the schedule",
          kReadOnly, observable_slip, gst_dmd_sync_slip_observable_get_type ()},
      {"stats", "Statistics",
          "All counters at one instant, of this run or the last one "
          "(docs/streams.md)",
          kReadOnly, [] (const SyncState &st) { return stats (st); }},
  };
}

/* READY to PAUSED waits so long for an upload: most devices have their masks by
 * then, and whatever begins with the frames finds them programmed. */
constexpr std::chrono::milliseconds kQuickUpload{1000};

void
say_observable (GstDmdSync *self)
{
  const SyncState &st = self->state;
  const SlipObservable observable = slip_observable (st.schedule);
  if (observable == SlipObservable::always || is_off_beam (self))
    return;
  const std::string schedule = st.schedule.text ();
  const std::string which = observable == SlipObservable::never
                                ? "by whole slots"
                                : "between two exposures";
  const std::string text =
      "A slip of the DMD " + which + " is not observable with " + schedule +
      ", so no frame is known to be synchronised; reserve some rows of mirrors "
      "for a pilot, as in " +
      schedule + ",pilot=16, to see every slip";
  /* What shows the masks does not say when they begin. */
  if (settings_of (self).device == kExternal)
    POST_WARNING (self, RESOURCE, SETTINGS, text);
  else
    POST_INFO (self, RESOURCE, SETTINGS, text);
}

void
begin_run (GstDmdSync *self)
{
  SyncState &st = self->state;
  locked (self, [&] { st.counters = Counters (); });
  say_observable (self);
  if (!st.runner)
    return;
  st.runner->upload (st.schedule);
  st.runner->settle (kQuickUpload);
}

void
forget_stream (GstElement *self)
{
  SyncState &st = state (self);
  st.stream = Stream ();
  const ObjectLock lock (self);
  st.time.reset ();
  st.switches = st.seen_switches = 0;
  st.locked.reset ();
  st.jitter = 0;
  st.latency = 0;
}

/* The schedule before a device is opened, and again because the property may
 * have changed. */
bool
open (GstElement *element)
{
  auto *self = as<GstDmdSync> (element);
  return read_schedule (self) && open_device (self);
}

bool
begin (GstElement *element)
{
  auto *self = as<GstDmdSync> (element);
  if (!read_schedule (self) || !read_bench (self))
    return false;
  begin_run (self);
  return true;
}

constexpr StateHooks kRun{.open = open,
    .begin = begin,
    .halt = park,
    .end = forget_stream,
    .close = close_device};

void
set_up (gpointer klass)
{
  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);
  GST_DEBUG_CATEGORY_INIT (
      dmdsync_debug, "dmdsync", 0, "drives the DMD, times coded frames");
  install_state<GstDmdSync, properties, want_schedule<GstDmdSync>> (klass);
  static const auto set = G_OBJECT_CLASS (klass)->set_property;
  G_OBJECT_CLASS (klass)->set_property = [] (GObject *object, guint id,
                                             const GValue *value,
                                             GParamSpec *pspec) noexcept {
    set (object, id, value, pspec);
    update_latency (as<GstDmdSync> (object));
  };
  describe_element (klass, "DMD synchroniser", "Filter/Video",
      "Drives the DMD of a coded exposure camera; times, counts and watches "
      "its frames");
  install_run<kRun> (klass);
  transform_class->set_caps = GST_DEBUG_FUNCPTR (set_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform_class->src_event = GST_DEBUG_FUNCPTR (src_event);
  transform_class->query = GST_DEBUG_FUNCPTR (query);
  transform_class->generate_output = GST_DEBUG_FUNCPTR (generate_output);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (dmdsync, "dmdsync", GST_RANK_NONE,
    (type_of<GstDmdSync, set_up, set_up_passing> (
        "GstDmdSync", GST_TYPE_BASE_TRANSFORM)))
