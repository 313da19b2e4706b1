/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* subframestats: correct figures of every picture, in all output forms. */
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include <glib/gstdio.h>
#include <nlohmann/json.hpp>

#include "common/meta.h"
#include "common/stats_report.h"
#include "harness.h"
#include "pipeline.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;
using Json = nlohmann::json;

/** An unused file name; the file is removed afterwards. */
class Scratch
{
public:
  Scratch ()
  {
    gchar *name = nullptr;
    g_close (g_file_open_tmp ("stats_test_XXXXXX", &name, nullptr), nullptr);
    path_.reset (name);
  }
  ~Scratch () { std::remove (path_.get ()); }
  std::string path () const { return path_.get (); }
  std::vector<std::string> lines () const
  {
    std::ifstream file (path_.get ());
    std::vector<std::string> lines;
    for (std::string line; std::getline (file, line);)
      lines.push_back (line);
    return lines;
  }
  std::vector<Json> objects () const
  {
    std::vector<Json> objects;
    for (const std::string &line : lines ())
      objects.push_back (Json::parse (line));
    return objects;
  }

private:
  CharPtr path_;
};

/* 0, 1, 2 ... along rows, from @p first. */
Image<guint8>
ramp (int width, int height, int first)
{
  return draw<guint8> (
      width, height, [&] (int x, int y) { return first + x + width * y; });
}

template <typename T>
T
field (const GstStructure *structure, const char *name)
{
  const GValue *value = gst_structure_get_value (structure, name);
  EXPECT_NE (value, nullptr) << name;
  if constexpr (std::is_same_v<T, double>)
    return g_value_get_double (value);
  else if constexpr (std::is_same_v<T, gint>)
    return g_value_get_int (value);
  else if constexpr (std::is_same_v<T, guint>)
    return g_value_get_uint (value);
  else
    return g_value_get_uint64 (value);
}

std::vector<double>
numbers (const GstStructure *structure, const char *name)
{
  const GValue *array = gst_structure_get_value (structure, name);
  std::vector<double> found;
  for (guint i = 0; array && i < gst_value_array_get_size (array); i++) {
    const GValue *value = gst_value_array_get_value (array, i);
    found.push_back (G_VALUE_HOLDS_DOUBLE (value)
                         ? g_value_get_double (value)
                         : double (g_value_get_uint64 (value)));
  }
  return found;
}

const GstStructure *
stats_meta (GstBuffer *buffer)
{
  GstCustomMeta *meta = gst_buffer_get_custom_meta (buffer, kStatsMetaName);
  return meta ? gst_custom_meta_get_structure (meta) : nullptr;
}

/* Expected values of ramp (4, 2, 250): 250, ..., 255, and 0 and 1 after the
 * overflow of a byte. */
void
expect_ramp (const GstStructure *fields)
{
  EXPECT_EQ (field<guint64> (fields, "frame"), 7u);
  EXPECT_EQ (field<gint> (fields, "subframe"), 2);
  EXPECT_EQ (field<guint64> (fields, "pts"), 33'366'666u);
  EXPECT_DOUBLE_EQ (field<double> (fields, "mean"), (6 * 252.5 + 1) / 8);
  EXPECT_EQ (field<guint> (fields, "minimum"), 0u);
  EXPECT_EQ (field<guint> (fields, "maximum"), 255u);
  EXPECT_DOUBLE_EQ (field<double> (fields, "entropy"), 3.0);
  EXPECT_EQ (field<guint64> (fields, "saturated"), 1u);
  EXPECT_EQ (field<guint64> (fields, "pixels"), 8u);
  EXPECT_EQ (numbers (fields, "histogram"), (std::vector<double>{2, 0, 0, 6}));
  EXPECT_EQ (
      numbers (fields, "profile"), (std::vector<double>{254, 255, 0, 1}));
}

TEST (SubframeStats, SaysTheSameInMetaMessageAndFile)
{
  const Scratch file;
  ElementHarness h (
      "subframestats line=row:100% histogram-bins=4 location=" + file.path ());
  h.set_caps (gray_caps (4, 2, "30000/1001"));
  BufferPtr buffer = frame_of (ramp (4, 2, 250), 33'366'666);
  FrameMeta meta;
  meta.frame = 7;
  meta.subframe = 2;
  set_frame_meta (buffer.get (), meta);
  GST_BUFFER_FLAG_SET (buffer.get (), GST_BUFFER_FLAG_CORRUPTED);
  ASSERT_EQ (h.push (std::move (buffer)), GST_FLOW_OK);

  const BufferPtr out = h.pull ();
  ASSERT_NE (stats_meta (out.get ()), nullptr);
  expect_ramp (stats_meta (out.get ()));
  const MessagePtr message = h.element_message ("subframestats/stats");
  ASSERT_NE (message, nullptr);
  expect_ramp (gst_message_get_structure (message.get ()));
  ASSERT_EQ (file.lines ().size (), 1u);
  EXPECT_EQ (file.objects ()[0], Json::parse (R"({"frame": 7, "subframe": 2,
      "pts_ns": 33366666, "mean": 189.5, "minimum": 0, "maximum": 255,
      "entropy": 3.0, "saturated": 1, "pixels": 8, "flags": ["corrupted"],
      "histogram": [2, 0, 0, 6], "profile": [254, 255, 0, 1],
      "lost_before": 0})"));
  EXPECT_EQ (property<guint64> (h.element (), "frames-in"), 1u);
  EXPECT_EQ (property<guint64> (h.element (), "saturated-frames"), 1u);
}

TEST (SubframeStats, WritesCsvWithAHead)
{
  const Scratch file;
  ElementHarness h (
      "subframestats format=csv line=column:0 histogram-bins=2 location=" +
      file.path ());
  h.set_caps (gray_caps (2, 2));
  for (int k = 0; k < 2; k++) {
    BufferPtr buffer = frame_of (ramp (2, 2, 100 * k), k * 40 * GST_MSECOND);
    if (k == 1) {
      GST_BUFFER_FLAG_SET (buffer.get (), GST_BUFFER_FLAG_GAP);
      GST_BUFFER_DURATION (buffer.get ()) = 40 * GST_MSECOND;
      FrameMeta meta;
      meta.frame = 1;
      meta.locked = true;
      meta.lost_before = 2;
      set_frame_meta (buffer.get (), meta);
    }
    ASSERT_EQ (h.push (std::move (buffer)), GST_FLOW_OK);
  }
  EXPECT_EQ (file.lines (),
      (std::vector<std::string>{
          "frame,subframe,pts_ns,mean,minimum,maximum,entropy,saturated,"
          "pixels,flags,histogram,profile,duration_ns,synchronised,lost_before",
          "0,,0,1.5,0,3,2,0,4,,4 0,0 2,,,0",
          "1,,40000000,101.5,100,103,2,0,4,gap,4 0,100 102,40000000,true,2"}));
}

TEST (SubframeStats, MeasuresSixteenBits)
{
  ElementHarness h ("subframestats bits=12 histogram-bins=2");
  h.set_caps (gray_caps (4, 1, "25/1", "GRAY16_LE"));
  ASSERT_EQ (
      h.push (frame_of (
          draw<guint16> (4, 1, [] (int x, int) { return x * 1365; }), 0)),
      GST_FLOW_OK);
  const BufferPtr out = h.pull ();
  const GstStructure *fields = stats_meta (out.get ());
  ASSERT_NE (fields, nullptr);
  EXPECT_DOUBLE_EQ (field<double> (fields, "mean"), 2047.5);
  EXPECT_EQ (field<guint> (fields, "maximum"), 4095u);
  EXPECT_EQ (field<guint64> (fields, "saturated"), 1u);
  EXPECT_EQ (numbers (fields, "histogram"), (std::vector<double>{2, 2}));
}

TEST (SubframeStats, PixelsAreNotTouchedNorCopied)
{
  ElementHarness h ("subframestats");
  h.set_caps (gray_caps (4, 4));
  BufferPtr buffer = frame_of (ramp (4, 4, 0), 0);
  const BufferPtr kept (gst_buffer_ref (buffer.get ()));
  GstMemory *const memory = gst_buffer_peek_memory (buffer.get (), 0);
  ASSERT_EQ (h.push (std::move (buffer)), GST_FLOW_OK);
  const BufferPtr out = h.pull ();
  EXPECT_EQ (gst_buffer_peek_memory (out.get (), 0), memory);
  EXPECT_EQ (stats_meta (kept.get ()), nullptr)
      << "somebody else's buffer must stay as it is";
}

TEST (SubframeStats, SaysNothingOnTheBusWhenToldSo)
{
  ElementHarness h ("subframestats post-messages=false histogram-bins=0");
  h.set_caps (gray_caps (4, 4));
  ASSERT_EQ (h.push (frame_of (ramp (4, 4, 0), 0)), GST_FLOW_OK);
  EXPECT_EQ (h.element_message ("subframestats/stats"), nullptr);
  const BufferPtr out = h.pull ();
  EXPECT_TRUE (numbers (stats_meta (out.get ()), "histogram").empty ());
}

TEST (SubframeStats, NewCapsAreMeasuredAnew)
{
  ElementHarness h ("subframestats line=row:50%");
  for (int width : {4, 6}) {
    h.set_caps (gray_caps (width, 3));
    ASSERT_EQ (h.push (frame_of (ramp (width, 3, 0), 0)), GST_FLOW_OK);
    const BufferPtr out = h.pull ();
    const GstStructure *fields = stats_meta (out.get ());
    EXPECT_EQ (field<guint64> (fields, "pixels"), guint64 (3 * width));
    EXPECT_EQ (numbers (fields, "profile").size (), std::size_t (width));
  }
}

/* The error that ends a stream of 4x4 pixels. */
std::string
complaint (const std::string &properties)
{
  Pipeline pipeline ("videotestsrc num-buffers=1 ! video/x-raw,format=GRAY8,"
                     "width=4,height=4 ! subframestats " +
                     properties + " ! fakesink");
  return pipeline.play ();
}

TEST (SubframeStats, SaysWhatItCannotDo)
{
  EXPECT_EQ (complaint (""), "");
  EXPECT_EQ (complaint ("line=diagonal"),
      "The line property cannot be read: 'diagonal' is not a line; use "
      "row:Y, column:X or X0/Y0/X1/Y1, in pixels or in %");
  EXPECT_EQ (complaint ("line=row:4"),
      "These pictures cannot be measured: the line reaches pixel (3, 4) of a "
      "picture of 4x4; its last pixel is (3, 3); percentages such as 50% fit "
      "every size");
  EXPECT_EQ (complaint ("bits=12"),
      "These pictures cannot be measured: bits = 12 is out of range; a pixel "
      "has 1 to 8, 0 means all");
  EXPECT_EQ (complaint ("location=/nonexistent/stats.csv"),
      "Cannot open \"/nonexistent/stats.csv\" for writing: No such file or "
      "directory");
  EXPECT_EQ (complaint ("location=/dev/full"),
      "Cannot write to \"/dev/full\": No space left on device. It contains "
      "the frames before this one.");
}

TEST (SubframeStats, RefusesTooFewBytes)
{
  ElementHarness h ("subframestats");
  h.set_caps (gray_caps (5, 4));
  EXPECT_EQ (h.push (frame_of (ramp (4, 4, 0), 0)), GST_FLOW_ERROR);
  EXPECT_EQ (h.error (),
      "A buffer of 16 bytes cannot hold the 5x4 GRAY8 pixels of its caps: they "
      "take 32 bytes. Correct the caps, or the element that made the buffer.");
}

/* Every pad of the demux at once, at a rate whose periods are no whole ns. */
TEST (SubframeStats, KnowsTheSubframesOfTheDemux)
{
  const Scratch all, one, coded;
  const auto measure = [] (const char *pad, const Scratch &file) {
    return std::string (" d.") + pad +
           " ! queue ! subframestats post-messages=false location=" +
           file.path () + " ! fakesink";
  };
  Pipeline pipeline (
      "videotestsrc num-buffers=12 pattern=gradient ! video/x-raw,format=GRAY8,"
      "width=64,height=48,framerate=120000/1001 ! codedexposure-sim "
      "full-well=5000 ! codedexposure-demux name=d" +
      measure ("src", all) + measure ("subframe_2", one) +
      measure ("coded", coded));
  ASSERT_EQ (pipeline.play (), "");

  const auto subframes = all.objects (), frames = coded.objects ();
  ASSERT_EQ (subframes.size (), 12u);
  ASSERT_EQ (frames.size (), 3u);
  ASSERT_EQ (one.objects ().size (), 3u);
  for (std::size_t f = 0; f < 3; f++) {
    const guint64 start = gst_util_uint64_scale (f, 1001 * GST_SECOND, 30000);
    double mean = 0, saturated = 0;
    for (std::size_t k = 0; k < 4; k++) {
      const Json &line = subframes[4 * f + k];
      EXPECT_EQ (line.at ("frame"), f);
      EXPECT_EQ (line.at ("subframe"), k);
      EXPECT_EQ (line.at ("pts_ns"),
          start + gst_util_uint64_scale (k, 1001 * GST_SECOND, 120000));
      EXPECT_EQ (line.at ("pixels"), 32 * 24);
      mean += line.at ("mean").get<double> () / 4;
      saturated += line.at ("saturated").get<double> ();
    }
    EXPECT_EQ (one.objects ()[f].at ("subframe"), 2);
    EXPECT_EQ (one.objects ()[f].at ("mean"), subframes[4 * f + 2].at ("mean"));
    EXPECT_EQ (frames[f].at ("frame"), f);
    EXPECT_FALSE (frames[f].contains ("subframe"));
    EXPECT_EQ (frames[f].at ("pts_ns"), start);
    EXPECT_NEAR (frames[f].at ("mean").get<double> (), mean, 1e-9)
        << "select moves pixels only";
    EXPECT_EQ (frames[f].at ("saturated"), saturated);
  }
}

} // namespace
