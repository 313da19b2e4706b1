/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "notes.h"

#include <cinttypes>

#include "common/meta.h"
#include "report.h"

using namespace codedexposure::gst;
using report::format;

namespace
{

using TakeProbe = GstPadProbeReturn (*) (GstPad *, GstPadProbeInfo *, gpointer);

void
watch (GstElement *element, const char *pad_name, gpointer self,
    TakeProbe take_event, TakeProbe take_picture)
{
  const ObjectPtr<GstPad> pad (gst_element_get_static_pad (element, pad_name));
  gst_pad_add_probe (pad.get (), GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
      take_event, self, nullptr);
  gst_pad_add_probe (
      pad.get (), GST_PAD_PROBE_TYPE_BUFFER, take_picture, self, nullptr);
}

std::string
text_of_meta (GstBuffer *picture)
{
  const std::optional<FrameMeta> meta = get_frame_meta (picture);
  if (!meta)
    return "";
  GstCustomMeta *custom = gst_buffer_get_custom_meta (picture, kFrameMetaName);
  return CharPtr (
      gst_structure_to_string (gst_custom_meta_get_structure (custom)))
      .get ();
}

struct Picture {
  GstClockTime pts = GST_CLOCK_TIME_NONE, duration = GST_CLOCK_TIME_NONE;
  guint flags = 0;
  std::string meta;
};

std::optional<Picture>
parse_picture (const std::string &text)
{
  Picture picture;
  int length = 0;
  if (std::sscanf (text.c_str (), "%" SCNu64 " %" SCNu64 " %u %n", &picture.pts,
          &picture.duration, &picture.flags, &length) < 3)
    return std::nullopt;
  picture.meta = text.substr (std::size_t (length));
  return picture;
}

constexpr guint kFlags = GST_BUFFER_FLAG_CORRUPTED | GST_BUFFER_FLAG_DISCONT;

/* Whether @note is of @picture; it is put onto it. */
bool
put (const Picture &note, GstBuffer *picture)
{
  if (!is_rounded (GST_BUFFER_PTS (picture), note.pts))
    return false;
  GST_BUFFER_PTS (picture) = note.pts;
  GST_BUFFER_DURATION (picture) = note.duration;
  GST_BUFFER_FLAG_UNSET (picture, kFlags);
  GST_BUFFER_FLAG_SET (picture, note.flags & kFlags);
  if (note.meta.empty ())
    return true;
  const std::unique_ptr<GstStructure, decltype (&gst_structure_free)> fields (
      gst_structure_new_from_string (note.meta.c_str ()), gst_structure_free);
  if (!fields)
    return false;
  GstCustomMeta *meta = gst_buffer_add_custom_meta (picture, kFrameMetaName);
  GstStructure *target = gst_custom_meta_get_structure (meta);
  const auto copy = [] (GQuark name, const GValue *value, gpointer target) {
    gst_structure_id_set_value (
        static_cast<GstStructure *> (target), name, value);
    return gboolean (TRUE);
  };
  gst_structure_foreach (fields.get (), copy, target);
  return true;
}

} // namespace

bool
is_rounded (GstClockTime read, GstClockTime noted)
{
  constexpr GstClockTimeDiff kRounding = 10 * GST_USECOND;
  return ABS (GST_CLOCK_DIFF (read, noted)) <= kRounding;
}

std::optional<NoteTimes::Times>
NoteTimes::next ()
{
  for (std::string line; std::getline (file_, line);)
    if (line.starts_with ("picture ")) {
      const auto note = parse_picture (line.substr (line.find (' ') + 1));
      return note ? std::optional (Times{note->pts, note->duration})
                  : std::nullopt;
    }
  return std::nullopt;
}

NoteWriter::NoteWriter (GstElement *element, const std::string &path)
    : file_ (std::fopen (path.c_str (), "w"), std::fclose), failed_ (!file_)
{
  watch (
      element, "src", this,
      [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
        static_cast<NoteWriter *> (self)->write_event (
            GST_PAD_PROBE_INFO_EVENT (info));
        return GST_PAD_PROBE_OK;
      },
      [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
        static_cast<NoteWriter *> (self)->write_picture (
            GST_PAD_PROBE_INFO_BUFFER (info));
        return GST_PAD_PROBE_OK;
      });
}

void
NoteWriter::write_event (GstEvent *event)
{
  if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS) {
    GstCaps *caps = nullptr;
    gst_event_parse_caps (event, &caps);
    write (std::string ("caps ") + CharPtr (gst_caps_to_string (caps)).get ());
  } else if (GST_EVENT_TYPE (event) == GST_EVENT_TAG) {
    GstTagList *tags = nullptr;
    gst_event_parse_tag (event, &tags);
    write (format ("tags %d ", int (gst_tag_list_get_scope (tags))) +
           CharPtr (gst_tag_list_to_string (tags)).get ());
  } else if (GST_EVENT_TYPE (event) == GST_EVENT_SEGMENT) {
    const GstSegment *segment = nullptr;
    gst_event_parse_segment (event, &segment);
    write (format ("segment %" G_GUINT64_FORMAT " %" G_GUINT64_FORMAT,
        segment->start, segment->time));
  }
}

void
NoteWriter::write_picture (GstBuffer *picture)
{
  write (format ("picture %" G_GUINT64_FORMAT " %" G_GUINT64_FORMAT " %u ",
             GST_BUFFER_PTS (picture), GST_BUFFER_DURATION (picture),
             GST_BUFFER_FLAGS (picture) & kFlags) +
         text_of_meta (picture));
}

void
NoteWriter::write (const std::string &line)
{
  if (file_ && std::fprintf (file_.get (), "%s\n", line.c_str ()) < 0)
    failed_ = true;
}

bool
NoteWriter::finish ()
{
  return file_ && std::fclose (file_.release ()) == 0 && !failed_;
}

NoteReader::NoteReader (GstElement *element, const std::string &path)
    : src_ (gst_element_get_static_pad (element, "src")), file_ (path)
{
  register_meta (kFrameMetaName);
  next ();
  watch (
      element, "sink", this,
      [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
        return static_cast<NoteReader *> (self)->take_event (info);
      },
      [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
        static_cast<NoteReader *> (self)->take_picture (info);
        return GST_PAD_PROBE_OK;
      });
}

void
NoteReader::next ()
{
  kind_.clear ();
  if (file_ >> kind_ && file_.get () == ' ')
    std::getline (file_, rest_);
}

/* The caps of the file may have another rate, and its tags more than there
 * were. */
GstPadProbeReturn
NoteReader::take_event (GstPadProbeInfo *info)
{
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  if (GST_EVENT_TYPE (event) == GST_EVENT_TAG)
    return GST_PAD_PROBE_DROP;
  if (GST_EVENT_TYPE (event) != GST_EVENT_CAPS || kind_ != "caps")
    return GST_PAD_PROBE_OK;
  const CapsPtr caps (gst_caps_from_string (rest_.c_str ()));
  if (!caps)
    return GST_PAD_PROBE_OK;
  info->data = gst_event_new_caps (caps.get ());
  gst_event_unref (event);
  next ();
  return GST_PAD_PROBE_OK;
}

void
NoteReader::push_tags ()
{
  int scope = 0, length = 0;
  if (std::sscanf (rest_.c_str (), "%d %n", &scope, &length) < 1)
    return;
  GstTagList *tags = gst_tag_list_new_from_string (rest_.c_str () + length);
  if (!tags)
    return;
  gst_tag_list_set_scope (tags, GstTagScope (scope));
  gst_pad_push_event (src_.get (), gst_event_new_tag (tags));
}

/* That of the file begins with a rounded time, which may be too late for the
 * first picture. */
void
NoteReader::push_segment ()
{
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  if (std::sscanf (rest_.c_str (), "%" SCNu64 " %" SCNu64, &segment.start,
          &segment.time) == 2)
    gst_pad_push_event (src_.get (), gst_event_new_segment (&segment));
}

void
NoteReader::take_picture (GstPadProbeInfo *info)
{
  for (; kind_ == "tags" || kind_ == "segment"; next ()) {
    if (kind_ == "tags")
      push_tags ();
    else
      push_segment ();
  }
  GstBuffer *picture =
      gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
  info->data = picture;
  const auto note = kind_ == "picture" ? parse_picture (rest_) : std::nullopt;
  if ((!note || !put (*note, picture)) && problem_.empty ())
    problem_ =
        format ("the notes do not have the picture at %" G_GUINT64_FORMAT " ns",
            GST_BUFFER_PTS (picture));
  next ();
}

std::string
NoteReader::finish ()
{
  if (problem_.empty () && !kind_.empty ())
    problem_ = "the notes have more pictures than the video";
  return problem_;
}
