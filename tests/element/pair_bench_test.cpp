/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-pair between the other elements, on simulated benches with two
 * cameras. */
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <vector>

#include "common/messages.h"
#include "common/tag.h"
#include "fuse/fuser.h"
#include "fuse/partner_correction.h"
#include "mapping_error.h"
#include "pipeline.h"
#include "rectify/rectifier.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;

std::string
bench_of (const std::string &rest)
{
  return "videotestsrc num-buffers=40 pattern=ball "
         "! video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 "
         "! tee name=light "
         "light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 "
         "! pair.on "
         "light. ! queue ! codedexposure-sim "
         "schedule=sequential:lattice:4/2 beam=off ! pair.off "
         "codedexposure-pair name=pair ! " +
         rest;
}

TEST (PairBench, TwoSimulatedCamerasMakePairs)
{
  Pipeline pipeline (bench_of ("codedexposure-fuse ! fakesink"));
  EXPECT_EQ (pipeline.play (), "");
  const auto pair = pipeline["pair"];
  EXPECT_EQ (property<guint64> (pair.get (), "frames-paired"), 10u);
  EXPECT_EQ (property<guint64> (pair.get (), "frames-alone"), 0u);
  EXPECT_TRUE (std::isinf (property<double> (pair.get (), "drift-uncertainty")))
      << "after less than five seconds";
}

/* Two cameras as on a real bench: each loses frames of its own. */
TEST (PairBench, ComesBehindDmdsyncOfBothCameras)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=400 pattern=ball "
      "! video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 "
      "! tee name=light "
      "light. ! queue ! codedexposure-sim schedule=sequential:lattice:4/2 "
      "! identity name=on ! dmdsync schedule=sequential:lattice:4/2 ! pair.on "
      "light. ! queue ! codedexposure-sim beam=off "
      "schedule=sequential:lattice:4/2 ! identity name=off "
      "! dmdsync schedule=sequential:lattice:4/2 beam=off ! pair.off "
      "codedexposure-pair name=pair ! codedexposure-fuse ! fakesink");
  const auto lose = [&] (const char *camera, std::set<int> lost) {
    auto *losses = new std::pair<int, std::set<int>> (0, std::move (lost));
    gst_pad_add_probe (
        pipeline.pad (camera, "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *, gpointer data) {
          auto &[number, which] =
              *static_cast<std::pair<int, std::set<int>> *> (data);
          return which.contains (number++) ? GST_PAD_PROBE_DROP
                                           : GST_PAD_PROBE_OK;
        },
        losses,
        [] (gpointer data) {
          delete static_cast<std::pair<int, std::set<int>> *> (data);
        });
  };
  lose ("on", {20, 21, 60});
  lose ("off", {21, 22, 23, 80});
  EXPECT_EQ (pipeline.play (), "");
  const auto pair = pipeline["pair"];
  EXPECT_EQ (property<guint64> (pair.get (), "frames-paired"), 100u - 3u - 3u);
  EXPECT_EQ (property<guint64> (pair.get (), "frames-alone"), 3u);
  EXPECT_EQ (property<guint64> (pair.get (), "pairs-refused"), 0u);
  EXPECT_EQ (property<guint64> (pair.get (), "partners-dropped"), 2u);
}

/* Each camera has a recording of its own, and their first frames differ. */
TEST (PairBench, RecordingsOfBothCamerasMakeTheSamePairs)
{
  const std::string folder = ::testing::TempDir ();
  const std::string schedule = "schedule=sequential:lattice:4/2 ";
  const auto file = [&] (const std::string &name) {
    return "location=" + folder + "pair-" + name + " ";
  };
  const auto recorded = [&] (const std::string &camera) {
    return "! identity name=" + camera + " ! dmdsync " + schedule +
           (camera == "off" ? "beam=off " : "") + "! tee name=" + camera +
           "-tee ! queue ! pair." + camera + " " + camera +
           "-tee. ! queue ! codedexposure-recordmux ! filesink " +
           file (camera + ".mkv");
  };
  const std::string fused = "codedexposure-pair name=pair "
                            "! codedexposure-fuse ! filesink ";
  Pipeline recording (
      "videotestsrc num-buffers=160 pattern=ball "
      "! video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 "
      "! tee name=light light. ! queue ! codedexposure-sim " +
      schedule + recorded ("on") +
      "light. ! queue ! codedexposure-sim beam=off " + schedule +
      recorded ("off") + fused + file ("live.gray"));
  gst_pad_add_probe (
      recording.pad ("off", "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *, GstPadProbeInfo *info, gpointer) {
        return GST_BUFFER_PTS (GST_PAD_PROBE_INFO_BUFFER (info)) < 3 * kPeriod
                   ? GST_PAD_PROBE_DROP
                   : GST_PAD_PROBE_OK;
      },
      nullptr, nullptr);
  ASSERT_EQ (recording.play (), "");
  Pipeline playing (
      "filesrc " + file ("on.mkv") +
      "! codedexposure-recorddemux ! pair.on filesrc " + file ("off.mkv") +
      "! codedexposure-recorddemux ! pair.off " + fused + file ("played.gray"));
  ASSERT_EQ (playing.play (), "");
  for (Pipeline *pipeline : {&recording, &playing}) {
    const auto pair = (*pipeline)["pair"];
    EXPECT_EQ (property<guint64> (pair.get (), "frames-paired"), 37u);
    EXPECT_EQ (property<guint64> (pair.get (), "frames-alone"), 3u);
    EXPECT_EQ (property<guint64> (pair.get (), "pairs-refused"), 0u);
  }
  const auto bytes = [&] (const std::string &name) {
    std::ifstream in (folder + "pair-" + name, std::ios::binary);
    return std::string (std::istreambuf_iterator<char> (in), {});
  };
  EXPECT_EQ (bytes ("live.gray").size (), 160u * 64 * 48);
  EXPECT_TRUE (bytes ("live.gray") == bytes ("played.gray"));
  for (const char *name : {"on.mkv", "off.mkv", "live.gray", "played.gray"})
    std::remove ((folder + "pair-" + name).c_str ());
}

/** Messages when the second camera looks @p shift mirrors to the right. */
std::vector<PartnerDrifted>
drifts (double shift, double &measured)
{
  Pipeline pipeline (
      "videotestsrc num-buffers=640 pattern=smpte "
      "! video/x-raw,format=GRAY8,width=288,height=216,framerate=100/1 "
      "! tee name=light light. ! queue "
      "! codedexposure-sim schedule=sequential:lattice:4/2 ! pair.on "
      "light. ! queue ! codedexposure-sim beam=off "
      "schedule=sequential:lattice:4/2 shift-x=" +
      std::to_string (shift) +
      " ! pair.off codedexposure-pair name=pair ! fakesink");
  std::vector<PartnerDrifted> said;
  const ObjectPtr<GstBus> bus (gst_element_get_bus (
      GST_ELEMENT (GST_OBJECT_PARENT (pipeline["pair"].get ()))));
  gst_bus_set_sync_handler (
      bus.get (),
      [] (GstBus *, GstMessage *message, gpointer data) {
        if (const auto one = parse_message<PartnerDrifted> (message))
          static_cast<std::vector<PartnerDrifted> *> (data)->push_back (*one);
        return GST_BUS_PASS;
      },
      &said, nullptr);
  EXPECT_EQ (pipeline.play (), "");
  measured = property<double> (pipeline["pair"].get (), "drift-x");
  EXPECT_LT (
      property<double> (pipeline["pair"].get (), "drift-uncertainty"), 0.05);
  return said;
}

TEST (PairBench, ASecondCameraThatHasMovedIsSaid)
{
  double measured = 0.0;
  EXPECT_TRUE (drifts (0.03, measured).empty ());
  EXPECT_NEAR (measured, -0.03, 0.02);
  const auto said = drifts (0.25, measured);
  EXPECT_NEAR (measured, -0.25, 0.05);
  ASSERT_EQ (said.size (), 1u);
  EXPECT_TRUE (said[0].active);
  EXPECT_NEAR (said[0].x, -0.25, 0.05);
  EXPECT_NEAR (said[0].y, 0.0, 0.05);
  EXPECT_EQ (said[0].from, 4 * GST_SECOND);
}

TEST (PairBench, BothCamerasAreCalibratedInOneRun)
{
  constexpr Alignment kFirst{
      .shift_x = 0.4, .shift_y = -0.3, .rotation = 0.5, .scale = 1.01},
      kSecond{.shift_x = -0.2, .shift_y = 0.1, .rotation = -0.4, .scale = 0.99};
  const auto camera = [] (const std::string &beam, double gain,
                          const Alignment &stand) {
    return "light. ! queue ! codedexposure-sim dmd=sim:both-calib "
           "full-well=10000 read-noise=5 psf-sigma=0.5 beam=" +
           beam + " gain=" + std::to_string (gain) +
           " shift-x=" + std::to_string (stand.shift_x) +
           " shift-y=" + std::to_string (stand.shift_y) +
           " rotation=" + std::to_string (stand.rotation) +
           " scale=" + std::to_string (stand.scale) + " ! dmdsync " +
           (beam == "on" ? "device=sim:both-calib,size=256x192 "
                         : "beam=off ") +
           "! pair." + beam + " ";
  };
  Pipeline pipeline (
      "videotestsrc pattern=white "
      "! video/x-raw,format=GRAY8,width=256,height=192,framerate=100/1 "
      "! tee name=light " +
      camera ("on", 3.2, kFirst) + camera ("off", 0.8, kSecond) +
      "codedexposure-pair name=pair ! moirecalib name=calib mode=map frames=4 "
      "overlay=false ! codedexposure-fuse ! fakesink");
  /* How many frames it takes depends on how fast the DMD's thread is. */
  const auto calib = pipeline["calib"];
  g_signal_connect (calib.get (), "notify::mapping",
      G_CALLBACK (+[] (GObject *mapped, GParamSpec *, gpointer) {
        gst_element_send_event (
            GST_ELEMENT (GST_OBJECT_PARENT (mapped)), gst_event_new_eos ());
      }),
      nullptr);
  ASSERT_EQ (pipeline.play (), "");
  const auto first =
      Mapping::from_json (text_property (calib.get (), "mapping"));
  ASSERT_TRUE (first) << first.error ().message;
  EXPECT_LT (worst_error (*first, kFirst), 1e-3);
  const auto second =
      Mapping::from_json (text_property (calib.get (), "second-mapping"));
  ASSERT_TRUE (second) << second.error ().message;
  EXPECT_LT (worst_error (*second, kSecond), 2e-3);
  /* What goes on has both. */
  const EventPtr tag (gst_pad_get_sticky_event (
      pipeline.pad ("calib", "src").get (), GST_EVENT_TAG, 0));
  ASSERT_TRUE (tag);
  const auto setup = setup_from_tags (tags_of (tag.get ()));
  ASSERT_TRUE (setup && *setup && setup->value ().partner);
  EXPECT_EQ (setup->value ().partner->mapping->to_json (), second->to_json ());
  EXPECT_EQ (setup->value ().mapping->to_json (), first->to_json ());
}

constexpr Extent kSize{64, 48};

/** How the frames of two cameras are made. */
struct Cameras {
  std::string first = {}; ///< options of the first one
  bool paired = true;     ///< there is a second one
  double right = 0.5;     ///< mirrors that it stands aside; and half a one down
  bool noise = false;     ///< its profile has it
  std::optional<Offset> spot = {}; ///< a pixel that is saturated in its frames
};

/** The bench profile of the second one. */
std::string
bench_of_second (const Cameras &cameras)
{
  BenchProfile first, second;
  second.camera.size = first.camera.size = kSize;
  Mapping::Parts parts{kSize, kSize,
      camera_to_mirrors ({.shift_x = cameras.right, .shift_y = 0.5},
          kSize.width, kSize.height)};
  second.mapping = Mapping::make (parts).value ();
  if (cameras.noise) {
    second.conversion_gain = Measured{20.0, 0.1};
    second.read_noise = Measured{7.0, 0.1};
  }
  first.second = {second};
  return first.to_json ();
}

constexpr const char *kScene =
    "videotestsrc num-buffers=16 pattern=smpte horizontal-speed=3 "
    "! video/x-raw,format=GRAY8,width=64,height=48,framerate=100/1 ";

std::vector<std::uint8_t>
bytes_of (Pipeline &pipeline, const std::string &path)
{
  EXPECT_EQ (pipeline.play (), "");
  std::ifstream in (path, std::ios::binary);
  const std::vector<std::uint8_t> pixels (
      std::istreambuf_iterator<char> (in), {});
  std::remove (path.c_str ());
  return pixels;
}

constexpr const char *kLattice = "schedule=sequential:lattice:4/2 ";

std::string
sim_of_second (const Cameras &cameras)
{
  return "codedexposure-sim beam=off gain=0.8 shift-y=0.5 shift-x=" +
         std::to_string (cameras.right) + " " + kLattice;
}

/** Pixels that @p element makes of them. */
std::vector<std::uint8_t>
made_by (const std::string &element, const Cameras &cameras = {})
{
  const std::string path = ::testing::TempDir () + "pair-made.gray";
  const std::string second =
      "light. ! queue ! " + sim_of_second (cameras) +
      "! identity name=off ! dmdsync name=sync beam=off " + kLattice +
      "! pair.off ";
  Pipeline pipeline (
      kScene +
      ("! tee name=light light. ! queue ! codedexposure-sim " + cameras.first +
          " " + kLattice) +
      "! dmdsync " + kLattice +
      (cameras.paired ? "! pair.on " + second + "codedexposure-pair name=pair"
                      : "") +
      " ! " + element + " ! filesink location=" + path);
  if (cameras.paired)
    g_object_set (pipeline["sync"].get (), "bench",
        bench_of_second (cameras).c_str (), nullptr);
  if (cameras.spot)
    gst_pad_add_probe (
        pipeline.pad ("off", "src").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *info, gpointer data) {
          const Offset &at = *static_cast<const Offset *> (data);
          GstBuffer *frame =
              gst_buffer_make_writable (GST_PAD_PROBE_INFO_BUFFER (info));
          gst_buffer_memset (frame, gsize (at.y * kSize.width + at.x), 255, 1);
          info->data = frame;
          return GST_PAD_PROBE_OK;
        },
        const_cast<Offset *> (&*cameras.spot), nullptr);
  return bytes_of (pipeline, path);
}

/** Mean squared error of what @p element makes of them where both see. */
double
error_of (const std::string &element, const Cameras &cameras)
{
  constexpr int kBorder = 8;
  const std::string path = ::testing::TempDir () + "pair-truth.gray";
  Pipeline scene (kScene + ("! filesink location=" + path));
  const auto truth = bytes_of (scene, path);
  const auto fused = made_by (element, cameras);
  EXPECT_EQ (fused.size (), truth.size ());
  double squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i < truth.size (); i++) {
    const int x = int (i) % 64, y = int (i) / 64 % 48;
    if (x < kBorder || x >= 64 - kBorder || y < kBorder || y >= 48 - kBorder)
      continue;
    squares += std::pow (double (fused[i]) - double (truth[i]), 2);
    count += 1.0;
  }
  return squares / count;
}

/* What the first camera tells of the mirrors between its pixels counts. */
TEST (PairBench, ASecondCameraBetweenTheMirrorsHelpsAsWell)
{
  EXPECT_LT (error_of ("codedexposure-fuse", {}),
      0.85 * error_of ("codedexposure-fuse", {.paired = false}));
}

/* As the library has it, with the errors that resampling makes. */
TEST (PairBench, TheUncertaintyHasTheErrorsOfASecondCamera)
{
  const auto [width, height] = kSize;
  const auto bytes = made_by ("codedexposure-fuse name=fuse fuse. ! queue ! "
                              "fakesink fuse.uncertainty ! queue");
  auto first = made_by ("identity", {.paired = false});
  const std::string path = ::testing::TempDir () + "pair-second.gray";
  Pipeline beam (
      kScene + ("! " + sim_of_second ({}) + "! filesink location=") + path);
  auto second = bytes_of (beam, path);
  const std::size_t size = std::size_t (width * height);
  ASSERT_EQ (bytes.size (), 2 * 16 * size);
  ASSERT_EQ (first.size (), 4 * size);
  ASSERT_EQ (second.size (), first.size ());

  const auto schedule =
      Schedule::from_preset ("sequential:lattice:4/2").value ();
  FuseOptions options;
  options.partner = true;
  options.partner_noise.emplace ();
  const auto profile = BenchProfile::from_json (bench_of_second ({})).value ();
  const Rectifier rectifier = Rectifier::make (*profile.second.front ().mapping,
      *schedule.complement (), {.keep_unknown = true, .correct = true})
                                  .value ();
  auto correction =
      PartnerCorrection<std::uint8_t>::make (schedule, rectifier, options)
          .value ();
  auto fuser =
      Fuser<std::uint8_t>::make (schedule, width, height, options).value ();
  std::vector<Image<std::uint8_t>> fused (
      4, Image<std::uint8_t> (width, height));
  std::vector<Image<std::uint16_t>> deviations (
      4, Image<std::uint16_t> (width, height));
  Image<std::uint8_t> partner (width, height);
  Image<float> errors (width, height);
  std::vector<std::uint16_t> expected;
  for (std::size_t at = 0; at < first.size (); at += size) {
    const ImageView<const std::uint8_t> coded{
        first.data () + at, width, height, width};
    const ImageView<const std::uint8_t> other{
        second.data () + at, width, height, width};
    ASSERT_TRUE (rectifier.run (other, partner.view (), 0, errors.view ()));
    ASSERT_TRUE (correction.run (coded, partner.view (), errors.view ()));
    ASSERT_TRUE (fuser.take (
        coded, std::as_const (partner).view (), {.partner = errors.view ()}));
    ASSERT_TRUE (fuser.fuse (views_of (fused), {}, views_of (deviations)));
    for (const auto &image : deviations)
      for (int y = 0; y < height; y++)
        expected.insert (expected.end (), image.view ().row (y),
            image.view ().row (y) + width);
  }
  for (std::size_t i = 0; i < expected.size (); i++)
    ASSERT_EQ (bytes[2 * i] + 256 * bytes[2 * i + 1], expected[i]) << i;
}

/* Half of the first camera's range is white of the scene. */
TEST (PairBench, WhatSaturatesTheFirstCameraIsSeenByTheSecond)
{
  const Cameras cameras{.first = "gain=8", .right = 0.0};
  const double both = error_of ("codedexposure-fuse range=2", cameras);
  Cameras one = cameras;
  one.paired = false;
  EXPECT_LT (both, 0.5 * error_of ("codedexposure-fuse range=2", one));
}

/* 20 e-/DN, and three slots make white: 20 * 255 * 4 / 3 electrons. */
TEST (PairBench, TheNoiseOfASecondCameraComesWithItsProfile)
{
  const auto profiled = made_by ("codedexposure-fuse", {.noise = true});
  EXPECT_EQ (profiled, made_by ("codedexposure-fuse second-full-well=6800 "
                                "second-read-noise=7"));
  EXPECT_NE (profiled, made_by ("codedexposure-fuse"));
}

/* Its light is spread over several mirrors, none of which is saturated then.
 * The sum has it as it is. */
TEST (PairBench, ASaturatedPixelOfASecondCameraWithAMappingIsNoticed)
{
  constexpr Offset kSpot{20, 24};
  constexpr int kReach = 16;
  const auto alone = made_by ("codedexposure-fuse", {.paired = false});
  const auto both = made_by ("codedexposure-fuse");
  const auto spotted = made_by ("codedexposure-fuse", {.spot = kSpot});
  ASSERT_EQ (alone.size (), 16u * 64 * 48);
  ASSERT_EQ (both.size (), alone.size ());
  ASSERT_EQ (spotted.size (), alone.size ());
  int paired = 0;
  for (std::size_t i = 0; i < alone.size (); i++) {
    const int x = int (i) % 64, y = int (i) / 64 % 48;
    if (std::abs (x - kSpot.x) <= kReach && std::abs (y - kSpot.y) <= kReach) {
      ASSERT_EQ (spotted[i], alone[i]) << x << ' ' << y;
      paired += both[i] != alone[i];
    }
  }
  EXPECT_GT (paired, 0);
  const auto sum = made_by ("codedexposure-sum");
  const auto with_spot = made_by ("codedexposure-sum", {.spot = kSpot});
  ASSERT_EQ (sum.size (), 4u * 64 * 48);
  ASSERT_EQ (with_spot.size (), sum.size ());
  int white = 0;
  for (std::size_t i = 0; i < sum.size (); i++)
    white += with_spot[i] == 255 && sum[i] < 255;
  EXPECT_LE (white, 4 * 2) << "of four frames";
}

/* It stands so far to the right that 13 columns of mirrors are outside its
 * frames. */
TEST (PairBench, WhatASecondCameraDoesNotSeeIsThatOfTheFirst)
{
  constexpr int kUnseen = 13, kReach = 16;
  const auto alone = made_by ("codedexposure-fuse", {.paired = false});
  const auto both = made_by ("codedexposure-fuse", {.right = 12.5});
  ASSERT_EQ (both.size (), alone.size ());
  int paired = 0;
  for (std::size_t i = 0; i < alone.size (); i++) {
    if (i % 64 < kUnseen + kReach)
      ASSERT_EQ (both[i], alone[i]) << i % 64 << ' ' << i / 64 % 48;
    else
      paired += both[i] != alone[i];
  }
  EXPECT_GT (paired, 0);
  const auto whole = made_by ("codedexposure-sum");
  const auto part = made_by ("codedexposure-sum", {.right = 12.5});
  ASSERT_EQ (part.size (), whole.size ());
  double difference = 0.0;
  for (std::size_t i = 0; i < part.size (); i++) {
    if (i % 64 < kUnseen)
      ASSERT_EQ (part[i], 0);
    else
      difference += std::abs (part[i] - whole[i]);
  }
  EXPECT_LT (difference / double (part.size ()), 2.0);
}

TEST (PairBench, TheFramesOfTheOtherBeamAreNotDecoded)
{
  Pipeline pipeline ("videotestsrc num-buffers=4 "
                     "! video/x-raw,format=GRAY8,framerate=100/1 "
                     "! codedexposure-sim beam=off ! codedexposure-demux "
                     "! fakesink");
  EXPECT_EQ (pipeline.play (),
      "These are frames of the beam of the mirrors that are off, partners of "
      "those of another camera. Link them to the pad off of "
      "codedexposure-pair, and the others to its pad on, or use "
      "\"codedexposure decode FIRST.mkv --fuse QUALITY --second "
      "SECOND.mkv\", whose SECOND.mkv has the beam of the mirrors that are "
      "off.");
}

} // namespace
