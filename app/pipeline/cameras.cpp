/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "cameras.h"

#include <arv.h>

#include "common/raii.h"

namespace codedexposure::app
{

std::vector<std::string>
camera_names ()
{
  std::vector<std::string> names;
  arv_update_device_list ();
  for (guint i = 0; i < arv_get_n_devices (); i++)
    names.emplace_back (arv_get_device_id (i));
  return names;
}

std::string
cameras_found ()
{
  std::string names;
  for (const std::string &name : camera_names ())
    names += (names.empty () ? "" : ", ") + name;
  return names.empty () ? "no camera was found; check its power and its network"
                        : "the cameras that were found are " + names +
                              "; set --camera to one of them";
}

std::optional<double>
camera_exposure (GstElement *camerasrc)
{
  GObject *found = nullptr;
  gst_child_proxy_get (
      GST_CHILD_PROXY (camerasrc), "source::camera", &found, nullptr);
  const gst::ObjectPtr<GObject> camera (found);
  GError *failed = nullptr;
  if (!camera)
    return std::nullopt;
  const double exposure =
      arv_camera_get_exposure_time (ARV_CAMERA (found), &failed);
  const bool known = !failed;
  g_clear_error (&failed);
  return known ? std::optional (exposure) : std::nullopt;
}

} // namespace codedexposure::app
