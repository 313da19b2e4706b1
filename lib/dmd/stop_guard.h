/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Stops a board when the process that started it ends without having done so.
 */
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "base/result.h"

namespace codedexposure
{

class Dmd;

/**
 * A process beside this one that is told when a board runs and when it stands.
 * Should this one end, be killed or crash while the board runs, it opens the
 * board and stops it.
 *
 * It is the tool codedexposure (its command "dmd guard"), as installed or as
 * the environment's CODEDEXPOSURE_TOOL says, in a session of its own: signals
 * of the terminal do not reach it.
 */
class StopGuard
{
public:
  /** @p device  for open_dmd (), once this process has let go of it. */
  static Result<std::unique_ptr<StopGuard>> post (const std::string &device);
  /** Relieves it; where the board runs, it stops the board now. */
  ~StopGuard ();
  StopGuard (const StopGuard &) = delete;
  StopGuard &operator= (const StopGuard &) = delete;

  /** False when the process is no more. */
  bool tell (bool running);

private:
  StopGuard (int words, pid_t process) : words_ (words), process_ (process) {}

  const int words_;
  const pid_t process_;
  bool running_ = false; ///< as it was told last
};

/** What that process does: waits for the end of @p words, what tell () writes,
 * and stops the device unless it was said to stand. Error when it cannot. */
Result<void> stand_guard (int words, const std::string &device);

/** @p dmd, which a guard stops as "@p device" if this process does not. */
std::unique_ptr<Dmd> guarded (std::unique_ptr<Dmd> dmd, std::string device);

} // namespace codedexposure
