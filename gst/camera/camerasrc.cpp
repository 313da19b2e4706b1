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
 * ## Example pipeline
 *
 * |[
 * gst-launch-1.0 -m codedexposure-camerasrc camera-name=192.168.1.20
 * pixel-format=Mono12Packed trigger=dmd trigger-line=Line1 reconnect=60 !
 * video/x-raw,width=768,height=576,framerate=25/1 !
 * dmdsync device=usb: timestamp-at=device-clock ! codedexposure-demux !
 * queue ! codedexposure-view ! videoconvert ! autovideosink
 * ]|
 *
 * Since: 0.2
 */
#include "camerasrc.h"

#include "common/caps.h"
#include "common/properties.h"
#include "state.h"

GST_DEBUG_CATEGORY (camerasrc_debug);
#define GST_CAT_DEFAULT camerasrc_debug

using namespace codedexposure;
using namespace codedexposure::gst;
using camera::CameraState;

struct _GstCodedExposureCameraSrc {
  GstBin parent;
  CameraState *state;
};

G_DEFINE_TYPE_WITH_CODE (GstCodedExposureCameraSrc,
    gst_coded_exposure_camera_src, GST_TYPE_BIN,
    GST_DEBUG_CATEGORY_INIT (camerasrc_debug, "codedexposure-camerasrc", 0,
        "frames of a GenICam camera"))
GST_ELEMENT_REGISTER_DEFINE (codedexposure_camerasrc, "codedexposure-camerasrc",
    GST_RANK_NONE, GST_TYPE_CODED_EXPOSURE_CAMERA_SRC)

#define GST_TYPE_CODED_EXPOSURE_CAMERA_TRIGGER                                 \
  (gst_coded_exposure_camera_trigger_get_type ())
static G_DEFINE_ENUM_TYPE (GstCodedExposureCameraTrigger,
    gst_coded_exposure_camera_trigger,
    {int (CameraTrigger::none), "As the camera is set up; it runs freely",
        "none"},
    {int (CameraTrigger::dmd), "The DMD triggers the camera", "dmd"},
    {int (CameraTrigger::camera), "The camera triggers the DMD", "camera"})

#define GST_TYPE_CODED_EXPOSURE_TRIGGER_EDGE                                   \
  (gst_coded_exposure_trigger_edge_get_type ())
    static G_DEFINE_ENUM_TYPE (GstCodedExposureTriggerEdge,
        gst_coded_exposure_trigger_edge,
        {int (TriggerEdge::rising), "Rising edge; output high in the exposure",
            "rising"},
        {int (TriggerEdge::falling), "Falling edge; output low in the exposure",
            "falling"})

        namespace
{

  enum {
    PROP_0,
    PROP_CAMERA_NAME,
    PROP_PIXEL_FORMAT,
    PROP_TRIGGER,
    PROP_TRIGGER_LINE,
    PROP_TRIGGER_EDGE,
    PROP_EXPOSURE_TIME,
    PROP_FEATURES,
    PROP_NUM_BUFFERS,
    PROP_RECONNECT,
    PROP_RECONNECTS,
  };

  GstStaticPadTemplate src_template = GST_STATIC_PAD_TEMPLATE ("src",
      GST_PAD_SRC, GST_PAD_ALWAYS, GST_STATIC_CAPS (CODED_EXPOSURE_VIDEO_CAPS));

  std::string text_of (const GValue *value)
  {
    const gchar *text = g_value_get_string (value);
    return text ? text : "";
  }

  void set_property (
      GObject * object, guint id, const GValue *value, GParamSpec *pspec)
  {
    auto *self = GST_CODED_EXPOSURE_CAMERA_SRC (object);
    const ObjectLock lock (self);
    if (!may_set (self, pspec))
      return;
    CameraSettings &settings = self->state->settings;
    switch (id) {
    case PROP_CAMERA_NAME:
      settings.name = text_of (value);
      break;
    case PROP_PIXEL_FORMAT:
      settings.pixel_format = text_of (value);
      break;
    case PROP_TRIGGER:
      settings.trigger = CameraTrigger (g_value_get_enum (value));
      break;
    case PROP_TRIGGER_LINE:
      settings.trigger_line = text_of (value);
      break;
    case PROP_TRIGGER_EDGE:
      settings.trigger_edge = TriggerEdge (g_value_get_enum (value));
      break;
    case PROP_EXPOSURE_TIME:
      settings.exposure_time = g_value_get_double (value);
      break;
    case PROP_FEATURES:
      settings.features = text_of (value);
      break;
    case PROP_NUM_BUFFERS:
      settings.num_buffers = g_value_get_int (value);
      break;
    case PROP_RECONNECT:
      settings.reconnect = g_value_get_uint (value);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
    }
  }

  void get_property (
      GObject * object, guint id, GValue * value, GParamSpec * pspec)
  {
    auto *self = GST_CODED_EXPOSURE_CAMERA_SRC (object);
    const ObjectLock lock (self);
    const CameraSettings &settings = self->state->settings;
    switch (id) {
    case PROP_CAMERA_NAME:
      return g_value_set_string (value, settings.name.c_str ());
    case PROP_PIXEL_FORMAT:
      return g_value_set_string (value, settings.pixel_format.c_str ());
    case PROP_TRIGGER:
      return g_value_set_enum (value, int (settings.trigger));
    case PROP_TRIGGER_LINE:
      return g_value_set_string (value, settings.trigger_line.c_str ());
    case PROP_TRIGGER_EDGE:
      return g_value_set_enum (value, int (settings.trigger_edge));
    case PROP_EXPOSURE_TIME:
      return g_value_set_double (value, settings.exposure_time);
    case PROP_FEATURES:
      return g_value_set_string (value, settings.features.c_str ());
    case PROP_NUM_BUFFERS:
      return g_value_set_int (value, settings.num_buffers);
    case PROP_RECONNECT:
      return g_value_set_uint (value, settings.reconnect);
    case PROP_RECONNECTS:
      return g_value_set_uint (value, self->state->reconnects);
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID (object, id, pspec);
    }
  }

  void install_properties (GObjectClass * klass)
  {
    klass->set_property = set_property;
    klass->get_property = get_property;
    constexpr auto kReady = GParamFlags (
        G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
    const auto install = [klass] (guint id, GParamSpec *pspec) {
      g_object_class_install_property (klass, id, pspec);
    };
    install (PROP_CAMERA_NAME,
        g_param_spec_string ("camera-name", "Camera name",
            "Camera as \"arv-tool-0.8\" or \"gst-device-monitor-1.0 "
            "Source/Video\" lists it, or its address; empty: the first one "
            "found",
            "", kReady));
    install (
        PROP_PIXEL_FORMAT, g_param_spec_string ("pixel-format", "Pixel format",
                               "Mono8, Mono10, Mono12, Mono16, Mono10Packed, "
                               "Mono12Packed, Mono10p "
                               "or Mono12p; packed ones are unpacked, without "
                               "a shift; empty: Mono8 "
                               "or Mono16, as the caps downstream say",
                               "", kReady));
    install (PROP_TRIGGER,
        g_param_spec_enum ("trigger", "Trigger", "Which device triggers",
            GST_TYPE_CODED_EXPOSURE_CAMERA_TRIGGER, int (CameraTrigger::none),
            kReady));
    install (PROP_TRIGGER_LINE,
        g_param_spec_string ("trigger-line", "Trigger line",
            "Line of the camera to or from the DMD; empty: Line0 with "
            "trigger=dmd, Line1 with trigger=camera",
            "", kReady));
    install (
        PROP_TRIGGER_EDGE, g_param_spec_enum ("trigger-edge", "Trigger edge",
                               "Edge of the line at which an exposure starts",
                               GST_TYPE_CODED_EXPOSURE_TRIGGER_EDGE,
                               int (TriggerEdge::rising), kReady));
    install (PROP_EXPOSURE_TIME,
        g_param_spec_double ("exposure-time", "Exposure time",
            "Exposure time in µs; 0: as the camera is set up", 0, 1e8, 0,
            kReady));
    install (PROP_FEATURES,
        g_param_spec_string ("features", "Features",
            "Assignments of other GenICam features, \"A=1 B=2\", made last", "",
            kReady));
    install (PROP_NUM_BUFFERS,
        g_param_spec_int ("num-buffers", "Number of buffers",
            "Frames until EOS, those before and after a restart together; -1: "
            "unlimited",
            -1, G_MAXINT, -1, kReady));
    install (PROP_RECONNECT,
        g_param_spec_uint ("reconnect", "Reconnect",
            "Tries in a row, at least a second apart, to restart a camera that "
            "failed after its first frame; 0: its error ends the pipeline",
            0, G_MAXUINT, 0, kReady));
    install (PROP_RECONNECTS,
        g_param_spec_uint ("reconnects", "Reconnects",
            "Times that the camera came back, in this run or the last one", 0,
            G_MAXUINT, 0,
            GParamFlags (G_PARAM_READABLE | G_PARAM_STATIC_STRINGS)));
  }

  /* What can be known before there is a camera. */
  bool check (GstCodedExposureCameraSrc * self)
  {
    if (!self->state->source) {
      GST_ELEMENT_ERROR (self, CORE, MISSING_PLUGIN,
          ("The GStreamer element aravissrc is not installed. It is in "
           "Debian's "
           "package libaravis-0.8-0."),
          (nullptr));
      return false;
    }
    Result<void> good;
    {
      const ObjectLock lock (self);
      good = check_settings (self->state->settings);
    }
    if (!good)
      GST_ELEMENT_ERROR (self, RESOURCE, SETTINGS,
          ("%s", good.error ().message.c_str ()), (nullptr));
    return good.ok ();
  }

  bool begin_run (GstCodedExposureCameraSrc * self)
  {
    CameraState &st = *self->state;
    st.stream = camera::Stream ();
    {
      const ObjectLock lock (self);
      st.reconnects = 0;
    }
    camera::begin_watch (self);
    return camera::set_up_source (self);
  }

  GstStateChangeReturn change_state (
      GstElement * element, GstStateChange transition)
  {
    auto *self = GST_CODED_EXPOSURE_CAMERA_SRC (element);
    if (transition == GST_STATE_CHANGE_NULL_TO_READY && !check (self))
      return GST_STATE_CHANGE_FAILURE;
    if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !begin_run (self))
      return GST_STATE_CHANGE_FAILURE;
    if (transition == GST_STATE_CHANGE_PAUSED_TO_READY)
      camera::end_watch (self);
    const GstStateChangeReturn changed =
        GST_ELEMENT_CLASS (gst_coded_exposure_camera_src_parent_class)
            ->change_state (element, transition);
    if (transition == GST_STATE_CHANGE_READY_TO_PAUSED &&
        changed == GST_STATE_CHANGE_FAILURE)
      camera::end_watch (self);
    if (transition == GST_STATE_CHANGE_PAUSED_TO_READY)
      self->state->stream = camera::Stream ();
    return changed;
  }

  void handle_message (GstBin * bin, GstMessage * message)
  {
    if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR &&
        camera::take_failure (GST_CODED_EXPOSURE_CAMERA_SRC (bin), message))
      return gst_message_unref (message);
    GST_BIN_CLASS (gst_coded_exposure_camera_src_parent_class)
        ->handle_message (bin, message);
  }

  /* Children get no clock: with one, aravissrc delays each frame until the time
   * that its camera has stamped on it. */
  gboolean set_clock (GstElement * element, GstClock * clock)
  {
    auto *base = GST_ELEMENT_CLASS (g_type_class_peek (GST_TYPE_ELEMENT));
    return base->set_clock (element, clock);
  }

  void finalize (GObject * object)
  {
    delete GST_CODED_EXPOSURE_CAMERA_SRC (object)->state;
    G_OBJECT_CLASS (gst_coded_exposure_camera_src_parent_class)
        ->finalize (object);
  }

} // namespace

namespace codedexposure::gst::camera
{

CameraState &
state (GstCodedExposureCameraSrc *self)
{
  return *self->state;
}

/* The name comes first: it makes aravissrc look for the camera, and forget the
 * one that it had, dead or alive. */
bool
set_up_source (GstCodedExposureCameraSrc *self)
{
  CameraState &st = *self->state;
  CameraSettings settings;
  {
    const ObjectLock lock (self);
    settings = st.settings;
  }
  st.stream.first = true;
  const std::string &name = settings.name;
  g_object_set (st.source, "camera-name",
      name.empty () ? nullptr : name.c_str (), nullptr);
  GObject *found = nullptr;
  g_object_get (st.source, "camera", &found, nullptr);
  if (!found)
    return false;
  g_object_unref (found);

  const CapsPtr caps (
      gst_caps_from_string (caps_of_format (settings.pixel_format).c_str ()));
  g_object_set (st.filter, "caps", caps.get (), nullptr);
  int frames_left;
  {
    const std::lock_guard guard (st.lock);
    frames_left = st.frames_left;
  }
  g_object_set (st.source, "features", feature_assignments (settings).c_str (),
      "exposure", settings.exposure_time > 0 ? settings.exposure_time : -1.0,
      "num-buffers", frames_left, nullptr);
  return true;
}

} // namespace codedexposure::gst::camera

static void
gst_coded_exposure_camera_src_class_init (GstCodedExposureCameraSrcClass *klass)
{
  auto *object_class = G_OBJECT_CLASS (klass);
  auto *element_class = GST_ELEMENT_CLASS (klass);

  object_class->finalize = finalize;
  install_properties (object_class);
  for (const GType type : {GST_TYPE_CODED_EXPOSURE_CAMERA_TRIGGER,
           GST_TYPE_CODED_EXPOSURE_TRIGGER_EDGE})
    gst_type_mark_as_plugin_api (type, GstPluginAPIFlags (0));

  gst_element_class_set_static_metadata (element_class, "GenICam camera",
      "Source/Video/Hardware",
      "Frames of a GenICam camera: aravissrc with trigger set-up, unpacked "
      "pixels, memory of its own and reconnection",
      "The gst-codedexposure authors");
  gst_element_class_add_static_pad_template (element_class, &src_template);
  element_class->change_state = GST_DEBUG_FUNCPTR (change_state);
  element_class->set_clock = GST_DEBUG_FUNCPTR (set_clock);
  GST_BIN_CLASS (klass)->handle_message = GST_DEBUG_FUNCPTR (handle_message);
}

static void
gst_coded_exposure_camera_src_init (GstCodedExposureCameraSrc *self)
{
  self->state = new CameraState;
  CameraState &st = *self->state;
  GstPadTemplate *pad_template =
      gst_element_class_get_pad_template (GST_ELEMENT_GET_CLASS (self), "src");
  GstPad *ghost =
      gst_ghost_pad_new_no_target_from_template ("src", pad_template);
  gst_element_add_pad (GST_ELEMENT (self), ghost);
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
  const ObjectPtr<GstPad> out (gst_element_get_static_pad (filter, "src"));
  gst_ghost_pad_set_target (GST_GHOST_PAD (ghost), out.get ());
  const ObjectPtr<GstPad> pad (gst_element_get_static_pad (source, "src"));
  gst_pad_add_probe (pad.get (),
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_BOTH),
      camera::take_item, self, nullptr);
}
