/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera that does not stand as the schedule has it: frames are rectified to
 * one pixel a mirror before anything is made of them. */
#include "gstcodedinput.h"

namespace cexp::gst
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
warn_of_other_size (GstElement *element, CodedStream &stream,
    const Mapping &mapping, Extent camera)
{
  if (std::exchange (stream.warned_of_mapping, true))
    return;
  GST_ELEMENT_WARNING (element, STREAM, FORMAT,
      ("The mapping in the stream's tags is of frames of %s pixels; these have "
       "%s, and are taken as they are. Do not scale coded frames.",
          text_of (mapping.camera ()).c_str (), text_of (camera).c_str ()),
      (nullptr));
}

bool
find_mapping (GstElement *element, CodedStream &stream,
    const CodedSettings &settings, Extent camera,
    std::optional<Mapping> &mapping)
{
  if (const auto &asked = settings.mapped) {
    if (!*asked) {
      refuse (element,
          "The mapping property cannot be read: " + asked->error ().message);
      return false;
    }
    mapping = asked->value ();
    if (mapping->camera () == camera)
      return true;
    refuse (element, "The mapping " + settings.mapping + " is of frames of " +
                         text_of (mapping->camera ()) + " pixels, these have " +
                         text_of (camera) +
                         ": map the camera as it is set now (moirecalib).");
    return false;
  }
  if (stream.tagged && *stream.tagged)
    mapping = stream.tagged->value ().mapping;
  if (mapping && !(mapping->camera () == camera)) {
    warn_of_other_size (element, stream, *mapping, camera);
    mapping.reset ();
  }
  return true;
}

template <typename Pixel>
ImageView<const Pixel>
rectify_into (Image<Pixel> &rectified, const Rectifier &rectifier,
    ImageView<const Pixel> coded, int bits)
{
  const Extent size = rectifier.mirrors ();
  if (rectified.width () != size.width || rectified.height () != size.height)
    rectified = Image<Pixel> (size.width, size.height);
  rectifier.run (coded, rectified.view (), bits > 0 ? (1 << bits) - 1 : 0);
  return rectified.view ();
}

} // namespace

bool
find_rectifier (GstElement *element, CodedStream &stream,
    const CodedSettings &settings, const Schedule &schedule, Extent camera,
    const RectifyOptions &options, std::shared_ptr<const Rectifier> &rectifier)
{
  std::optional<Mapping> mapping;
  if (!find_mapping (element, stream, settings, camera, mapping))
    return false;
  rectifier.reset ();
  if (!mapping)
    return true;

  auto &cache = stream.rectifiers;
  if (!cache || !(cache->mapping == *mapping) ||
      !(cache->schedule == schedule) || !(cache->options == options)) {
    Result<Rectifier> made = Rectifier::make (*mapping, schedule, options);
    if (!made) {
      refuse (element, "The mapping cannot be used: " + made.error ().message);
      return false;
    }
    cache.emplace (RectifierCache{*mapping, schedule, options,
        std::make_shared<const Rectifier> (*std::move (made))});
  }
  rectifier = cache->rectifier;
  return true;
}

void
say_mapping (
    GstElement *element, CodedCounters &counters, const Rectifier *rectifier)
{
  const RectifyReport report =
      rectifier ? rectifier->report () : RectifyReport ();
  {
    const ObjectLock lock (element);
    counters.rectified = report;
  }
  if (!rectifier)
    return;
  g_object_notify (G_OBJECT (element), "mirrors-mixed");
  g_object_notify (G_OBJECT (element), "mirrors-unseen");
  gst_element_post_message (
      element, gst_message_new_element (GST_OBJECT (element),
                   gst_structure_new ("codedexposure/mapping", "exact",
                       G_TYPE_UINT64, guint64 (report.exact), "weighted",
                       G_TYPE_UINT64, guint64 (report.weighted), "mixed",
                       G_TYPE_UINT64, guint64 (report.mixed), "unseen",
                       G_TYPE_UINT64, guint64 (report.unseen), nullptr)));
}

ImageView<const std::uint8_t>
rectify (CodedStream &stream, const Rectifier &rectifier,
    ImageView<const std::uint8_t> coded, int bits)
{
  return rectify_into (stream.narrow, rectifier, coded, bits);
}

ImageView<const std::uint16_t>
rectify (CodedStream &stream, const Rectifier &rectifier,
    ImageView<const std::uint16_t> coded, int bits)
{
  return rectify_into (stream.wide, rectifier, coded, bits);
}

} // namespace cexp::gst
