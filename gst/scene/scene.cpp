/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-scene
 * @title: codedexposure-scene
 * @short_description: Synthetic scenes with fast motion
 *
 * Draws a flickering candle, a candle that is blown out after half a second, or
 * dark liquid that is poured into a glass of clear liquid, at any size and
 * frame rate: the scenes of the paper's Figs. 9 to 11. Pixel values are linear
 * in light. A picture depends only on its time, so every run gives the same
 * pictures. With #codedexposure-scene:repeat, the scene begins again after that
 * time.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 codedexposure-scene scene=blown-out num-buffers=100 \
 *     ! video/x-raw,format=GRAY8,width=768,height=576,framerate=100/1 \
 *     ! codedexposure-sim full-well=10000 ! codedexposure-demux ! queue \
 *     ! videoconvert ! autovideosink
 * ]|
 *
 * Since: 0.1
 */
#include <memory>

#include <gst/base/gstpushsrc.h>

#include "bench/scene.h"
#include "common/element.h"
#include "common/elements.h"

using namespace codedexposure::gst;
using codedexposure::SceneKind;

namespace
{

struct SceneState {
  SceneKind kind = SceneKind::kCandle; // object lock
  guint64 repeat = 0;                  // ns; object lock

  /* Streaming thread, and start and stop, which exclude it. */
  SceneKind drawn = SceneKind::kCandle; ///< in force
  GstClockTime period = 0;              ///< in force; 0: never repeated
  GstVideoInfo info;
  std::unique_ptr<codedexposure::SyntheticScene> scene;
  codedexposure::Image<float> light;
  guint64 frame = 0;
};

struct GstCodedExposureScene : Instance<GstPushSrc, SceneState> {
};

G_DEFINE_ENUM_TYPE (GstCodedExposureSceneKind, gst_coded_exposure_scene_kind,
    {int (SceneKind::kCandle), "A candle that flickers", "candle"},
    {int (SceneKind::kBlownOut), "A candle that is blown out after 0.5 s",
        "blown-out"},
    {int (SceneKind::kPour), "Liquid that is poured into a glass", "pour"});

PropertyTable<SceneState>
properties ()
{
  return {
      {"scene", "Scene to draw",
          "What is drawn; takes effect when the stream starts", kReadWriteReady,
          &SceneState::kind, gst_coded_exposure_scene_kind_get_type ()},
      {"repeat", "Repeat",
          "Time after which the scene begins again, ns; 0: never. Takes effect "
          "when the stream starts",
          kReadWriteReady, &SceneState::repeat, guint64 (0),
          guint64 (G_MAXINT64)}};
}

gboolean
start (GstBaseSrc *base)
{
  auto *self = as<GstCodedExposureScene> (base);
  SceneState &state = self->state;
  const ObjectLock lock (self);
  state.drawn = state.kind;
  state.period = state.repeat;
  state.frame = 0;
  return TRUE;
}

GstCaps *
fixate (GstBaseSrc *base, GstCaps *caps)
{
  caps = gst_caps_make_writable (caps);
  GstStructure *fields = gst_caps_get_structure (caps, 0);
  gst_structure_fixate_field_nearest_int (fields, "width", 768);
  gst_structure_fixate_field_nearest_int (fields, "height", 576);
  gst_structure_fixate_field_nearest_fraction (fields, "framerate", 100, 1);
  return parent_class<GstBaseSrcClass> (base)->fixate (base, caps);
}

gboolean
set_caps (GstBaseSrc *base, GstCaps *caps) noexcept
{
  auto *self = as<GstCodedExposureScene> (base);
  SceneState &state = self->state;
  if (!gst_video_info_from_caps (&state.info, caps))
    return FALSE;
  if (state.info.fps_n == 0) {
    POST_ERROR (self, STREAM, FORMAT,
        "A scene that moves needs a frame rate: write one behind it, such as "
        "video/x-raw,framerate=100/1.");
    return FALSE;
  }
  const codedexposure::Extent size{state.info.width, state.info.height};
  state.scene = codedexposure::SyntheticScene::make (state.drawn, size);
  state.light = codedexposure::Image<float> (size.width, size.height);
  return TRUE;
}

GstFlowReturn
create (GstPushSrc *base, GstBuffer **outbuf) noexcept
{
  auto *self = as<GstCodedExposureScene> (base);
  SceneState &state = self->state;
  if (!state.scene)
    return GST_FLOW_NOT_NEGOTIATED;
  const auto time_of = [&state] (guint64 frame) {
    return gst_util_uint64_scale (frame,
        guint64 (state.info.fps_d) * GST_SECOND, guint64 (state.info.fps_n));
  };
  BufferPtr buffer (gst_buffer_new_allocate (
      nullptr, GST_VIDEO_INFO_SIZE (&state.info), nullptr));
  const GstClockTime time = time_of (state.frame);
  const GstClockTime since = state.period > 0 ? time % state.period : time;
  state.scene->draw (double (since) * 1e-9, state.light.view ());
  {
    MappedFrame mapped (state.info, buffer.get (), GST_MAP_WRITE);
    const auto light = std::as_const (state.light).view ();
    write_pixels (mapped,
        [light] (auto pixels) { codedexposure::expose (light, pixels); });
  }
  GST_BUFFER_PTS (buffer.get ()) = time;
  GST_BUFFER_OFFSET (buffer.get ()) = state.frame++;
  GST_BUFFER_OFFSET_END (buffer.get ()) = state.frame;
  GST_BUFFER_DURATION (buffer.get ()) = time_of (state.frame) - time;
  *outbuf = buffer.release ();
  return GST_FLOW_OK;
}

void
set_up (gpointer klass)
{
  install_state<GstCodedExposureScene, properties> (klass);
  describe_element (klass, "Coded exposure test scene", "Source/Video",
      "Draws a candle, a candle that is blown out, or liquid that is poured",
      {"src"});

  auto *base_class = GST_BASE_SRC_CLASS (klass);
  base_class->start = GST_DEBUG_FUNCPTR (start);
  base_class->fixate = GST_DEBUG_FUNCPTR (fixate);
  base_class->set_caps = GST_DEBUG_FUNCPTR (set_caps);
  GST_PUSH_SRC_CLASS (klass)->create = GST_DEBUG_FUNCPTR (create);
}

void
set_up_instance (GstCodedExposureScene *self)
{
  gst_base_src_set_format (GST_BASE_SRC (self), GST_FORMAT_TIME);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_scene, "codedexposure-scene",
    GST_RANK_NONE,
    (type_of<GstCodedExposureScene, set_up, set_up_instance> (
        "GstCodedExposureScene", GST_TYPE_PUSH_SRC)))
