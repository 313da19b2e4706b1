/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The whole chain, with nothing but the light and the silicon in software: the
 * driver uploads masks to a DLPC900 on the USB, the camera sees the scene
 * through the mirrors that the board shows, aravissrc reads it over the
 * network, and what is split, recorded and decoded again is the scene. */
#include <cstdio>
#include <filesystem>
#include <map>

#include "camera_rig.h"
#include "dmd/dmd.h"
#include "emulated_dlpc900.h"
#include "linked_elements.h"
#include "optics/bench.h"
#include "own_network.h"
#include "usb_bed.h"

namespace
{

using namespace cexp;
using namespace cexp::test;

const auto *const linked =
    ::testing::AddGlobalTestEnvironment (new LinkedElements);

constexpr std::uint16_t kDlpc900 = 0xC900;
constexpr int kDlp5500 = 5;
constexpr const char *kSchedule = "sequential:2x2";
constexpr const char *kWithPilot = "sequential:2x2,pilot=16";
constexpr int kSlots = 4;
constexpr guint64 kFrames = 40;

/** What there is to see in a slot of a frame. */
std::uint8_t
scene_value (std::uint64_t frame, int slot, int x, int y)
{
  return std::uint8_t (
      scene_pixel (frame * kSlots + std::uint64_t (slot), x, y));
}

/** Camera and mirrors: the optical model exposes through the masks that the
 * board shows, and through none while it stands still. */
class Optics
{
public:
  explicit Optics (EmulatedDlpc900 &board, const char *schedule = kSchedule)
      : board_ (board), schedule_ (*Schedule::parse (schedule)),
        bench_ (*OpticalBench::make (kCameraWidth, kCameraHeight, {})),
        scene_ (kCameraWidth, kCameraHeight),
        coded_ (kCameraWidth, kCameraHeight)
  {
  }

  /** The DMD misses a trigger right before this frame of its first run. */
  std::int64_t slip_before = -1;
  /** Number of the frame that came after the slip, from the first one on. */
  std::int64_t slipped = -1;

  bool expose (std::uint64_t frame, ImageView<std::uint16_t> picture)
  {
    if (!board_.running ()) {
      shown_ = 0;
      return false;
    }
    if (masks_.empty ())
      find_masks ();
    if (slipped < 0 && shown_ == slip_before * kSlots) {
      slipped = std::int64_t (frame - first_);
      shown_--;
    }
    if (std::exchange (began_, true) == false)
      first_ = frame;
    bench_.begin (schedule_);
    for (int slot = 0; slot < kSlots; slot++) {
      for (int y = 0; y < kCameraHeight; y++)
        for (int x = 0; x < kCameraWidth; x++)
          scene_.at (x, y) = scene_value (frame, slot, x, y);
      const auto view = scene_.view ();
      const auto line = std::size_t (shown_++) % masks_.size ();
      bench_.expose (ImageView<const std::uint8_t> (view), masks_[line], 1.0);
    }
    bench_.read_out (frame, coded_.view ());
    for (int y = 0; y < kCameraHeight; y++)
      std::copy_n (coded_.view ().row (y), kCameraWidth, picture.row (y));
    return true;
  }

private:
  /* Which mask of the schedule each line of the board's table shows. */
  void find_masks ()
  {
    const int lines = int (board_.shown ().size ());
    for (int line = 0; line < lines; line++) {
      const auto shown = board_.mirrors (line);
      int found = -1;
      for (int mask = 0; mask < schedule_.masks (); mask++) {
        Image<std::uint8_t> expected (shown.width (), shown.height ());
        render_mask (schedule_, mask, expected.view ());
        if (shown == expected)
          found = mask;
      }
      masks_.push_back (found);
    }
  }

  EmulatedDlpc900 &board_;
  const Schedule schedule_;
  OpticalBench bench_;
  Image<std::uint8_t> scene_;
  Image<std::uint8_t> coded_;
  std::vector<int> masks_; // by line of the board's table
  std::int64_t shown_ = 0; // slots since the board began
  std::uint64_t first_ = 0;
  bool began_ = false;
};

/** Compares subframes with the scene, whichever frame of the camera was the
 * first. */
struct Subframes {
  std::map<guint64, int> of_frame;
  guint64 first_frame = 0;
  int wrong = 0;

  static bool differs (
      GstBuffer *buffer, const GstVideoInfo &info, guint64 frame, int slot)
  {
    MappedFrame mapped (info, buffer, GST_MAP_READ);
    const auto view = view_of<std::uint8_t> (mapped);
    for (int y = 0; y < view.height; y++)
      for (int x = 0; x < view.width; x++)
        if (view.at (x, y) !=
            scene_value (frame, slot, 2 * x + slot % 2, 2 * y + slot / 2))
          return true;
    return false;
  }
  void take (GstBuffer *buffer, const GstVideoInfo &info)
  {
    const FrameMeta meta = get_frame_meta (buffer).value_or (FrameMeta ());
    if (of_frame.empty ())
      while (first_frame < 1000 &&
             differs (buffer, info, first_frame, meta.subframe))
        first_frame++;
    of_frame[meta.frame]++;
    wrong += differs (buffer, info, first_frame + meta.frame, meta.subframe);
  }
};

TEST (Chain, WhatIsSplitRecordedAndDecodedIsTheScene)
{
  const std::string recording =
      std::filesystem::temp_directory_path () /
      ("chain-" + std::to_string (getpid ()) + ".mkv");
  UsbBed bed;
  const auto board = std::make_shared<EmulatedDlpc900> (kDlp5500);
  bed.plug ("1-2", kDlpc900, "LCR", board);
  Optics optics (*board);
  const auto camera = open_camera ({}, [&] (std::uint64_t frame, auto picture) {
    return optics.expose (frame, picture);
  });

  Subframes live;
  {
    CameraPipeline pipeline (
        camera_source (
            "25/1", "GRAY8", "num-buffers=" + std::to_string (kFrames)) +
            "dmdsync name=sync device=usb:1-2,guard=off "
            "timestamp-at=device-clock "
            "schedule=" +
            kSchedule +
            " ! codedexposure-demux name=demux demux.coded ! queue ! "
            "avenc_ffv1 ! matroskamux timecodescale=1000 ! filesink location=" +
            recording + " demux.src ! queue max-size-buffers=100 ! ",
        [&] (auto *buffer, auto &info) { live.take (buffer, info); });
    /* A window shows every subframe at its time, or late, but drops none. */
    const auto window = pipeline.element ("sink");
    g_object_set (
        window.get (), "sync", TRUE, "max-lateness", gint64 (-1), nullptr);
    pipeline.play ();
    EXPECT_EQ (pipeline.wait_end (), "end");
    EXPECT_TRUE (board->running ());
    pipeline.stop ();
    EXPECT_FALSE (board->running ());
  }
  EXPECT_EQ (live.of_frame.size (), kFrames);
  for (const auto &[frame, subframes] : live.of_frame)
    EXPECT_EQ (subframes, kSlots) << frame;
  EXPECT_EQ (live.wrong, 0);

  Subframes decoded;
  CameraPipeline decoder (
      "filesrc location=" + recording +
          " ! matroskademux ! avdec_ffv1 ! codedexposure-demux ! ",
      [&] (auto *buffer, auto &info) { decoded.take (buffer, info); });
  decoder.play ();
  EXPECT_EQ (decoder.wait_end (), "end");
  EXPECT_EQ (decoded.of_frame.size (), kFrames);
  EXPECT_EQ (decoded.wrong, 0);
  EXPECT_EQ (decoded.first_frame, live.first_frame);
  std::filesystem::remove (recording);
}

guint64
counter_of (const CameraPipeline &pipeline)
{
  return property<guint64> (pipeline.element ("sync").get (), "slips");
}

TEST (Chain, ASlipIsFoundWithinThreeFramesAndMended)
{
  UsbBed bed;
  const auto board = std::make_shared<EmulatedDlpc900> (kDlp5500);
  bed.plug ("1-2", kDlpc900, "LCR", board);
  Optics optics (*board, kWithPilot);
  optics.slip_before = 20;
  const auto camera = open_camera ({}, [&] (std::uint64_t frame, auto picture) {
    return optics.expose (frame, picture);
  });
  std::map<guint64, bool> locked;
  CameraPipeline pipeline (camera_source ("25/1", "GRAY8", "num-buffers=60") +
                               "dmdsync name=sync device=usb:1-2,guard=off "
                               "timestamp-at=device-clock "
                               "schedule=" +
                               kWithPilot + " ! ",
      [&] (GstBuffer *buffer, const GstVideoInfo &) {
        const auto meta = *get_frame_meta (buffer);
        locked[meta.frame] = meta.locked;
      });
  pipeline.play ();
  EXPECT_EQ (pipeline.wait_end (), "end");

  ASSERT_GE (optics.slipped, 0);
  const auto slip = guint64 (optics.slipped);
  const auto first_unlocked = std::find_if (locked.begin (), locked.end (),
      [] (const auto &frame) { return !frame.second; });
  ASSERT_NE (first_unlocked, locked.end ());
  EXPECT_GE (first_unlocked->first, slip);
  EXPECT_LT (first_unlocked->first, slip + 3);
  const auto mended = std::find_if (first_unlocked, locked.end (),
      [] (const auto &frame) { return frame.second; });
  ASSERT_NE (mended, locked.end ());
  EXPECT_EQ (counter_of (pipeline), 1u);
  EXPECT_TRUE (std::all_of (
      mended, locked.end (), [] (const auto &frame) { return frame.second; }));
  std::printf ("slip in frame %d, found in %d, locked again in %d\n",
      int (slip), int (first_unlocked->first), int (mended->first));
}

} // namespace

int
main (int argc, char **argv)
{
  const bool alone = enter_own_network ();
  gst_init (&argc, &argv);
  ::testing::InitGoogleTest (&argc, argv);
  if (!alone) {
    std::puts ("a network of its own is not allowed here: skipped");
    return 77;
  }
  const int result = RUN_ALL_TESTS ();
  gst_deinit ();
  return result;
}
