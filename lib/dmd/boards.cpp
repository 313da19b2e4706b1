/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/boards.h"

#include <algorithm>
#include <initializer_list>
#include <optional>

#include "base/text.h"
#include "base/try.h"

namespace codedexposure
{

namespace
{

constexpr Nanoseconds kMicrosecond = 1000;
/** Masks in one frame of video. */
constexpr int kVideoMasks = 24;

/** Lines of the pattern table; every board holds more planes. */
constexpr int kDlpc900Lines = 400;

/** @p least  min time of a binary mask, us. */
constexpr BoardFacts
dlpc900_board (const char *name, const char *mirrors, const char *product,
    Extent size, std::uint8_t type, int controllers = 1,
    std::uint32_t least = 105)
{
  return {name, mirrors, product, Controller::dlpc900, size, Array::orthogonal,
      kDlpc900Lines, {least, 0xFFFFFF, least, 105, 105}, false, type,
      controllers};
}

/* The dark times of the DLP3000 are those of the option gap. A DLP4500 shows
 * the masks of its two buffers without reading flash meanwhile, and takes 230
 * us to load a black one. */
constexpr BoardFacts kBoards[] = {
    {"dlp3000", "DLP3000", "LightCrafter", Controller::dlpc300, {608, 684},
        Array::diamond, 96, {250, 2'000'000, 0, 0, 0}, true},
    {"dlp4500", "DLP4500", "LightCrafter 4500", Controller::dlpc350,
        {912, 1140}, Array::diamond, 48, {235, 200'000'000, 230, 0, 230}, true},
    dlpc900_board (
        "dlp500yx", "DLP500YX", "DLP500YX board", {2048, 1200}, 4, 1, 62),
    dlpc900_board ("dlp5500", "DLP5500", "DLP5500 board", {1024, 768}, 5),
    dlpc900_board ("dlp6500", "DLP6500", "LightCrafter 6500", {1920, 1080}, 1),
    dlpc900_board ("dlp670s", "DLP670S", "DLP670S board", {2716, 1600}, 3, 2),
    dlpc900_board (
        "dlp9000", "DLP9000", "LightCrafter 9000", {2560, 1600}, 2, 2),
};

/* The fastest shows a mask for 44 us, and each says its own limit when it is
 * used. The pulse of its gated output is that of one in up to 16 pictures, and
 * the pilot has two exposures. */
constexpr int kAlpSlots = 16;
constexpr BoardFacts kAlp{"alp", "DMD", "ViALUX board", Controller::alp, {},
    Array::orthogonal, 2 * kAlpSlots, {44, 10'000'000, 0, 0, 0}, true};

/** Options that not all controllers have. */
struct OwnOption {
  const char *key;
  std::initializer_list<Controller> controllers;
};
const OwnOption kOwnOptions[] = {
    {"edge", {Controller::dlpc300, Controller::dlpc350, Controller::dlpc900}},
    {"guard", {Controller::dlpc300, Controller::dlpc350, Controller::dlpc900}},
    {"trigger-delay", {Controller::dlpc900}},
    {"pulse", {Controller::dlpc350, Controller::dlpc900}},
    {"patience", {Controller::dlpc350, Controller::dlpc900}},
    {"images", {Controller::dlpc350}},
    {"source", {Controller::dlpc350}},
    {"polarity-bit", {Controller::dlpc350}},
    {"odd-rows", {Controller::dlpc300, Controller::dlpc350}},
    {"gap", {Controller::dlpc300}},
};

/** An option that the board does not have would be ignored. */
Result<void>
check_own (const BoardFacts &facts, const DmdOptions &options)
{
  for (const auto &[key, controllers] : kOwnOptions)
    if (std::ranges::find (options.keys, key) != options.keys.end () &&
        std::ranges::find (controllers, facts.controller) == controllers.end ())
      return Error{"a " + std::string (controller_text (facts.controller)) +
                   " has no option " + key + "; leave it out" +
                   (std::string_view (key) == "images"
                           ? ": the board takes its masks over its link"
                           : "")};
  return {};
}

/** From the camera's edge to light on a DLPC900, us. */
Result<std::uint32_t>
trigger_delay (const PatternLimits &limits, const DmdOptions &options)
{
  if (!options.trigger_delay)
    return std::max (limits.trigger_delay, limits.minimum_exposure);
  const Nanoseconds delay = *options.trigger_delay / kMicrosecond;
  if (delay < limits.minimum_exposure || delay > 0xFFFF)
    return Error{"trigger-delay is " + time_text (*options.trigger_delay) +
                 "; use " + std::to_string (limits.minimum_exposure) +
                 "us to 65535us"};
  return std::uint32_t (delay);
}

/** "alp:1024x768"; a row of its mirrors is whole bytes. */
std::optional<BoardFacts>
alp_board (std::string_view name)
{
  constexpr std::string_view kPrefix = "alp:";
  if (!name.starts_with (kPrefix))
    return std::nullopt;
  const auto size = parse_size (name.substr (kPrefix.size ()));
  if (!size || size->width % 8 != 0)
    return std::nullopt;
  BoardFacts facts = kAlp;
  facts.size = *size;
  return facts;
}

} // namespace

const char *
controller_text (Controller controller)
{
  return controller == Controller::dlpc300   ? "DLPC300"
         : controller == Controller::dlpc350 ? "DLPC350"
         : controller == Controller::dlpc900 ? "DLPC900"
                                             : "ViALUX board";
}

std::span<const BoardFacts>
boards ()
{
  return kBoards;
}

const BoardFacts *
find_board (std::string_view name)
{
  const auto found = std::ranges::find (kBoards, name, &BoardFacts::name);
  return found == std::end (kBoards) ? nullptr : found;
}

const BoardFacts *
find_dlpc900 (int type)
{
  for (const BoardFacts &board : kBoards)
    if (board.controller == Controller::dlpc900 && board.type == type)
      return &board;
  return nullptr;
}

std::string
board_names ()
{
  std::string names;
  for (const BoardFacts &board : kBoards)
    names += std::string (board.name) + ", ";
  return names + "or alp:WIDTHxHEIGHT";
}

Result<DmdInfo>
board_info (const BoardFacts &facts, const DmdOptions &options)
{
  PatternRule rule{.limits = facts.limits,
      .master = options.master,
      .equal_times = facts.equal_times};
  DmdInfo info{.name = facts.name,
      .size = facts.size,
      .resident_masks = facts.masks,
      .triggers_camera = options.master == Master::dmd,
      .trigger_in = true,
      .trigger_out = true,
      .array = facts.array};
  RETURN_IF_ERROR (check_own (facts, options));
  switch (facts.controller) {
  case Controller::dlpc300:
    info.minimum_switching = options.gap;
    rule.limits.minimum_dark = rule.limits.trigger_dark =
        std::uint32_t (options.gap / kMicrosecond);
    break;
  case Controller::dlpc350:
    rule.no_dark = options.source == dlpc350::Source::video;
    if (rule.no_dark)
      info.resident_masks = kVideoMasks;
    break;
  case Controller::alp:
    if (options.master == Master::camera)
      return Error{"a ViALUX board takes an edge for each mask, and a camera "
                   "gives one an exposure; let the board trigger: master=dmd"};
    rule.no_dark = true;
    info.most_slots = kAlpSlots;
    break;
  case Controller::dlpc900:
    ASSIGN_OR_RETURN (
        rule.limits.trigger_delay, trigger_delay (rule.limits, options));
    info.still_masks = true;
    if (const auto &region = options.placement.region)
      info.region = {region->width, region->height};
    break;
  }
  info.minimum_active = rule.limits.minimum_exposure * kMicrosecond;
  info.patterns = rule;
  RETURN_IF_ERROR (check_placement (options.placement, info.array, info.size));
  return info;
}

Result<NamedBoard>
parse_board (std::string_view text)
{
  ASSIGN_OR_RETURN (const DmdOptions options, DmdOptions::parse (text));
  const std::string name (split (text, ',').front ());
  const BoardFacts *found = find_board (name);
  const auto facts = found ? std::optional (*found) : alp_board (name);
  if (!facts)
    return Error{"unknown DMD " + in_quotes (name) + "; use " + board_names ()};
  ASSIGN_OR_RETURN (
      DmdInfo info, with_prefix (board_info (*facts, options), name + ": "));
  info.name = name;
  return NamedBoard{facts->controller, options, std::move (info)};
}

} // namespace codedexposure
