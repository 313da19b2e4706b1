/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure schedule: shows schedules, checks them, and writes their masks.
 */
#include <filesystem>
#include <optional>
#include <vector>

#include "base/file.h"
#include "base/text.h"
#include "command.h"
#include "dmd/alp.h"
#include "dmd/bitmap.h"
#include "dmd/boards.h"
#include "dmd/plane_image.h"
#include "options/board.h"

namespace codedexposure::app
{

namespace
{

struct Arguments : Printing, BoardOptions {
  std::string layout;
  std::string region;
  std::string prefix = "mask";
  std::optional<FrameRate> shown_at;
  bool planes = false;
  bool force = false;
};

Exit
show (const Arguments &arguments)
{
  const Schedule schedule = arguments.parsed ();
  if (arguments.json) {
    arguments.print (Json::parse (schedule.to_json ()));
    return Exit::done;
  }
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
  arguments.print (lines);
  return Exit::done;
}

Exit
check (const Arguments &arguments)
{
  const DmdInfo board = arguments.info ();
  const auto [schedule, plan] = fit (arguments, board);
  arguments.print ({{"schedule", schedule.text ()}, {"dmd", board.name},
      {"slots", plan.slots ()}, {"active", time_text (plan.active ())},
      {"exposure", time_text (plan.exposure ())},
      {"frame", time_text (plan.frame_period ())}, {"fits", true}});
  return Exit::done;
}

Placement
placement_of (const Arguments &arguments, const NamedBoard &board)
{
  Placement placement = board.options.placement;
  if (!arguments.layout.empty ())
    placement.layout = value_of (parse_layout (arguments.layout), Exit::usage);
  if (!arguments.region.empty ())
    placement.region = value_of (parse_region (arguments.region), Exit::usage);
  value_of (check_placement (placement, board.info.array, board.info.size),
      Exit::usage);
  return placement;
}

/* Files that exist are kept, unless --force is set. */
void
check_unused (const Arguments &arguments, const std::vector<std::string> &files)
{
  std::error_code ignored;
  for (const std::string &path : files)
    if (!arguments.force && std::filesystem::exists (path, ignored))
      fail (path + " exists; choose another --output, or set --force to "
                   "replace it");
}

void
write (const std::string &path, const std::string &content)
{
  if (const auto written = write_file (path, content); !written)
    fail (path + " " + written.error ().message +
          "; check that the folder exists and the disk has space");
}

/* One file for each mask, or for 24. */
std::vector<std::string>
write_bitmaps (const Arguments &arguments, const Schedule &schedule,
    const MaskRenderer &renderer, const std::stop_token &stop)
{
  const PlanePlan plan = plan_planes (schedule);
  const int count = arguments.planes ? plan.images : schedule.masks ();
  std::vector<std::string> files;
  for (int picture = 0; picture < count; picture++)
    files.push_back (arguments.prefix + std::to_string (picture) + ".bmp");
  check_unused (arguments, files);
  for (int picture = 0; picture < count; picture++) {
    if (stop.stop_requested ())
      fail ("interrupted", Exit::interrupted);
    const Bytes bytes = arguments.planes
                            ? encode_plane_bitmap (renderer.render<PlanePixel> (
                                  plan.of_image (picture)))
                            : encode_bitmap (renderer.render (picture));
    write (files[std::size_t (picture)], {bytes.begin (), bytes.end ()});
  }
  return files;
}

/* All masks in one file, and the program that shows them. */
std::vector<std::string>
write_alp (const Arguments &arguments, const DmdInfo &info,
    const MaskRenderer &renderer, const std::stop_token &stop)
{
  if (arguments.planes)
    usage_error ("--planes is for a LightCrafter 4500; leave it out");
  BoardOptions shown = arguments;
  shown.rate = arguments.shown_at.value_or (FrameRate{25, 1});
  const auto [schedule, plan] = fit (shown, info);
  const AlpSequence sequence =
      value_of (alp_sequence (info, schedule, plan), Exit::does_not_fit);
  const std::vector<std::string> files{
      arguments.prefix + ".bin", arguments.prefix + ".py"};
  check_unused (arguments, files);
  Bytes planes;
  for (int mask = 0; mask < sequence.pictures; mask++) {
    if (stop.stop_requested ())
      fail ("interrupted", Exit::interrupted);
    append_bit_plane (planes, renderer.render (mask));
  }
  write (files[0], {planes.begin (), planes.end ()});
  write (
      files[1], alp_script (sequence, info.size,
                    std::filesystem::path (files[0]).filename ().string (),
                    "Schedule " + schedule.text () + ", " +
                        real_text (double (shown.rate.num) / shown.rate.den) +
                        " coded frames/s"));
  return files;
}

Exit
render (const Arguments &arguments)
{
  const std::stop_token stop = stop_at_signals ();
  const Schedule schedule = arguments.parsed ();
  const NamedBoard board =
      value_of (parse_board (arguments.board), Exit::usage);
  const bool is_alp = board.controller == Controller::alp;
  if (arguments.shown_at && !is_alp)
    usage_error ("--rate is for --dmd alp:WIDTHxHEIGHT, whose times are in a "
                 "file; leave it out");
  const MaskRenderer renderer (
      schedule, board.info.size, placement_of (arguments, board));
  const auto files = is_alp
                         ? write_alp (arguments, board.info, renderer, stop)
                         : write_bitmaps (arguments, schedule, renderer, stop);
  arguments.print ({{"schedule", schedule.text ()}, {"dmd", board.info.name},
      {"files", files}});
  return Exit::done;
}

void
declare_pictures (Options &options, Arguments &arguments)
{
  options.value ("--layout", arguments.layout, "L",
      "layout of the tile on a diamond array: address, lattice or cell "
      "[address]",
      any_text ());
  options.value ("--region", arguments.region, "WxH[+X+Y]",
      "mirrors that show masks [all]", any_text ());
  options.value ("--output", arguments.prefix, "PREFIX",
      "prefix of the file names [mask]", any_text ());
  options.value ("--rate", arguments.shown_at, "R",
      "frame rate of the camera, for alp:WIDTHxHEIGHT [25]",
      frame_rate_rule ());
  options.flag ("--planes", arguments.planes,
      "24 masks per file, for the flash or the video of a LightCrafter 4500");
  options.flag ("--force", arguments.force, "replace files that exist");
}

} // namespace

Command
schedule_command ()
{
  const Below<Arguments> shows{{.name = "show",
                                   .summary = "show what a schedule means",
                                   .usage = "[option...] [SCHEDULE]",
                                   .description = R"(
Shows what a schedule means; with --json, prints its JSON form, which can be
edited.
)",
                                   .notes = R"(
Examples:
  A schedule to edit:
    codedexposure schedule show --json staircase:2x2
)"},
      [] (Options &options, Arguments &a) {
        options.word ("SCHEDULE", a.schedule, true);
        a.declare (options);
      },
      show};
  const Below<Arguments> checks{
      {.name = "check",
          .summary = "check whether it fits a DMD and a frame rate",
          .usage = "[option...] [SCHEDULE]",
          .description = R"(
Checks whether a board can show a schedule at a frame rate. Exit status 4: it
cannot.
)",
          .notes = R"(
Examples:
  256 slots at 25 frames/s:
    codedexposure schedule check sequential:16x16 --dmd dlp6500 --rate 25
)"},
      [] (Options &options, Arguments &a) {
        options.word ("SCHEDULE", a.schedule, true);
        a.declare_board (options);
        a.declare_rate (options);
        a.declare (options);
      },
      check};
  const Below<Arguments> renders{
      {.name = "render",
          .summary = "write the masks as bitmap files",
          .usage = "[option...] [SCHEDULE]",
          .description = R"(
Writes the masks of a schedule as files PREFIX0.bmp, PREFIX1.bmp ... For a
ViALUX board (alp:WIDTHxHEIGHT), writes PREFIX.bin, its bit planes, and
PREFIX.py, a program for its Python binding that shows them.
)",
          .notes = R"(
Examples:
  The four masks of the default:
    codedexposure schedule render sequential:2x2 --output mask
  For a ViALUX board of 1024x768 mirrors:
    codedexposure schedule render sequential:2x2 --dmd alp:1024x768
)"},
      [] (Options &options, Arguments &a) {
        options.word ("SCHEDULE", a.schedule, true);
        a.declare_board (options);
        declare_pictures (options, a);
        a.declare (options);
      },
      render};
  return make_group<Arguments> (
      {.name = "schedule",
          .summary = "show and check schedules, write their masks",
          .usage = "COMMAND [option...] [SCHEDULE]",
          .description = R"(
SCHEDULE is CODE:TILE[,key=value...] or the path of a JSON file
[sequential:2x2].
)"},
      {shows, checks, renders});
}

} // namespace codedexposure::app
