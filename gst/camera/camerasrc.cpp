/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-camerasrc
 * @title: codedexposure-camerasrc
 * @short_description: Frames of a GenICam camera, ready for dmdsync
 *
 * A bin around aravissrc that does what a GenICam camera needs beyond it:
 *
 * - The trigger is set up by #codedexposure-camerasrc:trigger and its line and
 *   edge, in the order that cameras accept.
 * - Packed pixels are unpacked, and every frame is copied once, into a buffer
 *   pool: aravissrc lets its camera overwrite memory that it has handed out.
 *   Frames may therefore be kept downstream as long as needed. The significant
 *   bits are in the metadata of the frame.
 * - PTS are the camera's own time stamps, counted from the arrival of the first
 *   frame. Frames are pushed when they arrive: aravissrc gets no clock, by
 *   which it would delay the frames of a fast camera more and more.
 * - A camera that goes away is restarted, see
 *   #codedexposure-camerasrc:reconnect.
 * - QoS events are dropped: aravissrc blocks a sink that sends one until the
 *   next frame arrives.
 *
 * Size and frame rate come from the caps downstream. All other properties of
 * aravissrc are those of the child `source`, as in `source::packet-size=9000`.
 *
 * ## A camera that goes away
 *
 * aravissrc ends in an error when its camera is silent for two seconds. After
 * the first frame, and with #codedexposure-camerasrc:reconnect above 0, that
 * error becomes the element message `codedexposure/camera-lost` and a warning,
 * and the camera is restarted once a second until a frame arrives, with
 * `codedexposure/camera-back`. That frame has the flags DISCONT and RESYNC; its
 * PTS counts from its arrival. Nothing else shows downstream. When all tries
 * fail, the error is posted, and EOS follows.
 *
 * A process that was stopped for two seconds (Ctrl-Z, a debugger) gets the same
 * error although its camera sends frames. The camera is then restarted even if
 * #codedexposure-camerasrc:reconnect is 0. So is one that gets no trigger
 * because dmdsync, downstream, sends other masks to the DMD.
 *
 * ## Example pipeline
 *
 * |[
 * gst-launch-1.0 -m codedexposure-camerasrc camera-name=192.168.1.20 \
 *     pixel-format=Mono12Packed trigger=dmd trigger-line=Line1 reconnect=60 \
 *     ! video/x-raw,width=768,height=576,framerate=25/1 \
 *     ! dmdsync device=usb: timestamp-at=device-clock ! codedexposure-demux \
 *     ! queue ! codedexposure-view ! videoconvert ! autovideosink
 * ]|
 *
 * Since: 0.2
 */
#include "camerasrc.h"

#include <cmath>
#include <string_view>

#ifdef CODEDEXPOSURE_ARAVIS
#include <arv.h>
#endif

#include "base/text.h"
#include "common/elements.h"
#include "common/properties.h"

GST_DEBUG_CATEGORY (camerasrc_debug);
#define GST_CAT_DEFAULT camerasrc_debug

using namespace codedexposure;
using namespace codedexposure::gst;
using camera::CameraState;
using camera::Edge;
using camera::GstCodedExposureCameraSrc;
using camera::Settings;
using camera::Trigger;

namespace
{

G_DEFINE_ENUM_TYPE (GstCodedExposureCameraTrigger,
    gst_coded_exposure_camera_trigger,
    {int (Trigger::none), "As the camera is set up; it runs freely", "none"},
    {int (Trigger::dmd), "The DMD triggers the camera", "dmd"},
    {int (Trigger::camera), "The camera triggers the DMD", "camera"});

G_DEFINE_ENUM_TYPE (GstCodedExposureTriggerEdge,
    gst_coded_exposure_trigger_edge,
    {int (Edge::rising), "Rising edge; output high in the exposure", "rising"},
    {int (Edge::falling), "Falling edge; output low in the exposure",
        "falling"});

constexpr guint kMostTries = 1'000'000; // ten days of one a second

PropertyTable<CameraState>
properties ()
{
  static const auto set = [] (auto member) {
    return within (&CameraState::settings, member);
  };
  return {
      {"camera-name", "Camera name",
          "Camera as \"codedexposure camera list\" or "
          "\"gst-device-monitor-1.0 -f Source/GenICam\" lists it, or its "
          "address; empty: the first one found",
          kReadWriteReady, set (&Settings::name)},
      {"pixel-format", "Pixel format",
          "Mono8, Mono10, Mono12, Mono16, Mono10Packed, Mono12Packed, Mono10p "
          "or Mono12p; packed ones are unpacked, without a shift; empty: Mono8 "
          "or Mono16, as the caps downstream say",
          kReadWriteReady, set (&Settings::pixel_format)},
      {"trigger", "Trigger", "Which device triggers", kReadWriteReady,
          set (&Settings::trigger),
          gst_coded_exposure_camera_trigger_get_type ()},
      {"trigger-line", "Trigger line",
          "Line of the camera to or from the DMD; empty: Line0 with "
          "trigger=dmd, Line1 with trigger=camera",
          kReadWriteReady, set (&Settings::trigger_line)},
      {"trigger-edge", "Trigger edge",
          "Edge of the line at which an exposure starts", kReadWriteReady,
          set (&Settings::trigger_edge),
          gst_coded_exposure_trigger_edge_get_type ()},
      {"exposure-time", "Exposure time",
          "Exposure time in µs; 0: as the camera is set up", kReadWriteReady,
          set (&Settings::exposure_time), 0.0, 1e8},
      {"features", "Features",
          "Assignments of other GenICam features, \"A=1 B=2\", made last",
          kReadWriteReady, set (&Settings::features)},
      {"bench", "Bench profile",
          "What was measured of the bench, a JSON file or its text "
          "(docs/formats.md); refused if it is of other cameras",
          kReadWriteReady, set (&Settings::bench)},
      {"num-buffers", "Number of buffers",
          "Frames until EOS, those before and after a restart together; -1: "
          "unlimited",
          kReadWriteReady, set (&Settings::num_buffers), -1, G_MAXINT},
      {"reconnect", "Reconnect",
          "Tries in a row, at least a second apart, to restart a camera that "
          "failed after its first frame; 0: its error ends the pipeline",
          kReadWriteReady, set (&Settings::reconnect), 0u, kMostTries},
      {"reconnects", "Reconnects",
          "Times that the camera came back, in this run or the last one",
          kReadOnly, &CameraState::reconnects, 0u, kMostTries},
  };
}

/* An error that names the value, the rule and the remedy. */
Result<void>
check_settings (const Settings &settings)
{
  if (!settings.pixel_format.empty ())
    if (const auto format = camera_format (settings.pixel_format); !format)
      return format.error ();
  if (settings.trigger_line.find_first_of (" =\t\n\"") != std::string::npos)
    return Error{"trigger-line=\"" + settings.trigger_line +
                 "\" is no line of a camera: it is one word, such as Line0. "
                 "\"codedexposure camera show\" lists those of the camera"};
  if (!settings.trigger_line.empty () && settings.trigger == Trigger::none)
    return Error{"trigger-line=" + settings.trigger_line +
                 " has no effect with trigger=none: set trigger=dmd where the "
                 "DMD triggers the camera, trigger=camera where the camera "
                 "triggers the DMD"};
  for (const std::string_view word : split (settings.features, ' '))
    if (word.starts_with ("PixelFormat="))
      return Error{"features=\"" + std::string (word) +
                   "\" does not say how to unpack the pixels: set "
                   "pixel-format=" +
                   std::string (word.substr (word.find ('=') + 1))};
  return {};
}

/* What can be known before there is a camera. */
bool
check (GstElement *element)
{
  auto *self = as<GstCodedExposureCameraSrc> (element);
  if (!self->state.source) {
    POST_ERROR (self, CORE, MISSING_PLUGIN,
        "The GStreamer element aravissrc is not installed. It is in Debian's "
        "package libaravis-0.8-0.");
    return false;
  }
  if (!check_named (
          self, "bench", read_again (self, self->state.settings.bench)))
    return false;
  const Result<void> good = check_settings (settings_of (self));
  if (!good)
    POST_ERROR (self, RESOURCE, SETTINGS, good.error ().message);
  return good.ok ();
}

bool
begin_run (GstElement *element)
{
  auto *self = as<GstCodedExposureCameraSrc> (element);
  CameraState &st = self->state;
  st.stream = camera::Stream ();
  locked (self, [&] { st.reconnects = 0; });
  camera::begin_watch (self);
  return camera::set_up_source (self);
}

void
end_run (GstElement *element)
{
  camera::state (element).stream = camera::Stream ();
}

constexpr StateHooks kRun{.open = check,
    .begin = begin_run,
    .pause = camera::stop_silent_camera,
    .halt = camera::end_watch,
    .end = end_run};

void
handle_message (GstBin *bin, GstMessage *message)
{
  if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR &&
      camera::take_failure (as<GstCodedExposureCameraSrc> (bin), message))
    return gst_message_unref (message);
  parent_class<GstBinClass> (bin)->handle_message (bin, message);
}

/* aravissrc looks at an end only between two frames, and not while it is
 * restarted. */
gboolean
send_event (GstElement *element, GstEvent *event)
{
  if (GST_EVENT_TYPE (event) != GST_EVENT_EOS ||
      !as<GstCodedExposureCameraSrc> (element)->state.filter)
    return parent_class<GstElementClass> (element)->send_event (element, event);
  const auto push = [] (GstElement *source, gpointer end) {
    CameraState &st = camera::state (source);
    locked (st.lock, [&st] { st.ending = true; });
    camera::stop_silent_camera (source);
    gst_pad_push_event (
        pad_of (st.filter, "src").get (), gst_event_ref (GST_EVENT (end)));
  };
  gst_element_call_async (element, push, event,
      [] (gpointer end) { gst_event_unref (GST_EVENT (end)); });
  return TRUE;
}

/* Children get no clock: with one, aravissrc delays each frame until the time
 * that its camera has stamped on it. */
gboolean
set_clock (GstElement *element, GstClock *clock)
{
  auto *base = GST_ELEMENT_CLASS (g_type_class_peek (GST_TYPE_ELEMENT));
  return base->set_clock (element, clock);
}

std::string
line_of (const Settings &settings)
{
  if (!settings.trigger_line.empty ())
    return settings.trigger_line;
  return settings.trigger == Trigger::dmd ? "Line0" : "Line1";
}

/* Assignments in the order that a camera needs: a selector before what it
 * selects, and the user's own last. Aravis makes them after it has set the
 * frame rate, which ends all triggers. @settings: checked. */
std::string
feature_assignments (const Settings &settings)
{
  const bool falling = settings.trigger_edge == Edge::falling;
  std::string text;
  if (settings.trigger == Trigger::dmd)
    text = "TriggerSelector=FrameStart TriggerSource=" + line_of (settings) +
           " TriggerActivation=" + (falling ? "FallingEdge" : "RisingEdge") +
           " TriggerMode=On";
  else if (settings.trigger == Trigger::camera)
    text = "TriggerSelector=FrameStart TriggerMode=Off LineSelector=" +
           line_of (settings) +
           " LineMode=Output LineSource=ExposureActive LineInverter=" +
           (falling ? "true" : "false");
  if (!settings.pixel_format.empty ())
    text += " PixelFormat=" + std::string (mono_format_text (
                                  *parse_mono_format (settings.pixel_format)));
  if (!settings.features.empty ())
    text += " " + settings.features;
  return text;
}

/* Caps of the frames that come with a pixel format. */
std::string
caps_of_format (const std::string &pixel_format)
{
  const auto format = parse_mono_format (pixel_format);
  return std::string ("video/x-raw,format=") +
         (!format                           ? "{GRAY8,GRAY16_LE}"
             : *format == MonoFormat::mono8 ? "GRAY8"
                                            : "GRAY16_LE");
}

/* Whether @found may be the camera of the bench profile, if there is one. */
bool
check_camera (GstCodedExposureCameraSrc *self, const Named<BenchProfile> &bench,
    [[maybe_unused]] GObject *found)
{
  const char *serial = nullptr;
#ifdef CODEDEXPOSURE_ARAVIS
  serial = arv_camera_get_device_serial_number (ARV_CAMERA (found), nullptr);
#endif
  if (!bench.read || !serial)
    return true;
  const auto check = [&] (bool off_beam) {
    return BenchProfile::check_device ("camera",
        bench.read->value ().of_beam (off_beam).camera, {.serial = serial});
  };
  const auto same = check (false);
  if (!same && check (true)) // it is the second one
    return true;
  if (!same)
    POST_ERROR (self, RESOURCE, SETTINGS,
        "The bench profile does not fit: " + same.error ().message);
  return same.ok ();
}

void
set_up (gpointer klass)
{
  auto *element_class = GST_ELEMENT_CLASS (klass);

  GST_DEBUG_CATEGORY_INIT (camerasrc_debug, "codedexposure-camerasrc", 0,
      "frames of a GenICam camera");
  install_state<GstCodedExposureCameraSrc, properties> (klass);
  describe_element (klass, "GenICam camera", "Source/Video/Hardware",
      "Frames of a GenICam camera: aravissrc with trigger set-up, unpacked "
      "pixels, memory of its own and reconnection",
      {"src"});
  install_run<kRun> (klass);
  element_class->send_event = GST_DEBUG_FUNCPTR (send_event);
  element_class->set_clock = GST_DEBUG_FUNCPTR (set_clock);
  GST_BIN_CLASS (klass)->handle_message = GST_DEBUG_FUNCPTR (handle_message);
}

void
set_up_instance (GstCodedExposureCameraSrc *self)
{
  CameraState &st = self->state;
  GstPad *ghost = add_ghost_pad (GST_ELEMENT (self), "src", nullptr);
  GST_OBJECT_FLAG_SET (self, GST_ELEMENT_FLAG_SOURCE);

  GstElement *source = gst_element_factory_make ("aravissrc", "source");
  GstElement *filter = gst_element_factory_make ("capsfilter", "format");
  if (!source || !filter) {
    gst_clear_object (&source);
    gst_clear_object (&filter);
    return;
  }
  gst_bin_add_many (GST_BIN (self), source, filter, nullptr);
  gst_element_link (source, filter);
  st.source = source;
  st.filter = filter;
  gst_ghost_pad_set_target (
      GST_GHOST_PAD (ghost), pad_of (filter, "src").get ());
  gst_pad_add_probe (pad_of (source, "src").get (),
      GstPadProbeType (GST_PAD_PROBE_TYPE_BUFFER |
                       GST_PAD_PROBE_TYPE_EVENT_BOTH |
                       GST_PAD_PROBE_TYPE_QUERY_BOTH),
      camera::take_item, self, nullptr);
  gst_pad_add_probe (pad_of (filter, "sink").get (),
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_QUERY_UPSTREAM | GST_PAD_PROBE_TYPE_PULL),
      camera::take_answer, self, nullptr);
}

} // namespace

namespace codedexposure::gst::camera
{

/* The name comes first: it makes aravissrc look for the camera, and forget the
 * one that it had, dead or alive. */
bool
set_up_source (GstCodedExposureCameraSrc *self)
{
  CameraState &st = self->state;
  const Settings settings = settings_of (self);
  st.stream.first = true;
  keep_camera (self, nullptr);
  const std::string &name = settings.name;
  g_object_set (st.source, "camera-name",
      name.empty () ? nullptr : name.c_str (), nullptr);
  GObject *found = nullptr;
  g_object_get (st.source, "camera", &found, nullptr);
  if (!found)
    return false;
  keep_camera (self, ObjectPtr<GObject> (found));
  if (!check_camera (self, settings.bench, found))
    return false;

  const CapsPtr caps (
      gst_caps_from_string (caps_of_format (settings.pixel_format).c_str ()));
  g_object_set (st.filter, "caps", caps.get (), nullptr);
  const int frames_left = locked (st.lock, [&] { return st.frames_left; });
  g_object_set (st.source, "features", feature_assignments (settings).c_str (),
      "exposure", settings.exposure_time > 0 ? settings.exposure_time : -1.0,
      "num-buffers", frames_left, nullptr);
  return true;
}

GstClockTime
exposure_of_camera ([[maybe_unused]] GstCodedExposureCameraSrc *self)
{
#ifdef CODEDEXPOSURE_ARAVIS
  CameraState &st = self->state;
  const ObjectPtr<GObject> held (locked (st.lock, [&] {
    return st.camera ? G_OBJECT (g_object_ref (st.camera.get ())) : nullptr;
  }));
  if (!held)
    return GST_CLOCK_TIME_NONE;
  ArvCamera *camera = ARV_CAMERA (held.get ());
  const auto is_set = [&] (const char *feature, const char *usual) {
    const char *said = arv_camera_get_string (camera, feature, nullptr);
    return said && g_strcmp0 (said, usual) != 0;
  };
  if (is_set ("ExposureAuto", "Off") || is_set ("ExposureMode", "Timed"))
    return GST_CLOCK_TIME_NONE;
  /* 0 if it cannot be read. */
  const double us = arv_camera_get_exposure_time (camera, nullptr);
  if (us > 0)
    return GstClockTime (std::llround (1e3 * us));
#endif
  return GST_CLOCK_TIME_NONE;
}

} // namespace codedexposure::gst::camera

GST_ELEMENT_REGISTER_DEFINE (codedexposure_camerasrc, "codedexposure-camerasrc",
    GST_RANK_NONE,
    (type_of<GstCodedExposureCameraSrc, set_up, set_up_instance> (
        "GstCodedExposureCameraSrc", GST_TYPE_BIN)))
