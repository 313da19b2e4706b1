/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* One element between pads of the test, which also reads its bus. */
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/check/gstharness.h>
#include <gst/gst.h>
#include <gst/video/video.h>
#include <gtest/gtest.h>

#include "base/image.h"
#include "common/raii.h"
#include "common/structure.h"

namespace codedexposure::test
{

using namespace codedexposure::gst;

using MessagePtr = std::unique_ptr<GstMessage, MiniObjectUnref>;

struct HarnessTeardown {
  void operator() (GstHarness *h) const { gst_harness_teardown (h); }
};
using HarnessPtr = std::unique_ptr<GstHarness, HarnessTeardown>;

inline CapsPtr
caps_of (const std::string &text)
{
  CapsPtr caps (gst_caps_from_string (text.c_str ()));
  EXPECT_TRUE (caps) << text;
  return caps;
}

inline std::string
text_of (const GstCaps *caps)
{
  return caps ? CharPtr (gst_caps_to_string (caps)).get () : "(null)";
}

/** Text of an error, warning or info. */
inline std::string
text_of (GstMessage *message)
{
  GError *error = nullptr;
  if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR)
    gst_message_parse_error (message, &error, nullptr);
  else if (GST_MESSAGE_TYPE (message) == GST_MESSAGE_WARNING)
    gst_message_parse_warning (message, &error, nullptr);
  else
    gst_message_parse_info (message, &error, nullptr);
  const std::string text = error->message;
  g_error_free (error);
  return text;
}

/** Text of the error with which @p element refuses to change to @p state. */
inline std::string
refusal (GstElement *element, GstState state)
{
  const ObjectPtr<GstBus> bus (gst_bus_new ());
  gst_element_set_bus (element, bus.get ());
  EXPECT_EQ (gst_element_set_state (element, state), GST_STATE_CHANGE_FAILURE);
  gst_element_set_bus (element, nullptr);
  const MessagePtr message (
      gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR));
  EXPECT_TRUE (message);
  return message ? text_of (message.get ()) : "";
}

/** Succeeds when both mean the same, whatever the order of their fields. */
inline ::testing::AssertionResult
same_caps (GstCaps *caps, const std::string &expected)
{
  if (caps && gst_caps_is_equal (caps, caps_of (expected).get ()))
    return ::testing::AssertionSuccess ();
  return ::testing::AssertionFailure () << text_of (caps);
}

template <typename T>
T
property (gpointer object, const char *name)
{
  T value{};
  g_object_get (object, name, &value, nullptr);
  return value;
}

inline std::string
text_property (gpointer object, const char *name)
{
  return CharPtr (property<gchar *> (object, name)).get ();
}

/** A counter in the stats of @p element. */
inline guint64
counter_of (gpointer element, const char *name)
{
  const StructurePtr stats (property<GstStructure *> (element, "stats"));
  guint64 value = 0;
  EXPECT_TRUE (gst_structure_get_uint64 (stats.get (), name, &value)) << name;
  return value;
}

/** The element of a launch line, e.g. "codedexposure-demux method=rank",
 * between a source pad and any number of sink pads of the test. */
class ElementHarness
{
public:
  explicit ElementHarness (const std::string &line, const char *sink = "sink",
      const char *src = "src")
      : bus_ (gst_bus_new ())
  {
    GError *error = nullptr;
    element_.reset (GST_ELEMENT (
        gst_object_ref_sink (gst_parse_launch (line.c_str (), &error))));
    EXPECT_EQ (error, nullptr) << error->message;
    gst_element_set_bus (element_.get (), bus_.get ());
    main_.reset (gst_harness_new_with_element (element_.get (), sink, src));
  }
  ~ElementHarness ()
  {
    pads_.clear ();
    main_.reset ();
    gst_element_set_bus (element_.get (), nullptr);
  }

  GstElement *element () const { return element_.get (); }
  GstHarness *get () const { return main_.get (); }

  /** Requests a source pad of the element and collects its output. */
  GstHarness *request (const std::string &pad)
  {
    HarnessPtr &harness = pads_[pad];
    harness.reset (
        gst_harness_new_with_element (element_.get (), nullptr, pad.c_str ()));
    return harness.get ();
  }
  /** The pad's harness; that of the always pad for an empty name. */
  GstHarness *pad (const std::string &name) const
  {
    return name.empty () ? main_.get () : pads_.at (name).get ();
  }
  void release (const std::string &pad) { pads_.erase (pad); }

  void set_caps (const std::string &caps)
  {
    gst_harness_set_src_caps_str (main_.get (), caps.c_str ());
  }
  GstFlowReturn push (BufferPtr buffer)
  {
    return gst_harness_push (main_.get (), buffer.release ());
  }
  gboolean push_event (GstEvent *event)
  {
    return gst_harness_push_event (main_.get (), event);
  }
  /** The next buffer of @p pad, null when there is none. */
  BufferPtr pull (const std::string &pad_name = "")
  {
    return BufferPtr (gst_harness_try_pull (pad (pad_name)));
  }
  /** All buffers of @p pad that have come. */
  std::vector<BufferPtr> pull_all (const std::string &pad_name = "")
  {
    std::vector<BufferPtr> all;
    while (BufferPtr buffer = pull (pad_name))
      all.push_back (std::move (buffer));
    return all;
  }
  /** The next event of @p type that came out of @p pad, null when there is
   * none; events before it are forgotten. */
  EventPtr pull_event (GstEventType type, const std::string &pad_name = "")
  {
    while (GstEvent *event = gst_harness_try_pull_event (pad (pad_name))) {
      EventPtr owned (event);
      if (GST_EVENT_TYPE (event) == type)
        return owned;
    }
    return nullptr;
  }
  /** The caps in force on the test's side of @p pad. */
  CapsPtr pad_caps (const std::string &pad_name = "") const
  {
    return CapsPtr (gst_pad_get_current_caps (pad (pad_name)->sinkpad));
  }

  /** The next message of @p type, null when there is none; messages of other
   * types stay. */
  MessagePtr message (GstMessageType type)
  {
    while (MessagePtr next{gst_bus_pop (bus_.get ())})
      messages_.push_back (std::move (next));
    const auto found = std::find_if (
        messages_.begin (), messages_.end (), [type] (const MessagePtr &one) {
          return GST_MESSAGE_TYPE (one.get ()) & type;
        });
    if (found == messages_.end ())
      return nullptr;
    MessagePtr taken = std::move (*found);
    messages_.erase (found);
    return taken;
  }
  /** The next element message named @p name. */
  MessagePtr element_message (const std::string &name)
  {
    while (MessagePtr found = message (GST_MESSAGE_ELEMENT)) {
      if (gst_message_has_name (found.get (), name.c_str ()))
        return found;
    }
    return nullptr;
  }
  /** The next element message that is a @p T; none where there is none. */
  template <typename T>
  std::optional<T> posted ()
  {
    const MessagePtr found = element_message (T::kName);
    if (!found)
      return std::nullopt;
    const auto parsed = parse_message<T> (found.get ());
    EXPECT_TRUE (parsed) << "a field is missing or of another type: "
                         << found.get ();
    return parsed;
  }
  /** Text of the next error, warning or info on the bus; "" when there is none.
   */
  std::string error () { return complaint (GST_MESSAGE_ERROR); }
  std::string warning () { return complaint (GST_MESSAGE_WARNING); }
  std::string info () { return complaint (GST_MESSAGE_INFO); }

private:
  std::string complaint (GstMessageType type)
  {
    const MessagePtr found = message (type);
    return found ? text_of (found.get ()) : "";
  }

  ObjectPtr<GstBus> bus_;
  std::deque<MessagePtr> messages_; ///< off the bus, and not asked for yet
  ObjectPtr<GstElement> element_;
  HarnessPtr main_;
  std::map<std::string, HarnessPtr> pads_;
};

inline std::string
gray_caps (int width, int height, const std::string &rate = "25/1",
    const std::string &format = "GRAY8")
{
  return "video/x-raw,format=" + format + ",width=" + std::to_string (width) +
         ",height=" + std::to_string (height) + ",framerate=" + rate;
}

inline GstVideoInfo
info_of (GstCaps *caps)
{
  GstVideoInfo info;
  EXPECT_TRUE (gst_video_info_from_caps (&info, caps));
  return info;
}

/** A picture whose pixels are @p value (x, y). */
template <typename Pixel>
Image<Pixel>
draw (int width, int height, const std::function<int (int, int)> &value)
{
  Image<Pixel> image (width, height);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      image.at (x, y) = Pixel (value (x, y));
  return image;
}

/** A frame with the pixels of @p image, in GStreamer's own strides. */
template <typename Pixel>
BufferPtr
frame_of (const Image<Pixel> &image, GstClockTime pts)
{
  GstVideoInfo info;
  gst_video_info_set_format (&info,
      sizeof (Pixel) == 1 ? GST_VIDEO_FORMAT_GRAY8 : GST_VIDEO_FORMAT_GRAY16_LE,
      guint (image.width ()), guint (image.height ()));
  BufferPtr buffer (
      gst_buffer_new_allocate (nullptr, GST_VIDEO_INFO_SIZE (&info), nullptr));
  GST_BUFFER_PTS (buffer.get ()) = pts;
  MappedFrame mapped (info, buffer.get (), GST_MAP_WRITE);
  const auto view = view_of<Pixel> (mapped);
  for (int y = 0; y < view.height; y++)
    for (int x = 0; x < view.width; x++)
      view.at (x, y) = image.at (x, y);
  return buffer;
}

/** The pixels of @p buffer as @p caps describe them, whatever its strides. */
template <typename Pixel>
Image<Pixel>
image_of (GstBuffer *buffer, GstCaps *caps)
{
  const GstVideoInfo info = info_of (caps);
  MappedFrame mapped (info, buffer, GST_MAP_READ);
  EXPECT_TRUE (mapped);
  Image<Pixel> image (info.width, info.height);
  if (mapped) {
    const auto view = view_of<Pixel> (mapped);
    for (int y = 0; y < view.height; y++)
      for (int x = 0; x < view.width; x++)
        image.at (x, y) = view.at (x, y);
  }
  return image;
}

template <typename Pixel>
std::vector<ImageView<Pixel>>
views_of (std::vector<Image<Pixel>> &images)
{
  std::vector<ImageView<Pixel>> views;
  for (Image<Pixel> &image : images)
    views.push_back (image.view ());
  return views;
}

/** The pixels of all buffers of @p pad that have come. */
template <typename Pixel = std::uint8_t>
std::vector<Image<Pixel>>
pull_images (ElementHarness &harness, const std::string &pad = "")
{
  std::vector<Image<Pixel>> images;
  const CapsPtr caps = harness.pad_caps (pad);
  for (const BufferPtr &buffer : harness.pull_all (pad))
    images.push_back (image_of<Pixel> (buffer.get (), caps.get ()));
  return images;
}

} // namespace codedexposure::test
