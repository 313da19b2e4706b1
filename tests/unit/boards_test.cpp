/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What is known of the boards without one: the same as with one, and what the
 * docs say. */
#include <fstream>
#include <iterator>

#include "dlpc900_rig.h"
#include "dmd/boards.h"
#include "emulated_dlpc350.h"
#include "lightcrafter_server.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

/** Preset behind "sequential:", and options of the driver. */
struct Case {
  const char *schedule;
  const char *options;
};

/* Each limit, from both sides, and both masters. */
constexpr Case kCases[] = {
    {"2x2", ""},
    {"2x2,readout=500us", ""},
    {"2x2,readout=500us", ",master=camera"},
    {"2x2,switching=200us", ""},
    {"2x2,switching=300us", ""},
    {"2x2,switching=300us,readout=500us", ""},
    {"2x2,switching=300us,readout=500us", ",master=camera"},
    {"2x2,switching=300us,readout=100us", ",master=camera"},
    {"2x2,switching=1ms", ",gap=1ms"},
    {"2x2,switching=1ms,active=8ms", ""},
    {"2x2,switching=300us", ",source=video"},
    {"2x2", ",source=video"},
    {"12x12", ""},
    {"16x16", ""},
    {"2x2,readout=200us", ",master=camera,trigger-delay=104us"},
    {"2x2", ",trigger-delay=90us"},
};

/** A few mirrors, which take little time to encode. */
constexpr const char *kRegion = ",region=96x64+16+8";

std::string
told (const char *board, const Case &each)
{
  const auto named = parse_board (std::string (board) + each.options);
  if (!named)
    return named.error ().message;
  const Schedule schedule =
      schedule_of (std::string ("sequential:") + each.schedule);
  return message_of (check_limits (named->info, schedule, plan_of (schedule)));
}

/** What the driver says to the same. */
std::string
done (Result<std::unique_ptr<Dmd>> dmd, const Case &each)
{
  if (!dmd)
    return dmd.error ().message;
  const Schedule schedule =
      schedule_of (std::string ("sequential:") + each.schedule);
  const SlotPlan plan = plan_of (schedule);
  if (const auto fits = check_limits ((*dmd)->info (), schedule, plan); !fits)
    return fits.error ().message;
  if (const auto sent = (*dmd)->upload (schedule, {}, ignore_progress); !sent)
    return sent.error ().message;
  return message_of ((*dmd)->start (plan));
}

std::string
text_of (const char *file)
{
  std::ifstream stream (std::string (SOURCE_ROOT "/") + file);
  return {std::istreambuf_iterator<char> (stream), {}};
}

} // namespace

TEST (Boards, DlpcDriversDoWhatTheTableSays)
{
  for (const Case &each : kCases) {
    SCOPED_TRACE (std::string (each.schedule) + each.options);
    struct Rig350 : DmdRig<EmulatedDlpc350, open_dlpc350> {
      Rig350 () : DmdRig (std::make_shared<EmulatedDlpc350> ()) {}
    } rig;
    rig.board->flash_images = 8;
    const bool video =
        std::string (each.options).find ("video") != std::string::npos;
    const bool large = std::string (each.schedule).find ("1") == 0;
    const std::string images = video ? "" : large ? "" : ",images=0";
    EXPECT_EQ (told ("dlp4500", each).empty (),
        done (rig.make (each.options + images), each).empty ())
        << told ("dlp4500", each);
    for (const BoardFacts &facts : boards ()) {
      if (facts.controller != Controller::dlpc900)
        continue;
      Rig other (facts.type);
      const std::string options = std::string (each.options) + kRegion;
      const Case part{each.schedule, options.c_str ()};
      const std::string says = told (facts.name, part);
      const std::string does = done (other.make (options), part);
      EXPECT_EQ (says.empty (), does.empty ()) << says << " / " << does;
    }
  }
}

TEST (Boards, TheLightcrafterDoesWhatTheTableSays)
{
  for (const Case &each : kCases) {
    SCOPED_TRACE (std::string (each.schedule) + each.options);
    LightcrafterServer server;
    const std::string does =
        done (open_lightcrafter (
                  "lightcrafter:127.0.0.1:" + std::to_string (server.port ()) +
                  ",guard=off" + each.options),
            each);
    EXPECT_EQ (told ("dlp3000", each).empty (), does.empty ())
        << told ("dlp3000", each) << " / " << does;
  }
}

TEST (Boards, ARefusalNamesTheBoardAndTheRemedy)
{
  EXPECT_EQ (told ("dlp4500", {"2x2,readout=500us", ""}),
      "dlp4500: as master, this DMD repeats its masks without a pause, and 4 "
      "slots of 9.875ms leave 500us of the frame; give the schedule active=0 "
      "and readout=0, or let the camera be master (master=camera)");
  EXPECT_EQ (told ("dlp3000", {"2x2,switching=300us,readout=500us", ""}),
      "dlp3000: as master, this DMD repeats its masks without a pause, and 4 "
      "slots of 9.875ms leave 500us of the frame; give the schedule active=0 "
      "and readout=0, or let the camera be master (master=camera)");
  EXPECT_EQ (told ("dlp7000", {"2x2", ""}),
      "unknown DMD 'dlp7000'; use dlp3000, dlp4500, dlp500yx, dlp5500, "
      "dlp6500, dlp670s, dlp9000, or alp:WIDTHxHEIGHT");
  EXPECT_EQ (told ("alp:1024x768", {"5x4", ""}),
      "alp:1024x768 gives the camera a pulse after 16 slots or fewer, and the "
      "schedule has 20 slots; use fewer");
  EXPECT_EQ (told ("alp:1024x768", {"4x4,pilot=16", ""}), "");
  EXPECT_EQ (told ("dlp6500", {"2x2", ",color=red"}).substr (0, 40),
      "DMD 'dlp6500,color=red': unknown option ");
}

TEST (Boards, OptionsOfAnotherDriverAreErrors)
{
  EXPECT_EQ (told ("dlp3000", {"2x2", ",trigger-delay=1ms"}),
      "dlp3000: a DLPC300 has no option trigger-delay; leave it out");
  EXPECT_EQ (told ("dlp4500", {"2x2", ",gap=1ms"}),
      "dlp4500: a DLPC350 has no option gap; leave it out");
  EXPECT_EQ (told ("dlp6500", {"2x2", ",images=1"}),
      "dlp6500: a DLPC900 has no option images; leave it out: the board takes "
      "its masks over its link");
  LightcrafterServer server;
  EXPECT_EQ (message_of (open_lightcrafter (
                 "lightcrafter:127.0.0.1:" + std::to_string (server.port ()) +
                 ",guard=off,pulse=low")),
      "lightcrafter:127.0.0.1: a DLPC300 has no option pulse; leave it out");
}

TEST (Boards, ThePagesHaveEachOfThem)
{
  const std::string page = text_of ("docs/dmd.md");
  for (const BoardFacts &facts : boards ()) {
    EXPECT_NE (board_names ().find (facts.name), std::string::npos)
        << facts.name;
    const std::string row =
        "| " + std::string (facts.product) + " | " + facts.mirrors + " | `" +
        facts.name + "` | " + size_text (facts.size) +
        (facts.array == Array::diamond ? ", diamond" : ", orthogonal") + " | " +
        (facts.controllers == 2 ? "two " : "") +
        controller_text (facts.controller) + ", " +
        (facts.controller == Controller::dlpc300 ? "TCP" : "USB") + " |";
    EXPECT_NE (page.find (row), std::string::npos) << row;
  }
  const std::string rule = text_of ("data/60-codedexposure-dmd.rules");
  EXPECT_NE (rule.find ("\"0451\""), std::string::npos);
  EXPECT_NE (rule.find ("\"6401|c900\""), std::string::npos);
}
