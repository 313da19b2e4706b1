/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Frames above the size up to which matroskademux reads blocks, 15 MiB. */
#include <filesystem>

#include "pipeline.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr int kFrames = 3;
constexpr int kWidth = 2816, kHeight = 2800; // 15.04 MiB

class LargeFrames : public ::testing::Test
{
protected:
  LargeFrames ()
  {
    std::string name = "/tmp/record_large_test_XXXXXX";
    folder_ = mkdtemp (name.data ());
  }
  ~LargeFrames () override { std::filesystem::remove_all (folder_); }

  void record (const std::string &options, int frames = kFrames,
      int width = kWidth, int height = kHeight)
  {
    Pipeline pipeline (
        "videotestsrc pattern=snow num-buffers=" + std::to_string (frames) +
        " ! " + gray_caps (width, height, "25/1", "GRAY16_LE") +
        " ! codedexposure-recordmux " + options +
        " ! filesink location=" + path ());
    ASSERT_EQ (pipeline.play (), "");
  }
  std::string path () const { return folder_ + "/large.mkv"; }

  void expect_frames (Pipeline &pipeline, guint64 frames)
  {
    EXPECT_EQ (pipeline.play (), "");
    const ObjectPtr<GstElement> demux = pipeline["demux"];
    EXPECT_EQ (counter_of (demux.get (), "frames"), frames);
    for (const char *flaw :
        {"frames-damaged", "frames-unknown", "frames-missing", "lines-damaged"})
      EXPECT_EQ (counter_of (demux.get (), flaw), 0u) << flaw;
  }
  void expect_all (const std::string &demux, guint64 frames = kFrames)
  {
    SCOPED_TRACE (demux);
    Pipeline pipeline ("filesrc location=" + path () + " ! " + demux +
                       " name=demux ! fakesink");
    expect_frames (pipeline, frames);
  }

private:
  std::string folder_;
};

TEST_F (LargeFrames, AreReadFromFilesAndStreams)
{
  for (const char *options : {"codec=raw", "codec=raw streamable=true"}) {
    SCOPED_TRACE (options);
    record (options);
    expect_all ("codedexposure-recorddemux");
    expect_all ("codedexposure-recorddemux salvage=true");
    expect_all ("queue ! codedexposure-recorddemux");
  }
}

TEST_F (LargeFrames, AreReadBeforeTheyAreDecoded)
{
  record ("codec=ffv1", 1); // takes seconds
  expect_all ("codedexposure-recorddemux", 1);
}

/* The demuxer is told where to read on. */
TEST_F (LargeFrames, AreReadAfterASeek)
{
  record ("codec=raw");
  for (const double rate : {1.0, -1.0}) {
    SCOPED_TRACE (rate);
    Pipeline pipeline ("filesrc location=" + path () +
                       " ! codedexposure-recorddemux name=demux ! fakesink "
                       "name=out");
    GstElement *top =
        GST_ELEMENT (GST_OBJECT_PARENT (pipeline["demux"].get ()));
    gst_element_set_state (top, GST_STATE_PAUSED);
    ASSERT_EQ (gst_element_get_state (top, nullptr, nullptr, kPatience),
        GST_STATE_CHANGE_SUCCESS);
    ASSERT_TRUE (gst_element_seek (top, rate, GST_FORMAT_TIME,
        GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        GST_SEEK_TYPE_SET, 40 * GST_MSECOND, GST_SEEK_TYPE_SET,
        120 * GST_MSECOND));
    EXPECT_EQ (pipeline.play (), "");
    for (const char *flaw :
        {"frames-damaged", "frames-unknown", "frames-missing", "lines-damaged"})
      EXPECT_EQ (counter_of (pipeline["demux"].get (), flaw), 0u) << flaw;
    GstSample *last = nullptr;
    g_object_get (pipeline["out"].get (), "last-sample", &last, nullptr);
    ASSERT_TRUE (last);
    EXPECT_EQ (GST_BUFFER_PTS (gst_sample_get_buffer (last)),
        (rate > 0 ? 80 : 40) * GST_MSECOND);
    gst_sample_unref (last);
  }
}

/* A frame waits for its rest where bytes are collected. */
TEST_F (LargeFrames, AndSmallOnesThatAreCutOffAreGoneInTheNextRun)
{
  for (const auto &[width, height] :
      {std::pair{kWidth, kHeight}, std::pair{64, 48}})
    for (const char *options : {"", "salvage=true"}) {
      SCOPED_TRACE (std::to_string (width) + " " + options);
      record ("codec=raw", kFrames, width, height);
      const std::string part = path () + ".part";
      std::filesystem::copy_file (path (), part);
      std::filesystem::resize_file (
          part, std::filesystem::file_size (part) * 3 / 5);
      Pipeline pipeline ("filesrc name=file location=" + part +
                         " ! queue ! codedexposure-recorddemux name=demux " +
                         options + " ! fakesink");
      EXPECT_EQ (pipeline.play (), "");
      const ObjectPtr<GstElement> file = pipeline["file"];
      gst_element_set_state (
          GST_ELEMENT (GST_OBJECT_PARENT (file.get ())), GST_STATE_READY);
      g_object_set (file.get (), "location", path ().c_str (), nullptr);
      expect_frames (pipeline, kFrames);
      std::filesystem::remove (part);
    }
}

TEST_F (LargeFrames, ThatAreCutOffAreMissing)
{
  record ("codec=raw");
  std::filesystem::resize_file (
      path (), std::filesystem::file_size (path ()) * 3 / 5);
  for (const char *options : {"", "salvage=true"}) {
    SCOPED_TRACE (options);
    Pipeline pipeline ("filesrc location=" + path () +
                       " ! codedexposure-recorddemux name=demux " + options +
                       " ! fakesink");
    EXPECT_EQ (pipeline.play (), "");
    EXPECT_EQ (counter_of (pipeline["demux"].get (), "frames"), 1u);
    EXPECT_EQ (counter_of (pipeline["demux"].get (), "frames-damaged"), 0u);
  }
}

} // namespace
