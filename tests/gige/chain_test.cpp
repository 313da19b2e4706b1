/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The whole chain, with nothing but the light and the silicon in software: the
 * driver uploads masks to a DLPC900 on the USB, the camera sees the scene
 * through the mirrors that the board shows, aravissrc reads it over the
 * network, and what is split, recorded and decoded again is the scene. */
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <map>

#include "bench/bench.h"
#include "camera_rig.h"
#include "dmd/dmd.h"
#include "emulation/dlpc900.h"
#include "mirrors.h"
#include "screen.h"
#include "emulation/usb_bed.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::emulated;

constexpr std::uint16_t kDlpc900 = 0xC900;
constexpr int kDlp5500 = 5;
/* The mirrors that the camera sees; the others would only take time to send. */
const std::string kDevice =
    "usb:1-2,guard=off,region=" + std::to_string (kCameraWidth) + "x" +
    std::to_string (kCameraHeight) + "+0+0 ";
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
  /** The scene stands as it is in frame 0. */
  bool still = false;

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
          scene_.at (x, y) = scene_value (still ? 0 : frame, slot, x, y);
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
      for (int mask = 0; mask < schedule_.masks (); mask++)
        if (shows (shown, mask))
          found = mask;
      masks_.push_back (found);
    }
  }

  /* Whether the mirrors that the camera sees are those of @p mask. */
  bool shows (const Image<std::uint8_t> &mirrors, int mask) const
  {
    Image<std::uint8_t> expected (kCameraWidth, kCameraHeight);
    expected_mask (schedule_, mask, expected.view ());
    for (int y = 0; y < kCameraHeight; y++)
      if (!std::equal (expected.view ().row (y),
              expected.view ().row (y) + kCameraWidth, mirrors.view ().row (y)))
        return false;
    return true;
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
 * first, and whether it came or was exposed before the stream's time 0. */
struct Subframes {
  std::map<guint64, int> of_frame;
  guint64 first_frame = 0; // of the camera, that is number 0
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
             differs (buffer, info, first_frame + meta.frame, meta.subframe))
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
  guint64 early = 0;
  {
    CameraPipeline pipeline (
        camera_source (
            "25/1", "GRAY8", "num-buffers=" + std::to_string (kFrames)) +
            "dmdsync name=sync device=" + kDevice +
            "timestamp-at=device-clock schedule=" + kSchedule +
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
    early = counter (pipeline, "frames-early");
    EXPECT_TRUE (board->running ());
    pipeline.stop ();
    EXPECT_FALSE (board->running ());
  }
  EXPECT_EQ (live.of_frame.size () + early, kFrames);
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
  EXPECT_EQ (decoded.of_frame.size (), live.of_frame.size ());
  EXPECT_EQ (decoded.wrong, 0);
  EXPECT_EQ (decoded.first_frame + decoded.of_frame.begin ()->first,
      live.first_frame + live.of_frame.begin ()->first);
  std::filesystem::remove (recording);
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
  CameraPipeline pipeline (
      camera_source ("25/1", "GRAY8", "num-buffers=60") +
          "dmdsync name=sync device=" + kDevice +
          "timestamp-at=device-clock schedule=" + kWithPilot + " ! ",
      [&] (GstBuffer *buffer, const GstVideoInfo &) {
        const auto meta = *get_frame_meta (buffer);
        locked[meta.frame] = meta.locked == true;
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
  EXPECT_EQ (counter (pipeline, "slips"), 1u);
  EXPECT_TRUE (std::all_of (
      mended, locked.end (), [] (const auto &frame) { return frame.second; }));
  std::printf ("slip in frame %d, found in %d, locked again in %d\n",
      int (slip), int (first_unlocked->first), int (mended->first));
}

/** Where @p picture is one of the four subframes of the still scene: which;
 * else -1. */
int
subframe_shown (const Image<int> &picture)
{
  for (int slot = 0; slot < kSlots; slot++) {
    bool same = true;
    for (int y = 0; y < picture.height () && same; y++)
      for (int x = 0; x < picture.width () && same; x++)
        same = picture.at (x, y) ==
               scene_value (0, slot, 2 * x + slot % 2, 2 * y + slot / 2);
    if (same)
      return slot;
  }
  return -1;
}

TEST (Chain, TheWindowShowsTheScene)
{
  const Screen screen;
  if (!screen.there ())
    GTEST_SKIP () << "there is no Xvfb";
  UsbBed bed;
  const auto board = std::make_shared<EmulatedDlpc900> (kDlp5500);
  bed.plug ("1-2", kDlpc900, "LCR", board);
  Optics optics (*board);
  optics.still = true;
  std::atomic<int> frames = 0;
  const auto camera = open_camera ({}, [&] (std::uint64_t frame, auto picture) {
    return optics.expose (frame, picture);
  });
  CameraPipeline pipeline (
      camera_source ("25/1") + "dmdsync device=" + kDevice +
          "timestamp-at=device-clock schedule=" + kSchedule +
          " ! codedexposure-demux ! tee name=both both. ! "
          "queue leaky=downstream max-size-buffers=8 ! videoconvert ! "
          "ximagesink both. ! queue ! ",
      [&] (auto *, auto &) { frames++; });
  pipeline.play ();
  /* Every subframe is on the screen for 10 ms of 40. */
  std::map<int, int> shown;
  while (frames < kSlots * 1500 && shown.size () < kSlots)
    if (const int slot = subframe_shown (
            screen.photograph (kCameraWidth / 2, kCameraHeight / 2));
        slot >= 0)
      shown[slot]++;
  EXPECT_EQ (shown.size (), std::size_t (kSlots))
      << "photographs of each subframe";
  pipeline.stop ();
}

TEST (Chain, ACameraThatComesBackFindsTheMasksInPhase)
{
  UsbBed bed;
  const auto board = std::make_shared<EmulatedDlpc900> (kDlp5500);
  bed.plug ("1-2", kDlpc900, "LCR", board);
  Optics optics (*board, kWithPilot);
  const auto open = [&] {
    return open_camera ({}, [&] (std::uint64_t frame, auto picture) {
      return optics.expose (frame, picture);
    });
  };
  auto camera = open ();
  std::vector<FrameMeta> came;
  std::atomic<int> frames = 0;
  CameraPipeline pipeline (
      camera_bin ("25/1", "GRAY8", "num-buffers=40 reconnect=10") +
          "dmdsync name=sync device=" + kDevice +
          "timestamp-at=device-clock schedule=" + kWithPilot + " ! ",
      [&] (GstBuffer *buffer, const GstVideoInfo &) {
        came.push_back (*get_frame_meta (buffer));
        frames++;
      });
  pipeline.play ();
  while (frames < 8)
    ASSERT_FALSE (pipeline.has_failed (GST_MSECOND));
  const auto told = board->messages ();
  camera.reset ();
  camera = open ();
  EXPECT_EQ (pipeline.wait_end (), "end");
  EXPECT_TRUE (board->running ());
  EXPECT_EQ (board->messages (), told) << "the masks went on by themselves";

  const auto back = std::find_if (came.begin (), came.end (),
      [] (const FrameMeta &meta) { return meta.lost_before > 25; });
  ASSERT_NE (back, came.end ());
  EXPECT_GT (came.end () - back, 20);
  const auto locked = std::find_if (back, came.end (),
      [] (const FrameMeta &meta) { return meta.locked == true; });
  EXPECT_LT (locked - back, 10);
  EXPECT_TRUE (std::all_of (locked, came.end (),
      [] (const FrameMeta &meta) { return meta.locked == true; }));
  std::printf ("away for %d frames, locked again in frame %d after them\n",
      int (back->lost_before), int (locked - back));
}

} // namespace
