/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common/beam.h"

#include <gst/gst.h>

namespace codedexposure::gst
{

/* Each of the plugins has this code, and a process knows a type once. */
GType
gst_coded_exposure_beam_get_type ()
{
  static const GEnumValue values[] = {
      {int (Beam::kOn), "The mirrors that are on", "on"},
      {int (Beam::kOff),
          "The mirrors that are off, as a second camera sees them", "off"},
      {0, nullptr, nullptr}};
  static const GType type = [] {
    constexpr const char *kName = "GstCodedExposureBeam";
    const GType known = g_type_from_name (kName);
    return known != G_TYPE_INVALID ? known
                                   : g_enum_register_static (kName, values);
  }();
  return type;
}

} // namespace codedexposure::gst
