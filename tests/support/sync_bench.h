/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A simulated bench and a dmdsync, exposed frame by frame. */
#pragma once

#include <deque>
#include <memory>

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

#include "scenes.h"
#include "sync_harness.h"

namespace codedexposure::test
{

constexpr int kWidth = 96;
constexpr int kHeight = 72;

/** A pipeline that exposes one coded frame at a time. */
class Bench
{
public:
  /** @p line: what stands between the scene and the test. */
  Bench (const std::string &schedule, const std::string &line)
      : slots_ (Schedule::parse (schedule)->slots ()),
        pipeline_ (GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
            ("appsrc name=scene format=time caps=\"" +
                gray_caps (
                    kWidth, kHeight, std::to_string (25 * slots_) + "/1") +
                "\" ! " + line + " ! appsink name=camera sync=false")
                .c_str (),
            nullptr)))),
        scene_ (gst_bin_get_by_name (GST_BIN (pipeline_.get ()), "scene")),
        camera_ (gst_bin_get_by_name (GST_BIN (pipeline_.get ()), "camera")),
        bus_ (gst_element_get_bus (pipeline_.get ()))
  {
    gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING);
  }
  ~Bench () { gst_element_set_state (pipeline_.get (), GST_STATE_NULL); }

  int slots () const { return slots_; }
  std::int64_t frames () const { return slot_ / slots_; }

  /** Exposes the next frame. */
  void expose (const Scene &scene)
  {
    const FrameRate rate{25 * slots_, 1};
    for (int s = 0; s < slots_; s++, slot_++) {
      Image<std::uint8_t> picture (kWidth, kHeight);
      scene (slot_, picture.view ());
      ASSERT_EQ (gst_app_src_push_buffer (GST_APP_SRC (scene_.get ()),
                     frame_of (picture, GstClockTime (rate.time_of (slot_)))
                         .release ()),
          GST_FLOW_OK);
    }
  }
  /** The next buffer that comes out; there has to be one. */
  BufferPtr pull ()
  {
    GstSample *sample = gst_app_sink_try_pull_sample (
        GST_APP_SINK (camera_.get ()), 60 * GST_SECOND);
    EXPECT_TRUE (sample) << "no frame";
    if (!sample)
      return nullptr;
    BufferPtr frame (gst_buffer_ref (gst_sample_get_buffer (sample)));
    gst_sample_unref (sample);
    return frame;
  }
  BufferPtr next (const Scene &scene)
  {
    expose (scene);
    return pull ();
  }

  ObjectPtr<GstElement> find (const char *name)
  {
    return ObjectPtr<GstElement> (
        gst_bin_get_by_name (GST_BIN (pipeline_.get ()), name));
  }
  /** Tags of the stream as they arrive. */
  struct TagsUnref {
    void operator() (GstTagList *tags) const { gst_tag_list_unref (tags); }
  };
  std::unique_ptr<GstTagList, TagsUnref> tags ()
  {
    const ObjectPtr<GstPad> pad (
        gst_element_get_static_pad (camera_.get (), "sink"));
    const EventPtr event (
        gst_pad_get_sticky_event (pad.get (), GST_EVENT_TAG, 0));
    GstTagList *tags = nullptr;
    if (event)
      gst_event_parse_tag (event.get (), &tags);
    return std::unique_ptr<GstTagList, TagsUnref> (
        tags ? gst_tag_list_ref (tags) : gst_tag_list_new_empty ());
  }
  gboolean send_upstream (GstEvent *event)
  {
    const ObjectPtr<GstPad> pad (
        gst_element_get_static_pad (camera_.get (), "sink"));
    return gst_pad_push_event (pad.get (), event);
  }
  /** To READY and back. */
  void restart ()
  {
    gst_element_set_state (pipeline_.get (), GST_STATE_READY);
    gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING);
  }
  /** Ends the stream, and waits until that has arrived. */
  void end ()
  {
    gst_app_src_end_of_stream (GST_APP_SRC (scene_.get ()));
    GstSample *none = gst_app_sink_try_pull_sample (
        GST_APP_SINK (camera_.get ()), 60 * GST_SECOND);
    EXPECT_EQ (none, nullptr);
    EXPECT_TRUE (gst_app_sink_is_eos (GST_APP_SINK (camera_.get ())));
  }

  /** Element messages of dmdsync so far, by name. */
  std::vector<MessagePtr> messages (const char *name)
  {
    while (GstMessage *next = gst_bus_pop (bus_.get ()))
      said_.emplace_back (next);
    std::vector<MessagePtr> found;
    for (const MessagePtr &message : said_)
      if (gst_message_has_name (message.get (), name))
        found.emplace_back (gst_message_ref (message.get ()));
    return found;
  }
  /** Text of the next error, for which it waits. */
  std::string wait_error ()
  {
    const MessagePtr found (gst_bus_timed_pop_filtered (
        bus_.get (), 60 * GST_SECOND, GST_MESSAGE_ERROR));
    if (!found)
      return "";
    GError *error = nullptr;
    gst_message_parse_error (found.get (), &error, nullptr);
    const std::string text = error->message;
    g_error_free (error);
    return text;
  }
  /** Texts of all warnings, one for each line. */
  std::string warnings ()
  {
    std::string all;
    messages ("");
    for (const MessagePtr &message : said_) {
      if (GST_MESSAGE_TYPE (message.get ()) != GST_MESSAGE_WARNING)
        continue;
      GError *error = nullptr;
      gst_message_parse_warning (message.get (), &error, nullptr);
      all += error->message + std::string ("\n");
      g_error_free (error);
    }
    return all;
  }
  guint64 counter (const char *name)
  {
    const ObjectPtr<GstElement> sync (
        gst_bin_get_by_name (GST_BIN (pipeline_.get ()), "sync"));
    const StructurePtr stats (property<GstStructure *> (sync.get (), "stats"));
    guint64 value = G_MAXUINT64;
    EXPECT_TRUE (gst_structure_get_uint64 (stats.get (), name, &value)) << name;
    return value;
  }

private:
  int slots_;
  ObjectPtr<GstElement> pipeline_, scene_, camera_;
  ObjectPtr<GstBus> bus_;
  std::int64_t slot_ = 0;
  std::deque<MessagePtr> said_;
};

} // namespace codedexposure::test
