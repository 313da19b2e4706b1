/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The USB transport under the unmodified libusb: boards are found, detached
 * from the kernel driver, show masks and are disconnected. */
#include <sys/wait.h>

#include <cstdio>

#include "dmd/usb_bus.h"
#include "dmd_rig.h"
#include "emulated_dlpc350.h"
#include "emulation/dlpc900.h"
#include "mirrors.h"
#include "emulation/usb_bed.h"

using namespace codedexposure;
using namespace codedexposure::test;
using namespace codedexposure::emulated;

namespace
{

constexpr std::uint16_t kDlpc350 = 0x6401, kDlpc900 = 0xC900;
constexpr int kDlp5500 = 5;

class Usb : public ::testing::Test
{
protected:
  std::shared_ptr<EmulatedDlpc900> plug_dlpc900 (
      const std::string &port, const std::string &serial = "LCR6500")
  {
    auto board = std::make_shared<EmulatedDlpc900> (kDlp5500);
    bed.plug (port, kDlpc900, serial, board);
    return board;
  }
  std::shared_ptr<EmulatedDlpc350> plug_dlpc350 (const std::string &port)
  {
    auto board = std::make_shared<EmulatedDlpc350> ();
    bed.plug (port, kDlpc350, "LCR2", board);
    return board;
  }

  UsbBed bed;
};

Result<void>
show (Dmd &dmd, const Schedule &schedule)
{
  const auto uploaded = dmd.upload (schedule, {}, ignore_progress);
  return uploaded ? dmd.start (plan_of (schedule)) : uploaded;
}

} // namespace

TEST_F (Usb, BoardsAreListedByPortAndSerial)
{
  plug_dlpc900 ("1-3", "second");
  plug_dlpc350 ("1-2");
  const auto boards = list_usb_boards ();
  ASSERT_EQ (message_of (boards), "");
  ASSERT_EQ (boards->size (), 2u);
  EXPECT_EQ ((*boards)[0].port, "1-2");
  EXPECT_EQ ((*boards)[0].controller, Controller::dlpc350);
  EXPECT_EQ ((*boards)[0].serial, "LCR2");
  EXPECT_EQ ((*boards)[1].port, "1-3");
  EXPECT_EQ ((*boards)[1].controller, Controller::dlpc900);
  EXPECT_EQ ((*boards)[1].serial, "second");
}

TEST_F (Usb, WithoutABoardSaysWhatToLookFor)
{
  EXPECT_NE (message_of (open_dmd ("usb:")).find ("no DMD is connected"),
      std::string::npos);
}

TEST_F (Usb, OneOfSeveralIsChosenByPortOrSerial)
{
  plug_dlpc900 ("1-2", "first");
  plug_dlpc900 ("1-3", "second");
  EXPECT_EQ (message_of (open_dmd ("usb:")),
      "several DMDs match 'usb:'; choose one by its port: usb:1-2 "
      "(first), usb:1-3 (second)");
  EXPECT_EQ (message_of (open_dmd ("usb:1-9")),
      "no DMD '1-9' is connected; found usb:1-2 (first), usb:1-3 (second)");
  for (const char *name : {"usb:1-3", "usb:second"}) {
    const auto dmd = open_dmd (name);
    ASSERT_EQ (message_of (dmd), "");
    EXPECT_EQ ((*dmd)->info ().name, "usb:1-3 (DLP5500)");
  }
}

TEST_F (Usb, MasksArriveMirrorByMirror)
{
  const auto board = plug_dlpc900 ("1-2");
  auto dmd = open_dmd ("usb:");
  ASSERT_EQ (message_of (dmd), "");
  const Schedule schedule = schedule_of ("sequential:4x1");
  ASSERT_EQ (message_of (show (**dmd, schedule)), "");
  EXPECT_TRUE (board->running ());
  for (int mask = 0; mask < schedule.masks (); mask++) {
    const auto shown = board->mirrors (mask);
    Image<std::uint8_t> expected (shown.width (), shown.height ());
    expected_mask (schedule, mask, expected.view ());
    EXPECT_TRUE (shown == expected) << mask;
  }
  dmd->reset ();
  EXPECT_FALSE (board->running ());
}

TEST_F (Usb, TheOtherControllerShowsItsFlash)
{
  const auto board = plug_dlpc350 ("1-2");
  auto dmd = open_dmd ("usb:,images=1");
  ASSERT_EQ (message_of (dmd), "");
  ASSERT_EQ (message_of (show (**dmd, Schedule ())), "");
  EXPECT_TRUE (board->running ());
  dmd->reset ();
  EXPECT_FALSE (board->running ());
}

TEST_F (Usb, TheKernelsDriverGivesTheBoardAwayAndGetsItBack)
{
  plug_dlpc900 ("1-2");
  EXPECT_TRUE (bed.kernel_driver_bound ("1-2"));
  {
    const auto dmd = open_dmd ("usb:");
    ASSERT_EQ (message_of (dmd), "");
    EXPECT_FALSE (bed.kernel_driver_bound ("1-2"));
  }
  EXPECT_TRUE (bed.kernel_driver_bound ("1-2"));
}

TEST_F (Usb, ABoardThatAnotherProgramHoldsIsAnError)
{
  plug_dlpc900 ("1-2");
  bed.occupy ("1-2");
  const std::string message = message_of (open_dmd ("usb:"));
  EXPECT_NE (message.find ("another program uses the board"), message.npos)
      << message;
}

TEST_F (Usb, PulledInTheMiddleOfAnUploadIsOneClearError)
{
  const auto board = plug_dlpc900 ("1-2");
  auto dmd = open_dmd ("usb:");
  ASSERT_EQ (message_of (dmd), "");
  const auto uploaded =
      (*dmd)->upload (Schedule (), {}, [&] (int sent, int total) {
        if (sent > total / 10 && !board->gone ())
          bed.unplug ("1-2");
      });
  EXPECT_EQ (message_of (uploaded), "usb:1-2 was unplugged or switched off; "
                                    "connect it, then open it again");
  (*dmd)->stop ();
  dmd->reset ();

  const auto again = plug_dlpc900 ("1-2");
  auto reopened = open_dmd ("usb:");
  ASSERT_EQ (message_of (reopened), "");
  EXPECT_EQ (
      message_of (show (**reopened, schedule_of ("sequential:4x1"))), "");
}

TEST_F (Usb, AStallIsAnErrorAndTheBoardStopped)
{
  const auto board = plug_dlpc900 ("1-2");
  auto dmd = open_dmd ("usb:");
  ASSERT_EQ (message_of (dmd), "");
  ASSERT_EQ (message_of (show (**dmd, schedule_of ("sequential:4x1"))), "");
  board->faults[board->messages ()] = Fault::stall;
  const auto stairs =
      (*dmd)->upload (schedule_of ("staircase:4x1"), {}, ignore_progress);
  EXPECT_NE (message_of (stairs).find ("0 of 64 bytes"), std::string::npos)
      << message_of (stairs);
  EXPECT_FALSE (board->running ());
}

TEST_F (Usb, AMessageThatATimeoutCutSpoilsNoOther)
{
  const auto board = plug_dlpc900 ("1-2");
  auto dmd = open_dmd ("usb:");
  ASSERT_EQ (message_of (dmd), "");
  const Schedule schedule = schedule_of ("sequential:4x1");
  // Behind the commands before it and the announcement: image data.
  board->faults[board->messages () + 15] = Fault::cut;
  const std::string message =
      message_of ((*dmd)->upload (schedule, {}, ignore_progress));
  EXPECT_NE (message.find ("send image data: it took 64 of 512 bytes"),
      std::string::npos)
      << message;
  ASSERT_EQ (message_of (show (**dmd, schedule)), "");
  EXPECT_TRUE (board->running ());
}

TEST_F (Usb, PulledAtAnyMessageItEnds)
{
  for (int message = 0; message < 60; message += 3) {
    const auto board = plug_dlpc900 ("1-2");
    board->faults[message] = Fault::unplug;
    auto dmd = open_dmd ("usb:,region=64x64");
    if (dmd.ok ()) {
      const auto shown = show (**dmd, schedule_of ("sequential:4x1"));
      EXPECT_EQ (shown.ok (), !board->gone ()) << message;
      dmd->reset ();
    }
    EXPECT_TRUE (board->gone () || !board->running ()) << message;
    bed.unplug ("1-2");
  }
}

namespace
{

/** What the command-line tool prints; its status is in @p status. */
std::string
tool_says (const std::string &arguments, int &status)
{
  // A child process sees this bus, too, if it loads what stands in between.
  const std::string command = "LD_PRELOAD='" + std::string (kPreload) +
                              "' '" TOOL "' --quiet --json " + arguments +
                              " 2>&1";
  std::string said;
  FILE *out = popen (command.c_str (), "r");
  char text[256];
  while (std::fgets (text, sizeof text, out) != nullptr)
    said += text;
  status = WEXITSTATUS (pclose (out));
  return said;
}

} // namespace

TEST_F (Usb, TheToolListsShowsAndStops)
{
  const auto board = plug_dlpc900 ("1-2");
  int status = -1;
  const std::string listed = tool_says ("dmd list", status);
  EXPECT_EQ (status, 0);
  EXPECT_NE (listed.find ("\"device\": \"usb:1-2\""), listed.npos) << listed;

  const std::string shown =
      tool_says ("dmd start usb: sequential:4x1 --for 10ms", status);
  EXPECT_EQ (status, 0) << shown;
  EXPECT_EQ (board->images_received (), 1);
  EXPECT_FALSE (board->running ());

  for (const char *mask : {"on", "3"}) {
    const std::string still = tool_says (
        std::string ("dmd show usb: sequential:4x1 --for 10ms --mask ") + mask,
        status);
    EXPECT_EQ (status, 0) << still;
    const auto mirrors = board->mirrors (0);
    EXPECT_EQ (mirrors.at (0, 0), std::string (mask) == "on");
    EXPECT_EQ (mirrors.at (3, 0), 1);
    EXPECT_FALSE (board->running ());
  }
  tool_says ("dmd show usb: sequential:4x1 --mask 4", status);
  EXPECT_EQ (status, 2);
  const std::string info = tool_says ("dmd info", status);
  for (const char *key :
      {"trigger-input", "trigger-output", "shortest-dark-time"})
    EXPECT_NE (info.find (key), info.npos) << key;

  tool_says ("dmd start usb: sequential:2x2,active=12ms", status);
  EXPECT_EQ (status, 4);
  bed.unplug ("1-2");
  tool_says ("dmd status", status);
  EXPECT_EQ (status, 3);
}

TEST_F (Usb, TheToolStopsWhatSomebodyLeftRunning)
{
  const auto board = plug_dlpc350 ("1-2");
  auto dmd = open_dmd ("usb:,images=0");
  ASSERT_EQ (message_of (dmd), "");
  ASSERT_EQ (message_of (show (**dmd, Schedule ())), "");
  // The program crashes.
  const auto survivor = std::make_shared<EmulatedDlpc350> (*board);
  dmd->reset ();
  bed.unplug ("1-2");
  bed.plug ("1-3", kDlpc350, "LCR2", survivor);
  ASSERT_TRUE (survivor->running ());
  int status = -1;
  for (const char *question :
      {"dmd status", "dmd info", "dmd upload usb: sequential:2x2 --predict"}) {
    tool_says (question, status);
    EXPECT_TRUE (survivor->running ()) << question;
  }
  tool_says ("dmd stop", status);
  EXPECT_EQ (status, 0);
  EXPECT_FALSE (survivor->running ());
}
