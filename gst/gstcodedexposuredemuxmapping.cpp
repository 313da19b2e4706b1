/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera that does not stand as the schedule has it: frames are rectified to
 * one pixel a mirror before they are taken apart. */
#include "gstcodedexposuredemuxstate.h"

#define GST_CAT_DEFAULT codedexposure_demux_debug

namespace cexp::gst::demux
{

namespace
{

std::string
text_of (Extent size)
{
  return std::to_string (size.width) + "x" + std::to_string (size.height);
}

/* A stream that was scaled or cropped since it was mapped. */
void
warn_of_other_size (
    GstCodedExposureDemux *self, const Mapping &mapping, Extent camera)
{
  if (std::exchange (state (self).stream.warned_of_mapping, true))
    return;
  GST_ELEMENT_WARNING (self, STREAM, FORMAT,
      ("The mapping in the stream's tags is of frames of %s pixels; these have "
       "%s, and are taken as they are. Do not scale coded frames.",
          text_of (mapping.camera ()).c_str (), text_of (camera).c_str ()),
      (nullptr));
}

/* The property wins over the stream's tag. */
bool
find_mapping (
    GstCodedExposureDemux *self, Extent camera, std::optional<Mapping> &mapping)
{
  Stream &stream = state (self).stream;
  if (const auto &asked = stream.settings.mapped) {
    if (!*asked) {
      refuse (GST_ELEMENT (self),
          "The mapping property cannot be read: " + asked->error ().message);
      return false;
    }
    mapping = asked->value ();
    if (mapping->camera () == camera)
      return true;
    refuse (GST_ELEMENT (self),
        "The mapping " + stream.settings.mapping + " is of frames of " +
            text_of (mapping->camera ()) + " pixels, these have " +
            text_of (camera) +
            ": map the camera as it is set now (moirecalib).");
    return false;
  }
  if (stream.tagged && *stream.tagged)
    mapping = stream.tagged->value ().mapping;
  if (mapping && !(mapping->camera () == camera)) {
    warn_of_other_size (self, *mapping, camera);
    mapping.reset ();
  }
  return true;
}

template <typename Pixel>
ImageView<const Pixel>
rectify_into (
    Stream &stream, ImageView<const Pixel> coded, Image<Pixel> &rectified)
{
  const Plan &plan = *stream.plan;
  if (rectified.width () != plan.extracted.width ||
      rectified.height () != plan.extracted.height)
    rectified = Image<Pixel> (plan.extracted.width, plan.extracted.height);
  const int bits = stream.bits_in_force ();
  plan.rectifier->run (
      coded, rectified.view (), bits > 0 ? (1 << bits) - 1 : 0);
  return rectified.view ();
}

} // namespace

bool
find_rectifier (GstCodedExposureDemux *self, const Schedule &schedule,
    Extent camera, std::shared_ptr<const Rectifier> &rectifier)
{
  std::optional<Mapping> mapping;
  if (!find_mapping (self, camera, mapping))
    return false;
  rectifier.reset ();
  if (!mapping)
    return true;

  auto &cache = state (self).stream.rectifiers;
  if (!cache || !(cache->mapping == *mapping) ||
      !(cache->schedule == schedule)) {
    Result<Rectifier> made = Rectifier::make (*mapping, schedule);
    if (!made) {
      refuse (GST_ELEMENT (self),
          "The mapping cannot be used: " + made.error ().message);
      return false;
    }
    cache.emplace (RectifierCache{*mapping, schedule,
        std::make_shared<const Rectifier> (*std::move (made))});
  }
  rectifier = cache->rectifier;
  return true;
}

void
say_mapping (GstCodedExposureDemux *self)
{
  DemuxState &st = state (self);
  const auto &rectifier = st.stream.plan->rectifier;
  const RectifyReport report =
      rectifier ? rectifier->report () : RectifyReport ();
  {
    const ObjectLock lock (self);
    st.counters.rectified = report;
    st.rectifies = rectifier != nullptr;
  }
  if (!rectifier)
    return;
  notify (self, "mirrors-mixed");
  notify (self, "mirrors-unseen");
  gst_element_post_message (GST_ELEMENT (self),
      gst_message_new_element (GST_OBJECT (self),
          gst_structure_new ("codedexposure/mapping", "exact", G_TYPE_UINT64,
              guint64 (report.exact), "weighted", G_TYPE_UINT64,
              guint64 (report.weighted), "mixed", G_TYPE_UINT64,
              guint64 (report.mixed), "unseen", G_TYPE_UINT64,
              guint64 (report.unseen), nullptr)));
}

ImageView<const std::uint8_t>
rectify (Stream &stream, ImageView<const std::uint8_t> coded)
{
  return rectify_into (stream, coded, stream.narrow);
}

ImageView<const std::uint16_t>
rectify (Stream &stream, ImageView<const std::uint16_t> coded)
{
  return rectify_into (stream, coded, stream.wide);
}

} // namespace cexp::gst::demux
