/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The boards that the drivers control, and what each of them can do. */
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "dmd/dmd.h"
#include "dmd/options.h"

namespace codedexposure
{

enum class Controller {
  dlpc300, ///< behind a TCP port
  dlpc350,
  dlpc900,
  alp, ///< of a ViALUX board, which another program controls
};

/** "DLPC350" */
const char *controller_text (Controller controller);

/** USB ids of the boards: the vendor, and the product of each controller. */
constexpr std::uint16_t kUsbVendor = 0x0451;
constexpr std::uint16_t kUsbDlpc350 = 0x6401;
constexpr std::uint16_t kUsbDlpc900 = 0xC900;

/** What is known of a board before one is connected. */
struct BoardFacts {
  const char *name;    ///< in options: "dlp6500"
  const char *mirrors; ///< of the DMD on it: "DLP6500"
  const char *product; ///< "LightCrafter 6500"
  Controller controller;
  Extent size;
  Array array = Array::orthogonal;
  int masks = 0; ///< that it holds at once
  /** With the default options; a DLPC900 reports its own minimum_exposure,
   * which is also its min trigger_delay. */
  PatternLimits limits = {};
  /** One exposure and one dark time for all masks. */
  bool equal_times = false;
  std::uint8_t type = 0; ///< hardware type that a DLPC900 reports
  int controllers = 1;   ///< each has a part of the columns
};

/** All of them, by their names. */
std::span<const BoardFacts> boards ();
/** Null for an unknown name. */
const BoardFacts *find_board (std::string_view name);
/** Null for a hardware type that no DLPC900 has. */
const BoardFacts *find_dlpc900 (int type);
/** "dlp3000, dlp4500, ... dlp9000, or alp:WIDTHxHEIGHT", for help and messages.
 */
std::string board_names ();

/** What a board does with @p options. Error for options that it does not have
 * or that are out of its range. */
Result<DmdInfo> board_info (const BoardFacts &facts, const DmdOptions &options);

/** A board that need not be connected, with the options of its driver. */
struct NamedBoard {
  Controller controller;
  DmdOptions options;
  DmdInfo info;
};
/** "NAME[,key=value...]" with the keys of DmdOptions, such as
 * "dlp4500,master=camera"; a ViALUX board is "alp:WIDTHxHEIGHT", by its
 * mirrors. */
Result<NamedBoard> parse_board (std::string_view text);

} // namespace codedexposure
