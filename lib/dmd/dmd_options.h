/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the user says of a board behind its name. */
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dmd/dlpc350_protocol.h"
#include "dmd/erle.h"
#include "dmd/hid_link.h"
#include "dmd/pattern_timing.h"
#include "schedule/mirror_array.h"

namespace codedexposure
{

/**
 * Options of a real DMD: "SCHEME:WHICH[,key=value...]" with the keys
 *   master=dmd|camera    who starts an exposure; default dmd
 *   layout=address|lattice|cell  of the tile on a diamond array
 *   region=WxH[+X+Y]     mirrors that show masks; the others stay off, and
 *                        cost next to nothing to upload
 *   trigger-delay=TIME   from the camera's edge to light (DLPC900: 104 us or
 *                        more, default 105 us)
 *   edge=rising|falling  of the camera's signal
 *   pulse=high|low       level of the pulses to the camera (USB boards)
 *   patience=TIME        for a USB board that does not answer, or is not ready,
 *                        in one go; default 2 s. A DLPC900 may take longer over
 *                        a table
 *   guard=on|off         stop_guard.h; default on
 * and, for boards whose masks come from elsewhere (DLPC350),
 *   images=A[/B...]      flash images that hold the masks, 24 each
 *   source=flash|video
 * What documents leave open can be turned, see docs/dmd.md:
 *   trigger2-bit=disables|enables  sense of the DLPC900's trigger output flag
 *   table=first|last     whether its table is sent before the images
 *   erle-padding=on|off  of its encoded images to 4 bytes
 *   polarity-bit=0|1     of the DLPC350 that pulse=low sets
 *   odd-rows=right|left  where they are shifted to on a diamond array
 *   image-pair=plain|swapped  order of two images in the DLPC350's table
 *   gap=TIME             between two masks of a DLP3000, default 250 us
 */
struct DmdOptions {
  std::string which; ///< what stands between the scheme and the first comma
  Master master = Master::dmd;
  Placement placement = {};
  Nanoseconds trigger_delay = 105'000;
  bool falling_edge = false;
  bool pulse_low = false;
  std::chrono::milliseconds patience = HidLink::kPatience;
  std::vector<int> images = {};
  dlpc350::Source source = dlpc350::Source::flash;
  bool guard = true;
  bool trigger2_bit_disables = true;
  bool table_first = true;
  std::size_t erle_unit = kErleUnit;
  int polarity_bit = 0;
  bool swap_image_pair = false;
  Nanoseconds gap = 250'000;

  /** @p text  what follows the scheme. */
  static Result<DmdOptions> parse (std::string_view text);
};

} // namespace codedexposure
