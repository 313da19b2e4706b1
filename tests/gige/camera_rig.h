/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A camera in software, and a pipeline with the unmodified aravissrc that reads
 * it. */
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "emulation/gige_camera.h"
#include "common/meta.h"
#include "harness.h"

namespace codedexposure::test
{

constexpr int kCameraWidth = 256;
constexpr int kCameraHeight = 192;

/** What a camera of the tests sees: every frame and pixel is another one. */
inline std::uint16_t
scene_pixel (std::uint64_t frame, int x, int y)
{
  return std::uint16_t (
      (frame * 0x9E37 + std::uint64_t (x) * 31 + std::uint64_t (y) * 1021) *
          0x2545F491 >>
      7);
}

inline std::unique_ptr<GigeCamera>
open_camera (GigeCameraOptions options, Expose expose = {})
{
  options.width = kCameraWidth;
  options.height = kCameraHeight;
  const int mask = (1 << options.bits) - 1;
  if (!expose)
    expose = [mask] (std::uint64_t frame, ImageView<std::uint16_t> picture) {
      for (int y = 0; y < picture.height; y++)
        for (int x = 0; x < picture.width; x++)
          picture.at (x, y) = scene_pixel (frame, x, y) & mask;
      return true;
    };
  auto camera = GigeCamera::open (std::move (options), std::move (expose));
  EXPECT_TRUE (camera.ok ()) << camera.error ().message;
  return camera ? *std::move (camera) : nullptr;
}

inline std::string
camera_source (const std::string &rate = "100/1",
    const std::string &format = "GRAY8", const std::string &more = "")
{
  return "aravissrc camera-name=127.0.0.1 packet-resend=false " + more +
         " ! video/x-raw,format=" + format +
         ",width=" + std::to_string (kCameraWidth) +
         ",height=" + std::to_string (kCameraHeight) + ",framerate=" + rate +
         " ! ";
}

/** The same through the bin, which names some of the properties otherwise. */
inline std::string
camera_bin (const std::string &rate = "100/1",
    const std::string &format = "GRAY8", const std::string &more = "")
{
  return "codedexposure-camerasrc name=camera camera-name=127.0.0.1 "
         "source::packet-resend=false " +
         more + " ! video/x-raw,format=" + format +
         ",width=" + std::to_string (kCameraWidth) +
         ",height=" + std::to_string (kCameraHeight) + ",framerate=" + rate +
         " ! ";
}

/** A pipeline that ends in a sink which hands every frame to the test, on the
 * streaming thread: a camera source writes into its memory again. */
class CameraPipeline
{
public:
  using Take = std::function<void (GstBuffer *, const GstVideoInfo &)>;

  CameraPipeline (const std::string &line, Take take) : take_ (std::move (take))
  {
    GError *error = nullptr;
    pipeline_.reset (GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
        (line + " fakesink name=sink signal-handoffs=true").c_str (),
        &error))));
    EXPECT_EQ (error, nullptr) << error->message;
    bus_.reset (gst_element_get_bus (pipeline_.get ()));
    const auto sink = element ("sink");
    g_signal_connect (
        sink.get (), "handoff", G_CALLBACK (&CameraPipeline::hand_over), this);
  }
  ~CameraPipeline () { stop (); }
  CameraPipeline (const CameraPipeline &) = delete;
  CameraPipeline &operator= (const CameraPipeline &) = delete;

  void pause () { gst_element_set_state (pipeline_.get (), GST_STATE_PAUSED); }
  void play () { gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING); }
  void stop () { gst_element_set_state (pipeline_.get (), GST_STATE_NULL); }
  GstElement *get () const { return pipeline_.get (); }
  ObjectPtr<GstElement> element (const char *name) const
  {
    return ObjectPtr<GstElement> (
        gst_bin_get_by_name (GST_BIN (pipeline_.get ()), name));
  }

  /** The next message of one of @p types within a minute, keeping element
   * messages and warnings that come before it. */
  MessagePtr wait (int types)
  {
    for (;;) {
      MessagePtr message (gst_bus_timed_pop_filtered (bus_.get (),
          60 * GST_SECOND,
          GstMessageType (types | GST_MESSAGE_ELEMENT | GST_MESSAGE_WARNING)));
      if (!message || (GST_MESSAGE_TYPE (message.get ()) & types) != 0)
        return message;
      messages.push_back (std::move (message));
    }
  }
  /** Whether an error comes within @p time. */
  testing::AssertionResult has_failed (GstClockTime time)
  {
    const MessagePtr error (
        gst_bus_timed_pop_filtered (bus_.get (), time, GST_MESSAGE_ERROR));
    if (!error)
      return testing::AssertionFailure ();
    return testing::AssertionSuccess () << error_text (error);
  }
  /** The text of the error that ends the stream; "end" when there is none. */
  std::string wait_end ()
  {
    const MessagePtr message = wait (GST_MESSAGE_EOS | GST_MESSAGE_ERROR);
    if (!message)
      return "nothing for a minute";
    return GST_MESSAGE_TYPE (message.get ()) == GST_MESSAGE_EOS
               ? "end"
               : error_text (message);
  }
  static std::string error_text (const MessagePtr &message)
  {
    GError *error = nullptr;
    gchar *debug = nullptr;
    if (GST_MESSAGE_TYPE (message.get ()) == GST_MESSAGE_WARNING)
      gst_message_parse_warning (message.get (), &error, &debug);
    else
      gst_message_parse_error (message.get (), &error, &debug);
    const std::string text =
        std::string (error->message) + (debug ? debug : "");
    g_error_free (error);
    g_free (debug);
    return text;
  }

  std::vector<MessagePtr> messages;

private:
  static void hand_over (
      GstElement *, GstBuffer *buffer, GstPad *pad, gpointer data)
  {
    auto *self = static_cast<CameraPipeline *> (data);
    const CapsPtr caps (gst_pad_get_current_caps (pad));
    GstVideoInfo info;
    ASSERT_TRUE (gst_video_info_from_caps (&info, caps.get ()));
    self->take_ (buffer, info);
  }

  Take take_;
  ObjectPtr<GstElement> pipeline_;
  ObjectPtr<GstBus> bus_;
};

/** One of the counters of the pipeline's dmdsync, whose name is "sync". */
inline guint64
counter (const CameraPipeline &pipeline, const char *name)
{
  const auto sync = pipeline.element ("sync");
  const StructurePtr stats (property<GstStructure *> (sync.get (), "stats"));
  guint64 value = 0;
  EXPECT_TRUE (gst_structure_get_uint64 (stats.get (), name, &value)) << name;
  return value;
}

} // namespace codedexposure::test
