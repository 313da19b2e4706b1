/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "cameras.h"

#include <algorithm>
#include <vector>

#include <arv.h>

#include "base/try.h"
#include "common/raii.h"
#include "pipeline/graph.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

std::string
cameras_found ()
{
  std::vector<std::string> found;
  arv_update_device_list ();
  for (guint i = 0; i < arv_get_n_devices (); i++)
    found.emplace_back (arv_get_device_id (i));
  const std::string names = joined (found);
  return names.empty () ? "no camera was found; check its power and its network"
                        : "the cameras that were found are " + names +
                              "; give the name of one of them";
}

std::optional<std::string>
feature_text (ArvDevice *device, const char *name)
{
  ArvGcNode *node = arv_device_get_feature (device, name);
  if (!ARV_IS_GC_FEATURE_NODE (node) ||
      !arv_gc_feature_node_is_available (ARV_GC_FEATURE_NODE (node), nullptr))
    return std::nullopt;
  const char *text = arv_gc_feature_node_get_value_as_string (
      ARV_GC_FEATURE_NODE (node), nullptr);
  return text ? std::optional<std::string> (text) : std::nullopt;
}

namespace
{

/* Null: there is none yet. */
gst::ObjectPtr<GObject>
camera_of (GstElement *camerasrc)
{
  GObject *found = nullptr;
  gst_child_proxy_get (
      GST_CHILD_PROXY (camerasrc), "source::camera", &found, nullptr);
  return gst::ObjectPtr<GObject> (found);
}

/* Why @call, which gets the place of an error, fails; "": it does not. */
template <typename Call>
std::string
failure_of (Call call)
{
  GError *failed = nullptr;
  call (&failed);
  const std::string why = failed ? failed->message : "";
  g_clear_error (&failed);
  return why;
}

/* A number of a camera that keys change. */
struct CameraNumber {
  const char *name;
  void (*range) (ArvCamera *, double *, double *, GError **);
  double (*get) (ArvCamera *, GError **);
  void (*set) (ArvCamera *, double, GError **);
  void (*set_auto) (ArvCamera *, ArvAuto, GError **);
};

constexpr CameraNumber kGain{"gain", arv_camera_get_gain_bounds,
    arv_camera_get_gain, arv_camera_set_gain, arv_camera_set_gain_auto};
constexpr CameraNumber kExposure{"exposure",
    arv_camera_get_exposure_time_bounds, arv_camera_get_exposure_time,
    arv_camera_set_exposure_time, arv_camera_set_exposure_time_auto};

struct Changed {
  double value = 0;
  Between range;
};

/* By steps of a twentieth of the part of its range that lies in @within. */
Result<Changed>
change_number (GstElement *camerasrc, const CameraNumber &number, int steps,
    std::optional<Between> within)
{
  constexpr double kSteps = 20;
  const auto held = camera_of (camerasrc);
  if (!held)
    return Error{"there is no camera yet"};
  if (!text_property (camerasrc, "bench").empty ())
    return Error{"the bench profile was measured at the " +
                 std::string (number.name) +
                 " that the camera has; start without --bench to change it"};
  ArvCamera *camera = ARV_CAMERA (held.get ());
  double low = 0, high = 0;
  std::string why = failure_of (
      [&] (GError **failed) { number.range (camera, &low, &high, failed); });
  if (within) {
    low = std::max (low, within->low);
    high = std::min (high, within->high);
  }
  if (why.empty () && !(high > low))
    why = "it has one only";
  const double before = number.get (camera, nullptr);
  /* Some count in whole numbers. */
  double after = before;
  for (double step = (high - low) / kSteps;
       why.empty () && after == before && step <= high - low; step *= 2) {
    const double wanted = std::clamp (before + steps * step, low, high);
    why = failure_of ([&] (GError **failed) {
      number.set_auto (camera, ARV_AUTO_OFF, nullptr);
      number.set (camera, wanted, failed);
    });
    after = number.get (camera, nullptr);
  }
  if (!why.empty ())
    return Error{"the " + std::string (number.name) +
                 " of the camera cannot be changed: " + why};
  return Changed{after, {low, high}};
}

} // namespace

Result<std::string>
change_gain (GstElement *camerasrc, int steps)
{
  ASSIGN_OR_RETURN (const Changed gain,
      change_number (camerasrc, kGain, steps, std::nullopt));
  return format (
      "gain %.4g (%.4g to %.4g)", gain.value, gain.range.low, gain.range.high);
}

Result<std::string>
change_exposure (GstElement *camerasrc, int steps, Between allowed)
{
  if (!(allowed.high > allowed.low))
    return Error{format ("the exposure stays: the last slot of the schedule "
                         "ends after %.0f us, and the next frame needs its "
                         "trigger; set a schedule with shorter slots",
        allowed.low)};
  ASSIGN_OR_RETURN (const Changed exposure,
      change_number (camerasrc, kExposure, steps, allowed));
  return format (
      "exposure %.0f us (%.0f to %.0f, with which all slots are whole)",
      exposure.value, exposure.range.low, exposure.range.high);
}

} // namespace codedexposure::app
