/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Stops a board if the process that started it ends without stopping it. */
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "dmd/dmd.h"
#include "dmd/options.h"

namespace codedexposure
{

/**
 * A process beside this one that knows whether a board runs. If this process
 * ends, is killed or crashes while the board runs, it opens the board and stops
 * it.
 *
 * It is the tool codedexposure (its command "dmd guard"), as installed or as
 * the environment variable CODEDEXPOSURE_TOOL names it, in a session of its
 * own: signals of the terminal do not reach it.
 */
class StopGuard
{
public:
  /** @p device  for open_dmd (), after this process has closed it. */
  static Result<std::unique_ptr<StopGuard>> post (const std::string &device);
  /** Ends the process, which first stops the board if it runs. */
  ~StopGuard ();
  StopGuard (const StopGuard &) = delete;
  StopGuard &operator= (const StopGuard &) = delete;

  /** Tells it whether the board runs; false if the process has ended. */
  bool tell (bool running);

private:
  StopGuard (int words, pid_t process) : words_ (words), process_ (process) {}

  const int words_;
  const pid_t process_;
  bool running_ = false; ///< the last message
};

/** The work of that process: reads what tell () writes from @p words to the end
 * and then stops the device, unless it is known not to run. */
Result<void> stand_guard (int words, const std::string &device);

/** A device on hardware: what all drivers share, such as the guard. */
class BoardDmd : public Dmd
{
public:
  const DmdInfo &info () const final { return info_; }
  bool running () const final { return running_; }
  void stop () final;

protected:
  /** @p device  as in StopGuard::post (). */
  BoardDmd (const DmdOptions &options, std::string device);

  /** Starts the guard; called before the board shows masks. */
  Result<void> watch ();
  /** Stops the board; false if it did not acknowledge it and may still run. */
  virtual bool park () = 0;

  const DmdOptions options_;
  const std::string device_;
  DmdInfo info_;
  bool touched_ = false; // it shows, or may show, what it was told here
  bool running_ = false;

private:
  std::unique_ptr<StopGuard>
      guard_; // ends after the driver has closed the board
};

} // namespace codedexposure
