/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties that codedexposure-demux has beside those of GstCodedFilter. */
#include "common/properties.h"
#include "demux.h"

namespace codedexposure::gst::demux
{

namespace
{

enum {
  PROP_0,
  PROP_METHOD,
  PROP_GAIN,
  PROP_INTERPOLATE,
  PROP_QOS,
  PROP_METHOD_IN_FORCE,
};

G_DEFINE_ENUM_TYPE (GstCodedExposureMethod, gst_coded_exposure_method,
    {int (Method::kAuto),
        "select for one-hot codes without leak, decode for other codes that "
        "can be inverted, else rank",
        "auto"},
    {int (Method::kRank), "subframe k is the k-th smallest pixel of each group",
        "rank"},
    {int (Method::kSelect), "subframe k is the element that is on in slot k",
        "select"},
    {int (Method::kDecode), "solves the code for the light of each slot",
        "decode"})

} // namespace

bool
Demux::set_own (guint id, const GValue *value)
{
  switch (id) {
  case PROP_METHOD:
    settings_.extract.method = Method (g_value_get_enum (value));
    return true;
  case PROP_GAIN:
    settings_.extract.gain = g_value_get_double (value);
    return true;
  case PROP_INTERPOLATE:
    settings_.extract.interpolate = g_value_get_boolean (value);
    return true;
  case PROP_QOS:
    settings_.qos = g_value_get_boolean (value);
    return true;
  default:
    return false;
  }
}

bool
Demux::get_own (guint id, GValue *value) const
{
  switch (id) {
  case PROP_METHOD:
    g_value_set_enum (value, int (settings_.extract.method));
    return true;
  case PROP_GAIN:
    g_value_set_double (value, settings_.extract.gain);
    return true;
  case PROP_INTERPOLATE:
    g_value_set_boolean (value, settings_.extract.interpolate);
    return true;
  case PROP_QOS:
    g_value_set_boolean (value, settings_.qos);
    return true;
  case PROP_METHOD_IN_FORCE:
    g_value_set_enum (value, int (method_));
    return true;
  default:
    return false;
  }
}

void
Demux::install_properties (GObjectClass *klass)
{
  use_own_properties (klass);
  const GType method = gst_coded_exposure_method_get_type ();
  gst_type_mark_as_plugin_api (method, GstPluginAPIFlags (0));
  /**
   * codedexposure-demux:method:
   *
   * How subframes are found in a coded frame. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_METHOD,
      g_param_spec_enum ("method", "Method",
          "How subframes are found in a coded frame", method,
          int (Method::kAuto), kReadWrite));
  /**
   * codedexposure-demux:gain:
   *
   * Factor on the light of a slot, with method decode. Applied at the next
   * frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_GAIN,
      g_param_spec_double ("gain", "Gain",
          "Factor on the light of a slot (method decode); 0: automatic, white "
          "in a slot is white out",
          0.0, ExtractOptions::kMaxGain, 0.0, kReadWrite));
  /**
   * codedexposure-demux:interpolate:
   *
   * Whether the elements are brought to one place before the code is solved.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_INTERPOLATE,
      g_param_spec_boolean ("interpolate", "Interpolate",
          "Interpolate the elements to the centre of their cell before the "
          "code is solved (method decode on raster tiles)",
          TRUE, kReadWrite));
  /**
   * codedexposure-demux:qos:
   *
   * Whether subframes that come too late for their sink are left out.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_QOS,
      g_param_spec_boolean ("qos", "QoS",
          "Leave out subframes that would reach their sink too late, and post "
          "a QoS message for each; off: nothing is ever dropped",
          FALSE, kReadWrite));
  /**
   * codedexposure-demux:method-in-force:
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_METHOD_IN_FORCE,
      g_param_spec_enum ("method-in-force", "Method in force",
          "The method that frames are split by; auto before the first frame; "
          "notifies",
          method, int (Method::kAuto), kReadOnly));
}

} // namespace codedexposure::gst::demux
