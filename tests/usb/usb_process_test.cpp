/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Processes that end while a board shows masks, by a signal that they handle or
 * by SIGKILL. The board is stopped in both cases. */
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "emulated_dlpc350.h"
#include "emulation/dlpc900.h"
#include "emulation/usb_bed.h"

using namespace codedexposure::emulated;

namespace
{

constexpr std::uint16_t kDlpc350 = 0x6401, kDlpc900 = 0xC900;
constexpr int kDlp5500 = 5;
constexpr const char *kPort = "1-2";

using namespace std::chrono_literals;
using std::chrono::steady_clock;

/** Time limit of events; after it, the test fails. */
constexpr auto kPatience = 30s;

/** A process that sees the bus of this one. */
class Process
{
public:
  explicit Process (std::vector<std::string> words)
  {
    std::vector<char *> arguments;
    for (std::string &word : words)
      arguments.push_back (word.data ());
    arguments.push_back (nullptr);
    // It does not have in it what stands between libusb and the kernel.
    setenv ("LD_PRELOAD", kPreload, 1);
    const int code = posix_spawnp (
        &id_, arguments[0], nullptr, nullptr, arguments.data (), environ);
    unsetenv ("LD_PRELOAD");
    EXPECT_EQ (code, 0) << words[0];
  }
  ~Process ()
  {
    if (!ended_)
      end_by (SIGKILL);
  }

  /** Kills the process between two messages to the board: unlike a real bus,
   * the emulated one does not survive half a message. @return as waitpid (). */
  int end_between_messages (const UsbBed &bed, int signal)
  {
    const auto deadline = steady_clock::now () + kPatience;
    bool between = false;
    while (!between && steady_clock::now () < deadline) {
      kill (id_, SIGSTOP);
      int status = 0;
      waitpid (id_, &status, WUNTRACED);
      EXPECT_TRUE (WIFSTOPPED (status)) << "it ended by itself";
      between = bed.idle (kPort);
      if (!between) {
        kill (id_, SIGCONT);
        std::this_thread::sleep_for (1ms);
      }
    }
    EXPECT_TRUE (between) << "it never was between two messages";
    kill (id_, signal);
    kill (id_, SIGCONT);
    return end_by (signal);
  }
  /** @return as waitpid () has it. */
  int end_by (int signal)
  {
    kill (id_, signal);
    int status = -1;
    waitpid (id_, &status, 0);
    ended_ = true;
    return status;
  }

private:
  pid_t id_ = 0;
  bool ended_ = false;
};

class UsbProcess : public ::testing::TestWithParam<std::uint16_t>
{
protected:
  void SetUp () override
  {
    // Guards of processes that ended become children of this one.
    prctl (PR_SET_CHILD_SUBREAPER, 1);
    if (GetParam () == kDlpc900)
      bed.plug (
          kPort, kDlpc900, "LCR", std::make_shared<EmulatedDlpc900> (kDlp5500));
    else
      bed.plug (kPort, kDlpc350, "LCR2", std::make_shared<EmulatedDlpc350> ());
  }

  /** No process uses the bus when it is destroyed. */
  void TearDown () override
  {
    const auto deadline = steady_clock::now () + kPatience;
    pid_t ended = 0;
    while ((ended = waitpid (-1, nullptr, WNOHANG)) >= 0)
      if (ended == 0 && steady_clock::now () < deadline)
        std::this_thread::sleep_for (1ms);
      else if (ended == 0)
        kill_children ();
  }

  static void kill_children ()
  {
    std::ifstream children (
        "/proc/self/task/" + std::to_string (getpid ()) + "/children");
    for (pid_t child = 0; children >> child;) {
      ADD_FAILURE () << "process " << child << " does not end";
      kill (child, SIGKILL);
      waitpid (child, nullptr, 0);
    }
  }

  std::string device () const
  {
    return GetParam () == kDlpc900 ? "usb:" : "usb:,images=0";
  }
  std::vector<std::string> pipeline () const
  {
    return {"gst-launch-1.0", "-q", "videotestsrc", "is-live=true", "!",
        "video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1", "!",
        "dmdsync", "device=" + device (), "schedule=sequential:4x1", "!",
        "fakesink"};
  }
  std::vector<std::string> tool () const
  {
    return {TOOL, "--quiet", "dmd", "start", device (), "sequential:4x1"};
  }
  /** Whether the board gets there. */
  bool comes_to_be (bool running) const
  {
    const auto deadline = steady_clock::now () + kPatience;
    while (bed.running (kPort) != running && steady_clock::now () < deadline)
      std::this_thread::sleep_for (1ms);
    return bed.running (kPort) == running;
  }

  UsbBed bed;
};

} // namespace

TEST_P (UsbProcess, AnInterruptedPipelineStopsTheBoard)
{
  Process launch (pipeline ());
  ASSERT_TRUE (comes_to_be (true));
  EXPECT_TRUE (WIFEXITED (launch.end_by (SIGINT)));
  EXPECT_FALSE (bed.running (kPort)) << "it was stopped before the end";
}

TEST_P (UsbProcess, AKilledPipelineIsStoppedFor)
{
  Process launch (pipeline ());
  ASSERT_TRUE (comes_to_be (true));
  EXPECT_TRUE (WIFSIGNALED (launch.end_between_messages (bed, SIGKILL)));
  EXPECT_TRUE (comes_to_be (false));
}

TEST_P (UsbProcess, AnInterruptedToolStopsTheBoard)
{
  Process start (tool ());
  ASSERT_TRUE (comes_to_be (true));
  EXPECT_TRUE (WIFEXITED (start.end_by (SIGTERM)));
  EXPECT_FALSE (bed.running (kPort)) << "it was stopped before the end";
}

TEST_P (UsbProcess, AToolThatCrashesIsStoppedFor)
{
  Process start (tool ());
  ASSERT_TRUE (comes_to_be (true));
  EXPECT_TRUE (WIFSIGNALED (start.end_between_messages (bed, SIGABRT)));
  EXPECT_TRUE (comes_to_be (false));
}

INSTANTIATE_TEST_SUITE_P (
    Controllers, UsbProcess, ::testing::Values (kDlpc900, kDlpc350));
