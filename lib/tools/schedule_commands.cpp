/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure schedule: shows schedules, checks them, and writes their masks.
 */
#include <fstream>
#include <memory>

#include "base/text.h"
#include "dmd/bitmap.h"
#include "dmd/dmd.h"
#include "dmd/plane_image.h"
#include "tools/board_kinds.h"
#include "tools/tool.h"

namespace codedexposure::tool
{

namespace
{

using Json = nlohmann::ordered_json;

struct Arguments {
  std::string schedule = "sequential:2x2";
  std::string board = "dlp6500";
  std::string layout = "address";
  std::string region;
  std::string prefix = "mask";
  std::string rate = "25";
  bool planes = false;
};

std::optional<Schedule>
read (Session &session, const Arguments &arguments)
{
  auto schedule = Schedule::parse (arguments.schedule);
  if (schedule)
    return *std::move (schedule);
  session.fail (Exit::usage, schedule.error ());
  return std::nullopt;
}

std::string
cell_text (const Schedule &schedule)
{
  return std::to_string (schedule.cell ().width) + "x" +
         std::to_string (schedule.cell ().height);
}

void
show (Session &session, const Arguments &arguments)
{
  const auto schedule = read (session, arguments);
  if (!schedule)
    return;
  if (session.json)
    return session.print (Json::parse (schedule->to_json ()));
  const Timing &timing = schedule->timing ();
  Json lines{{"schedule", schedule->text ()}, {"slots", schedule->slots ()},
      {"masks", schedule->masks ()}, {"cell", cell_text (*schedule)},
      {"active", timing.active > 0 ? time_text (timing.active)
                                   : "the rest of the frame"},
      {"switching", time_text (timing.switching)},
      {"readout", time_text (timing.readout)}};
  for (int i = 0; i < int (schedule->regions ().size ()); i++) {
    const Schedule &region = schedule->region (i);
    lines["region " + std::to_string (i)] =
        rect_text (schedule->regions ()[std::size_t (i)].rect) + ", slots " +
        std::to_string (region.slots ()) + ", cell " + cell_text (region);
  }
  session.print (lines);
}

void
check (Session &session, const Arguments &arguments)
{
  const auto schedule = read (session, arguments);
  if (!schedule)
    return;
  const auto rate = parse_rate (arguments.rate);
  const auto kind = find_kind (arguments.board);
  if (!rate || !kind)
    return session.fail (Exit::usage, rate ? kind.error () : rate.error ());
  const auto plan =
      SlotPlan::fit (schedule->timing (), schedule->slots (), *rate);
  const auto fits =
      plan ? check_limits (*kind, *schedule, *plan) : plan.error ();
  if (!fits)
    return session.fail (Exit::does_not_fit, fits.error ());
  session.print ({{"schedule", schedule->text ()}, {"dmd", kind->name},
      {"slots", plan->slots ()}, {"active", time_text (plan->active ())},
      {"exposure", time_text (plan->exposure ())},
      {"frame", time_text (plan->frame_period ())}, {"fits", true}});
}

Result<Placement>
placement_of (const Arguments &arguments, const DmdInfo &kind)
{
  Placement placement;
  const auto layout = parse_layout (arguments.layout);
  if (!layout)
    return layout.error ();
  placement.layout = *layout;
  if (!arguments.region.empty ()) {
    const auto region = parse_region (arguments.region);
    if (!region)
      return region.error ();
    placement.region = *region;
  }
  const auto checked = check_placement (placement, kind.array, kind.size);
  return checked ? Result<Placement> (placement) : checked.error ();
}

Result<void>
write_file (const std::string &path, const Bytes &bytes)
{
  std::ofstream file (path, std::ios::binary);
  file.write (reinterpret_cast<const char *> (bytes.data ()),
      std::streamsize (bytes.size ()));
  file.close ();
  return file ? Result<void> ()
              : Error{"cannot write " + in_quotes (path) +
                      "; check that the folder exists and the disk has "
                      "space"};
}

void
render (Session &session, const Arguments &arguments)
{
  const auto schedule = read (session, arguments);
  if (!schedule)
    return;
  const auto kind = find_kind (arguments.board);
  const auto placement = kind ? placement_of (arguments, *kind) : kind.error ();
  if (!placement)
    return session.fail (Exit::usage, placement.error ());

  const PlanePlan plan = plan_planes (*schedule);
  const int pictures = arguments.planes ? plan.images : schedule->masks ();
  Json files = Json::array ();
  const MaskRenderer renderer (*schedule, kind->size, *placement);
  for (int picture = 0; picture < pictures; picture++) {
    if (session.stop.stop_requested ())
      return session.fail (Exit::interrupted, Error{"interrupted"});
    const std::string path =
        arguments.prefix + std::to_string (picture) + ".bmp";
    const Bytes bytes = arguments.planes
                            ? encode_plane_bitmap (renderer.render<PlanePixel> (
                                  plan.of_image (picture)))
                            : encode_bitmap (renderer.render (picture));
    if (const auto written = write_file (path, bytes); !written)
      return session.fail (Exit::failed, written.error ());
    files.push_back (path);
  }
  session.print (
      {{"schedule", schedule->text ()}, {"dmd", kind->name}, {"files", files}});
}

} // namespace

void
add_schedule_commands (CLI::App &app, Session &session)
{
  auto *schedule = app.add_subcommand ("schedule", "Show and check schedules");
  schedule->require_subcommand (1);
  const auto arguments = std::make_shared<Arguments> ();
  const auto add = [&] (const char *name, const char *help, auto command) {
    auto *sub = schedule->add_subcommand (name, help);
    sub->add_option ("schedule", arguments->schedule,
        "CODE:TILE[,key=value...] or a JSON file");
    sub->callback (
        [&session, arguments, command] { command (session, *arguments); });
    return sub;
  };
  const auto with_board = [&] (CLI::App *sub) {
    sub->add_option (
        "--dmd", arguments->board, "DMD: dlp3000, dlp4500, dlp6500 or dlp9000");
    return sub;
  };

  add ("show", "Show what a schedule means", show);
  with_board (
      add ("check", "Check whether it fits a DMD and a frame rate", check))
      ->add_option (
          "--rate", arguments->rate, "Frame rate of the camera, frames/s");
  auto *pictures =
      with_board (add ("render", "Write the masks as bitmap files", render));
  pictures->add_option ("--layout", arguments->layout,
      "Layout of the tile on a diamond array: address, lattice or cell");
  pictures->add_option (
      "--region", arguments->region, "Mirrors that show masks, WxH[+X+Y]");
  pictures->add_option (
      "--output", arguments->prefix, "Prefix of the file names");
  pictures->add_flag ("--planes", arguments->planes,
      "24 masks per file, for the flash or the video of a LightCrafter 4500");
}

} // namespace codedexposure::tool
