/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the user and the stream say of coded frames. */
#include "gstcodedinput.h"

#include <utility>

namespace cexp::gst
{

void
refuse (GstElement *element, const std::string &why)
{
  GST_ELEMENT_ERROR (element, STREAM, FORMAT, ("%s", why.c_str ()), (nullptr));
}

namespace
{

/* Null for an empty text. */
template <typename Read>
auto
read_unless_empty (GstElement *element, const std::string &text, Read read)
{
  using Parsed = decltype (read (text));
  std::shared_ptr<const Parsed> parsed;
  if (!text.empty ())
    parsed = std::make_shared<const Parsed> (read (text));
  if (parsed && !*parsed)
    GST_WARNING_OBJECT (element, "%s", parsed->error ().message.c_str ());
  return parsed;
}

template <typename Parsed>
bool
check_read (GstElement *element, const char *property,
    const std::shared_ptr<const Parsed> &parsed)
{
  if (!parsed || *parsed)
    return true;
  GST_ELEMENT_ERROR (element, RESOURCE, SETTINGS,
      ("The %s property cannot be read: %s", property,
          parsed->error ().message.c_str ()),
      (nullptr));
  return false;
}

/** Says so where @p asked is not what the stream says of itself. */
void
say_overruled (GstElement *element, CodedStream &stream, const Schedule &asked)
{
  if (!stream.tagged || !*stream.tagged)
    return;
  const Schedule &tagged = stream.tagged->value ().schedule;
  if (tagged == asked || stream.overruled == tagged)
    return;
  stream.overruled = tagged;
  const std::string text = "The schedule property, " + asked.text () +
                           ", is in force. The stream was made with " +
                           tagged.text () + ".";
  /* gst-launch shows the second text only. */
  GST_ELEMENT_INFO (
      element, STREAM, FORMAT, ("%s", text.c_str ()), ("%s", text.c_str ()));
}

} // namespace

void
set_schedule (
    GstElement *element, CodedSettings &settings, const std::string &text)
{
  auto parsed = read_unless_empty (element, text, Schedule::parse);
  const ObjectLock lock (element);
  settings.schedule = text;
  settings.parsed = std::move (parsed);
}

void
set_mapping (
    GstElement *element, CodedSettings &settings, const std::string &path)
{
  auto mapped = read_unless_empty (element, path, Mapping::load);
  const ObjectLock lock (element);
  settings.mapping = path;
  settings.mapped = std::move (mapped);
}

bool
read_again (GstElement *element, CodedSettings &settings)
{
  std::string schedule, mapping;
  {
    const ObjectLock lock (element);
    schedule = settings.schedule;
    mapping = settings.mapping;
  }
  set_schedule (element, settings, schedule);
  set_mapping (element, settings, mapping);
  CodedSettings read;
  {
    const ObjectLock lock (element);
    read = settings;
  }
  return check_read (element, "schedule", read.parsed) &&
         check_read (element, "mapping", read.mapped);
}

std::optional<FoundSchedule>
find_schedule (
    GstElement *element, CodedStream &stream, const CodedSettings &settings)
{
  if (const auto &asked = settings.parsed) {
    if (*asked) {
      say_overruled (element, stream, asked->value ());
      return FoundSchedule{asked->value ()};
    }
    refuse (element,
        "The schedule property cannot be read: " + asked->error ().message);
    return std::nullopt;
  }
  if (const auto &tagged = stream.tagged) {
    if (*tagged)
      return FoundSchedule{tagged->value ().schedule};
    refuse (element, "The schedule in the stream's tags cannot be read: " +
                         tagged->error ().message);
    return std::nullopt;
  }
  const FoundSchedule assumed{Schedule (), true};
  if (!std::exchange (stream.warned_assumed, true))
    GST_ELEMENT_WARNING (element, STREAM, FORMAT,
        ("The stream says nothing of its schedule: assuming %s. Set the "
         "schedule property if it is another.",
            assumed.schedule.text ().c_str ()),
        (nullptr));
  return assumed;
}

ScheduleRef
binding_schedule (
    const CodedSettings &settings, const ScheduleRef &in_force, bool assumed)
{
  if (settings.parsed && *settings.parsed)
    return {settings.parsed, &settings.parsed->value ()};
  return assumed ? nullptr : in_force;
}

std::optional<CodedFormat>
find_format (GstElement *element, const CodedStream &stream,
    const CodedSettings &settings)
{
  if (!stream.caps) {
    refuse (element, "Coded frames came without caps.");
    return std::nullopt;
  }
  CodedFormat format{fill_in_rate (settings.rate, stream.caps.get ()), {}};
  if (!gst_video_info_from_caps (&format.info, format.caps.get ())) {
    refuse (element, "The caps of the coded frames cannot be read.");
    return std::nullopt;
  }
  if (GST_VIDEO_INFO_IS_INTERLACED (&format.info)) {
    refuse (element,
        "The coded frames are interlaced: a coded exposure needs a camera "
        "that exposes all rows together (progressive, global shutter).");
    return std::nullopt;
  }
  if (format.info.fps_n == 0) {
    refuse (element,
        "The coded frames have no frame rate, so what is made of them has no "
        "length: set the frame-rate property, for example frame-rate=25/1.");
    return std::nullopt;
  }
  return format;
}

CapsPtr
resized_caps (const CodedFormat &format, Extent size)
{
  CapsPtr caps (gst_caps_copy (format.caps.get ()));
  gst_caps_set_simple (caps.get (), "pixel-aspect-ratio", GST_TYPE_FRACTION,
      format.info.par_n, format.info.par_d, "width", G_TYPE_INT, size.width,
      "height", G_TYPE_INT, size.height, nullptr);
  return caps;
}

void
take_bits (CodedStream &stream, GstBuffer *next)
{
  const auto meta = next ? get_frame_meta (next) : std::nullopt;
  const int bits = meta ? std::max (0, meta->bits) : 0;
  if (meta && std::exchange (stream.bits, bits) != bits)
    stream.stale = true;
}

void
count_at_rate (
    CodedStream &stream, FrameRate rate, std::optional<FrameRate> before)
{
  if (before == rate)
    return;
  stream.sequence.emplace (
      rate, stream.sequence ? stream.sequence->next_number () : 0);
}

} // namespace cexp::gst
