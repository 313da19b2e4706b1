/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-view
 * @title: codedexposure-view
 * @short_description: Pictures of any bit depth in 8 bits, for display
 *
 * Converts pictures of any bit depth to 8 bits for display. A 12-bit camera
 * uses a sixteenth of the range of GRAY16_LE, so other converters show its
 * pictures almost black; here the largest value of the significant bits becomes
 * white.
 *
 * The #codedexposure-view:bits property sets the number of significant bits. If
 * it is 0, the frame metadata of dmdsync and codedexposure-sim tell the number,
 * and without them the format. GRAY8 pictures with 8 significant bits pass
 * unchanged. #codedexposure-view:white stretches the contrast of a dark scene.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 videotestsrc num-buffers=400 \
 *     ! video/x-raw,format=GRAY16_LE,framerate=100/1 \
 *     ! codedexposure-sim bits=12 ! codedexposure-demux ! codedexposure-view \
 *     ! videoconvert ! autovideosink
 * ]| Shows the pictures of a 12-bit camera.
 *
 * Since: 0.1
 */
#include <algorithm>

#include <gst/video/gstvideofilter.h>

#include "base/pixels.h"
#include "common/element.h"
#include "common/elements.h"
#include "common/meta.h"
#include "common/tag.h"

using namespace codedexposure;
using namespace codedexposure::gst;

GST_DEBUG_CATEGORY_STATIC (codedexposure_view_debug);
#define GST_CAT_DEFAULT codedexposure_view_debug

namespace
{

struct ViewState {
  gint bits = 0, white = 0; // object lock
  gint tagged_bits = 0;     // streaming thread
};
struct GstCodedExposureView : Instance<GstVideoFilter, ViewState> {
};

constexpr int kWhite = 255;

/** The pixel value of @p picture that becomes white. */
guint64
white_of (GstCodedExposureView *self, GstBuffer *picture)
{
  int bits, white;
  locked (self, [&] {
    bits = self->state.bits;
    white = self->state.white;
  });
  if (white > 0)
    return guint64 (white);
  const GstVideoInfo &info = GST_VIDEO_FILTER (self)->in_info;
  return guint64 (
      largest_pixel (bits_of (picture, info, bits, self->state.tagged_bits)));
}

/** 0 to black, @p white and more to 255. */
template <typename Pixel>
void
show (ImageView<const Pixel> from, guint64 white, ImageView<guint8> to)
{
  constexpr int kFraction = 24;
  const guint64 scale = ((guint64 (255) << kFraction) + white / 2) / white;
  constexpr guint64 kHalf = guint64 (1) << (kFraction - 1);
  for (int y = 0; y < to.height; y++)
    for (int x = 0; x < to.width; x++)
      to.at (x, y) = guint8 (std::min<guint64> (
          255, (from.at (x, y) * scale + kHalf) >> kFraction));
}

GstCaps *
transform_caps (GstBaseTransform *, GstPadDirection direction, GstCaps *caps,
    GstCaps *filter)
{
  const bool to_shown = direction == GST_PAD_SINK;
  GValue formats = G_VALUE_INIT;
  g_value_init (&formats, to_shown ? G_TYPE_STRING : GST_TYPE_LIST);
  gst_value_deserialize (&formats, to_shown ? "GRAY8" : "{ GRAY8, GRAY16_LE }");
  CapsPtr other (gst_caps_copy (caps));
  gst_caps_set_value (other.get (), "format", &formats);
  g_value_unset (&formats);
  return (filter ? intersect_caps (filter, other.get ()) : std::move (other))
      .release ();
}

/* Frames of a file without a track have no metadata, but tags. */
gboolean
sink_event (GstBaseTransform *base, GstEvent *event)
{
  follow_tagged_bits (event, state_in<GstCodedExposureView> (base).tagged_bits);
  return base_transform_class ()->sink_event (base, event);
}

void
before_transform (GstBaseTransform *base, GstBuffer *picture)
{
  auto *self = as<GstCodedExposureView> (base);
  const GstVideoInfo &in = GST_VIDEO_FILTER (base)->in_info;
  const bool as_it_is = GST_VIDEO_INFO_FORMAT (&in) == GST_VIDEO_FORMAT_GRAY8 &&
                        white_of (self, picture) == kWhite;
  gst_base_transform_set_passthrough (base, as_it_is);
}

/* In place of the video filter's own, which passes a buffer that it cannot map
 * on without pixels. */
GstFlowReturn
transform (GstBaseTransform *base, GstBuffer *picture, GstBuffer *shown)
{
  auto *self = as<GstCodedExposureView> (base);
  const GstVideoInfo &in = GST_VIDEO_FILTER (base)->in_info;
  const GstVideoInfo &out = GST_VIDEO_FILTER (base)->out_info;
  MappedFrame from (in, picture, GST_MAP_READ);
  if (!from)
    return refuse_buffer (self, in, picture);
  MappedFrame to (out, shown, GST_MAP_WRITE);
  if (!to)
    return refuse_buffer (self, out, shown);
  const guint64 white = white_of (self, picture);
  read_pixels (
      from, [&] (auto pixels) { show (pixels, white, view_of<guint8> (to)); });
  if (auto meta = get_frame_meta (shown)) {
    meta->bits = 0;
    set_frame_meta (shown, *meta);
  }
  return GST_FLOW_OK;
}

PropertyTable<ViewState>
properties ()
{
  return {
      {"bits", "Significant bits",
          "Significant bits of a pixel; their largest value becomes white. 0: "
          "as the frame metadata or the tags say, or all bits of the format",
          kReadWrite, &ViewState::bits, 0, 16},
      {"white", "White",
          "Pixel value that becomes white, to see a dark scene; larger ones "
          "are white, too. 0: the largest value of the significant bits",
          kReadWrite, &ViewState::white, 0, 65535}};
}

void
set_up (gpointer klass)
{
  GST_DEBUG_CATEGORY_INIT (codedexposure_view_debug, "codedexposure-view", 0,
      "8-bit pictures for display");
  install_state<GstCodedExposureView, properties> (klass);
  describe_element (klass, "Coded exposure view", "Filter/Converter/Video",
      "Converts pictures of any bit depth to 8 bits for display", {"sink"});
  add_pad_template (klass, "src", {.caps = GST_VIDEO_CAPS_MAKE ("GRAY8")});

  auto *transform_class = GST_BASE_TRANSFORM_CLASS (klass);
  transform_class->transform_caps = GST_DEBUG_FUNCPTR (transform_caps);
  transform_class->sink_event = GST_DEBUG_FUNCPTR (sink_event);
  transform_class->before_transform = GST_DEBUG_FUNCPTR (before_transform);
  /* A video filter works in place where it can; depths differ here. */
  transform_class->transform_ip = nullptr;
  transform_class->transform = GST_DEBUG_FUNCPTR (transform);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_view, "codedexposure-view",
    GST_RANK_NONE,
    (type_of<GstCodedExposureView, set_up> (
        "GstCodedExposureView", GST_TYPE_VIDEO_FILTER)))
