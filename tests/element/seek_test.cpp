/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A seek gives the pictures of the whole: those of the coded frames whose times
 * lie in [start, stop), bit for bit, whatever they depend on. */
#include <cstdio>
#include <random>

#include <gst/app/gstappsrc.h>
#include <unistd.h>

#include "common/excerpt.h"
#include "common/meta.h"
#include "common/tag.h"
#include "pipeline.h"
#include "preset.h"
#include "schedule_tags.h"
#include "shown.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
constexpr GstClockTime kNone = GST_CLOCK_TIME_NONE;

struct Recorded {
  GstClockTime pts;
  std::string schedule;
};

/* Begins late, has a gap after 20 frames, and another schedule from frame 48
 * on; times are rounded to microseconds. */
std::vector<Recorded>
recording ()
{
  std::vector<Recorded> frames;
  for (int i = 0; i < 70; i++) {
    const GstClockTime pts = 3210 * GST_MSECOND + GstClockTime (i) * kPeriod +
                             GstClockTime (i % 3) * 1000 +
                             (i < 20 ? 0 : 7 * kPeriod);
    frames.push_back (
        {pts, i < 48 ? "sequential:lattice:4/2" : "sequential:2x2"});
  }
  return frames;
}

/* A texture that stands still beside one that moves, with noise. */
Image<std::uint8_t>
coded_picture (int number)
{
  std::mt19937 noise{unsigned (number)};
  return draw<std::uint8_t> (32, 24, [&] (int x, int y) {
    const int base = y < 12 ? 40 + (13 * x + 29 * y) % 120
                            : 40 + (7 * (x + number / 3) + 31 * y) % 150;
    return base + int (noise () % 5);
  });
}

/* Of a recording and what reads it, as files are: seeks flush, and frames are
 * clipped to the segment. */
class Reader
{
public:
  explicit Reader (const std::string &line) : element (line)
  {
    GstPad *pad = element.get ()->srcpad;
    gst_pad_set_event_function_full (
        pad,
        +[] (GstPad *pad, GstObject *, GstEvent *event) {
          return static_cast<Reader *> (pad->eventdata)
              ->take (EventPtr (event));
        },
        this, nullptr);
    gst_pad_set_query_function (
        pad, +[] (GstPad *pad, GstObject *parent, GstQuery *query) {
          if (GST_QUERY_TYPE (query) != GST_QUERY_DURATION)
            return gst_pad_query_default (pad, parent, query);
          gst_query_set_duration (query, GST_FORMAT_TIME, kEnd);
          return gboolean (TRUE);
        });
    element.set_caps (gray_caps (32, 24));
    gst_segment_init (&segment, GST_FORMAT_TIME);
  }

  /** Pushes the frames of the segment, and the end. */
  void play ()
  {
    push_segment ();
    std::string tagged;
    const bool forwards = segment.rate > 0;
    for (std::size_t k = 0; k < frames.size (); k++) {
      const std::size_t i = forwards ? k : frames.size () - 1 - k;
      const auto &[pts, schedule] = frames[i];
      guint64 from, to;
      if (!gst_segment_clip (
              &segment, GST_FORMAT_TIME, pts, pts + kPeriod, &from, &to))
        continue;
      if (std::exchange (tagged, schedule) != schedule)
        element.push_event (schedule_to_event (schedule_of (schedule)));
      BufferPtr frame = frame_of (coded_picture (int (i)), from);
      GST_BUFFER_DURATION (frame.get ()) = to - from;
      ASSERT_EQ (element.push (std::move (frame)), GST_FLOW_OK);
    }
    element.push_event (segment.flags & GST_SEGMENT_FLAG_SEGMENT
                            ? gst_event_new_segment_done (
                                  GST_FORMAT_TIME, gint64 (segment.stop))
                            : gst_event_new_eos ());
    if (GST_CLOCK_TIME_IS_VALID (segment.stop))
      segment.position = segment.stop;
  }

  void push_segment ()
  {
    GstEvent *event = gst_event_new_segment (&segment);
    gst_event_set_seqnum (event, seqnum);
    element.push_event (event);
  }
  bool seek (GstEvent *event, const std::string &pad = "")
  {
    return gst_harness_push_upstream_event (element.pad (pad), event);
  }

  std::vector<Shown> shown (const std::string &pad = "")
  {
    std::vector<Shown> all;
    const CapsPtr caps = element.pad_caps (pad);
    for (const BufferPtr &buffer : element.pull_all (pad))
      all.push_back (
          {GST_BUFFER_PTS (buffer.get ()), GST_BUFFER_DURATION (buffer.get ()),
              image_of<std::uint8_t> (buffer.get (), caps.get ())});
    return all;
  }

  /* What the last SEGMENT event of @pad says. */
  GstSegment downstream (const std::string &pad = "")
  {
    GstSegment own;
    const EventPtr event (gst_pad_get_sticky_event (
        element.pad (pad)->sinkpad, GST_EVENT_SEGMENT, 0));
    gst_event_copy_segment (event.get (), &own);
    seqnum_downstream = gst_event_get_seqnum (event.get ());
    return own;
  }

  static constexpr gint64 kEnd = 6330 * GST_MSECOND;
  const std::vector<Recorded> frames = recording ();
  ElementHarness element;
  GstSegment segment;
  guint32 seqnum = gst_util_seqnum_next ();
  guint32 seqnum_downstream = 0;
  int seeks = 0;

private:
  gboolean take (EventPtr event)
  {
    if (GST_EVENT_TYPE (event.get ()) != GST_EVENT_SEEK)
      return TRUE;
    gdouble rate;
    GstFormat format;
    GstSeekFlags flags;
    GstSeekType start_type, stop_type;
    gint64 start, stop;
    gst_event_parse_seek (event.get (), &rate, &format, &flags, &start_type,
        &start, &stop_type, &stop);
    seeks++;
    if (format != GST_FORMAT_TIME)
      return TRUE;
    seqnum = gst_event_get_seqnum (event.get ());
    segment.duration = kEnd;
    gst_segment_do_seek (&segment, rate, format, flags, start_type,
        guint64 (start), stop_type, guint64 (stop), nullptr);
    if (flags & GST_SEEK_FLAG_FLUSH) {
      element.push_event (gst_event_new_flush_start ());
      element.push_event (gst_event_new_flush_stop (TRUE));
    }
    return TRUE;
  }
};

GstEvent *
new_seek (GstClockTime start, GstClockTime stop, double rate = 1.0,
    int flags = GST_SEEK_FLAG_FLUSH)
{
  return gst_event_new_seek (rate, GST_FORMAT_TIME, GstSeekFlags (flags),
      GST_SEEK_TYPE_SET, gint64 (start), GST_SEEK_TYPE_SET, gint64 (stop));
}

bool
lies_in (GstClockTime pts, GstClockTime start, GstClockTime stop)
{
  return pts + kRounding >= start && (stop == kNone || pts + kRounding < stop);
}

struct Case {
  const char *name, *line;
  int seeks;
};

void
PrintTo (const Case &how, std::ostream *out)
{
  *out << how.name;
}

class Excerpts : public ::testing::TestWithParam<Case>
{
protected:
  /* Plays the whole, from the first frame to the last. */
  Excerpts ()
  {
    reader.play ();
    whole = reader.shown ();
    EXPECT_EQ (whole.size (), 4 * reader.frames.size ());
  }
  /* The pictures of the coded frames in [start, stop). */
  std::vector<Shown> part (GstClockTime start, GstClockTime stop) const
  {
    std::vector<Shown> pictures;
    for (std::size_t i = 0; i < reader.frames.size (); i++)
      if (lies_in (reader.frames[i].pts, start, stop))
        pictures.insert (pictures.end (), whole.begin () + long (4 * i),
            whole.begin () + long (4 * i + 4));
    return pictures;
  }
  void expect_parts_of_the_whole ();
  /* A time near that of a frame, or between two. */
  GstClockTime some_time ()
  {
    const auto &frame = reader.frames[random () % reader.frames.size ()];
    const GstClockTime off[] = {0, 0, 1, 3000, kPeriod / 3, kPeriod - 20000};
    return frame.pts + off[random () % std::size (off)];
  }

  Reader reader{GetParam ().line};
  std::vector<Shown> whole;
  std::mt19937 random{11};
};

const auto name_of = [] (const auto &info) { return info.param.name; };

INSTANTIATE_TEST_SUITE_P (Of, Excerpts,
    ::testing::Values (Case{"demux", "codedexposure-demux", 60},
        Case{"rank", "codedexposure-demux method=rank", 10},
        Case{"fast", "codedexposure-fuse", 40},
        Case{"fast_ahead", "codedexposure-fuse lookahead=1", 40},
        Case{"fast_noise", "codedexposure-fuse lookahead=1 full-well=8000", 60},
        Case{"overlap", "codedexposure-fuse lookahead=1 overlap=2", 30},
        Case{"overlap_noise",
            "codedexposure-fuse lookahead=1 overlap=3 full-well=8000", 30}),
    name_of);

/* These take long. */
class LongExcerpts : public Excerpts
{
};
INSTANTIATE_TEST_SUITE_P (Of, LongExcerpts,
    ::testing::Values (
        Case{"balanced",
            "codedexposure-fuse quality=balanced lookahead=1 full-well=8000",
            4},
        Case{"best",
            "codedexposure-fuse quality=best lookahead=1 full-well=8000", 3}),
    name_of);

/* One stream of one element after another. */
void
Excerpts::expect_parts_of_the_whole ()
{
  for (int i = 0; i < GetParam ().seeks; i++) {
    const GstClockTime start = i % 7 == 0 ? 0 : some_time ();
    GstClockTime stop = i % 5 == 0 ? kNone : some_time ();
    if (stop < start)
      stop = start + 1 + 3 * kPeriod;
    GstEvent *seek = new_seek (start, stop, 1.0,
        GST_SEEK_FLAG_FLUSH | (i % 2 ? GST_SEEK_FLAG_ACCURATE : 0));
    const guint32 seqnum = gst_event_get_seqnum (seek);
    ASSERT_TRUE (reader.seek (seek));
    reader.play ();
    const auto pictures = reader.shown ();
    EXPECT_TRUE (pictures == part (start, stop))
        << start << " to " << stop << ": " << pictures.size () << " of "
        << part (start, stop).size () << " pictures";
    const GstSegment segment = reader.downstream ();
    EXPECT_EQ (reader.seqnum_downstream, seqnum);
    const GstClockTime least = std::min<GstClockTime> (start, Reader::kEnd);
    EXPECT_NEAR (double (segment.start), double (least), double (kRounding));
    EXPECT_EQ (segment.time, segment.start);
    if (stop != kNone) {
      EXPECT_LE (segment.stop, stop + kPeriod);
    }
    for (const Shown &picture : pictures) {
      EXPECT_GE (picture.pts, segment.start);
      EXPECT_LE (picture.pts + picture.duration, segment.stop);
    }
    EXPECT_TRUE (reader.element.pull_event (GST_EVENT_EOS));
  }
  EXPECT_EQ (reader.element.error (), "");
}

TEST_P (Excerpts, HaveThePicturesOfTheWhole)
{
  expect_parts_of_the_whole ();
}

TEST_P (LongExcerpts, HaveThePicturesOfTheWhole)
{
  expect_parts_of_the_whole ();
}

TEST_P (Excerpts, BeforeTheFirstFrameAndAfterTheLastAreEmpty)
{
  for (const GstClockTime start : {0 * GST_SECOND, 7 * GST_SECOND}) {
    ASSERT_TRUE (reader.seek (new_seek (start, start + GST_SECOND)));
    reader.play ();
    EXPECT_EQ (reader.shown ().size (), 0u);
    EXPECT_TRUE (reader.element.pull_event (GST_EVENT_EOS));
  }
  EXPECT_EQ (reader.element.error (), "");
}

/* The application may ask while frames come. */
TEST_P (Excerpts, FlushWhatIsUnderWay)
{
  const GstClockTime start = reader.frames[30].pts;
  ASSERT_TRUE (reader.seek (new_seek (reader.frames[2].pts, kNone)));
  reader.push_segment ();
  for (int i = 0; i < 5; i++)
    reader.element.push (
        frame_of (coded_picture (i), reader.frames[std::size_t (i)].pts));
  reader.shown ();
  ASSERT_TRUE (reader.seek (new_seek (start, start + 2 * kPeriod)));
  reader.play ();
  EXPECT_TRUE (reader.shown () == part (start, start + 2 * kPeriod));
}

/* Backwards, each coded frame is decoded alone. */
TEST_P (Excerpts, BackwardsHaveThePicturesOfTheWholeBackwards)
{
  ASSERT_TRUE (reader.seek (new_seek (0, kNone, -1.0)));
  reader.play ();
  const auto all = reader.shown ();
  ASSERT_EQ (all.size (), whole.size ());
  const auto &frames = reader.frames;
  for (const auto &[first, end] : {std::pair (3, 9), {15, 25}, {40, 60}}) {
    const GstClockTime start = frames[std::size_t (first)].pts;
    const GstClockTime stop = frames[std::size_t (end)].pts;
    ASSERT_TRUE (reader.seek (new_seek (start, stop, -1.0)));
    reader.play ();
    const auto from = all.begin () + 4 * (long (frames.size ()) - end);
    EXPECT_TRUE (
        reader.shown () == std::vector<Shown> (from, from + 4 * (end - first)))
        << first << " to " << end;
    EXPECT_EQ (reader.downstream ().start, start);
    EXPECT_NEAR (double (reader.downstream ().stop), double (stop), 5000);
  }
}

/* Segments that follow each other without a flush, as in a loop: running time
 * goes on without the frames that were only read. */
TEST_P (Excerpts, OfALoopFollowEachOther)
{
  const GstClockTime start = reader.frames[50].pts, stop = start + 4 * kPeriod;
  ASSERT_TRUE (reader.seek (new_seek (
      start, stop, 1.0, GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_SEGMENT)));
  for (guint64 i = 0; i < 3; i++) {
    reader.play ();
    EXPECT_TRUE (reader.shown () == part (start, stop));
    EXPECT_NEAR (double (reader.downstream ().base),
        double (i * (stop - start)), 5000 * double (i));
    const EventPtr done = reader.element.pull_event (GST_EVENT_SEGMENT_DONE);
    ASSERT_TRUE (done);
    gint64 position = 0;
    gst_event_parse_segment_done (done.get (), nullptr, &position);
    EXPECT_NEAR (double (position), double (stop), 5000);
    ASSERT_TRUE (
        reader.seek (new_seek (start, stop, 1.0, GST_SEEK_FLAG_SEGMENT)));
  }
}

/* To the end, as GStreamer's players ask, and relative to it. */
TEST_P (Excerpts, OfOtherFormsOfSeeks)
{
  const GstClockTime start = reader.frames[60].pts;
  ASSERT_TRUE (reader.seek (
      gst_event_new_seek (1.0, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
          GST_SEEK_TYPE_SET, gint64 (start), GST_SEEK_TYPE_NONE, 0)));
  reader.play ();
  EXPECT_TRUE (reader.shown () == part (start, kNone));

  ASSERT_TRUE (reader.seek (gst_event_new_seek (1.0, GST_FORMAT_TIME,
      GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_END, -10 * gint64 (kPeriod),
      GST_SEEK_TYPE_END, -4 * gint64 (kPeriod))));
  reader.play ();
  EXPECT_TRUE (reader.shown () ==
               part (Reader::kEnd - 10 * kPeriod, Reader::kEnd - 4 * kPeriod));

  /* A seek to a unit begins with the coded frame of that time. */
  ASSERT_TRUE (reader.seek (new_seek (start + kPeriod / 2, kNone, 1.0,
      GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_KEY_UNIT)));
  reader.play ();
  EXPECT_TRUE (reader.shown () == part (start, kNone));

  ASSERT_TRUE (reader.seek (gst_event_new_seek (1.0, GST_FORMAT_BYTES,
      GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET, 0, GST_SEEK_TYPE_NONE, -1)));
}

/* Those around it are read and not counted. */
TEST_P (Excerpts, CountTheirOwnFrames)
{
  Reader reader (GetParam ().line);
  const GstClockTime start = reader.frames[22].pts;
  ASSERT_TRUE (reader.seek (new_seek (start, start + 5 * kPeriod)));
  reader.play ();
  EXPECT_EQ (counter_of (reader.element.element (), "frames-in"), 5u);
  EXPECT_EQ (counter_of (reader.element.element (), "frames-lost"), 0u);
  EXPECT_EQ (reader.shown ().size (), 20u);
}

/* Both pads send the same seek; upstream gets one. */
TEST (Excerpt, OfTwoPadsIsOne)
{
  Reader reader ("codedexposure-demux");
  reader.element.request ("coded");
  reader.play ();
  reader.shown ();
  reader.shown ("coded");
  const GstClockTime start = reader.frames[5].pts;
  GstEvent *seek = new_seek (start, start + 3 * kPeriod);
  ASSERT_TRUE (reader.seek (gst_event_ref (seek)));
  ASSERT_TRUE (reader.seek (seek, "coded"));
  EXPECT_EQ (reader.seeks, 1);
  reader.play ();
  EXPECT_EQ (reader.shown ().size (), 12u);
  const auto coded = reader.shown ("coded");
  ASSERT_EQ (coded.size (), 3u);
  EXPECT_EQ (coded[0].pts, start);
  EXPECT_TRUE (coded[2].pixels == coded_picture (7));
  EXPECT_EQ (reader.downstream ("coded").start, start);
}

/* A pad that is requested afterwards has the segment of the others. */
TEST (Excerpt, OfAPadThatComesLaterIsTheSame)
{
  Reader reader ("codedexposure-demux");
  const GstClockTime start = reader.frames[5].pts;
  ASSERT_TRUE (reader.seek (new_seek (start, start + 3 * kPeriod)));
  reader.play ();
  reader.element.request ("coded");
  const ObjectPtr<GstPad> pad (
      gst_element_get_static_pad (reader.element.element (), "coded"));
  const EventPtr event (
      gst_pad_get_sticky_event (pad.get (), GST_EVENT_SEGMENT, 0));
  ASSERT_TRUE (event);
  GstSegment segment;
  gst_event_copy_segment (event.get (), &segment);
  EXPECT_EQ (segment.start, start);
}

/* ----------------------------------------------------------------- files -- */

/* Without the changed schedule, which such a file does not hold. */
std::string
write_file (const std::vector<Recorded> &frames)
{
  const std::string path =
      ::testing::TempDir () + "/seek_" + std::to_string (getpid ()) + ".mkv";
  Pipeline pipeline (
      "appsrc name=source format=time caps=" + gray_caps (32, 24) +
      " ! avenc_ffv1 ! matroskamux timecodescale=1000 ! "
      "filesink location=" +
      path);
  const ObjectPtr<GstElement> source = pipeline["source"];
  for (std::size_t i = 0; i < frames.size (); i++) {
    BufferPtr frame = frame_of (coded_picture (int (i)), frames[i].pts);
    GST_BUFFER_DURATION (frame.get ()) = kPeriod;
    gst_app_src_push_buffer (GST_APP_SRC (source.get ()), frame.release ());
  }
  gst_app_src_end_of_stream (GST_APP_SRC (source.get ()));
  EXPECT_EQ (pipeline.play (), "");
  return path;
}

/* Each of two elements needs other frames around those that are asked for, and
 * only the first copy of a seek is followed. */
TEST (Excerpt, OfAFileIsThatOfTheWholeForEachElement)
{
  const std::vector<Recorded> frames = recording ();
  const std::string path = write_file (frames);
  const std::string line =
      "filesrc location=" + path +
      " ! matroskademux ! avdec_ffv1 ! tee name=all "
      "all. ! queue ! codedexposure-demux name=demux schedule=sequential:2x2 ! "
      "fakesink "
      "all. ! queue ! codedexposure-fuse name=fuse schedule=sequential:2x2 "
      "lookahead=1 full-well=8000 ! fakesink";
  std::vector<Shown> whole_demuxed, whole_fused;
  {
    Pipeline pipeline (line);
    const Output demuxed (pipeline, "demux"), fused (pipeline, "fuse");
    ASSERT_EQ (pipeline.play (), "");
    whole_demuxed = demuxed.shown;
    whole_fused = fused.shown;
  }
  ASSERT_EQ (whole_demuxed.size (), 4 * frames.size ());
  ASSERT_EQ (whole_fused.size (), 4 * frames.size ());

  Pipeline pipeline (line);
  const Output demuxed (pipeline, "demux"), fused (pipeline, "fuse");
  GstElement *top = GST_ELEMENT (GST_OBJECT_PARENT (pipeline["fuse"].get ()));
  gst_element_set_state (top, GST_STATE_PAUSED);
  ASSERT_EQ (gst_element_get_state (top, nullptr, nullptr, kPatience),
      GST_STATE_CHANGE_SUCCESS);
  for (const auto &[first, end] :
      {std::pair (0, 3), {17, 24}, {20, 23}, {45, 70}, {31, 32}, {8, 12}}) {
    /* Stream time begins with the first frame. */
    const auto time_of = [&] (int i) {
      return i < int (frames.size ())
                 ? gint64 (frames[std::size_t (i)].pts - frames[0].pts)
                 : gint64 (10 * GST_SECOND);
    };
    ASSERT_TRUE (gst_element_seek (top, 1.0, GST_FORMAT_TIME,
        GstSeekFlags (
            GST_SEEK_FLAG_FLUSH | (first % 2 ? GST_SEEK_FLAG_ACCURATE : 0)),
        GST_SEEK_TYPE_SET, time_of (first), GST_SEEK_TYPE_SET, time_of (end)));
    ASSERT_EQ (pipeline.play (), "");
    for (const auto &[part, whole] :
        {std::pair (&demuxed.shown, &whole_demuxed),
            {&fused.shown, &whole_fused}})
      EXPECT_TRUE (*part == std::vector<Shown> (whole->begin () + 4 * first,
                                whole->begin () + 4 * end))
          << first << " to " << end << ": " << part->size () << " of "
          << 4 * (end - first);
  }
  std::remove (path.c_str ());
}

/* Its pad has all events that came before. */
TEST (File, TakesABranchThatIsAddedLater)
{
  const std::string path = write_file (recording ());
  for (const auto &[source, name] :
      {std::pair ("matroskademux ! avdec_ffv1", "coded"),
          {"matroskademux ! avdec_ffv1", "subframe_2"},
          {"codedexposure-recorddemux", "coded"},
          {"codedexposure-recorddemux", "subframe_2"}}) {
    Pipeline pipeline (
        "filesrc location=" + path + " ! " + source +
        " ! codedexposure-demux name=demux schedule=sequential:2x2 "
        "demux.src ! queue max-size-buffers=1 ! fakesink");
    const ObjectPtr<GstElement> demux = pipeline["demux"];
    GstElement *top = GST_ELEMENT (GST_OBJECT_PARENT (demux.get ()));
    gst_element_set_state (top, GST_STATE_PAUSED);
    ASSERT_EQ (gst_element_get_state (top, nullptr, nullptr, kPatience),
        GST_STATE_CHANGE_SUCCESS);
    GstElement *branch = gst_parse_bin_from_description (
        "queue ! avenc_ffv1 ! matroskamux ! fakesink async=false", TRUE,
        nullptr);
    gst_bin_add (GST_BIN (top), branch);
    gst_element_sync_state_with_parent (branch);
    const ObjectPtr<GstPad> pad (
        gst_element_request_pad_simple (demux.get (), name));
    const ObjectPtr<GstPad> sink (gst_element_get_static_pad (branch, "sink"));
    ASSERT_EQ (gst_pad_link (pad.get (), sink.get ()), GST_PAD_LINK_OK);
    EXPECT_EQ (pipeline.play (), "") << name;
  }
  std::remove (path.c_str ());
}

} // namespace
