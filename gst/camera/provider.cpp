/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Lists GenICam cameras as devices of codedexposure-camerasrc. */
#include <arv.h>

#include <memory>
#include <mutex>

#include "camerasrc.h"
#include "common/caps.h"
#include "common/elements.h"

using namespace codedexposure::gst;

namespace
{

/** Searches that were begun or abandoned. */
struct Searches {
  std::mutex lock; // held while the list of devices changes
  int number = 0;
};
struct GstCodedExposureCameraProvider : Instance<GstDeviceProvider, Searches> {
};
struct None {
};
/* A camera in the list. Its name is in the property "id" of its properties. */
struct GstCodedExposureCamera : Instance<GstDevice, None> {
};

constexpr const char *kId = "id";

bool
set_name (GstDevice *device, GstElement *element)
{
  const StructurePtr facts (gst_device_get_properties (device));
  g_object_set (element, "camera-name",
      gst_structure_get_string (facts.get (), kId), nullptr);
  return true;
}

GstElement *
create_element (GstDevice *device, const gchar *name)
{
  GstElement *element =
      gst_element_factory_make ("codedexposure-camerasrc", name);
  if (element)
    set_name (device, element);
  return element;
}

gboolean
reconfigure_element (GstDevice *device, GstElement *element)
{
  return g_str_equal (
             G_OBJECT_TYPE_NAME (element), "GstCodedExposureCameraSrc") &&
         set_name (device, element);
}

GType
camera_type ()
{
  const auto set_up = [] (gpointer klass) {
    GST_DEVICE_CLASS (klass)->create_element = create_element;
    GST_DEVICE_CLASS (klass)->reconfigure_element = reconfigure_element;
  };
  return type_of<GstCodedExposureCamera, set_up> (
      "GstCodedExposureCamera", GST_TYPE_DEVICE);
}

/* Size and rate are known only after a camera was opened, which another program
 * may have done: the caps are those of any camera. */
GstDevice *
make_device (guint number)
{
  const auto known = [] (const char *text) { return text ? text : ""; };
  const std::string vendor = known (arv_get_device_vendor (number));
  const std::string model = known (arv_get_device_model (number));
  const std::string serial = known (arv_get_device_serial_nbr (number));
  const StructurePtr facts (gst_structure_new ("genicam-camera", kId,
      G_TYPE_STRING, arv_get_device_id (number), "vendor", G_TYPE_STRING,
      vendor.c_str (), "model", G_TYPE_STRING, model.c_str (), "serial",
      G_TYPE_STRING, serial.c_str (), "address", G_TYPE_STRING,
      known (arv_get_device_address (number)), "protocol", G_TYPE_STRING,
      known (arv_get_device_protocol (number)), nullptr));
  const CapsPtr caps (gst_caps_from_string (CODED_EXPOSURE_VIDEO_CAPS));
  const std::string name = vendor + " " + model + " " + serial;
  return GST_DEVICE (g_object_new (camera_type (), "display-name",
      name.c_str (), "device-class", "Source/Video/GenICam", "caps",
      caps.get (), "properties", facts.get (), nullptr));
}

/* Searching takes a second, and a broadcast to all networks of the machine. */
GList *
probe (GstDeviceProvider *)
{
  GList *devices = nullptr;
  arv_update_device_list ();
  for (guint number = arv_get_n_devices (); number-- > 0;)
    devices = g_list_prepend (devices, make_device (number));
  return devices;
}

/* A search for a monitor, which shall not wait for it. */
struct Search {
  ObjectPtr<GstDeviceProvider> provider;
  int number;
};

gpointer
find_cameras (gpointer data)
{
  const std::unique_ptr<Search> search (static_cast<Search *> (data));
  GstDeviceProvider *provider = search->provider.get ();
  Searches &searches = as<GstCodedExposureCameraProvider> (provider)->state;
  GList *const devices = probe (provider);
  const std::lock_guard guard (searches.lock);
  for (const GList *at = devices; at; at = at->next) {
    const ObjectPtr<GstDevice> device (
        GST_DEVICE (gst_object_ref_sink (at->data)));
    if (search->number == searches.number)
      gst_device_provider_device_add (provider, device.get ());
  }
  g_list_free (devices);
  return nullptr;
}

gboolean
start (GstDeviceProvider *provider)
{
  Searches &searches = as<GstCodedExposureCameraProvider> (provider)->state;
  const std::lock_guard guard (searches.lock);
  auto search = std::make_unique<Search> (
      Search{ObjectPtr<GstDeviceProvider> (
                 GST_DEVICE_PROVIDER (gst_object_ref (provider))),
          ++searches.number});
  GThread *thread =
      g_thread_try_new ("cameras", find_cameras, search.get (), nullptr);
  if (!thread)
    return FALSE;
  (void)search.release (); // the thread has it
  g_thread_unref (thread);
  return TRUE;
}

void
stop (GstDeviceProvider *provider)
{
  Searches &searches = as<GstCodedExposureCameraProvider> (provider)->state;
  const std::lock_guard guard (searches.lock);
  searches.number++;
}

/* The class is not one of those that programs ask for when they list video
 * sources: only who asks for GenICam cameras has them searched for. */
void
set_up (gpointer klass)
{
  auto *provider_class = GST_DEVICE_PROVIDER_CLASS (klass);
  provider_class->probe = probe;
  provider_class->start = start;
  provider_class->stop = stop;
  gst_device_provider_class_set_static_metadata (provider_class,
      "GenICam cameras", "Source/GenICam",
      "Lists GenICam cameras that Aravis finds",
      "The gst-codedexposure authors");
}

} // namespace

GST_DEVICE_PROVIDER_REGISTER_DEFINE (codedexposure_cameraprovider,
    "codedexposure-cameraprovider", GST_RANK_MARGINAL,
    (type_of<GstCodedExposureCameraProvider, set_up> (
        "GstCodedExposureCameraProvider", GST_TYPE_DEVICE_PROVIDER)))
