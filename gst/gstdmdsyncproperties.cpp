/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync's properties. */
#include "gstdmdsyncenums.h"
#include "gstdmdsyncstate.h"
#include "gstproperties.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace cexp::gst::sync
{

namespace
{

enum {
  PROP_0,
  PROP_DEVICE,
  PROP_SCHEDULE,
  PROP_TIMESTAMP_AT,
  PROP_EXPOSURE_OFFSET,
  PROP_ON_LOSS,
  PROP_ON_UNLOCK,
  PROP_MAX_HOLD,
  PROP_PIXEL_FORMAT,
  PROP_RECONNECT,
  PROP_LOCKED,
  PROP_SLIP_OBSERVABLE,
  PROP_FRAMES_IN,
  PROP_FRAMES_LOST,
  PROP_FRAMES_INCOMPLETE,
  PROP_FRAMES_LATE,
  PROP_FRAMES_DUPLICATE,
  PROP_FRAMES_HELD,
  PROP_SLIPS,
  PROP_STATS,
};

#define DEFAULT_DEVICE ""
#define DEFAULT_SCHEDULE "sequential:2x2"
#define DEFAULT_TIMESTAMP_AT int (TimestampAt::exposure_start)
#define DEFAULT_EXPOSURE_OFFSET 0
#define DEFAULT_ON_LOSS int (OnLoss::gap)
#define DEFAULT_ON_UNLOCK int (OnUnlock::keep)
#define DEFAULT_MAX_HOLD GST_CLOCK_TIME_NONE
#define DEFAULT_PIXEL_FORMAT ""
#define DEFAULT_RECONNECT 0

/* Longer offsets are slips of the pen. */
constexpr gint64 kMaxOffset = 3600 * GST_SECOND;

constexpr auto kNull = GParamFlags (G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS);
constexpr auto kReady = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
constexpr auto kPlaying = GParamFlags (
    G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto kReadOnly =
    GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);

/* The text may name a file: read before the object lock. */
void
set_schedule (GstDmdSync *self, const GParamSpec *pspec, const gchar *given)
{
  const std::string text = given && *given ? given : DEFAULT_SCHEDULE;
  const Result<Schedule> schedule = Schedule::parse (text);
  const ObjectLock lock (self);
  if (!may_set (self, pspec))
    return;
  SyncState &st = state (self);
  st.settings.schedule = text;
  if (schedule)
    st.observable = slip_observable (*schedule);
  else
    GST_WARNING_OBJECT (self, "%s", schedule.error ().message.c_str ());
}

void
set_property (GObject *object, guint id, const GValue *value, GParamSpec *pspec)
{
  auto *self = GST_DMD_SYNC (object);
  if (id == PROP_SCHEDULE)
    return set_schedule (self, pspec, g_value_get_string (value));
  {
    const ObjectLock lock (self);
    if (!may_set (self, pspec))
      return;
    Settings &settings = state (self).settings;
    switch (id) {
    case PROP_DEVICE: {
      const gchar *device = g_value_get_string (value);
      settings.device = device ? device : DEFAULT_DEVICE;
      break;
    }
    case PROP_TIMESTAMP_AT:
      settings.timestamp_at = TimestampAt (g_value_get_enum (value));
      break;
    case PROP_EXPOSURE_OFFSET:
      settings.exposure_offset = g_value_get_int64 (value);
      break;
    case PROP_ON_LOSS:
      settings.on_loss = OnLoss (g_value_get_enum (value));
      break;
    case PROP_ON_UNLOCK:
      settings.on_unlock = OnUnlock (g_value_get_enum (value));
      break;
    case PROP_MAX_HOLD:
      settings.max_hold = g_value_get_uint64 (value);
      break;
    case PROP_PIXEL_FORMAT: {
      const gchar *format = g_value_get_string (value);
      settings.pixel_format = format ? format : DEFAULT_PIXEL_FORMAT;
      break;
    }
    case PROP_RECONNECT:
      settings.reconnect = g_value_get_uint (value);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
    }
  }
  update_latency (self);
}

GstStructure *
stats (const SyncState &st)
{
  const Counters &counters = st.counters;
  return gst_structure_new ("application/x-dmdsync-stats", "frames-in",
      G_TYPE_UINT64, counters.frames_in, "frames-lost", G_TYPE_UINT64,
      counters.frames_lost, "frames-incomplete", G_TYPE_UINT64,
      counters.frames_incomplete, "frames-held", G_TYPE_UINT64,
      counters.frames_held, "frames-spoilt", G_TYPE_UINT64,
      counters.frames_spoilt, "frames-late", G_TYPE_UINT64,
      counters.frames_late, "frames-duplicate", G_TYPE_UINT64,
      counters.frames_duplicate, "frames-early", G_TYPE_UINT64,
      counters.frames_early, "frames-skipped", G_TYPE_UINT64,
      counters.frames_skipped, "frames-repeated", G_TYPE_UINT64,
      counters.frames_repeated, "slips", G_TYPE_UINT64, counters.slips,
      "reconnects", G_TYPE_UINT64, counters.reconnects, "clock-restarts",
      G_TYPE_UINT64, counters.clock_restarts, "clock-drift", G_TYPE_DOUBLE,
      counters.clock_drift, "time-uncertainty", G_TYPE_UINT64,
      counters.time_uncertainty, "locked", G_TYPE_BOOLEAN, gboolean (st.locked),
      nullptr);
}

/* Everything that the streaming thread writes. */
void
get_report (GObject *object, guint id, GValue *value, GParamSpec *pspec)
{
  const SyncState &st = state (GST_DMD_SYNC (object));
  switch (id) {
  case PROP_LOCKED:
    return g_value_set_boolean (value, st.locked);
  case PROP_SLIP_OBSERVABLE:
    return g_value_set_enum (value, int (st.observable));
  case PROP_FRAMES_IN:
    return g_value_set_uint64 (value, st.counters.frames_in);
  case PROP_FRAMES_LOST:
    return g_value_set_uint64 (value, st.counters.frames_lost);
  case PROP_FRAMES_INCOMPLETE:
    return g_value_set_uint64 (value, st.counters.frames_incomplete);
  case PROP_FRAMES_HELD:
    return g_value_set_uint64 (value, st.counters.frames_held);
  case PROP_FRAMES_LATE:
    return g_value_set_uint64 (value, st.counters.frames_late);
  case PROP_FRAMES_DUPLICATE:
    return g_value_set_uint64 (value, st.counters.frames_duplicate);
  case PROP_SLIPS:
    return g_value_set_uint64 (value, st.counters.slips);
  case PROP_STATS:
    return g_value_take_boxed (value, stats (st));
  default:
    G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
  }
}

void
get_property (GObject *object, guint id, GValue *value, GParamSpec *pspec)
{
  auto *self = GST_DMD_SYNC (object);
  const ObjectLock lock (self);
  const Settings &settings = state (self).settings;
  switch (id) {
  case PROP_DEVICE:
    return g_value_set_string (value, settings.device.c_str ());
  case PROP_SCHEDULE:
    return g_value_set_string (value, settings.schedule.c_str ());
  case PROP_TIMESTAMP_AT:
    return g_value_set_enum (value, int (settings.timestamp_at));
  case PROP_EXPOSURE_OFFSET:
    return g_value_set_int64 (value, settings.exposure_offset);
  case PROP_ON_LOSS:
    return g_value_set_enum (value, int (settings.on_loss));
  case PROP_ON_UNLOCK:
    return g_value_set_enum (value, int (settings.on_unlock));
  case PROP_MAX_HOLD:
    return g_value_set_uint64 (value, settings.max_hold);
  case PROP_PIXEL_FORMAT:
    return g_value_set_string (value, settings.pixel_format.c_str ());
  case PROP_RECONNECT:
    return g_value_set_uint (value, settings.reconnect);
  default:
    get_report (object, id, value, pspec);
  }
}

void
install_settings (GObjectClass *klass)
{
  /**
   * dmdsync:device:
   *
   * Name of the DMD: a board, or `sim:NAME` for a simulated one. Empty: no DMD
   * is driven. Fixed above NULL.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_DEVICE,
      g_param_spec_string ("device", "Device",
          "DMD to drive: usb: or lightcrafter: for a board (docs/dmd.md), "
          "sim:NAME[,key=value...] for a simulated one (docs/timing.md); "
          "empty: "
          "none, frames are stamped and watched only; fixed above NULL",
          DEFAULT_DEVICE, kNull));
  /**
   * dmdsync:schedule:
   *
   * Tile, code and timing that the DMD shows. Fixed above READY.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SCHEDULE,
      g_param_spec_string ("schedule", "Schedule",
          "Tile, code and timing of the exposure: a preset such as "
          "staircase:2x2 or sequential:lattice:8/3,pilot=16, or a JSON file",
          DEFAULT_SCHEDULE, kReady));
  /**
   * dmdsync:timestamp-at:
   *
   * What the PTS of incoming frames mean.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_TIMESTAMP_AT,
      g_param_spec_enum ("timestamp-at", "Timestamp at",
          "The instant that PTS of incoming frames mean; outgoing ones mean "
          "the start of the exposure's first slot",
          GST_TYPE_DMD_SYNC_TIMESTAMP_AT, DEFAULT_TIMESTAMP_AT, kPlaying));
  /**
   * dmdsync:exposure-offset:
   *
   * What is known beyond timestamp-at: a trigger delay, the transfer.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_EXPOSURE_OFFSET,
      g_param_spec_int64 ("exposure-offset", "Exposure offset",
          "Nanoseconds by which PTS are moved back beyond what timestamp-at "
          "says (negative: forward), at most an hour; paid for as latency",
          -kMaxOffset, kMaxOffset, DEFAULT_EXPOSURE_OFFSET, kPlaying));
  /**
   * dmdsync:on-loss:
   *
   * What takes the place of lost frames.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_ON_LOSS,
      g_param_spec_enum ("on-loss", "On loss",
          "What takes the place of lost frames", GST_TYPE_DMD_SYNC_ON_LOSS,
          DEFAULT_ON_LOSS, kPlaying));
  /**
   * dmdsync:on-unlock:
   *
   * What becomes of a frame whose masks are not known to be in phase.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_ON_UNLOCK,
      g_param_spec_enum ("on-unlock", "On unlock",
          "What becomes of a frame whose masks are not known to be in phase "
          "with the exposure",
          GST_TYPE_DMD_SYNC_ON_UNLOCK, DEFAULT_ON_UNLOCK, kPlaying));
  /**
   * dmdsync:max-hold:
   *
   * For how long frames may be kept downstream in the memory that they came in.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_MAX_HOLD,
      g_param_spec_uint64 ("max-hold", "Max hold",
          "Nanoseconds after which a frame that is still kept downstream is "
          "copied, since its source writes into its memory again; the default "
          "(-1): half of what the buffers of an aravissrc last, else never",
          0, G_MAXUINT64, DEFAULT_MAX_HOLD, kPlaying));
  /**
   * dmdsync:pixel-format:
   *
   * How the camera packs grey values: aravissrc calls all of more than 8 bits
   * GRAY16_LE, those with 10 and 12 bits and packed ones as well.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_PIXEL_FORMAT,
      g_param_spec_string ("pixel-format", "Pixel format",
          "PixelFormat of the camera: Mono10, Mono12, Mono10Packed, "
          "Mono12Packed, Mono10p, Mono12p. Packed ones are unpacked, without a "
          "shift, and the significant bits said in the frame's meta; empty: "
          "what the caps say",
          DEFAULT_PIXEL_FORMAT, kReady));
  /**
   * dmdsync:reconnect:
   *
   * What becomes of a stream whose camera is unplugged or stops.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_RECONNECT,
      g_param_spec_uint ("reconnect", "Reconnect",
          "How often, in a row, a source is started anew that ended in an "
          "error after its first frame, a second or more apart; 0: never, its "
          "error ends the pipeline",
          0, G_MAXUINT, DEFAULT_RECONNECT, kReady));
}

void
install_counter (GObjectClass *klass, guint id, const char *name,
    const char *nick, const char *blurb)
{
  g_object_class_install_property (klass, id,
      g_param_spec_uint64 (name, nick, blurb, 0, G_MAXUINT64, 0, kReadOnly));
}

void
install_reports (GObjectClass *klass)
{
  /**
   * dmdsync:locked:
   *
   * Whether the masks are in phase with the exposure, as far as the frames can
   * show; see #dmdsync:slip-observable.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_LOCKED,
      g_param_spec_boolean ("locked", "Locked",
          "The masks are in phase with the exposure: the DMD was started, and "
          "no slip was seen since",
          FALSE, kReadOnly));
  /**
   * dmdsync:slip-observable:
   *
   * Whether the schedule lets a slip of the DMD by whole slots be seen.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_SLIP_OBSERVABLE,
      g_param_spec_enum ("slip-observable", "Slip observable",
          "In which frames a slip of the DMD by whole slots can be seen with "
          "the schedule",
          GST_TYPE_DMD_SYNC_SLIP_OBSERVABLE, int (SlipObservable::never),
          kReadOnly));
  install_counter (klass, PROP_FRAMES_IN, "frames-in", "Frames in",
      "Frames that came from the camera");
  install_counter (klass, PROP_FRAMES_LOST, "frames-lost", "Frames lost",
      "Frames that were missing between two that came");
  install_counter (klass, PROP_FRAMES_INCOMPLETE, "frames-incomplete",
      "Frames incomplete",
      "Frames of which a part was missing: flagged, or dropped when they "
      "could not be read");
  install_counter (klass, PROP_FRAMES_HELD, "frames-held", "Frames held",
      "Frames that were kept downstream for longer than max-hold; copied");
  install_counter (klass, PROP_FRAMES_LATE, "frames-late", "Frames late",
      "Frames whose time had passed; they were counted as lost before");
  install_counter (klass, PROP_FRAMES_DUPLICATE, "frames-duplicate",
      "Frames duplicate", "Frames at the time of the one before; dropped");
  install_counter (klass, PROP_SLIPS, "slips", "Slips",
      "Times that the DMD was found to have slipped");
  /**
   * dmdsync:stats:
   *
   * All counters at one instant, of this run or the last one.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_STATS,
      g_param_spec_boxed ("stats", "Statistics",
          "All counters at one instant (docs/formats.md)", GST_TYPE_STRUCTURE,
          kReadOnly));
}

} // namespace

void
install_properties (GObjectClass *klass)
{
  klass->set_property = set_property;
  klass->get_property = get_property;
  install_settings (klass);
  install_reports (klass);
}

} // namespace cexp::gst::sync
