/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure camera: which GenICam cameras answer, and what they can do. */
#include <arv.h>

#include <cstdio>
#include <memory>

#include "base/text.h"
#include "command.h"
#include "common/raii.h"
#include "options/board.h"
#include "pipeline/cameras.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

namespace
{

struct Arguments : Printing {
  std::string name;
};

using CameraPtr = gst::ObjectPtr<ArvCamera>;

CameraPtr
open (const std::string &name)
{
  GError *failed = nullptr;
  CameraPtr camera (arv_camera_new (name.c_str (), &failed));
  if (camera)
    return camera;
  const std::string why = failed ? failed->message : "it does not answer";
  g_clear_error (&failed);
  fail ("cannot open the camera " + name + ": " + why + "; " + cameras_found (),
      Exit::no_device);
}

/* As the camera writes it; "": it has no such feature. */
std::string
text_of (ArvCamera *camera, const char *feature)
{
  return feature_text (arv_camera_get_device (camera), feature).value_or ("");
}

using ReadNames = const char **(*)(ArvCamera *, guint *, GError **);

std::vector<std::string>
names_of (ArvCamera *camera, ReadNames read)
{
  guint count = 0;
  const std::unique_ptr<const char *, FreeWith<g_free>> list (
      read (camera, &count, nullptr));
  return {list.get (), list.get () + count};
}

/* Those that coded frames can have. */
std::vector<std::string>
grey_formats (ArvCamera *camera)
{
  std::vector<std::string> grey;
  for (std::string &name :
      names_of (camera, arv_camera_dup_available_pixel_formats_as_strings))
    if (name.starts_with ("Mono"))
      grey.push_back (std::move (name));
  return grey;
}

std::string
size_of (ArvCamera *camera)
{
  gint width = 0, height = 0;
  arv_camera_get_sensor_size (camera, &width, &height, nullptr);
  return width > 0 ? std::to_string (width) + "x" + std::to_string (height)
                   : "not known";
}

/* A camera that a DMD drives starts each exposure at its trigger. */
std::string
trigger_of (ArvCamera *camera)
{
  for (const char *feature : {"TriggerMode", "TriggerSource"})
    if (!arv_camera_is_feature_available (camera, feature, nullptr))
      return "no";
  const auto sources =
      names_of (camera, arv_camera_dup_available_trigger_sources);
  std::vector<std::string> lines;
  for (const std::string &source : sources)
    if (source.starts_with ("Line"))
      lines.push_back (source);
  return lines.empty () ? "by no line" : "by " + joined (lines);
}

/* Rows of a rolling shutter are exposed one after the other, through other
 * masks. */
std::string
shutter_of (ArvCamera *camera)
{
  for (const char *feature : {"SensorShutterMode", "ShutterMode"}) {
    const std::string mode = text_of (camera, feature);
    if (mode.find ("Rolling") != mode.npos)
      return "rolling; coded frames need a global one";
    if (!mode.empty ())
      return mode.find ("Global") != mode.npos ? "global" : mode;
  }
  return "not known: the camera does not say; see its data sheet";
}

std::string
known_or (const char *text)
{
  return text && *text ? text : "not known";
}

/* ------------------------------------------------------------------ list -- */

/* Without opening it: another program may use it. */
Json
identity_of (guint number)
{
  return {{"camera", arv_get_device_id (number)},
      {"vendor", known_or (arv_get_device_vendor (number))},
      {"model", known_or (arv_get_device_model (number))},
      {"serial", known_or (arv_get_device_serial_nbr (number))},
      {"address", known_or (arv_get_device_address (number))},
      {"protocol", known_or (arv_get_device_protocol (number))}};
}

void
add_abilities (Json &entry, ArvCamera *camera)
{
  entry["sensor"] = size_of (camera);
  entry["pixel-formats"] = joined (grey_formats (camera));
  entry["trigger"] = trigger_of (camera);
  entry["shutter"] = shutter_of (camera);
}

Exit
list (const Arguments &arguments)
{
  arv_update_device_list ();
  Json result = Json::array ();
  for (guint i = 0; i < arv_get_n_devices (); i++) {
    Json entry = identity_of (i);
    try {
      const CameraPtr camera = open (arv_get_device_id (i));
      add_abilities (entry, camera.get ());
    } catch (const Failure &) {
      entry["trouble"] = "another program uses it, or it does not answer";
    }
    result.push_back (std::move (entry));
  }
  if (result.empty ())
    arguments.say (cameras_found ());
  if (arguments.json) {
    arguments.print (result);
    return Exit::done;
  }
  for (std::size_t i = 0; i < result.size (); i++) {
    if (i > 0)
      std::putchar ('\n');
    arguments.print (result[i]);
  }
  return Exit::done;
}

/* ------------------------------------------------------------------ show -- */

/* 10000000 rather than 1e+07. */
std::string
number_text (double value)
{
  return format ("%.10g", value);
}

using ReadBounds = void (*) (ArvCamera *, double *, double *, GError **);

void
add_range (Json &entry, const char *key, ArvCamera *camera, ReadBounds bounds,
    double (*value) (ArvCamera *, GError **), const char *unit)
{
  double least = 0.0, most = 0.0;
  GError *unbounded = nullptr, *unknown = nullptr;
  bounds (camera, &least, &most, &unbounded);
  const double now = value (camera, &unknown);
  if (!unknown)
    entry[key] = number_text (now) + unit +
                 (unbounded ? ""
                            : " (" + number_text (least) + " to " +
                                  number_text (most) + ")");
  g_clear_error (&unbounded);
  g_clear_error (&unknown);
}

/* Of these, none may change pixels behind the back of a calibration, or a rate
 * behind that of a trigger. */
constexpr const char *kFeatures[] = {"ExposureMode", "ExposureAuto", "GainAuto",
    "BlackLevel", "Gamma", "GammaEnable", "LUTEnable", "BinningHorizontal",
    "BinningVertical", "DecimationHorizontal", "ReverseX", "ReverseY",
    "TestPattern", "AcquisitionFrameRateEnable",
    "DeviceLinkThroughputLimitMode", "DeviceTemperature"};

Exit
show (const Arguments &arguments)
{
  const CameraPtr owned = open (arguments.name);
  ArvCamera *camera = owned.get ();
  Json result;
  for (const auto &[key, feature] : {std::pair ("vendor", "DeviceVendorName"),
           std::pair ("model", "DeviceModelName"),
           std::pair ("serial", "DeviceSerialNumber"),
           std::pair ("firmware", "DeviceFirmwareVersion")})
    if (const std::string text = text_of (camera, feature); !text.empty ())
      result[key] = text;
  add_abilities (result, camera);
  const std::string width = text_of (camera, "Width");
  const std::string height = text_of (camera, "Height");
  if (!width.empty () && !height.empty ())
    result["size"] = width + "x" + height;
  result["pixel-format"] = text_of (camera, "PixelFormat");
  add_range (result, "exposure", camera, arv_camera_get_exposure_time_bounds,
      arv_camera_get_exposure_time, " us");
  add_range (result, "gain", camera, arv_camera_get_gain_bounds,
      arv_camera_get_gain, "");
  add_range (result, "frame-rate", camera, arv_camera_get_frame_rate_bounds,
      arv_camera_get_frame_rate, "/s");
  for (const char *feature : kFeatures)
    if (const std::string text = text_of (camera, feature); !text.empty ())
      result[feature] = text;
  arguments.print (result);
  return Exit::done;
}

} // namespace

Command
camera_command ()
{
  return make_group<Arguments> (
      {.name = "camera",
          .summary = "list the cameras, and show how one is set",
          .usage = "COMMAND [option...] [CAMERA]",
          .description = "GenICam cameras, on GigE Vision and USB3 Vision.\n",
          .notes = R"(
Exit status: 0 done, 2 wrong usage, 3 there is no such camera.

Examples:
  Which cameras are there:
    codedexposure camera list
  The emulated one, as JSON:
    codedexposure bench codedexposure camera list --json
  How it is set:
    codedexposure bench codedexposure camera show 127.0.0.1
)"},
      {{{.name = "list",
            .summary = "list the GenICam cameras that answer",
            .usage = "[option...]",
            .description = R"(
Lists the GenICam cameras on the network and the USB: the name for --camera, the
sensor, the grey formats, and whether a DMD can trigger it.
)"},
           [] (Options &options, Arguments &a) { a.declare (options); }, list},
          {{.name = "show",
               .summary = "show how a camera is set",
               .usage = "[option...] CAMERA",
               .description = R"(
Shows what a camera can do and how it is set, with the features that change
coded frames. Nothing is changed.
)"},
              [] (Options &options, Arguments &a) {
                options.word ("CAMERA", a.name);
                a.declare (options);
              },
              show}});
}

} // namespace codedexposure::app
