/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Random faults of boards under the unmodified libusb: no call hangs, nothing
 * leaks, and the mirrors are stopped at the end. */
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "emulated_dlpc350.h"
#include "emulation/dlpc900.h"
#include "fault_life.h"
#include "emulation/usb_bed.h"

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::emulated;

namespace
{

constexpr std::uint16_t kDlpc350 = 0x6401, kDlpc900 = 0xC900;
constexpr int kDlp5500 = 5;

std::ptrdiff_t
entries (const char *folder)
{
  return std::distance (std::filesystem::directory_iterator (folder),
      std::filesystem::directory_iterator ());
}

/** Time for which threads of this process were ready but other processes ran.
 */
std::chrono::nanoseconds
kept_waiting ()
{
  std::chrono::nanoseconds sum{0};
  for (const auto &task :
      std::filesystem::directory_iterator ("/proc/self/task")) {
    std::ifstream file (task.path () / "schedstat");
    std::int64_t ran = 0, waited = 0;
    if (file >> ran >> waited)
      sum += std::chrono::nanoseconds (waited);
  }
  return sum;
}

/** Whether @p folder comes to have no more than @p most entries: the bus closes
 * its ends a little later. */
bool
settles (const char *folder, std::ptrdiff_t most)
{
  using namespace std::chrono;
  const auto deadline = steady_clock::now () + 10s;
  while (entries (folder) > most && steady_clock::now () < deadline)
    std::this_thread::sleep_for (1ms);
  return entries (folder) <= most;
}

/** A clock that stops while other processes use the machine. */
FaultLife::Time
now ()
{
  return std::chrono::duration_cast<FaultLife::Time> (
      std::chrono::steady_clock::now ().time_since_epoch () - kept_waiting ());
}

/** One life of one board. */
void
live (UsbBed &bed, FaultLife &life, std::uint16_t product, const char *options)
{
  std::shared_ptr<EmulatedHid> board;
  if (product == kDlpc900)
    board = std::make_shared<EmulatedDlpc900> (kDlp5500);
  else
    board = std::make_shared<EmulatedDlpc350> ();
  life.draw (*board, 100);
  bed.plug ("1-2", product, "LCR", board);
  const char *patience = std::getenv ("FAULT_PATIENCE");
  const std::string device = std::string ("usb:,guard=off,patience=") +
                             (patience != nullptr ? patience : "2s") + options;
  const auto open = [&] { return open_dmd (device); };
  life.close (life.live (open, schedule_of ("sequential:2x1")));
  if (!board->gone () && board->running ()) {
    // Both stops failed, so the next user stops the board.
    board->faults.clear ();
    const auto next = open_dmd ("usb:");
    ASSERT_EQ (message_of (next), "");
    (*next)->stop ();
  }
  EXPECT_TRUE (board->gone () || !board->running ());
  bed.unplug ("1-2");
  bed.forget_pulled ();
}

} // namespace

/** FAULT_SEQUENCES lives of each controller, with the luck of FAULT_SEED.
 * Nearly all of its time is patience with boards that do not answer;
 * FAULT_PATIENCE (2s unless told) makes many lives short. */
TEST (UsbFaults, WhateverHappensItStopsInTheEndAndHangsNowhere)
{
  const char *seed = std::getenv ("FAULT_SEED");
  std::mt19937 random (seed != nullptr ? unsigned (std::atoi (seed)) : 5);
  UsbBed bed;
  std::ptrdiff_t files = 0, threads = 0;
  int shown = 0;
  FaultLife::Time longest{0};
  const int sequences = fault_sequences (3);
  for (int sequence = 0; sequence < sequences; sequence++)
    for (const auto &[product, options] :
        {std::pair{kDlpc900, ",region=32x16"}, {kDlpc350, ",images=0"}}) {
      FaultLife life (random, now);
      live (bed, life, product, options);
      if (HasFatalFailure ())
        return;
      ASSERT_LE (life.longest (), FaultLife::kLongestCall)
          << "sequence " << sequence << " of " << std::hex << product;
      if (sequence == 0) { // allocated once by libraries
        files = entries ("/proc/self/fd");
        threads = entries ("/proc/self/task");
      }
      ASSERT_TRUE (settles ("/proc/self/fd", files)) << sequence;
      ASSERT_TRUE (settles ("/proc/self/task", threads)) << sequence;
      shown += life.shown ();
      longest = std::max (longest, life.longest ());
    }
  EXPECT_GT (shown, 0);
  std::printf ("%d sequences, masks shown %d times, longest call %d ms\n",
      2 * sequences, shown, int (longest.count ()));
}
