/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync's properties. */
#include "common/properties.h"
#include "state.h"

#define GST_CAT_DEFAULT dmdsync_debug

using codedexposure::SlipObservable;
using codedexposure::gst::sync::OnLoss;
using codedexposure::gst::sync::OnUnlock;
using codedexposure::gst::sync::TimestampAt;

#define GST_TYPE_DMD_SYNC_TIMESTAMP_AT (gst_dmd_sync_timestamp_at_get_type ())
static G_DEFINE_ENUM_TYPE (GstDmdSyncTimestampAt, gst_dmd_sync_timestamp_at,
    {int (TimestampAt::exposure_start), "Start of the first slot",
        "exposure-start"},
    {int (TimestampAt::exposure_end), "End of the last slot", "exposure-end"},
    {int (TimestampAt::arrival),
        "Arrival: one frame period after the start, exposure and readout",
        "arrival"},
    {int (TimestampAt::device_clock),
        "Some instant of each exposure by the camera's own clock, fitted to "
        "when frames arrive, then as arrival",
        "device-clock"})

#define GST_TYPE_DMD_SYNC_ON_LOSS (gst_dmd_sync_on_loss_get_type ())
    static G_DEFINE_ENUM_TYPE (GstDmdSyncOnLoss, gst_dmd_sync_on_loss,
        {int (OnLoss::gap), "A GAP event for the missing time", "gap"},
        {int (OnLoss::repeat),
            "The frame before, repeated with the flags GAP and DROPPABLE, up "
            "to "
            "100 times; a GAP event for a longer time",
            "repeat"},
        {int (OnLoss::error), "The stream stops with an error", "error"})

#define GST_TYPE_DMD_SYNC_ON_UNLOCK (gst_dmd_sync_on_unlock_get_type ())
        static G_DEFINE_ENUM_TYPE (GstDmdSyncOnUnlock, gst_dmd_sync_on_unlock,
            {int (OnUnlock::keep), "It is flagged CORRUPTED", "keep"},
            {int (OnUnlock::skip), "It is dropped; a GAP event replaces it",
                "skip"},
            {int (OnUnlock::error), "The stream stops with an error", "error"})

#define GST_TYPE_DMD_SYNC_SLIP_OBSERVABLE                                      \
  (gst_dmd_sync_slip_observable_get_type ())
            static G_DEFINE_ENUM_TYPE (GstDmdSyncSlipObservable,
                gst_dmd_sync_slip_observable,
                {int (SlipObservable::never), "In no frame", "never"},
                {int (SlipObservable::in_the_frame),
                    "In the frame in which it happens, if it happens during "
                    "the exposure",
                    "in-the-frame"},
                {int (SlipObservable::always), "In every frame while it lasts",
                    "always"})

                namespace codedexposure::gst::sync
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
    PROP_PIXEL_FORMAT,
    PROP_LOCKED,
    PROP_SLIP_OBSERVABLE,
    PROP_STATS,
  };

  /* Longer offsets are rejected as typing errors. */
  constexpr gint64 kMaxOffset = 3600 * GST_SECOND;

  std::string text_of (const GValue *value)
  {
    const gchar *text = g_value_get_string (value);
    return text ? text : "";
  }

  /* The text may name a file, which is read before the object lock is taken. */
  void set_schedule (
      GstDmdSync *self, const GParamSpec *pspec, std::string text)
  {
    if (text.empty ())
      text = Settings ().schedule;
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

  void set_property (
      GObject *object, guint id, const GValue *value, GParamSpec *pspec)
  {
    auto *self = GST_DMD_SYNC (object);
    if (id == PROP_SCHEDULE)
      return set_schedule (self, pspec, text_of (value));
    {
      const ObjectLock lock (self);
      if (!may_set (self, pspec))
        return;
      Settings &settings = state (self).settings;
      switch (id) {
      case PROP_DEVICE:
        settings.device = text_of (value);
        break;
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
      case PROP_PIXEL_FORMAT:
        settings.pixel_format = text_of (value);
        break;
      default:
        G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
      }
    }
    update_latency (self);
  }

  GstStructure *stats (const SyncState &st)
  {
    const Counters &counters = st.counters;
    GstStructure *stats =
        gst_structure_new_empty ("application/x-dmdsync-stats");
    const std::pair<const char *, guint64> numbers[] = {
        {"frames-in", counters.frames_in},
        {"frames-lost", counters.frames_lost},
        {"frames-incomplete", counters.frames_incomplete},
        {"frames-late", counters.frames_late},
        {"frames-duplicate", counters.frames_duplicate},
        {"frames-early", counters.frames_early},
        {"frames-skipped", counters.frames_skipped},
        {"frames-repeated", counters.frames_repeated},
        {"slips", counters.slips},
        {"clock-restarts", counters.clock_restarts},
        {"time-uncertainty", counters.time_uncertainty},
    };
    for (const auto &[name, number] : numbers)
      gst_structure_set (stats, name, G_TYPE_UINT64, number, nullptr);
    gst_structure_set (stats, "clock-drift", G_TYPE_DOUBLE,
        counters.clock_drift, "locked", G_TYPE_BOOLEAN, gboolean (st.locked),
        nullptr);
    return stats;
  }

  void get_property (
      GObject *object, guint id, GValue *value, GParamSpec *pspec)
  {
    auto *self = GST_DMD_SYNC (object);
    const ObjectLock lock (self);
    const SyncState &st = state (self);
    const Settings &settings = st.settings;
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
    case PROP_PIXEL_FORMAT:
      return g_value_set_string (value, settings.pixel_format.c_str ());
    case PROP_LOCKED:
      return g_value_set_boolean (value, st.locked);
    case PROP_SLIP_OBSERVABLE:
      return g_value_set_enum (value, int (st.observable));
    case PROP_STATS:
      return g_value_take_boxed (value, stats (st));
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
    }
  }

  /* In the order of the enum: the first ones are set by users. */
  void install_settings (GObjectClass *klass)
  {
    constexpr auto kNull =
        GParamFlags (G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS);
    constexpr auto kReady = GParamFlags (kNull | GST_PARAM_MUTABLE_READY);
    constexpr auto kPlaying = GParamFlags (kNull | GST_PARAM_MUTABLE_PLAYING);
    const Settings defaults;
    guint id = PROP_DEVICE;
    for (GParamSpec *pspec :
        {
            g_param_spec_string ("device", "Device",
                "DMD to control: usb: or lightcrafter: for a board "
                "(docs/dmd.md), sim:NAME[,key=value...] for a simulated one "
                "(docs/timing.md); empty: none, frames are stamped and watched "
                "only; fixed above NULL",
                defaults.device.c_str (), kNull),
            g_param_spec_string ("schedule", "Schedule",
                "Tile, code and timing of the exposure: a preset such as "
                "staircase:2x2 or sequential:lattice:8/3,pilot=16, or a JSON "
                "file",
                defaults.schedule.c_str (), kReady),
            g_param_spec_enum ("timestamp-at", "Timestamp at",
                "The instant that PTS of incoming frames mean; outgoing ones "
                "mean the start of the exposure's first slot",
                GST_TYPE_DMD_SYNC_TIMESTAMP_AT, int (defaults.timestamp_at),
                kPlaying),
            g_param_spec_int64 ("exposure-offset", "Exposure offset",
                "Nanoseconds by which PTS are moved back beyond what "
                "timestamp-at says (negative: forward), at most an hour; adds "
                "to the latency",
                -kMaxOffset, kMaxOffset, defaults.exposure_offset, kPlaying),
            g_param_spec_enum ("on-loss", "On loss",
                "What replaces lost frames", GST_TYPE_DMD_SYNC_ON_LOSS,
                int (defaults.on_loss), kPlaying),
            g_param_spec_enum ("on-unlock", "On unlock",
                "What happens to a frame whose masks are not known to be "
                "synchronised with the exposure",
                GST_TYPE_DMD_SYNC_ON_UNLOCK, int (defaults.on_unlock),
                kPlaying),
            g_param_spec_string ("pixel-format", "Pixel format",
                "PixelFormat of the camera behind a plain aravissrc: Mono10, "
                "Mono12, Mono10Packed, Mono12Packed, Mono10p, Mono12p. Packed "
                "ones are unpacked, without a shift, and the frame's meta has "
                "the significant bits; empty: as the caps say",
                defaults.pixel_format.c_str (), kReady),
        })
      g_object_class_install_property (klass, id++, pspec);
  }

  void install_reports (GObjectClass *klass)
  {
    constexpr auto kReadOnly =
        GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS);
    guint id = PROP_LOCKED;
    for (GParamSpec *pspec : {
             g_param_spec_boolean ("locked", "Locked",
                 "The masks are synchronised with the exposure, as far as "
                 "slip-observable says: the DMD was started, and no slip was "
                 "seen since",
                 FALSE, kReadOnly),
             g_param_spec_enum ("slip-observable", "Slip observable",
                 "In which frames a slip of the DMD by whole slots can be seen "
                 "with the schedule",
                 GST_TYPE_DMD_SYNC_SLIP_OBSERVABLE, int (SlipObservable::never),
                 kReadOnly),
             g_param_spec_boxed ("stats", "Statistics",
                 "All counters at one instant, of this run or the last one "
                 "(docs/formats.md)",
                 GST_TYPE_STRUCTURE, kReadOnly),
         })
      g_object_class_install_property (klass, id++, pspec);
  }

  } // namespace

  void install_properties (GObjectClass * klass)
  {
    klass->set_property = set_property;
    klass->get_property = get_property;
    install_settings (klass);
    install_reports (klass);
    for (const GType type :
        {GST_TYPE_DMD_SYNC_TIMESTAMP_AT, GST_TYPE_DMD_SYNC_ON_LOSS,
            GST_TYPE_DMD_SYNC_ON_UNLOCK, GST_TYPE_DMD_SYNC_SLIP_OBSERVABLE})
      gst_type_mark_as_plugin_api (type, GstPluginAPIFlags (0));
  }

} // namespace codedexposure::gst::sync
