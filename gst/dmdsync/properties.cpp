/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync's properties. */
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
          "and "
          "only a pilot can tell whether frames are synchronised; empty: none, "
          "frames are stamped and watched only; fixed above NULL",
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

} // namespace

void
install_own_state (gpointer klass)
{
  install_state<GstDmdSync, properties, want_schedule<GstDmdSync>> (klass);
  static const auto set = G_OBJECT_CLASS (klass)->set_property;
  G_OBJECT_CLASS (klass)->set_property = [] (GObject *object, guint id,
                                             const GValue *value,
                                             GParamSpec *pspec) noexcept {
    set (object, id, value, pspec);
    update_latency (as<GstDmdSync> (object));
  };
}

} // namespace codedexposure::gst::sync
