/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Recordings of coded frames with partners: what comes out is what went in,
 * also where frames are alone, after seeks, and from damaged files. */
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <set>

#include "common/messages.h"
#include "common/meta.h"
#include "common/partner.h"
#include "common/tag.h"
#include "harness.h"
#include "pipeline.h"
#include "record/matroska.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
constexpr guint64 kFrames = 20;

/** The coded frames at the sink pad of an element: for each, whether it has a
 * partner, and the pixels of that. */
struct Seen {
  std::vector<GstClockTime> times;
  std::vector<std::string> partners; ///< "": none

  void follow (Pipeline &pipeline, const char *element)
  {
    gst_pad_add_probe (
        pipeline.pad (element, "sink").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
          GstBuffer *frame = GST_PAD_PROBE_INFO_BUFFER (info);
          auto *seen = static_cast<Seen *> (self);
          seen->times.push_back (GST_BUFFER_PTS (frame));
          std::string pixels;
          if (const auto partner = get_partner (frame)) {
            pixels.resize (gst_buffer_get_size (partner->buffer.get ()));
            gst_buffer_extract (
                partner->buffer.get (), 0, pixels.data (), pixels.size ());
          }
          seen->partners.push_back (pixels);
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
  }
  std::set<std::size_t> alone () const
  {
    std::set<std::size_t> frames;
    for (std::size_t i = 0; i < partners.size (); i++)
      if (partners[i].empty ())
        frames.insert (i);
    return frames;
  }
};

ObjectPtr<GstElement>
top_of (const Pipeline &pipeline, const char *element)
{
  return ObjectPtr<GstElement> (
      GST_ELEMENT (gst_element_get_parent (pipeline[element].get ())));
}

/** What the pipeline with @p element posts of damaged partners, and its last
 * warning. */
struct Said {
  std::vector<PartnerLost> lost; ///< ends of sequences
  std::string warning;

  void follow (const Pipeline &pipeline, const char *element)
  {
    const ObjectPtr<GstBus> bus (
        gst_element_get_bus (top_of (pipeline, element).get ()));
    gst_bus_set_sync_handler (
        bus.get (),
        [] (GstBus *, GstMessage *message, gpointer self) {
          static_cast<Said *> (self)->take (message);
          return GST_BUS_PASS;
        },
        this, nullptr);
  }
  void take (GstMessage *message)
  {
    if (const auto one = parse_message<PartnerLost> (message);
        one && !one->active)
      lost.push_back (*one);
    if (GST_MESSAGE_TYPE (message) != GST_MESSAGE_WARNING)
      return;
    GError *error = nullptr;
    gst_message_parse_warning (message, &error, nullptr);
    warning = error->message;
    g_error_free (error);
  }
};

class RecordPairs : public ::testing::Test
{
protected:
  RecordPairs ()
  {
    std::string name = "/tmp/record_pairs_XXXXXX";
    folder_ = mkdtemp (name.data ());
  }
  ~RecordPairs () override { std::filesystem::remove_all (folder_); }

  std::string at (const std::string &name) const
  {
    return folder_ + "/" + name + " ";
  }
  std::string bytes (const std::string &name) const
  {
    std::ifstream in (folder_ + "/" + name, std::ios::binary);
    return {std::istreambuf_iterator<char> (in), {}};
  }
  void write (const std::string &name, const std::string &content) const
  {
    std::ofstream (folder_ + "/" + name, std::ios::binary) << content;
  }

  /** Pairs of two simulated cameras; those of the second camera in @p lost do
   * not come. */
  std::string pairs (const std::string &format = "GRAY8") const
  {
    return "videotestsrc num-buffers=" + std::to_string (4 * kFrames) +
           " pattern=ball ! " + gray_caps (64, 48, "100/1", format) +
           " ! tee name=light "
           "light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 "
           "! dmdsync schedule=sequential:lattice:4/2 ! pair.on "
           "light. ! queue ! codedexposure-sim beam=off "
           "schedule=sequential:lattice:4/2 ! identity name=second "
           "! dmdsync beam=off schedule=sequential:lattice:4/2 ! pair.off "
           "codedexposure-pair name=pair ! tee name=pairs ! queue ";
  }
  void record (Seen &seen, const std::string &codec = "ffv1",
      const std::string &format = "GRAY8",
      const std::set<guint64> &lost = {}) const
  {
    Pipeline pipeline (pairs (format) + "! codedexposure-recordmux codec=" +
                       codec + " ! filesink location=" + at ("both.mkv") +
                       "pairs. ! queue ! fakesink name=live");
    auto state = std::pair (guint64 (0), lost);
    gst_pad_add_probe (
        pipeline.pad ("second", "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *, gpointer data) {
          auto &[number, which] = *static_cast<decltype (state) *> (data);
          return which.contains (number++) ? GST_PAD_PROBE_DROP
                                           : GST_PAD_PROBE_OK;
        },
        &state, nullptr);
    seen.follow (pipeline, "live");
    ASSERT_EQ (pipeline.play (), "");
    ASSERT_EQ (seen.times.size (), kFrames);
  }
  std::string play (Seen &seen, const std::string &name = "both.mkv",
      const std::string &options = "") const
  {
    Pipeline pipeline ("filesrc location=" + at (name) +
                       "! codedexposure-recorddemux " + options +
                       " ! fakesink name=out");
    seen.follow (pipeline, "out");
    return pipeline.play ();
  }

private:
  std::string folder_;
};

struct Form {
  const char *codec, *format;
};
class RecordPairsForms : public RecordPairs,
                         public ::testing::WithParamInterface<Form>
{
};

/* The second camera loses its first frame, and others. */
TEST_P (RecordPairsForms, PartnersComeOutAsTheyWentIn)
{
  Seen live, played;
  record (live, GetParam ().codec, GetParam ().format, {0, 7, 8, 9});
  EXPECT_EQ (live.alone (), (std::set<std::size_t>{0, 7, 8, 9}));
  ASSERT_EQ (play (played), "");
  EXPECT_EQ (played.times, live.times);
  EXPECT_TRUE (played.partners == live.partners);
}

INSTANTIATE_TEST_SUITE_P (Forms, RecordPairsForms,
    ::testing::Values (Form{"ffv1", "GRAY8"}, Form{"raw", "GRAY8"},
        Form{"ffv1", "GRAY16_LE"}, Form{"raw", "GRAY16_LE"}));

TEST_F (RecordPairs, BothTracksHaveAFrameOfEachTime)
{
  Seen live;
  record (live, "ffv1", "GRAY8", {3});
  const auto head = matroska_head (bytes ("both.mkv"));
  ASSERT_TRUE (head);
  EXPECT_TRUE (head->has_partners ());
  EXPECT_EQ (head->partner_size, (Extent{64, 48}));
  const auto info =
      recording_info (at ("both.mkv").substr (0, at ("both.mkv").size () - 1));
  ASSERT_TRUE (info) << info.error ().message;
  EXPECT_EQ (info->times.size (), kFrames);
  EXPECT_EQ (info->partners, kFrames);
  EXPECT_EQ (info->alone, live.alone ().size ());
  EXPECT_TRUE (info->extras.empty ());
  ASSERT_TRUE (info->setup);
  ASSERT_TRUE (info->setup->partner);
  EXPECT_EQ (info->setup->partner->size, (Extent{64, 48}));
  EXPECT_FALSE (info->setup->off_beam);
}

TEST_F (RecordPairs, FusedFramesAreThoseOfTheLiveStream)
{
  Pipeline live (pairs () + "! codedexposure-recordmux ! filesink location=" +
                 at ("both.mkv") +
                 "pairs. ! queue ! codedexposure-fuse ! filesink location=" +
                 at ("live.gray"));
  ASSERT_EQ (live.play (), "");
  Pipeline played ("filesrc location=" + at ("both.mkv") +
                   "! codedexposure-recorddemux ! codedexposure-fuse "
                   "! filesink location=" +
                   at ("played.gray"));
  ASSERT_EQ (played.play (), "");
  EXPECT_EQ (bytes ("live.gray").size (), 4 * kFrames * 64 * 48);
  EXPECT_TRUE (bytes ("live.gray") == bytes ("played.gray"));
}

TEST_F (RecordPairs, ACopyWithoutDecodingIsTheSame)
{
  Seen live, copied;
  record (live, "ffv1", "GRAY8", {0, 5});
  Pipeline copy ("filesrc location=" + at ("both.mkv") +
                 "! codedexposure-recorddemux decode=false "
                 "! codedexposure-recordmux codec=copy ! filesink location=" +
                 at ("copy.mkv"));
  ASSERT_EQ (copy.play (), "");
  ASSERT_EQ (play (copied, "copy.mkv"), "");
  EXPECT_EQ (copied.times, live.times);
  EXPECT_TRUE (copied.partners == live.partners);
}

/* Over a network there is no index. */
TEST_F (RecordPairs, AStreamHasThemToo)
{
  Pipeline sent (pairs () +
                 "! codedexposure-recordmux streamable=true "
                 "! filesink location=" +
                 at ("stream.mkv"));
  ASSERT_EQ (sent.play (), "");
  Seen played;
  ASSERT_EQ (play (played, "stream.mkv"), "");
  EXPECT_EQ (played.times.size (), kFrames);
  EXPECT_TRUE (played.alone ().empty ());
}

TEST_F (RecordPairs, FramesAfterASeekHaveTheirs)
{
  Seen live, played;
  record (live);
  Pipeline pipeline ("filesrc location=" + at ("both.mkv") +
                     "! codedexposure-recorddemux ! fakesink name=out");
  const auto owned = top_of (pipeline, "out");
  GstElement *top = owned.get ();
  for (const guint64 first : {13u, 4u}) {
    gst_element_set_state (top, GST_STATE_PAUSED);
    gst_element_get_state (top, nullptr, nullptr, kPatience);
    ASSERT_TRUE (gst_element_seek_simple (top, GST_FORMAT_TIME,
        GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        gint64 (first * kPeriod)));
    gst_element_get_state (top, nullptr, nullptr, kPatience);
    if (first == 13)
      played.follow (pipeline, "out");
    played.times.clear ();
    played.partners.clear ();
    ASSERT_EQ (pipeline.play (), "");
    ASSERT_FALSE (played.times.empty ());
    EXPECT_TRUE (std::equal (played.partners.rbegin (), played.partners.rend (),
        live.partners.rbegin ()));
    EXPECT_GE (played.times.size (), kFrames - first - 1);
  }
}

/** Holds back the end of the second camera's frames until that of the coded
 * frames comes, which should not. */
struct HeldEnd {
  std::promise<void> coded;
  bool was_held = false, was_last = false;
  bool has_first = false; ///< the part of the first camera was added

  void follow (const Pipeline &pipeline)
  {
    const auto added = [] (GstBin *, GstElement *part, gpointer self) {
      if (std::string (G_OBJECT_TYPE_NAME (part)) ==
              "GstCodedExposureRestore" &&
          std::exchange (static_cast<HeldEnd *> (self)->has_first, true))
        gst_pad_add_probe (pad_of (part, "sink").get (),
            GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, hold, self, nullptr);
    };
    g_signal_connect (
        pipeline["both"].get (), "element-added", G_CALLBACK (+added), this);
    gst_pad_add_probe (
        pipeline.pad ("out", "sink").get (),
        GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM,
        [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
          if (is_end (info))
            static_cast<HeldEnd *> (self)->coded.set_value ();
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
  }

private:
  static bool is_end (GstPadProbeInfo *info)
  {
    return GST_EVENT_TYPE (GST_PAD_PROBE_INFO_EVENT (info)) == GST_EVENT_EOS;
  }
  static GstPadProbeReturn hold (GstPad *, GstPadProbeInfo *info, gpointer data)
  {
    constexpr std::chrono::milliseconds kLong (500);
    auto &self = *static_cast<HeldEnd *> (data);
    if (!is_end (info))
      return GST_PAD_PROBE_OK;
    self.was_held = true;
    self.was_last =
        self.coded.get_future ().wait_for (kLong) == std::future_status::ready;
    return GST_PAD_PROBE_OK;
  }
};

/* What is said of the second camera's frames is said before the end. */
TEST_F (RecordPairs, TheEndFollowsThatOfTheSecondCamera)
{
  Seen live;
  record (live);
  Pipeline pipeline ("filesrc location=" + at ("both.mkv") +
                     "! codedexposure-recorddemux name=both "
                     "! fakesink name=out");
  HeldEnd end;
  end.follow (pipeline);
  ASSERT_EQ (pipeline.play (), "");
  EXPECT_TRUE (end.was_held);
  EXPECT_FALSE (end.was_last);
}

/* A frame that waits for its partner when a flush comes is not alone. */
TEST_F (RecordPairs, ASeekTakesNoPartnersAway)
{
  constexpr int kSeeks = 2000;
  Seen live;
  record (live);
  Pipeline pipeline ("filesrc location=" + at ("both.mkv") +
                     "! codedexposure-recorddemux ! fakesink name=out");
  const auto owned = top_of (pipeline, "out");
  GstElement *top = owned.get ();
  std::atomic<int> alone = 0;
  const ObjectPtr<GstBus> bus (gst_element_get_bus (top));
  gst_bus_set_sync_handler (
      bus.get (),
      [] (GstBus *, GstMessage *message, gpointer count) {
        if (parse_message<PartnerLost> (message))
          ++*static_cast<std::atomic<int> *> (count);
        return GST_BUS_PASS;
      },
      &alone, nullptr);
  gst_element_set_state (top, GST_STATE_PLAYING);
  gst_element_get_state (top, nullptr, nullptr, kPatience);
  for (int i = 0; i < kSeeks; i++)
    ASSERT_TRUE (gst_element_seek_simple (top, GST_FORMAT_TIME,
        GstSeekFlags (GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        gint64 (guint64 (i % 7) * kPeriod)));
  ASSERT_EQ (pipeline.play (), "");
  EXPECT_EQ (alone, 0);
}

/* It breaks off the frames before it at any place of the file; backwards, the
 * decoder holds one of them. */
class RecordPairsSeeks : public RecordPairs,
                         public ::testing::WithParamInterface<int>
{
};

TEST_P (RecordPairsSeeks, WithoutAFlushTakeNoPartnersAway)
{
  constexpr int kSeeks = 60;
  Seen live;
  record (live);
  Pipeline pipeline ("filesrc location=" + at ("both.mkv") +
                     "! codedexposure-recorddemux name=demux ! fakesink "
                     "name=out");
  Said said;
  said.follow (pipeline, "out");
  const auto owned = top_of (pipeline, "out");
  gst_element_set_state (owned.get (), GST_STATE_PAUSED);
  gst_element_get_state (owned.get (), nullptr, nullptr, kPatience);
  gst_element_set_state (owned.get (), GST_STATE_PLAYING);
  for (int i = 0; i < kSeeks; i++)
    gst_element_seek (owned.get (), (i + 1) % GetParam () == 0 ? -1 : 1,
        GST_FORMAT_TIME, GST_SEEK_FLAG_ACCURATE, GST_SEEK_TYPE_SET,
        gint64 (i % 5 * kPeriod), GST_SEEK_TYPE_SET,
        gint64 (kFrames * kPeriod));
  ASSERT_EQ (pipeline.play (), "");
  EXPECT_EQ (said.lost.size (), 0u);
  for (const char *flaw : {"frames-unknown", "frames-missing"})
    EXPECT_EQ (counter_of (pipeline["demux"].get (), flaw), 0u) << flaw;
}

INSTANTIATE_TEST_SUITE_P (
    Backwards, RecordPairsSeeks, ::testing::Values (1, 2, 3));

TEST_F (RecordPairs, AFileThatIsCutOffHasThemUpToThere)
{
  Seen live, played;
  record (live);
  const std::string whole = bytes ("both.mkv");
  write ("cut.mkv", whole.substr (0, whole.size () / 2));
  play (played, "cut.mkv");
  ASSERT_GE (played.times.size (), kFrames / 3);
  ASSERT_LT (played.times.size (), kFrames);
  for (std::size_t i = 0; i + 1 < played.partners.size (); i++)
    EXPECT_TRUE (played.partners[i] == live.partners[i]) << i;
}

/* One bit of a partner's pixels. */
TEST_F (RecordPairs, APartnerThatIsDamagedIsNoneAndIsSaid)
{
  Seen live, played;
  record (live, "raw");
  std::string whole = bytes ("both.mkv");
  const auto place = whole.find (live.partners[6]);
  ASSERT_NE (place, whole.npos);
  whole[place + 100] = char (whole[place + 100] ^ 1);
  write ("bad.mkv", whole);
  Pipeline pipeline ("filesrc location=" + at ("bad.mkv") +
                     "! codedexposure-recorddemux ! fakesink name=out");
  played.follow (pipeline, "out");
  Said said;
  said.follow (pipeline, "out");
  ASSERT_EQ (pipeline.play (), "");
  EXPECT_EQ (played.alone (), std::set<std::size_t>{6});
  ASSERT_EQ (said.lost.size (), 1u);
  EXPECT_EQ (said.lost[0].reason, "damaged");
  EXPECT_EQ (said.lost[0].frames, guint64 (1));
  EXPECT_EQ (said.lost[0].from, 6 * kPeriod);
}

TEST_F (RecordPairs, FramesThatAreKeptHaveThem)
{
  std::string location = at ("kept");
  location.pop_back ();
  Pipeline pipeline (pairs () + "! codedexposure-keep name=keep location=" +
                     location + " ! fakesink name=live");
  Seen live, kept;
  live.follow (pipeline, "live");
  auto state = std::pair (pipeline["keep"].get (), 0);
  gst_pad_add_probe (
      pipeline.pad ("live", "sink").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *, GstPadProbeInfo *, gpointer data) {
        auto &[keep, frames] = *static_cast<decltype (state) *> (data);
        if (++frames == int (kFrames))
          g_object_set (keep, "keep", TRUE, nullptr);
        return GST_PAD_PROBE_OK;
      },
      &state, nullptr);
  ASSERT_EQ (pipeline.play (), "");
  gst_element_set_state (
      top_of (pipeline, "live").get (), GST_STATE_NULL); // it is written
  ASSERT_EQ (play (kept, "kept-frame000000.mkv"), "");
  EXPECT_EQ (kept.times.size (), kFrames);
  EXPECT_TRUE (kept.partners == live.partners);
}

/** Tags and partners, from the third frame on. */
struct LateCamera {
  int frames = 0;

  void join (GstPad *pad, GstPadProbeInfo *info)
  {
    if (++frames < 3)
      return;
    if (frames == 3)
      gst_pad_push_event (pad,
          setup_to_event (
              {.schedule = *Schedule::from_preset ("sequential:lattice:4/2"),
                  .partner = PartnerSetup{{64, 48}}}));
    GstBuffer *frame =
        gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
    const CapsPtr caps (gst_pad_get_current_caps (pad));
    set_partner (frame, {BufferPtr (gst_buffer_copy_deep (frame)),
                            CapsPtr (gst_caps_ref (caps.get ()))});
    info->data = frame;
  }
};

TEST_F (RecordPairs, ASecondCameraThatComesLaterIsSaidNotToBeRecorded)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=40 ! " + gray_caps (64, 48, "100/1") +
      " ! codedexposure-sim schedule=sequential:lattice:4/2 "
      "! identity name=camera ! codedexposure-recordmux name=recorder "
      "! fakesink");
  LateCamera camera;
  gst_pad_add_probe (
      pipeline.pad ("camera", "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *pad, GstPadProbeInfo *info, gpointer self) {
        static_cast<LateCamera *> (self)->join (pad, info);
        return GST_PAD_PROBE_OK;
      },
      &camera, nullptr);
  Said said;
  said.follow (pipeline, "camera");
  for (int run = 0; run < 2; run++) {
    camera = {};
    said = {};
    ASSERT_EQ (pipeline.play (), "");
    EXPECT_NE (said.warning.find ("The second camera came after the first "
                                  "frame"),
        std::string::npos)
        << run;
    EXPECT_EQ (camera.frames, 10);
    EXPECT_EQ (counter_of (pipeline["recorder"].get (), "frames-lost"), 8u);
    gst_element_set_state (top_of (pipeline, "camera").get (), GST_STATE_READY);
  }
}

} // namespace
