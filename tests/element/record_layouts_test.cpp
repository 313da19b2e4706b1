/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-recordmux: frames whose bytes are not laid out as GStreamer
 * does are recorded as their pixels, and those that come encoded as they are.
 */
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>

#include <fcntl.h>
#include <unistd.h>

#include "common/messages.h"
#include "pipeline.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr int kFrames = 3;

struct Layout {
  const char *name, *format;
  int width, height;
  gsize before;  ///< bytes before the first row
  gsize between; ///< after each row, beyond those of GStreamer
  gsize after;   ///< the last one
  const char *options;
};

/* The same pixels, among bytes that are none. */
BufferPtr
laid_out (const GstVideoInfo &info, GstBuffer *frame, const Layout &layout)
{
  const gsize own = gsize (GST_VIDEO_INFO_PLANE_STRIDE (&info, 0));
  const gsize rows = gsize (info.height), stride = own + layout.between;
  const gsize size = layout.before + stride * rows + layout.after;
  BufferPtr to (gst_buffer_new_allocate (nullptr, size, nullptr));
  gst_buffer_memset (to.get (), 0, 0xee, size);
  GstMapInfo map;
  gst_buffer_map (frame, &map, GST_MAP_READ);
  for (gsize y = 0; y < rows; y++)
    gst_buffer_fill (
        to.get (), layout.before + y * stride, map.data + y * own, own);
  gst_buffer_unmap (frame, &map);
  gsize offsets[GST_VIDEO_MAX_PLANES] = {layout.before};
  gint strides[GST_VIDEO_MAX_PLANES] = {gint (stride)};
  if (layout.before + layout.between > 0)
    gst_buffer_add_video_meta_full (to.get (), GST_VIDEO_FRAME_FLAG_NONE,
        GST_VIDEO_INFO_FORMAT (&info), guint (info.width), guint (info.height),
        1, offsets, strides);
  gst_buffer_copy_into (to.get (), frame, GST_BUFFER_COPY_TIMESTAMPS, 0, -1);
  return to;
}

GstPadProbeReturn
lay_out (GstPad *pad, GstPadProbeInfo *info, gpointer layout)
{
  const BufferPtr frame (GST_PAD_PROBE_INFO_BUFFER (info));
  const CapsPtr caps (gst_pad_get_current_caps (pad));
  GstVideoInfo video;
  gst_video_info_from_caps (&video, caps.get ());
  info->data =
      laid_out (video, frame.get (), *static_cast<const Layout *> (layout))
          .release ();
  return GST_PAD_PROBE_OK;
}

class RecordLayouts : public ::testing::TestWithParam<Layout>
{
};

TEST_P (RecordLayouts, AreReadAsTheyWereSeen)
{
  Layout layout = GetParam ();
  const std::string path =
      "/tmp/record_layouts_test_" + std::to_string (getpid ()) + ".mkv";
  {
    Pipeline recording (
        "videotestsrc num-buffers=" + std::to_string (kFrames) + " ! " +
        gray_caps (layout.width, layout.height, "100/1", layout.format) +
        " ! identity name=change ! codedexposure-recordmux " + layout.options +
        " ! filesink location=" + path);
    gst_pad_add_probe (recording.pad ("change", "src").get (),
        GST_PAD_PROBE_TYPE_BUFFER, lay_out, &layout, nullptr);
    ASSERT_EQ (recording.play (), "");
  }
  Pipeline reading ("filesrc location=" + path +
                    " ! codedexposure-recorddemux name=demux ! fakesink");
  EXPECT_EQ (reading.play (), "");
  const ObjectPtr<GstElement> demux = reading["demux"];
  EXPECT_EQ (counter_of (demux.get (), "frames"), guint64 (kFrames));
  EXPECT_EQ (counter_of (demux.get (), "frames-damaged"), 0u);
  EXPECT_EQ (counter_of (demux.get (), "frames-missing"), 0u);
  std::filesystem::remove (path);
}

INSTANTIATE_TEST_SUITE_P (All, RecordLayouts,
    ::testing::Values (
        Layout{"Strides", "GRAY8", 64, 48, 32, 64, 0, "codec=raw"},
        Layout{"DeepStrides", "GRAY16_LE", 64, 48, 32, 128, 0, "codec=raw"},
        Layout{"Longer", "GRAY8", 64, 48, 0, 0, 100, "codec=raw"},
        Layout{"DeepLonger", "GRAY16_LE", 64, 48, 0, 0, 100, "codec=raw"},
        Layout{"OneRow", "GRAY8", 64, 1, 32, 0, 100, "codec=ffv1"}),
    [] (const auto &layout) { return layout.param.name; });

std::string
record_encoded (const std::string &codec, const std::string &to)
{
  return Pipeline ("videotestsrc num-buffers=3 ! " + gray_caps (64, 48) +
                   " ! avenc_ffv1 ! codedexposure-recordmux codec=" + codec +
                   " ! " + to)
      .play ();
}

TEST (RecordEncoded, TheyAreCopiedOrRefused)
{
  const std::string reader = "codedexposure-recorddemux ! fakesink";
  EXPECT_EQ (record_encoded ("copy", reader), "");
  for (const std::string codec : {"ffv1", "raw"})
    EXPECT_NE (
        record_encoded (codec, reader).find ("codec=copy"), std::string::npos);
}

/* How it ends where frames of the caps @p then follow others. */
std::string
record_change (const std::string &then, const std::string &codec = "ffv1")
{
  const std::string frames = "videotestsrc num-buffers=3 ! ";
  return Pipeline (
      frames + gray_caps (64, 48, "25/1") +
      " ! concat name=all ! codedexposure-recordmux codec=" + codec +
      " ! fakesink " + frames + gray_caps (64, 48, "25/1") +
      " ! capssetter caps=video/x-raw," + then + " ! all.")
      .play ();
}

TEST (RecordedFrames, OfAnotherRateAreAnErrorThatSaysSo)
{
  EXPECT_NE (
      record_change ("framerate=50/1")
          .find ("The framerate of the frames changes from 25/1 to 50/1, but a "
                 "recording has one for all. Begin another recording"),
      std::string::npos);
}

TEST (RecordedFrames, ThatBecomeInterlacedAreAnErrorThatSaysSo)
{
  for (const std::string codec : {"ffv1", "raw"})
    EXPECT_NE (record_change ("interlace-mode=interleaved", codec)
                   .find ("changes from progressive to interleaved"),
        std::string::npos);
}

TEST (RecordedFrames, OfAnotherColorimetryAreRecorded)
{
  const std::string frames = "videotestsrc num-buffers=3 ! ";
  const std::string caps = gray_caps (64, 48) + ",colorimetry=";
  Pipeline pipeline (frames + caps +
                     "1:4:0:0 ! concat name=all ! codedexposure-recordmux "
                     "! codedexposure-recorddemux name=demux ! fakesink " +
                     frames + caps + "bt709 ! all.");
  EXPECT_EQ (pipeline.play (), "");
  const ObjectPtr<GstElement> demux = pipeline["demux"];
  EXPECT_EQ (counter_of (demux.get (), "frames"), 6u);
  EXPECT_EQ (counter_of (demux.get (), "frames-unknown"), 0u);
}

TEST (RecordedFrames, FartherThanTheTimesOfARecordingAreAnErrorThatSaysSo)
{
  for (const gint64 offset : {gint64 (1) << 62, G_MAXINT64}) {
    Pipeline pipeline ("videotestsrc num-buffers=3 ! " + gray_caps (64, 48) +
                       " ! identity name=later ! codedexposure-recordmux "
                       "! fakesink");
    gst_pad_set_offset (pipeline.pad ("later", "src").get (), offset);
    EXPECT_NE (pipeline.play ().find (
                   std::to_string (offset) + " ns, but none may be farther"),
        std::string::npos);
  }
}

using ChangeSegment = void (*) (GstSegment &);

/* By a ChangeSegment, @change. */
GstPadProbeReturn
on_segment (GstPad *, GstPadProbeInfo *info, gpointer change) noexcept
{
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  if (GST_EVENT_TYPE (event) != GST_EVENT_SEGMENT)
    return GST_PAD_PROBE_OK;
  GstSegment segment;
  gst_event_copy_segment (event, &segment);
  gst_event_unref (event);
  reinterpret_cast<ChangeSegment> (change) (segment);
  info->data = gst_event_new_segment (&segment);
  return GST_PAD_PROBE_OK;
}

/* Of what the element `change` sends. */
void
change_segment (const Pipeline &pipeline, ChangeSegment change)
{
  gst_pad_add_probe (pipeline.pad ("change", "src").get (),
      GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, on_segment,
      reinterpret_cast<gpointer> (change), nullptr);
}

/* 10 ms apart, at the positions 0 to 40 ms. */
std::string
five_frames (const std::string &codec = "ffv1")
{
  return "videotestsrc num-buffers=5 ! " + gray_caps (64, 48, "100/1") +
         " ! identity name=change ! codedexposure-recordmux codec=" + codec +
         " ! ";
}

void
cut (GstSegment &segment)
{
  segment.start = segment.time = 15 * GST_MSECOND;
  segment.stop = 45 * GST_MSECOND;
}

struct Cut {
  const char *name;
  ChangeSegment change;
};

/* The messages of the pipeline of @element. */
void
watch (GstElement *element, GstBusSyncHandler handler, gpointer data)
{
  const ObjectPtr<GstElement> top (
      GST_ELEMENT (gst_object_get_parent (GST_OBJECT (element))));
  const ObjectPtr<GstBus> bus (gst_element_get_bus (top.get ()));
  gst_bus_set_sync_handler (bus.get (), handler, data, nullptr);
}

class CutSegments : public ::testing::TestWithParam<Cut>
{
};

TEST_P (CutSegments, HaveThreeWholeFrames)
{
  for (const std::string codec : {"ffv1", "raw"}) {
    Pipeline pipeline (five_frames (codec) +
                       "codedexposure-recorddemux name=demux ! fakesink");
    change_segment (pipeline, GetParam ().change);
    std::atomic<bool> is_cut = false;
    const ObjectPtr<GstElement> demux = pipeline["demux"];
    watch (
        demux.get (),
        [] (GstBus *, GstMessage *message, gpointer data) {
          if (parse_message<StreamCut> (message))
            *static_cast<std::atomic<bool> *> (data) = true;
          return GST_BUS_PASS;
        },
        &is_cut);
    EXPECT_EQ (pipeline.play (), "");
    EXPECT_EQ (counter_of (demux.get (), "frames"), 3u);
    EXPECT_EQ (counter_of (demux.get (), "frames-unknown"), 0u);
    EXPECT_EQ (counter_of (demux.get (), "frames-missing"), 0u);
    EXPECT_FALSE (is_cut);
  }
}

/* As a negative offset of a pad does. */
void
leave_two_out (GstSegment &segment)
{
  segment.offset = 20 * GST_MSECOND;
}

INSTANTIATE_TEST_SUITE_P (All, CutSegments,
    ::testing::Values (Cut{"WithinTwo", cut}, Cut{"ByOffset", leave_two_out}),
    [] (const auto &tested) { return tested.param.name; });

TEST (RecordedFrames, ThatComeBackwardsAreAnErrorThatSaysSo)
{
  Pipeline pipeline (five_frames () + "fakesink");
  change_segment (pipeline, [] (GstSegment &segment) {
    cut (segment);
    segment.rate = -1;
  });
  EXPECT_NE (pipeline.play ().find ("played forwards"), std::string::npos);
}

TEST (RecordedFrames, WhoseTimesAreNotKnownAreAnErrorThatSaysSo)
{
  for (const std::string codec : {"ffv1", "raw"}) {
    Pipeline pipeline (five_frames (codec) + "fakesink");
    change_segment (pipeline, [] (GstSegment &segment) {
      gst_segment_init (&segment, GST_FORMAT_BYTES);
    });
    EXPECT_NE (pipeline.play ().find ("counts in bytes"), std::string::npos);
  }
}

TEST (RecordBins, OfADescriptionHaveThePadOfItsFirstElement)
{
  for (const char *element :
      {"codedexposure-recordmux", "codedexposure-recorddemux"}) {
    const std::string description =
        std::string ("queue name=first ! ") + element + " ! fakesink";
    const ObjectPtr<GstElement> bin (GST_ELEMENT (gst_object_ref_sink (
        gst_parse_bin_from_description (description.c_str (), TRUE, nullptr))));
    const auto sink = pad_of (bin.get (), "sink");
    ASSERT_TRUE (sink);
    const ObjectPtr<GstPad> target (
        gst_ghost_pad_get_target (GST_GHOST_PAD (sink.get ())));
    const ObjectPtr<GstElement> owner (
        gst_pad_get_parent_element (target.get ()));
    EXPECT_STREQ (GST_OBJECT_NAME (owner.get ()), "first");
  }
}

GstBusSyncReply
add_warning (GstBus *, GstMessage *message, gpointer text)
{
  if (GST_MESSAGE_TYPE (message) != GST_MESSAGE_WARNING)
    return GST_BUS_PASS;
  GError *error = nullptr;
  gst_message_parse_warning (message, &error, nullptr);
  *static_cast<std::string *> (text) += error->message;
  g_error_free (error);
  return GST_BUS_PASS;
}

/* Whose length a source does not know; that of five frames fits into it. */
void
read_from_pipe (const std::string &path,
    const std::function<void (const std::string &)> &read)
{
  std::string bytes (std::filesystem::file_size (path), '\0');
  std::ifstream (path, std::ios::binary)
      .read (bytes.data (), std::streamsize (bytes.size ()));
  int ends[2];
  ASSERT_EQ (pipe2 (ends, O_CLOEXEC), 0);
  EXPECT_EQ (
      write (ends[1], bytes.data (), bytes.size ()), ssize_t (bytes.size ()));
  close (ends[1]);
  read ("fdsrc fd=" + std::to_string (ends[0]));
  close (ends[0]);
}

TEST (RecordDemux, SaysWhatIsBehindTheEnd)
{
  const std::string path =
      "/tmp/record_twice_test_" + std::to_string (getpid ()) + ".mkv";
  ASSERT_EQ (
      Pipeline (five_frames () + "filesink location=" + path).play (), "");
  std::string warning;
  const auto read = [&] (const std::string &source) {
    Pipeline reading (
        source + " ! codedexposure-recorddemux name=demux ! fakesink");
    watch (reading["demux"].get (), add_warning, &warning);
    EXPECT_EQ (reading.play (), "");
    EXPECT_EQ (counter_of (reading["demux"].get (), "frames"), 5u);
  };
  const std::string from_file = "filesrc location=" + path;
  read (from_file);
  EXPECT_EQ (warning, "");
  read_from_pipe (path, read);
  EXPECT_EQ (warning, "");
  std::ofstream (path, std::ios::binary | std::ios::app) << "another";
  read (from_file);
  EXPECT_NE (warning.find ("the file has 7 bytes more"), std::string::npos);
  std::filesystem::remove (path);
}

TEST (RecordDemux, SaysWhatIsBehindTheEndOfOneWithoutALength)
{
  const std::string path =
      "/tmp/record_streams_test_" + std::to_string (getpid ()) + ".mkv";
  for (const std::string codec : {"ffv1", "raw"}) {
    ASSERT_EQ (Pipeline (five_frames (codec + " streamable=true") +
                         "filesink location=" + path)
                   .play (),
        "");
    std::string warnings;
    const auto read = [&] {
      Pipeline reading ("filesrc location=" + path +
                        " ! codedexposure-recorddemux name=demux ! fakesink");
      watch (reading["demux"].get (), add_warning, &warnings);
      EXPECT_EQ (reading.play (), "");
      EXPECT_EQ (counter_of (reading["demux"].get (), "frames"), 5u);
    };
    read ();
    EXPECT_EQ (warnings, "");
    std::string bytes (std::filesystem::file_size (path), '\0');
    std::ifstream (path, std::ios::binary)
        .read (bytes.data (), std::streamsize (bytes.size ()));
    std::ofstream (path, std::ios::binary | std::ios::app) << bytes;
    read ();
    EXPECT_NE (
        warnings.find ("another one, which is not read"), std::string::npos);
    std::filesystem::remove (path);
  }
}

TEST (RecordDemux, SaysThatItDoesNotReadAnotherVideo)
{
  const std::string path =
      "/tmp/record_videos_test_" + std::to_string (getpid ()) + ".mkv";
  const std::string frames = "videotestsrc num-buffers=5 ! " +
                             gray_caps (64, 48, "100/1") + " ! mux. ";
  for (const std::string more : {"", frames.c_str ()}) {
    ASSERT_EQ (Pipeline (frames + more +
                         "matroskamux name=mux ! filesink "
                         "location=" +
                         path)
                   .play (),
        "");
    std::string warnings;
    Pipeline reading ("filesrc location=" + path +
                      " ! codedexposure-recorddemux name=demux ! fakesink");
    watch (reading["demux"].get (), add_warning, &warnings);
    EXPECT_EQ (reading.play (), "");
    EXPECT_EQ (warnings.find ("another recording, which is not read") !=
                   std::string::npos,
        !more.empty ())
        << warnings;
  }
  std::filesystem::remove (path);
}

/* Takes the caps of a demuxer's pad before others know of it, as a stop of the
 * pipeline does meanwhile. */
gboolean
stop_pad (GSignalInvocationHint *, guint, const GValue *values, gpointer last)
{
  auto *element = static_cast<GstElement *> (g_value_get_object (values));
  auto *pad = static_cast<GstPad *> (g_value_get_object (values + 1));
  if (G_OBJECT_TYPE_NAME (element) != std::string ("GstMatroskaDemux") ||
      !GST_PAD_IS_SRC (pad))
    return TRUE;
  gst_pad_set_active (pad, FALSE);
  if (!g_str_has_prefix (GST_OBJECT_NAME (pad), "video_"))
    static_cast<std::promise<void> *> (last)->set_value ();
  return TRUE;
}

TEST (RecordTracks, AreNotReadOnceTheirPadsHaveStopped)
{
  const std::string path =
      "/tmp/record_stop_test_" + std::to_string (getpid ()) + ".mkv";
  ASSERT_EQ (
      Pipeline ("videotestsrc num-buffers=5 ! " + gray_caps (64, 48, "100/1") +
                " ! codedexposure-recordmux ! filesink location=" + path)
          .play (),
      "");
  std::promise<void> last;
  const guint added = g_signal_lookup ("pad-added", GST_TYPE_ELEMENT);
  const gulong hook =
      g_signal_add_emission_hook (added, 0, stop_pad, &last, nullptr);
  {
    Pipeline reading ("filesrc location=" + path +
                      " ! codedexposure-recorddemux name=demux ! fakesink");
    const ObjectPtr<GstObject> whole (
        gst_object_get_parent (GST_OBJECT (reading["demux"].get ())));
    gst_element_set_state (GST_ELEMENT (whole.get ()), GST_STATE_PAUSED);
    last.get_future ().wait ();
  }
  g_signal_remove_emission_hook (added, hook);
  std::filesystem::remove (path);
}

TEST (RecordSegments, BeginWhileTheLastOneIsFinished)
{
  const std::string path =
      "/tmp/record_segments_test_" + std::to_string (getpid ()) + "_";
  EXPECT_EQ (Pipeline ("videotestsrc is-live=true num-buffers=9 ! " +
                       gray_caps (64, 48, "100/1") +
                       " ! splitmuxsink async-finalize=true "
                       "muxer-factory=codedexposure-recordmux "
                       "max-size-time=30000000 location=" +
                       path + "%d.mkv")
                 .play (),
      "");
  for (const std::string part : {"0.mkv", "1.mkv", "2.mkv"}) {
    Pipeline reading ("filesrc location=" + path + part +
                      " ! codedexposure-recorddemux name=demux ! fakesink");
    EXPECT_EQ (reading.play (), "");
    EXPECT_EQ (counter_of (reading["demux"].get (), "frames"), 3u);
    std::filesystem::remove (path + part);
  }
}

} // namespace
