/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A DLPC900 on an emulated USB, for other processes. */
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "emulation/live_bench.h"

namespace codedexposure
{

/** Kind of the board @p name as EmulatedDlpc900 has it: "dlp6500" or "dlp5500".
 */
Result<int> board_kind (const std::string &name);

/** The emulated USB with the board of a bench, as long as it lives. */
class UsbBoard
{
public:
  /** Faults of the bench's parts, such as "dmd-busy", are those of the board.
   * Fails if this build has no emulated USB. */
  static Result<std::unique_ptr<UsbBoard>> plug (const LiveBench &bench);
  virtual ~UsbBoard () = default;

  /** Names and values of what a process needs in its environment to see the
   * bus. */
  virtual std::vector<std::pair<std::string, std::string>>
  environment () const = 0;
};

} // namespace codedexposure
