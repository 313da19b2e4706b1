/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure schedule: shows schedules, checks them, and writes their masks.
 */
#include <fstream>
#include <memory>

#include "base/text.h"
#include "dmd/bitmap.h"
#include "dmd/plane_image.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

namespace
{

struct Pictures {
  std::string layout = "address";
  std::string region;
  std::string prefix = "mask";
  bool planes = false;
};

Schedule
schedule_of (const Session &session)
{
  return value_of (Schedule::parse (session.schedule), Exit::usage);
}

void
show (const Session &session)
{
  const Schedule schedule = schedule_of (session);
  if (session.json)
    return session.print (Json::parse (schedule.to_json ()));
  const Timing &timing = schedule.timing ();
  Json lines{{"schedule", schedule.text ()}, {"slots", schedule.slots ()},
      {"masks", schedule.masks ()}, {"cell", size_text (schedule.cell ())},
      {"active", timing.active > 0 ? time_text (timing.active)
                                   : "the rest of the frame"},
      {"switching", time_text (timing.switching)},
      {"readout", time_text (timing.readout)}};
  for (int i = 0; i < int (schedule.regions ().size ()); i++) {
    const Schedule &region = schedule.region (i);
    lines["region " + std::to_string (i)] =
        rect_text (schedule.regions ()[std::size_t (i)].rect) + ", slots " +
        std::to_string (region.slots ()) + ", cell " +
        size_text (region.cell ());
  }
  session.print (lines);
}

void
check (const Session &session)
{
  const DmdInfo board = find_board (session.board);
  const auto [schedule, plan] = fit (session, board);
  session.print ({{"schedule", schedule.text ()}, {"dmd", board.name},
      {"slots", plan.slots ()}, {"active", time_text (plan.active ())},
      {"exposure", time_text (plan.exposure ())},
      {"frame", time_text (plan.frame_period ())}, {"fits", true}});
}

Placement
placement_of (const Pictures &pictures, const DmdInfo &board)
{
  Placement placement;
  placement.layout = value_of (parse_layout (pictures.layout), Exit::usage);
  if (!pictures.region.empty ())
    placement.region = value_of (parse_region (pictures.region), Exit::usage);
  value_of (check_placement (placement, board.array, board.size), Exit::usage);
  return placement;
}

void
write_file (const std::string &path, const Bytes &bytes)
{
  std::ofstream file (path, std::ios::binary);
  file.write (reinterpret_cast<const char *> (bytes.data ()),
      std::streamsize (bytes.size ()));
  file.close ();
  if (!file)
    throw Failure{Exit::failed,
        Error{"cannot write " + in_quotes (path) +
              "; check that the folder exists and the disk has space"}};
}

void
render (const Session &session, const Pictures &pictures)
{
  const Schedule schedule = schedule_of (session);
  const DmdInfo board = find_board (session.board);
  const MaskRenderer renderer (
      schedule, board.size, placement_of (pictures, board));
  const PlanePlan plan = plan_planes (schedule);
  const int count = pictures.planes ? plan.images : schedule.masks ();
  Json files = Json::array ();
  for (int picture = 0; picture < count; picture++) {
    if (session.stop.stop_requested ())
      throw Failure{Exit::interrupted, Error{"interrupted"}};
    const std::string path =
        pictures.prefix + std::to_string (picture) + ".bmp";
    write_file (path, pictures.planes
                          ? encode_plane_bitmap (renderer.render<PlanePixel> (
                                plan.of_image (picture)))
                          : encode_bitmap (renderer.render (picture)));
    files.push_back (path);
  }
  session.print (
      {{"schedule", schedule.text ()}, {"dmd", board.name}, {"files", files}});
}

} // namespace

Command
schedule_commands (Session &session)
{
  const Option schedule = schedule_argument (session);
  const Option board = board_option (session);
  const auto pictures = std::make_shared<Pictures> ();
  const Command shown = {.name = "show",
      .help = "Show what a schedule means",
      .options = {schedule},
      .run = [&session] { show (session); }};
  const Command checked = {.name = "check",
      .help = "Check whether it fits a DMD and a frame rate",
      .options = {schedule, board, rate_option (session)},
      .run = [&session] { check (session); }};
  const Command rendered = {.name = "render",
      .help = "Write the masks as bitmap files",
      .options = {schedule, board,
          {"--layout", &pictures->layout,
              "Layout of the tile on a diamond array: address, lattice or "
              "cell"},
          {"--region", &pictures->region, "Mirrors that show masks, WxH[+X+Y]"},
          {"--output", &pictures->prefix, "Prefix of the file names"},
          {"--planes", &pictures->planes,
              "24 masks per file, for the flash or the video of a "
              "LightCrafter 4500"}},
      .run = [&session, pictures] { render (session, *pictures); }};
  return {.name = "schedule",
      .help = "Show and check schedules",
      .commands = {shown, checked, rendered}};
}

} // namespace codedexposure::tool
