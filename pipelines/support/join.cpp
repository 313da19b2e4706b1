/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-join: puts videos of decoded excerpts together, without
 * decoding them, as one run of decode would have written them. */
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>
#include <gst/gst.h>

#include "base/result.h"
#include "common/raii.h"
#include "notes.h"
#include "part.h"
#include "record/matroska.h"
#include "report.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;

using SamplePtr = std::unique_ptr<GstSample, MiniObjectUnref>;

constexpr guint64 kMaxQueued = 64 << 20; // bytes between reader and muxer

/** A pipeline that is set to NULL at the end. */
class Pipeline
{
public:
  explicit Pipeline (const std::string &description)
      : bin_ (gst_parse_launch (description.c_str (), nullptr))
  {
  }
  ~Pipeline ()
  {
    if (bin_)
      gst_element_set_state (bin_.get (), GST_STATE_NULL);
  }
  Pipeline (const Pipeline &) = delete;
  Pipeline &operator= (const Pipeline &) = delete;

  ObjectPtr<GstElement> find (const char *name) const
  {
    return ObjectPtr<GstElement> (
        gst_bin_get_by_name (GST_BIN (bin_.get ()), name));
  }
  void set_location (const char *element, const std::string &path)
  {
    g_object_set (find (element).get (), "location", path.c_str (), nullptr);
  }
  void play () { gst_element_set_state (bin_.get (), GST_STATE_PLAYING); }
  /** Why it failed, or none; waits for its end if @p wait. */
  std::optional<std::string> failure (bool wait) const;

private:
  ObjectPtr<GstElement> bin_;
};

std::optional<std::string>
Pipeline::failure (bool wait) const
{
  const ObjectPtr<GstBus> bus (gst_element_get_bus (bin_.get ()));
  const std::unique_ptr<GstMessage, decltype (&gst_message_unref)> message (
      gst_bus_timed_pop_filtered (bus.get (), wait ? GST_CLOCK_TIME_NONE : 0,
          GstMessageType (GST_MESSAGE_ERROR | (wait ? GST_MESSAGE_EOS : 0))),
      gst_message_unref);
  if (!message || GST_MESSAGE_TYPE (message.get ()) == GST_MESSAGE_EOS)
    return std::nullopt;
  GError *error = nullptr;
  gst_message_parse_error (message.get (), &error, nullptr);
  const std::string text = error->message;
  g_error_free (error);
  return text;
}

/** The encoded frames of a Matroska file. */
class Reader
{
public:
  explicit Reader (const std::string &name)
      : name_ (name), pipeline_ ("filesrc name=source ! matroskademux "
                                 "name=file file.video_0 ! appsink "
                                 "name=frames sync=false max-buffers=32"),
        frames_ (pipeline_.find ("frames"))
  {
    pipeline_.set_location ("source", name);
    pipeline_.play ();
  }

  /** Null at the end. */
  Result<SamplePtr> next ()
  {
    SamplePtr sample;
    while (!sample) {
      sample.reset (gst_app_sink_try_pull_sample (
          GST_APP_SINK (frames_.get ()), 100 * GST_MSECOND));
      if (const auto failure = pipeline_.failure (false))
        return Error{name_ + ": " + *failure, ErrorCode::io};
      if (!sample && gst_app_sink_is_eos (GST_APP_SINK (frames_.get ())))
        return SamplePtr ();
    }
    return sample;
  }

  /** The tags of the video, without those that the demuxer adds. */
  std::unique_ptr<GstTagList, decltype (&gst_tag_list_unref)> tags () const
  {
    std::unique_ptr<GstTagList, decltype (&gst_tag_list_unref)> found (
        gst_tag_list_new_empty (), gst_tag_list_unref);
    const ObjectPtr<GstPad> pad (
        gst_element_get_static_pad (frames_.get (), "sink"));
    for (guint i = 0;; i++) {
      const EventPtr event (
          gst_pad_get_sticky_event (pad.get (), GST_EVENT_TAG, i));
      if (!event)
        return found;
      GstTagList *tags = nullptr;
      gst_event_parse_tag (event.get (), &tags);
      if (gst_tag_list_get_scope (tags) == GST_TAG_SCOPE_STREAM)
        gst_tag_list_insert (found.get (), tags, GST_TAG_MERGE_APPEND);
    }
  }

private:
  std::string name_;
  Pipeline pipeline_;
  ObjectPtr<GstElement> frames_;
};

/** Writes encoded frames as decode does. */
class Writer
{
public:
  explicit Writer (const std::string &path)
      : pipeline_ ("appsrc name=frames format=time block=true max-bytes=" +
                   std::to_string (kMaxQueued) +
                   " ! matroskamux timecodescale=1000 ! filesink name=target"),
        frames_ (pipeline_.find ("frames"))
  {
    pipeline_.set_location ("target", path);
  }

  void begin (GstSample *first, const Reader &reader)
  {
    const CapsPtr caps (gst_caps_copy (gst_sample_get_caps (first)));
    /* The muxer and the demuxer have different names for it. */
    gst_caps_set_simple (caps.get (), "ffversion", G_TYPE_INT, 1, nullptr);
    gst_app_src_set_caps (GST_APP_SRC (frames_.get ()), caps.get ());
    pipeline_.play ();
    const auto tags = reader.tags ();
    gst_element_send_event (
        frames_.get (), gst_event_new_tag (gst_tag_list_ref (tags.get ())));
  }

  Result<void> write (GstBuffer *frame)
  {
    const GstFlowReturn flow = gst_app_src_push_buffer (
        GST_APP_SRC (frames_.get ()), gst_buffer_ref (frame));
    return flow == GST_FLOW_OK ? Result<void> () : error (false);
  }

  Result<void> finish ()
  {
    gst_app_src_end_of_stream (GST_APP_SRC (frames_.get ()));
    return error (true);
  }

private:
  Result<void> error (bool at_end) const
  {
    const auto failure = pipeline_.failure (at_end);
    if (!failure && at_end)
      return {};
    return Error{
        failure.value_or ("the file cannot be written"), ErrorCode::io};
  }

  Pipeline pipeline_;
  ObjectPtr<GstElement> frames_;
};

bool
same_video (GstSample *a, GstSample *b)
{
  return gst_caps_is_equal (gst_sample_get_caps (a), gst_sample_get_caps (b));
}

struct PartFiles {
  std::string video, notes;
};

/* Gives @frame its exact times, which Matroska has rounded. */
Result<void>
restore_times (GstBuffer *frame, NoteTimes &notes, const PartFiles &part)
{
  const auto times = notes.next ();
  if (!times || !is_rounded (GST_BUFFER_PTS (frame), times->pts))
    return Error{part.notes + " are not the notes of " + part.video};
  GST_BUFFER_PTS (frame) = times->pts;
  GST_BUFFER_DURATION (frame) = times->duration;
  return {};
}

/** Copies the frames of @p parts, in their order, to @p path. */
Result<guint64>
join (const std::vector<PartFiles> &parts, const std::string &path)
{
  Writer writer (path);
  SamplePtr first;
  guint64 frames = 0;
  GstClockTime last = GST_CLOCK_TIME_NONE;
  for (const PartFiles &part : parts) {
    Reader reader (part.video);
    NoteTimes notes (part.notes);
    for (;;) {
      auto next = reader.next ();
      if (!next)
        return next.error ();
      if (!*next)
        break;
      SamplePtr &sample = *next;
      const BufferPtr owned (
          gst_buffer_copy (gst_sample_get_buffer (sample.get ())));
      GstBuffer *frame = owned.get ();
      if (!first) {
        writer.begin (sample.get (), reader);
        first.reset (gst_sample_ref (sample.get ()));
      } else if (!same_video (first.get (), sample.get ())) {
        return Error{part.video +
                     " is another kind of video than the parts before "
                     "it; decode all parts with the same options"};
      } else if (GST_BUFFER_PTS (frame) <= last) {
        return Error{
            part.video + " begins before the end of the part before it"};
      }
      if (auto restored = restore_times (frame, notes, part); !restored)
        return restored.error ();
      last = GST_BUFFER_PTS (frame);
      if (auto written = writer.write (frame); !written)
        return written.error ();
      frames++;
    }
  }
  if (!first)
    return Error{"the parts have no frames"};
  if (auto finished = writer.finish (); !finished)
    return finished.error ();
  return frames;
}

Result<guint64>
join_to_file (
    const std::vector<PartFiles> &parts, const std::string &name, bool force)
{
  Part output (name, Part::kFile);
  if (auto claimed = output.claim (true); !claimed)
    return claimed.error ();
  auto joined = join (parts, output.path ());
  Result<void> published;
  if (joined)
    published = tidy_matroska (output.path ());
  if (joined && published)
    published = output.publish (force);
  if (!joined || !published)
    output.discard ();
  if (joined && !published)
    return published.error ();
  return joined;
}

Result<guint64>
list_times (const std::string &name)
{
  Reader reader (name);
  guint64 frames = 0;
  for (;; frames++) {
    auto next = reader.next ();
    if (!next)
      return next.error ();
    if (!*next)
      return frames;
    std::printf ("%" G_GUINT64_FORMAT "\n",
        GST_BUFFER_PTS (gst_sample_get_buffer (next->get ())));
  }
}

int
usage ()
{
  std::cerr << "codedexposure-join [--force] OUT.mkv < names of the video and "
               "the notes of each part, each ends with a byte 0\n"
               "codedexposure-join --times IN.mkv\n";
  return 2;
}

} // namespace

int
main (int argc, char **argv)
{
  gst_init (nullptr, nullptr);
  std::vector<std::string> words (argv + 1, argv + argc);
  const std::string option = words.size () == 2 ? words[0] : "";
  if (words.empty () || words.size () > 2 ||
      (words.size () == 2 && option != "--force" && option != "--times"))
    return usage ();
  Result<guint64> done = Error{"nothing to do"};
  if (option == "--times") {
    done = list_times (words[1]);
  } else {
    std::vector<PartFiles> parts;
    for (PartFiles part; std::getline (std::cin, part.video, '\0') &&
                         std::getline (std::cin, part.notes, '\0');)
      parts.push_back (part);
    done = join_to_file (parts, words.back (), option == "--force");
    if (done)
      std::printf ("%" G_GUINT64_FORMAT "\n", *done);
  }
  if (!done)
    std::cerr << "join: " << done.error ().message << '\n';
  return done && std::fflush (stdout) == 0 ? 0 : 1;
}
