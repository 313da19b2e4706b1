/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Cameras that stop, are killed and come back in the middle of a run. */
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "camera_process.h"
#include "camera_rig.h"
#include "dmd/simulated_dmd.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::test;

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

  static std::string camera (int tries)
  {
    return camera_bin ("100/1", "GRAY8", "reconnect=" + std::to_string (tries));
  }
  static std::string sync ()
  {
    return std::string ("dmdsync name=sync device=sim:reconnect schedule=") +
           kSchedule + " timestamp-at=device-clock ";
  }
  /** @p behind  what stands behind dmdsync. */
  void play (int tries, const std::string &behind = "")
  {
    play_line (
        camera_bin ("100/1", "GRAY8", "reconnect=" + std::to_string (tries)) +
        sync () + "! " + behind);
  }
  void play_line (const std::string &line)
  {
    pipeline.emplace (line, [this] (GstBuffer *buffer, const GstVideoInfo &) {
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
  guint reconnects ()
  {
    return property<guint> (pipeline->element ("camera").get (), "reconnects");
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
  const StructurePtr lost = wait_said ("codedexposure/camera-lost");
  ASSERT_TRUE (lost);
  EXPECT_NE (gst_structure_get_string (lost.get (), "reason"), nullptr);
  const StructurePtr back = wait_said ("codedexposure/camera-back");
  ASSERT_TRUE (back);
  ASSERT_TRUE (wait_frames (30));
  const auto mirrors = SimulatedMirrors::find ("reconnect");
  EXPECT_TRUE (mirrors->running ());
  pipeline->stop ();
  EXPECT_FALSE (mirrors->running ());

  GstClockTime silent = 0;
  guint tries = 0;
  EXPECT_TRUE (gst_structure_get_uint64 (back.get (), "silent", &silent));
  EXPECT_TRUE (gst_structure_get_uint (back.get (), "tries", &tries));
  EXPECT_GT (tries, 0u);
  EXPECT_EQ (reconnects (), 1u);
  EXPECT_EQ (counter ("slips"), 0u);
  const auto found = std::find_if (came.begin (), came.end (),
      [] (const Came &frame) { return frame.meta.lost_before >= 100; });
  ASSERT_NE (found, came.end ()) << "silent for two seconds at least";
  ASSERT_NE (found, came.begin ());
  EXPECT_TRUE (found->discont);
  const guint64 first = found->number;
  const guint64 missing = found->meta.lost_before;
  EXPECT_GE (silent, 100 * kPeriod);
  EXPECT_EQ (counter ("frames-lost"), missing);
  const Came &last = *(found - 1);
  EXPECT_EQ (first, last.number + missing + 1);
  EXPECT_EQ ((found->pts - last.pts + kPeriod / 2) / kPeriod, missing + 1);
  const auto locked = std::find_if (found, came.end (),
      [] (const Came &frame) { return frame.meta.locked == true; });
  EXPECT_LT (locked - found, 10);
  EXPECT_TRUE (std::all_of (locked, came.end (),
      [] (const Came &frame) { return frame.meta.locked == true; }));
  std::printf ("%d frames lost, locked again in frame %d after them\n",
      int (missing), int (locked - found));
}

namespace
{

/** Stops this process for @p time, as Ctrl-Z does: a child of it lets it go on.
 */
void
stop_process (std::chrono::microseconds time)
{
  const pid_t test = getpid ();
  const pid_t child = fork ();
  if (child == 0) {
    kill (test, SIGSTOP);
    usleep (useconds_t (time.count ()));
    kill (test, SIGCONT);
    _exit (0);
  }
  waitpid (child, nullptr, 0);
}

} // namespace

TEST_F (Reconnect, AProcessThatWasStoppedGoesOnAndBlamesNoCamera)
{
  CameraProcess camera (kSchedule);
  play (0);
  ASSERT_TRUE (wait_frames (10));
  stop_process (std::chrono::seconds (3));
  const StructurePtr lost = wait_said ("codedexposure/camera-lost");
  ASSERT_TRUE (lost);
  const std::string reason = gst_structure_get_string (lost.get (), "reason");
  EXPECT_NE (reason.find ("this process was stopped for 3."), reason.npos)
      << reason;
  ASSERT_TRUE (wait_said ("codedexposure/camera-back"));
  ASSERT_TRUE (wait_frames (30));
  pipeline->stop ();
  EXPECT_GE (counter ("frames-lost"), 200u);
}

/* For longer than the camera is waited for. */
TEST_F (Reconnect, ACameraThatGetsNoTriggerWhileTheDmdGetsAMaskIsWaitedFor)
{
  CameraProcess camera (kSchedule);
  play_line (camera_bin ("100/1", "GRAY8", "") +
             "dmdsync name=sync device=sim:masks,triggers=yes,mask-time=500ms "
             "schedule=" +
             kSchedule + " timestamp-at=device-clock ! ");
  ASSERT_TRUE (wait_frames (10));
  GstStructure *pattern = gst_structure_new (
      "dmdsync/pattern", "pattern", G_TYPE_STRING, "grating-x:12/0", nullptr);
  ASSERT_TRUE (gst_element_send_event (pipeline->element ("sync").get (),
      gst_event_new_custom (GST_EVENT_CUSTOM_UPSTREAM, pattern)));
  camera.type ("lose@now:250");
  const StructurePtr lost = wait_said ("codedexposure/camera-lost");
  ASSERT_TRUE (lost);
  EXPECT_STREQ (gst_structure_get_string (lost.get (), "reason"),
      "the DMD triggers no frame while it gets masks");
  ASSERT_TRUE (wait_said ("codedexposure/camera-back"));
  ASSERT_TRUE (wait_frames (30));
  EXPECT_EQ (counter ("frames-lost"), 0u);
  pipeline->stop ();
}

TEST_F (Reconnect, ACameraThatStaysSilentIsOneErrorAfterTheTries)
{
  CameraProcess camera (kSchedule);
  play (1);
  ASSERT_TRUE (wait_frames (10));
  camera.type ("stop@now");
  ASSERT_TRUE (wait_said ("codedexposure/camera-lost"));
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
  ASSERT_TRUE (wait_said ("codedexposure/camera-lost"));
  pipeline->stop ();
  EXPECT_FALSE (SimulatedMirrors::find ("reconnect")->running ());
}

TEST_F (Reconnect, AnEndThatIsAskedForWhileTheCameraIsGoneComes)
{
  CameraProcess camera (kSchedule);
  play (1000);
  ASSERT_TRUE (wait_frames (10));
  camera.type ("stop@now");
  ASSERT_TRUE (wait_said ("codedexposure/camera-lost"));
  EXPECT_TRUE (gst_element_send_event (pipeline->get (), gst_event_new_eos ()));
  EXPECT_EQ (pipeline->wait_end (), "end");
  pipeline->stop ();
}

TEST_F (Reconnect, WhatFailsBehindItIsAnErrorAtOnce)
{
  CameraProcess camera (kSchedule);
  play (1000, "identity error-after=20 ! ");
  const std::string error = pipeline->wait_end ();
  EXPECT_NE (error.find ("Failed after iterations"), error.npos) << error;
  EXPECT_EQ (reconnects (), 0u);
  EXPECT_EQ (came.size (), 19u);
  pipeline->stop ();
}

TEST_F (Reconnect, DmdsyncMayStandInABinAndFramesOfBothStartsAreCounted)
{
  CameraProcess camera (kSchedule);
  play_line ("bin.( " + sync () + ") " +
             camera_bin ("100/1", "GRAY8", "reconnect=10 num-buffers=60") +
             "sync. sync. ! ");
  ASSERT_TRUE (wait_frames (10));
  camera.type ("lose@now:250");
  ASSERT_TRUE (wait_said ("codedexposure/camera-lost"));
  EXPECT_EQ (pipeline->wait_end (), "end");
  EXPECT_EQ (reconnects (), 1u);
  EXPECT_EQ (counter ("frames-in"), 60u);
  EXPECT_EQ (counter ("frames-late"), 0u);
  pipeline->stop ();
  EXPECT_EQ (came.back ().meta.locked, true);
  EXPECT_TRUE (std::is_sorted (came.begin (), came.end (),
      [] (const Came &one, const Came &two) { return one.pts < two.pts; }));
}

/* aravissrc takes ten seconds to let go of a camera that does not answer. */
TEST_F (Reconnect, DISABLED_ARunThatIsStoppedWhileTheCameraIsDeadEnds)
{
  CameraProcess camera (kSchedule);
  play (1000);
  ASSERT_TRUE (wait_frames (10));
  camera.end (SIGKILL);
  ASSERT_TRUE (wait_said ("codedexposure/camera-lost"));
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
  ASSERT_TRUE (wait_said ("codedexposure/camera-lost"));
  camera.emplace (kSchedule);
  ASSERT_TRUE (wait_said ("codedexposure/camera-back"));
  ASSERT_TRUE (wait_frames (10));
  pipeline->stop ();
  EXPECT_EQ (came.back ().meta.locked, true);
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
