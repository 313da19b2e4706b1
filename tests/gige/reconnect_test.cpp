/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Cameras that stop, are killed and come back in the middle of a run. */
#include <condition_variable>
#include <mutex>

#include "camera_process.h"
#include "camera_rig.h"
#include "dmd/simulated_dmd.h"

namespace
{

using namespace cexp;
using namespace cexp::test;

constexpr const char *kSchedule = "sequential:2x2,pilot=16";
constexpr GstClockTime kPeriod = 10 * GST_MSECOND;

/** A run of a camera at 100 frames a second; notes what came. */
class Reconnect : public ::testing::Test
{
protected:
  struct Came {
    guint64 number;
    GstClockTime pts;
    bool discont;
    FrameMeta meta;
  };

  /** @p behind  what stands behind dmdsync. */
  void play (int tries, const std::string &behind = "")
  {
    pipeline.emplace (
        camera_source () +
            "dmdsync name=sync device=sim:reconnect schedule=" + kSchedule +
            " timestamp-at=device-clock reconnect=" + std::to_string (tries) +
            " ! " + behind,
        [this] (GstBuffer *buffer, const GstVideoInfo &) {
          const std::lock_guard guard (lock);
          came.push_back ({GST_BUFFER_OFFSET (buffer), GST_BUFFER_PTS (buffer),
              GST_BUFFER_IS_DISCONT (buffer), *get_frame_meta (buffer)});
          more.notify_all ();
        });
    pipeline->play ();
  }
  /** Waits for @p count frames from now on, a minute at most. */
  bool wait_frames (std::size_t count)
  {
    std::unique_lock guard (lock);
    const std::size_t wanted = came.size () + count;
    return more.wait_for (guard, std::chrono::minutes (1),
        [&] { return came.size () >= wanted; });
  }
  /** The message of that name, for which it waits. */
  StructurePtr wait_said (const char *name)
  {
    while (const MessagePtr message = pipeline->wait (GST_MESSAGE_ELEMENT))
      if (gst_message_has_name (message.get (), name))
        return StructurePtr (
            gst_structure_copy (gst_message_get_structure (message.get ())));
    ADD_FAILURE () << name << " was never said";
    return nullptr;
  }
  guint64 counter (const char *name)
  {
    const StructurePtr stats (
        property<GstStructure *> (pipeline->element ("sync").get (), "stats"));
    guint64 value = G_MAXUINT64;
    EXPECT_TRUE (gst_structure_get_uint64 (stats.get (), name, &value)) << name;
    return value;
  }

  std::mutex lock;
  std::condition_variable more;
  std::vector<Came> came;
  std::optional<CameraPipeline> pipeline;
};

TEST_F (Reconnect, AKilledCameraThatComesBackIsLockedWithinTenFrames)
{
  std::optional<CameraProcess> camera;
  camera.emplace (kSchedule);
  play (10);
  ASSERT_TRUE (wait_frames (30));
  camera.reset ();
  camera.emplace (kSchedule);
  const StructurePtr lost = wait_said ("dmdsync/camera-lost");
  ASSERT_TRUE (lost);
  EXPECT_NE (gst_structure_get_string (lost.get (), "reason"), nullptr);
  const StructurePtr back = wait_said ("dmdsync/camera-back");
  ASSERT_TRUE (back);
  ASSERT_TRUE (wait_frames (30));
  const auto mirrors = SimulatedMirrors::find ("reconnect");
  EXPECT_TRUE (mirrors->running ());
  pipeline->stop ();
  EXPECT_FALSE (mirrors->running ());

  guint64 first = 0;
  guint64 missing = 0;
  EXPECT_TRUE (gst_structure_get_uint64 (back.get (), "frame", &first));
  EXPECT_TRUE (gst_structure_get_uint64 (back.get (), "lost", &missing));
  EXPECT_GE (missing, 100u) << "silent for two seconds at least";
  EXPECT_EQ (counter ("reconnects"), 1u);
  EXPECT_EQ (counter ("slips"), 0u);
  const auto found = std::find_if (came.begin (), came.end (),
      [first] (const Came &frame) { return frame.number == first; });
  ASSERT_NE (found, came.end ());
  ASSERT_NE (found, came.begin ());
  EXPECT_TRUE (found->discont);
  EXPECT_EQ (found->meta.lost_before, missing);
  const Came &last = *(found - 1);
  EXPECT_EQ (first, last.number + missing + 1);
  EXPECT_EQ ((found->pts - last.pts + kPeriod / 2) / kPeriod, missing + 1);
  const auto locked = std::find_if (
      found, came.end (), [] (const Came &frame) { return frame.meta.locked; });
  EXPECT_LT (locked - found, 10);
  EXPECT_TRUE (std::all_of (locked, came.end (),
      [] (const Came &frame) { return frame.meta.locked; }));
  std::printf ("%d frames lost, locked again in frame %d after them\n",
      int (missing), int (locked - found));
}

TEST_F (Reconnect, ACameraThatStaysSilentIsOneErrorAfterTheTries)
{
  CameraProcess camera (kSchedule);
  play (1);
  ASSERT_TRUE (wait_frames (10));
  camera.type ("stop@now");
  ASSERT_TRUE (wait_said ("dmdsync/camera-lost"));
  const std::string error = pipeline->wait_end ();
  EXPECT_NE (error.find ("did not come back after 1 tries"), error.npos)
      << error;
  EXPECT_EQ (pipeline->wait_end (), "end") << "files are finished after it";
  pipeline->stop ();
}

TEST_F (Reconnect, ARunThatIsStoppedWhileTheCameraIsGoneEnds)
{
  CameraProcess camera (kSchedule);
  play (1000);
  ASSERT_TRUE (wait_frames (10));
  camera.type ("stop@now");
  ASSERT_TRUE (wait_said ("dmdsync/camera-lost"));
  pipeline->stop ();
  EXPECT_FALSE (SimulatedMirrors::find ("reconnect")->running ());
}

TEST_F (Reconnect, WhatFailsBehindItIsAnErrorAtOnce)
{
  CameraProcess camera (kSchedule);
  play (1000, "identity error-after=20 ! ");
  const std::string error = pipeline->wait_end ();
  EXPECT_NE (error.find ("Failed after iterations"), error.npos) << error;
  EXPECT_EQ (counter ("reconnects"), 0u);
  EXPECT_EQ (came.size (), 19u);
  pipeline->stop ();
}

/* aravissrc takes ten seconds to let go of a camera that does not answer. */
TEST_F (Reconnect, DISABLED_ARunThatIsStoppedWhileTheCameraIsDeadEnds)
{
  CameraProcess camera (kSchedule);
  play (1000);
  ASSERT_TRUE (wait_frames (10));
  camera.end (SIGKILL);
  ASSERT_TRUE (wait_said ("dmdsync/camera-lost"));
  pipeline->stop ();
  EXPECT_FALSE (SimulatedMirrors::find ("reconnect")->running ());
}

TEST_F (Reconnect, DISABLED_ADeadCameraIsOneErrorAfterTheTries)
{
  CameraProcess camera (kSchedule);
  play (2);
  ASSERT_TRUE (wait_frames (10));
  camera.end (SIGKILL);
  const std::string error = pipeline->wait_end ();
  EXPECT_NE (error.find ("did not come back after 2 tries"), error.npos)
      << error;
  EXPECT_EQ (pipeline->wait_end (), "end");
  pipeline->stop ();
}

TEST_F (Reconnect, DISABLED_ADeadCameraComesBackWithinItsTries)
{
  std::optional<CameraProcess> camera;
  camera.emplace (kSchedule);
  play (100);
  ASSERT_TRUE (wait_frames (10));
  camera.reset ();
  ASSERT_TRUE (wait_said ("dmdsync/camera-lost"));
  camera.emplace (kSchedule);
  ASSERT_TRUE (wait_said ("dmdsync/camera-back"));
  ASSERT_TRUE (wait_frames (10));
  pipeline->stop ();
  EXPECT_TRUE (came.back ().meta.locked);
}

TEST_F (Reconnect, DISABLED_WithoutItADeadCameraIsAnErrorAndACleanStop)
{
  CameraProcess camera (kSchedule);
  play (0);
  ASSERT_TRUE (wait_frames (10));
  camera.end (SIGKILL);
  const std::string error = pipeline->wait_end ();
  EXPECT_NE (error.find ("data stream error"), error.npos) << error;
  pipeline->stop ();
  EXPECT_FALSE (SimulatedMirrors::find ("reconnect")->running ());
}

} // namespace
