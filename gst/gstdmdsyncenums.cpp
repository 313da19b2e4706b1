/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstdmdsyncenums.h"

#include "gstdmdsyncstate.h"

using cexp::SlipObservable;
using cexp::gst::sync::OnLoss;
using cexp::gst::sync::OnUnlock;
using cexp::gst::sync::TimestampAt;

namespace
{

GType
register_enum (gsize &type, const char *name, const GEnumValue *values)
{
  if (g_once_init_enter (&type))
    g_once_init_leave (&type, g_enum_register_static (name, values));
  return type;
}

} // namespace

GType
gst_dmd_sync_timestamp_at_get_type ()
{
  static gsize type = 0;
  static const GEnumValue values[] = {
      {int (TimestampAt::exposure_start), "Start of the first slot",
          "exposure-start"},
      {int (TimestampAt::exposure_end), "End of the last slot", "exposure-end"},
      {int (TimestampAt::arrival),
          "Arrival: one frame period after the start, exposure and readout",
          "arrival"},
      {int (TimestampAt::device_clock),
          "Some instant of each exposure by the camera's own clock, as "
          "aravissrc has it: fitted to when frames arrive, then as arrival",
          "device-clock"},
      {0, nullptr, nullptr},
  };
  return register_enum (type, "GstDmdSyncTimestampAt", values);
}

GType
gst_dmd_sync_on_loss_get_type ()
{
  static gsize type = 0;
  static const GEnumValue values[] = {
      {int (OnLoss::gap), "A GAP event tells of the time that is missing",
          "gap"},
      {int (OnLoss::repeat),
          "The frame before, again, with the flags GAP and DROPPABLE; a gap "
          "of more than 100 frames stays one",
          "repeat"},
      {int (OnLoss::error), "The stream stops with an error", "error"},
      {0, nullptr, nullptr},
  };
  return register_enum (type, "GstDmdSyncOnLoss", values);
}

GType
gst_dmd_sync_on_unlock_get_type ()
{
  static gsize type = 0;
  static const GEnumValue values[] = {
      {int (OnUnlock::keep), "Goes on with the flag CORRUPTED", "keep"},
      {int (OnUnlock::skip), "Is dropped; a GAP event takes its place", "skip"},
      {int (OnUnlock::error), "The stream stops with an error", "error"},
      {0, nullptr, nullptr},
  };
  return register_enum (type, "GstDmdSyncOnUnlock", values);
}

GType
gst_dmd_sync_slip_observable_get_type ()
{
  static gsize type = 0;
  static const GEnumValue values[] = {
      {int (SlipObservable::never), "In no frame", "never"},
      {int (SlipObservable::in_the_frame),
          "In the frame in which it happens, if it happens during the exposure",
          "in-the-frame"},
      {int (SlipObservable::always), "In every frame while it lasts", "always"},
      {0, nullptr, nullptr},
  };
  return register_enum (type, "GstDmdSyncSlipObservable", values);
}
