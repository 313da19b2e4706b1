/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-recordmux and codedexposure-recorddemux: what goes in comes out
 * again, from files and streams, whole and damaged. */
#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/messages.h"
#include "common/meta.h"
#include "pipeline.h"
#include "record/matroska.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;
using namespace std::string_literals;

class Folder
{
public:
  Folder ()
  {
    std::string name = "/tmp/record_test_XXXXXX";
    path_ = mkdtemp (name.data ());
  }
  ~Folder () { std::filesystem::remove_all (path_); }
  std::string operator/ (const std::string &name) const
  {
    return path_ + "/" + name;
  }

private:
  std::string path_;
};

std::string
content (const std::string &path)
{
  std::ifstream file (path, std::ios::binary);
  return {std::istreambuf_iterator<char> (file), {}};
}

void
write (const std::string &path, const std::string &bytes)
{
  std::ofstream (path, std::ios::binary) << bytes;
}

constexpr int kFrames = 20;

/** Coded frames of 32x24 pixels with numbers, losses and synchronisation. */
std::string
source (const std::string &format = "GRAY8", const std::string &rate = "100/1")
{
  return "videotestsrc num-buffers=" + std::to_string (4 * kFrames) +
         " pattern=ball ! " + gray_caps (32, 24, rate, format) +
         " ! codedexposure-sim ! dmdsync ! ";
}

/** A recording of source (), and the line of each frame. */
std::string
record (const std::string &path, const std::string &options = "",
    const std::string &from = source ())
{
  Pipeline pipeline (from + "codedexposure-recordmux " + options +
                     " log-location=" + path +
                     ".jsonl ! filesink location=" + path);
  return pipeline.play ();
}

/** A file as coded frames: times and flags of each, and its messages. */
class Reading
{
public:
  /** @p log  the lines of the frames that came out; empty: none. */
  explicit Reading (const std::string &path, const std::string &options = "",
      const std::string &log = "")
      : pipeline_ ("filesrc location=" + path +
                   " ! codedexposure-recorddemux name=demux " + options +
                   (log.empty () ? ""
                                 : " ! tee name=t ! queue ! "
                                   "codedexposure-recordmux codec=raw "
                                   "log-location=" +
                                       log + " ! fakesink t. ! queue") +
                   " ! fakesink name=out sync=false")
  {
    gst_pad_add_probe (
        pipeline_.pad ("out", "sink").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
          GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
          auto *reading = static_cast<Reading *> (self);
          reading->times.push_back (GST_BUFFER_PTS (frame));
          reading->corrupted +=
              GST_BUFFER_FLAG_IS_SET (frame, GST_BUFFER_FLAG_CORRUPTED) ? 1 : 0;
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
    const ObjectPtr<GstBus> bus (gst_element_get_bus (top ()));
    gst_bus_set_sync_handler (
        bus.get (),
        [] (GstBus *, GstMessage *message, gpointer self) {
          auto *reading = static_cast<Reading *> (self);
          if (parse_message<StreamCut> (message))
            reading->was_cut = true;
          if (parse_message<FramesLost> (message))
            reading->losses++;
          return GST_BUS_PASS;
        },
        this, nullptr);
  }

  std::string play () { return pipeline_.play (); }
  guint64 count (const char *name) const
  {
    return counter_of (pipeline_["demux"].get (), name);
  }
  GstPad *out () { return pipeline_.pad ("out", "sink").get (); }
  Pipeline &pipeline () { return pipeline_; }
  GstElement *top ()
  {
    return GST_ELEMENT (GST_OBJECT_PARENT (pipeline_["demux"].get ()));
  }

  std::vector<GstClockTime> times;
  int corrupted = 0;
  std::atomic<bool> was_cut = false;
  std::atomic<int> losses = 0; ///< messages

private:
  Pipeline pipeline_;
};

struct Form {
  const char *name, *format, *options;
};

class Forms : public ::testing::TestWithParam<Form>
{
protected:
  Folder folder;
};

TEST_P (Forms, WhatGoesInComesOutAgain)
{
  const auto [name, format, options] = GetParam ();
  const std::string path = folder / "coded.mkv";
  ASSERT_EQ (record (path, options, source (format, "120000/1001")), "");
  Reading reading (path, "", folder / "again.jsonl");
  EXPECT_EQ (reading.play (), "");
  EXPECT_EQ (content (folder / "again.jsonl"), content (path + ".jsonl"));
  ASSERT_EQ (reading.times.size (), std::size_t (kFrames));
  EXPECT_EQ (reading.corrupted, 0);
  for (const char *flaw :
      {"frames-damaged", "frames-unknown", "frames-missing", "lines-damaged"})
    EXPECT_EQ (reading.count (flaw), 0u) << flaw;

  const auto info = recording_info (path);
  ASSERT_TRUE (info) << info.error ().message;
  EXPECT_EQ (info->head.codec == MatroskaHead::Codec::raw,
      std::string (options).find ("raw") != std::string::npos);
  EXPECT_EQ (info->head.size, (Extent{32, 24}));
  EXPECT_EQ (info->head.tick, 1);
  EXPECT_EQ (info->is_open,
      std::string (options).find ("stream") != std::string::npos);
  EXPECT_FALSE (info->is_cut_short);
  ASSERT_EQ (info->times.size (), std::size_t (kFrames));
  for (std::size_t i = 0; i < info->times.size (); i++) {
    EXPECT_EQ (GstClockTime (info->times[i]),
        gst_util_uint64_scale (i, 1001 * GST_SECOND, 30000))
        << "exact to the ns";
    EXPECT_EQ (GstClockTime (info->times[i]), reading.times[i]);
  }
  ASSERT_TRUE (info->setup);
  EXPECT_EQ (info->setup->schedule.text (), "sequential:2x2");
}

INSTANTIATE_TEST_SUITE_P (All, Forms,
    ::testing::Values (Form{"FFV1", "GRAY8", "codec=ffv1"},
        Form{"FFV1Deep", "GRAY16_LE", "threads=1"},
        Form{"Raw", "GRAY8", "codec=raw"},
        Form{"RawDeep", "GRAY16_LE", "codec=raw"},
        Form{"Stream", "GRAY8", "streamable=true"},
        Form{"RawDeepStream", "GRAY16_LE", "codec=raw streamable=true"}),
    [] (const auto &form) { return form.param.name; });

class Record : public ::testing::Test
{
protected:
  Folder folder;
  const std::string path = folder / "coded.mkv";
};

TEST_F (Record, BytesAreForOtherProgramsToo)
{
  ASSERT_EQ (record (path, "codec=raw", source ("GRAY16_LE")), "");
  const std::string bytes = content (path);
  EXPECT_NE (bytes.find ("\x2e\xb5\x24\x84Y1\0\x10"s), bytes.npos);
  EXPECT_NE (bytes.find ("\x88\x81\0\x53\x6e\x86"s + "Frames"), bytes.npos)
      << "the text track is not the default";
  EXPECT_NE (bytes.find ("coded-exposure={\"format\""), bytes.npos)
      << "the tag is plain";
}

TEST_F (Record, LateReceiversOfAStreamGetTheSameHead)
{
  Pipeline pipeline (source ("GRAY16_LE") +
                     "codedexposure-recordmux codec=raw streamable=true ! "
                     "fakesink name=out");
  EXPECT_EQ (pipeline.play (), "");
  const CapsPtr caps (
      gst_pad_get_current_caps (pipeline.pad ("out", "sink").get ()));
  const GValue *heads = gst_structure_get_value (
      gst_caps_get_structure (caps.get (), 0), "streamheader");
  ASSERT_NE (heads, nullptr);
  GstBuffer *head = gst_value_get_buffer (gst_value_array_get_value (heads, 0));
  std::string bytes (gst_buffer_get_size (head), '\0');
  gst_buffer_extract (head, 0, bytes.data (), bytes.size ());
  EXPECT_EQ (bytes.find ("Y16 "), bytes.npos);
  EXPECT_NE (bytes.find ("Y1\0\x10"s), bytes.npos);
  EXPECT_NE (bytes.find ("coded-exposure={\"format\""), bytes.npos);
}

/* A live muxer does not wait for frames, and writes their lines before them. */
TEST_F (Record, WaitsForLiveFrames)
{
  Pipeline pipeline ("videotestsrc is-live=true num-buffers=3 ! " +
                     gray_caps (8, 8, "100/1") +
                     " ! codedexposure-recordmux name=mux ! fakesink");
  EXPECT_EQ (pipeline.play (), "");
  const QueryPtr query (gst_query_new_latency ());
  ASSERT_TRUE (
      gst_pad_query (pipeline.pad ("mux", "src").get (), query.get ()));
  gboolean live = TRUE;
  gst_query_parse_latency (query.get (), &live, nullptr, nullptr);
  EXPECT_FALSE (live);
}

TEST_F (Record, EachSegmentIsARecording)
{
  Pipeline pipeline (source () +
                     "splitmuxsink muxer-factory=codedexposure-recordmux "
                     "max-size-time=300000000 location=" +
                     (folder / "part%d.mkv"));
  EXPECT_EQ (pipeline.play (), "");
  std::size_t frames = 0, parts = 0;
  for (std::string part = folder / "part0.mkv"; std::filesystem::exists (part);
       part = folder / ("part" + std::to_string (parts) + ".mkv")) {
    Reading reading (part);
    EXPECT_EQ (reading.play (), "");
    EXPECT_EQ (reading.corrupted, 0);
    EXPECT_EQ (reading.count ("frames-missing"), 0u);
    frames += reading.times.size ();
    parts++;
  }
  EXPECT_EQ (frames, std::size_t (kFrames));
  EXPECT_GE (parts, 2u);
}

TEST_F (Record, ARunFollowsARun)
{
  ASSERT_EQ (record (path), "");
  Reading reading (path);
  for (int run = 1; run <= 2; run++) {
    EXPECT_EQ (reading.play (), "");
    EXPECT_EQ (reading.times.size (), std::size_t (run * kFrames));
    gst_element_set_state (reading.top (), GST_STATE_READY);
  }
}

TEST_F (Record, OtherVideoIsAnErrorThatNamesIt)
{
  const auto error_of = [this] (const std::string &video) {
    Pipeline made ("videotestsrc num-buffers=3 ! " + video +
                   " ! matroskamux ! filesink location=" + path);
    EXPECT_EQ (made.play (), "");
    return Reading (path).play ();
  };
  EXPECT_NE (error_of ("video/x-raw,format=I420").find ("not grey"),
      std::string::npos);
  ASSERT_EQ (record (path, "codec=raw"), "");
  std::string bytes = content (path);
  bytes.replace (bytes.find ("Y800"), 4, "ABCD");
  write (path, bytes);
  EXPECT_NE (Reading (path).play ().find ("not grey"), std::string::npos);
  EXPECT_NE (error_of ("jpegenc").find ("image/jpeg"), std::string::npos);
}

/* An index that is damaged ends the demuxer; without it, all frames are there.
 */
TEST_F (Record, ADamagedIndexIsSalvaged)
{
  ASSERT_EQ (record (path), "");
  std::string bytes = content (path);
  const auto index = bytes.rfind ("\x1c\x53\xbb\x6b");
  ASSERT_NE (index, bytes.npos);
  for (std::size_t i = index + 20; i < index + 60; i++)
    bytes[i] = char (bytes[i] ^ 0x55);
  write (path, bytes);
  Reading salvaged (path, "salvage=true");
  EXPECT_EQ (salvaged.play (), "");
  EXPECT_EQ (salvaged.times.size (), std::size_t (kFrames));
  EXPECT_EQ (salvaged.corrupted, 0);
}

/* The last cluster has the last line of the track. Others of raw frames with as
 * many digits are as long. */
TEST_F (Record, AClusterInThePlaceOfAnotherIsSaid)
{
  ASSERT_EQ (record (path, "codec=raw"), "");
  const std::string bytes = content (path);
  const std::string name = "\x1f\x43\xb6\x75";
  const auto before = [&] (std::size_t at) {
    return bytes.rfind (name, at - 1);
  };
  const auto end = before (bytes.size ());
  const auto last = before (end), one = before (before (last));
  const auto length = bytes.find (name, one + 1) - one;
  ASSERT_EQ (end - last, length);
  for (const auto at : {last, end}) {
    std::string copied = bytes;
    copied.replace (at, length, bytes, one, length);
    write (path, copied);
    Reading reading (path);
    EXPECT_EQ (reading.play (), "");
    EXPECT_EQ (reading.corrupted, 1);
    EXPECT_EQ (reading.count ("frames-missing"), at == last ? 1u : 0u);
    EXPECT_EQ (reading.was_cut, at == end);
  }
}

/* A source may give the head and the first frames at once. */
TEST_F (Record, TheSizeOfDeepRawFramesIsFoundInLargeBuffers)
{
  ASSERT_EQ (record (path, "codec=raw streamable=true",
                 "videotestsrc num-buffers=40 ! " +
                     gray_caps (512, 384, "100/1", "GRAY16_LE") +
                     " ! codedexposure-sim ! dmdsync ! "),
      "");
  Pipeline pipeline ("filesrc blocksize=16777216 location=" + path +
                     " ! codedexposure-recorddemux name=demux salvage=true ! "
                     "fakesink");
  EXPECT_EQ (pipeline.play (), "");
  EXPECT_EQ (counter_of (pipeline["demux"].get (), "frames"), 10u);
  EXPECT_EQ (counter_of (pipeline["demux"].get (), "frames-damaged"), 0u);
}

/* What changes the frames of a recording before they are decoded. */
class Edits : public ::testing::TestWithParam<std::pair<const char *, int>>
{
};

TEST_P (Edits, AreFlagged)
{
  const auto [edit, edited] = GetParam ();
  const Folder folder;
  const std::string path = folder / "coded.mkv";
  ASSERT_EQ (record (path), "");
  Pipeline pipeline ("filesrc location=" + path +
                     " ! codedexposure-recorddemux ! " + edit +
                     " ! codedexposure-demux name=demux ! fakesink");
  EXPECT_EQ (pipeline.play (), "");
  EXPECT_EQ (counter_of (pipeline["demux"].get (), "frames-corrupted"),
      guint64 (edited));
}

INSTANTIATE_TEST_SUITE_P (OfFrames, Edits,
    ::testing::Values (std::pair ("queue", 0),
        std::pair ("avenc_ffv1 ! avdec_ffv1", 0),
        std::pair ("compositor ! video/x-raw,format=GRAY8", kFrames),
        std::pair ("videoflip video-direction=horiz", kFrames),
        std::pair ("videoscale ! video/x-raw,width=16 ! videoscale ! "
                   "video/x-raw,width=32",
            kFrames),
        std::pair ("videocrop left=2 ! videobox left=-2", kFrames),
        std::pair ("videorate rate=2", kFrames / 2),
        std::pair (
            "imagefreeze num-buffers=5 ! video/x-raw,framerate=25/1", 4)));

/* Elements that need earlier frames have them read, too. */
TEST_F (Record, ASeekSaysNothingOfLossesBeforeIt)
{
  constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
  Pipeline made ("videotestsrc num-buffers=80 ! " +
                 gray_caps (32, 24, "100/1") +
                 " ! codedexposure-sim ! identity name=camera ! dmdsync ! "
                 "codedexposure-recordmux ! filesink location=" +
                 path);
  gst_pad_add_probe (
      made.pad ("camera", "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *, GstPadProbeInfo *info, gpointer) {
        return GST_BUFFER_PTS (GST_PAD_PROBE_INFO_BUFFER (info)) == 5 * kPeriod
                   ? GST_PAD_PROBE_DROP
                   : GST_PAD_PROBE_OK;
      },
      nullptr, nullptr);
  ASSERT_EQ (made.play (), "");
  Reading reading (path, "! codedexposure-fuse quality=fast");
  GstElement *top = reading.top ();
  gst_element_set_state (top, GST_STATE_PAUSED);
  gst_element_get_state (top, nullptr, nullptr, kPatience);
  for (const auto &[frame, losses] : {std::pair (8, 0), std::pair (4, 1)}) {
    gst_element_set_state (top, GST_STATE_PAUSED);
    reading.losses = 0;
    ASSERT_TRUE (gst_element_seek_simple (top, GST_FORMAT_TIME,
        GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        gint64 (frame * kPeriod)));
    EXPECT_EQ (reading.play (), "");
    EXPECT_EQ (reading.losses, losses);
  }
}

/** Of the frames of a log. */
std::vector<std::string>
hashes_in (const std::string &log)
{
  std::vector<std::string> hashes;
  std::ifstream lines (log);
  for (std::string line; std::getline (lines, line);)
    if (const auto at = line.find ("\"hash\":"); at != line.npos)
      hashes.push_back (line.substr (at, 26));
  return hashes;
}

/** Plays until the frame @p number passes @p pad, and pauses. @p passed must
 * outlive the pipeline @p top. */
void
play_until (GstElement *top, GstPad *pad, int number, std::atomic<int> &passed)
{
  passed = -number;
  const gulong probe = gst_pad_add_probe (
      pad, GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *, GstPadProbeInfo *, gpointer data) {
        auto &left = *static_cast<std::atomic<int> *> (data);
        left++;
        left.notify_one ();
        left.wait (0);
        return GST_PAD_PROBE_OK;
      },
      &passed, nullptr);
  gst_element_set_state (top, GST_STATE_PLAYING);
  for (int seen = passed; seen < 0; seen = passed)
    passed.wait (seen);
  gst_element_set_state (top, GST_STATE_PAUSED);
  gst_pad_remove_probe (pad, probe);
  passed = 1;
  passed.notify_one ();
}

/* A sink that is flushed forgets the head of the file: before it plays, and in
 * the middle. There, filesink may be where a muxer without streamable goes back
 * in the file, and fails loudly. */
TEST_F (Record, AFlushBeginsAnotherRecording)
{
  constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
  ASSERT_EQ (record (path), "");
  for (const int played : {0, 6}) {
    SCOPED_TRACE (played);
    std::atomic<int> passed = 0;
    Pipeline copy ("filesrc location=" + path +
                   " ! codedexposure-recorddemux name=demux ! identity "
                   "name=frames ! codedexposure-recordmux " +
                   (played > 0 ? "streamable=true " : "") + "log-location=" +
                   path + ".part.jsonl ! filesink location=" + path + ".part");
    GstElement *top = GST_ELEMENT (GST_OBJECT_PARENT (copy["demux"].get ()));
    if (played > 0)
      play_until (top, copy.pad ("frames", "src").get (), played, passed);
    else
      gst_element_set_state (top, GST_STATE_PAUSED);
    gst_element_get_state (top, nullptr, nullptr, kPatience);
    ASSERT_TRUE (gst_element_seek_simple (top, GST_FORMAT_TIME,
        GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        gint64 (8 * kPeriod)));
    ASSERT_EQ (copy.play (), "");
    Reading reading (path + ".part");
    ASSERT_EQ (reading.play (), "");
    EXPECT_EQ (reading.times.size (), std::size_t (kFrames - 8));
    EXPECT_FALSE (reading.was_cut);
    EXPECT_EQ (reading.count ("frames-missing"), 0u);
    auto expected = hashes_in (path + ".jsonl");
    expected.erase (expected.begin (), expected.begin () + 8);
    EXPECT_EQ (hashes_in (path + ".part.jsonl"), expected);
  }
}

class LateFrames : public Record,
                   public testing::WithParamInterface<const char *>
{
};

/* Frame 3 comes after frame 5. */
TEST_P (LateFrames, HaveTheirOwnTimesAndLines)
{
  constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
  Pipeline made ("videotestsrc num-buffers=80 ! " +
                 gray_caps (32, 24, "100/1") +
                 " ! codedexposure-sim ! identity name=cable ! dmdsync ! "
                 "codedexposure-recordmux " +
                 GetParam () + " ! filesink location=" + path);
  BufferPtr late;
  gst_pad_add_probe (
      made.pad ("cable", "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *pad, GstPadProbeInfo *info, gpointer late) {
        auto &held = *static_cast<BufferPtr *> (late);
        GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
        if (GST_BUFFER_PTS (frame) == 3 * kPeriod && !held) {
          held.reset (gst_buffer_ref (frame));
          return GST_PAD_PROBE_DROP;
        }
        if (GST_BUFFER_PTS (frame) == 6 * kPeriod)
          gst_pad_push (pad, gst_buffer_ref (held.get ()));
        return GST_PAD_PROBE_OK;
      },
      &late, nullptr);
  ASSERT_EQ (made.play (), "");
  Reading reading (path);
  ASSERT_EQ (reading.play (), "");
  std::vector<GstClockTime> expected;
  for (const int k : {0, 1, 2, 4, 5, 3})
    expected.push_back (GstClockTime (k) * kPeriod);
  for (int k = 6; k < kFrames; k++)
    expected.push_back (GstClockTime (k) * kPeriod);
  EXPECT_EQ (reading.times, expected);
  EXPECT_EQ (reading.corrupted, 0);
  EXPECT_EQ (reading.count ("frames-unknown"), 0u);
  EXPECT_EQ (reading.count ("frames-missing"), 0u);
}

INSTANTIATE_TEST_SUITE_P (
    Record, LateFrames, testing::Values ("codec=ffv1", "codec=raw"));

/* The inner demuxer logs some of them as critical. */
TEST_F (Record, NoFlippedBitInTheListOfTracksHangs)
{
  ASSERT_EQ (record (path), "");
  const GLogLevelFlags fatal =
      g_log_set_always_fatal (GLogLevelFlags (G_LOG_FATAL_MASK));
  const std::string bytes = content (path);
  const auto clusters = bytes.find ("\x1f\x43\xb6\x75", 400);
  for (auto at = bytes.rfind ("\x16\x54\xae\x6b", clusters); at < clusters;
       at++) {
    std::string flipped = bytes;
    flipped[at] = char (flipped[at] ^ 1 << at % 8);
    write (path, flipped);
    EXPECT_NE (Reading (path).play (), "the pipeline hangs") << at;
  }
  g_log_set_always_fatal (fatal);
}

TEST_F (Record, ABranchCanBeAddedWhileItPlays)
{
  ASSERT_EQ (record (path), "");
  Reading reading (path);
  ASSERT_EQ (reading.play (), "");
  const CapsPtr caps (gst_pad_query_caps (
      reading.pipeline ().pad ("demux", "src").get (), nullptr));
  const CapsPtr own (gst_caps_from_string (gray_caps (32, 24).c_str ()));
  EXPECT_TRUE (gst_caps_can_intersect (caps.get (), own.get ()));
}

TEST_F (Record, BackwardsTheFramesAreThoseOfForwards)
{
  ASSERT_EQ (record (path), "");
  Reading reading (path);
  GstElement *top = reading.top ();
  gst_element_set_state (top, GST_STATE_PAUSED);
  gst_element_get_state (top, nullptr, nullptr, kPatience);
  ASSERT_TRUE (gst_element_seek (top, -1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
      GST_SEEK_TYPE_SET, 0, GST_SEEK_TYPE_SET, kFrames * 40 * GST_MSECOND));
  gst_element_get_state (top, nullptr, nullptr, kPatience);
  reading.times.clear ();
  reading.corrupted = 0;
  EXPECT_EQ (reading.play (), "");
  EXPECT_GE (reading.times.size (), std::size_t (kFrames - 1));
  EXPECT_EQ (reading.corrupted, 0);
  EXPECT_TRUE (std::ranges::is_sorted (reading.times, std::greater ()));
  EXPECT_EQ (reading.count ("frames-missing"), 0u);
}

/* A player that does not want grey finds no decoder, and no crash. */
TEST_F (Record, OfOursNothingIsBuiltForAPlayer)
{
  ASSERT_EQ (record (path, "", source ("GRAY16_LE")), "");
  Pipeline player ("uridecodebin uri=file://" + path +
                   " caps=video/x-raw,format=I420 name=bin ! fakesink");
  player.play ();
  GstIterator *all = gst_bin_iterate_recurse (
      GST_BIN (GST_OBJECT_PARENT (player["bin"].get ())));
  const auto look = [] (const GValue *item, gpointer) {
    GstElement *element = GST_ELEMENT (g_value_get_object (item));
    EXPECT_FALSE (g_str_has_prefix (G_OBJECT_TYPE_NAME (element), "GstCoded"));
  };
  gst_iterator_foreach (all, look, nullptr);
  gst_iterator_free (all);
}

} // namespace
