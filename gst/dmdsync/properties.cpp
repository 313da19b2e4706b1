/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync's properties. */
#include "common/properties.h"
#include "dmdsync.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace codedexposure::gst::sync
{

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
        "device-clock"})

G_DEFINE_ENUM_TYPE (GstDmdSyncOnLoss, gst_dmd_sync_on_loss,
    {int (OnLoss::gap), "A GAP event for the missing time", "gap"},
    {int (OnLoss::repeat),
        "The frame before, repeated with the flags GAP and DROPPABLE, up to "
        "100 times; a GAP event for a longer time",
        "repeat"},
    {int (OnLoss::error), "The stream stops with an error", "error"})

G_DEFINE_ENUM_TYPE (GstDmdSyncOnUnlock, gst_dmd_sync_on_unlock,
    {int (OnUnlock::keep), "It is flagged CORRUPTED", "keep"},
    {int (OnUnlock::skip), "It is dropped; a GAP event replaces it", "skip"},
    {int (OnUnlock::error), "The stream stops with an error", "error"})

G_DEFINE_ENUM_TYPE (GstDmdSyncSlipObservable, gst_dmd_sync_slip_observable,
    {int (SlipObservable::never), "In no frame", "never"},
    {int (SlipObservable::in_the_frame),
        "In the frame in which it happens, if it happens during the exposure",
        "in-the-frame"},
    {int (SlipObservable::always), "In every frame while it lasts", "always"})

/* Longer offsets are rejected as typing errors. */
constexpr gint64 kMaxOffset = 3600 * GST_SECOND;

GstStructure *
stats (const SyncState &st)
{
  const Counters &counters = st.counters;
  GstStructure *stats = gst_structure_new_empty ("application/x-dmdsync-stats");
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
  gst_structure_set (stats, "clock-drift", G_TYPE_DOUBLE, counters.clock_drift,
      "locked", G_TYPE_BOOLEAN, gboolean (st.locked), nullptr);
  return stats;
}

template <typename Member>
Property<SyncState>
own (GParamSpec *spec, Member Settings::*place)
{
  return setting (spec, &SyncState::settings, place);
}

/* First those that users set. */
const PropertyTable<SyncState> &
properties ()
{
  const Settings standard;
  static const PropertyTable<SyncState> table = {
      own (g_param_spec_string ("device", "Device",
               "DMD to control: usb: or lightcrafter: for a board "
               "(docs/dmd.md), sim:NAME[,key=value...] for a simulated one "
               "(docs/timing.md); empty: none, frames are stamped and watched "
               "only; fixed above NULL",
               standard.device.c_str (), kReadWriteNull),
          &Settings::device),
      own (g_param_spec_string ("schedule", "Schedule",
               "Tile, code and timing of the exposure: a preset such as "
               "staircase:2x2 or sequential:lattice:8/3,pilot=16, or a JSON "
               "file",
               standard.schedule.c_str (), kReadWriteReady),
          &Settings::schedule),
      own (g_param_spec_enum ("timestamp-at", "Timestamp at",
               "The instant that PTS of incoming frames mean; outgoing ones "
               "mean the start of the exposure's first slot",
               gst_dmd_sync_timestamp_at_get_type (),
               int (standard.timestamp_at), kReadWrite),
          &Settings::timestamp_at),
      own (g_param_spec_int64 ("exposure-offset", "Exposure offset",
               "Nanoseconds by which PTS are moved back beyond what "
               "timestamp-at says (negative: forward), at most an hour; adds "
               "to the latency",
               -kMaxOffset, kMaxOffset, standard.exposure_offset, kReadWrite),
          &Settings::exposure_offset),
      own (g_param_spec_enum ("on-loss", "On loss", "What replaces lost frames",
               gst_dmd_sync_on_loss_get_type (), int (standard.on_loss),
               kReadWrite),
          &Settings::on_loss),
      own (g_param_spec_enum ("on-unlock", "On unlock",
               "What happens to a frame whose masks are not known to be "
               "synchronised with the exposure",
               gst_dmd_sync_on_unlock_get_type (), int (standard.on_unlock),
               kReadWrite),
          &Settings::on_unlock),
      own (g_param_spec_string ("pixel-format", "Pixel format",
               "PixelFormat of the camera behind a plain aravissrc: Mono10, "
               "Mono12, Mono10Packed, Mono12Packed, Mono10p, Mono12p. Packed "
               "ones are unpacked, without a shift, and the frame's meta has "
               "the significant bits; empty: as the caps say",
               standard.pixel_format.c_str (), kReadWriteReady),
          &Settings::pixel_format),
      reading<SyncState> (
          g_param_spec_boolean ("locked", "Locked",
              "The masks are synchronised with the exposure, as far as "
              "slip-observable says: the DMD was started, and no slip was "
              "seen since",
              FALSE, kReadOnly),
          &SyncState::locked),
      reading<SyncState> (
          g_param_spec_enum ("slip-observable", "Slip observable",
              "In which frames a slip of the DMD by whole slots can be seen "
              "with the schedule",
              gst_dmd_sync_slip_observable_get_type (),
              int (SlipObservable::never), kReadOnly),
          &SyncState::observable),
      reading<SyncState> (
          g_param_spec_boxed ("stats", "Statistics",
              "All counters at one instant, of this run or the last one "
              "(docs/formats.md)",
              GST_TYPE_STRUCTURE, kReadOnly),
          stats),
  };
  return table;
}

/* The text may name a file, which is read before the object lock is taken. */
void
set_schedule (GstDmdSync *self, const GValue *value, const GParamSpec *pspec)
{
  std::string text = Wire<std::string>::get (value);
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

void
set_property (GObject *object, guint id, const GValue *value, GParamSpec *pspec)
{
  auto *self = GST_DMD_SYNC (object);
  if (g_str_equal (pspec->name, "schedule"))
    return set_schedule (self, value, pspec);
  {
    const ObjectLock lock (self);
    if (!may_set (self, pspec))
      return;
    properties ().set (state (self), id, value);
  }
  update_latency (self);
}

} // namespace

void
install_own_properties (GObjectClass *klass)
{
  install_properties<&properties, &state> (klass);
  klass->set_property = set_property;
  for (const GType type : {gst_dmd_sync_timestamp_at_get_type (),
           gst_dmd_sync_on_loss_get_type (), gst_dmd_sync_on_unlock_get_type (),
           gst_dmd_sync_slip_observable_get_type ()})
    gst_type_mark_as_plugin_api (type, GstPluginAPIFlags (0));
}

} // namespace codedexposure::gst::sync
