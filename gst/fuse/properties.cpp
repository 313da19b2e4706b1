/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Properties that codedexposure-fuse has beside those of GstCodedFilter. */
#include "common/properties.h"
#include "base/workers.h"
#include "fuse.h"

namespace codedexposure::gst::fuse
{

namespace
{

enum {
  PROP_0,
  PROP_QUALITY,
  PROP_LOOKAHEAD,
  PROP_THREADS,
  PROP_FULL_WELL,
  PROP_READ_NOISE,
};

#define GST_TYPE_CODED_EXPOSURE_QUALITY (gst_coded_exposure_quality_get_type ())
G_DEFINE_ENUM_TYPE (GstCodedExposureQuality, gst_coded_exposure_quality,
    {int (FuseQuality::kFast), "one linear filter a pixel, in real time",
        "fast"},
    {int (FuseQuality::kBalanced),
        "the filter of the motion that fits around each pixel", "balanced"},
    {int (FuseQuality::kBest),
        "more motions, and collaborative filtering of similar blocks; for "
        "recordings",
        "best"})

} // namespace

bool
Fuse::set_own (guint id, const GValue *value)
{
  switch (id) {
  case PROP_QUALITY:
    settings_.quality = FuseQuality (g_value_get_enum (value));
    return true;
  case PROP_LOOKAHEAD:
    settings_.lookahead = int (g_value_get_uint (value));
    return true;
  case PROP_THREADS:
    settings_.threads = int (g_value_get_uint (value));
    return true;
  case PROP_FULL_WELL:
    settings_.noise.full_well = g_value_get_double (value);
    return true;
  case PROP_READ_NOISE:
    settings_.noise.read_noise = g_value_get_double (value);
    return true;
  default:
    return false;
  }
}

bool
Fuse::get_own (guint id, GValue *value) const
{
  switch (id) {
  case PROP_QUALITY:
    g_value_set_enum (value, int (settings_.quality));
    return true;
  case PROP_LOOKAHEAD:
    g_value_set_uint (value, guint (settings_.lookahead));
    return true;
  case PROP_THREADS:
    g_value_set_uint (value, guint (settings_.threads));
    return true;
  case PROP_FULL_WELL:
    g_value_set_double (value, settings_.noise.full_well);
    return true;
  case PROP_READ_NOISE:
    g_value_set_double (value, settings_.noise.read_noise);
    return true;
  default:
    return false;
  }
}

void
Fuse::install_properties (GObjectClass *klass)
{
  use_own_properties (klass);
  gst_type_mark_as_plugin_api (
      GST_TYPE_CODED_EXPOSURE_QUALITY, GstPluginAPIFlags (0));
  /**
   * codedexposure-fuse:quality:
   *
   * How much work a frame is worth. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_QUALITY,
      g_param_spec_enum ("quality", "Quality",
          "How much work a frame is worth; balanced and best are for up to 16 "
          "slots",
          GST_TYPE_CODED_EXPOSURE_QUALITY, int (FuseQuality::kFast),
          kReadWrite));
  /**
   * codedexposure-fuse:lookahead:
   *
   * Coded frames that are waited for before one is fused. Applied at the next
   * frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_LOOKAHEAD,
      g_param_spec_uint ("lookahead", "Lookahead",
          "Coded frames that are waited for before one is fused: what stands "
          "still is then known from the first frame on; each adds a frame "
          "period to the latency",
          0, guint (Fuser<std::uint8_t>::kMaxLookahead), 0, kReadWrite));
  /**
   * codedexposure-fuse:threads:
   *
   * Threads that share the work of balanced and best. Applied at the next
   * frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_THREADS,
      g_param_spec_uint ("threads", "Threads",
          "Threads that balanced and best work on, which changes no pixel; 0: "
          "one for each processor; fast works on the streaming thread",
          0, guint (Workers::kMost), 0, kReadWrite));
  /**
   * codedexposure-fuse:full-well:
   *
   * How much light the camera counts. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_FULL_WELL,
      g_param_spec_double ("full-well", "Full well",
          "Electrons that white makes in a pixel that is open for the whole "
          "exposure, as in codedexposure-sim; the noise of light follows from "
          "it; 0: the frames are noise-free",
          0.0, SensorNoise::kMaxFullWell, 0.0, kReadWrite));
  /**
   * codedexposure-fuse:read-noise:
   *
   * Noise of the camera in the dark. Applied at the next frame.
   *
   * Since: 0.1
   */
  g_object_class_install_property (klass, PROP_READ_NOISE,
      g_param_spec_double ("read-noise", "Read noise",
          "Noise of the camera's electronics in electrons rms; counts only "
          "with a full-well",
          0.0, SensorNoise::kMaxReadNoise, 0.0, kReadWrite));
}

} // namespace codedexposure::gst::fuse
