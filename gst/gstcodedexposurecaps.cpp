/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "gstcodedexposurecaps.h"

namespace cexp::gst
{

CapsScale
CapsScale::inverse () const
{
  CapsScale other;
  other.rate_num = rate_den;
  other.rate_den = rate_num;
  other.width_num = width_den;
  other.width_den = width_num;
  other.height_num = height_den;
  other.height_den = height_num;
  other.crop_rows = -crop_rows;
  return other;
}

CapsScale
coded_to_subframes (const Schedule &schedule, bool raised_rate)
{
  CapsScale scale;
  scale.rate_num = raised_rate ? schedule.slots () : 1;
  scale.width_den = schedule.cell ().width;
  scale.height_den = schedule.cell ().height;
  scale.crop_rows = schedule.pilot_rows ();
  return scale;
}

/* Identity for now. */
GstCaps *
scale_caps (GstCaps *caps, const CapsScale &)
{
  return gst_caps_copy (caps);
}

} // namespace cexp::gst
