/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the drivers of DLPC350 and DLPC900 share. */
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dmd/boards.h"
#include "dmd/drivers.h"
#include "dmd/stop_guard.h"

namespace codedexposure
{

/** Commands, and a sequencer that starts and stops. */
class DlpcBoard : public BoardDmd
{
protected:
  using Setting = std::pair<HidCommand, Bytes>;

  /** @p failures  bits of the hardware status that report a failure. */
  DlpcBoard (std::unique_ptr<HidLink> link, const DmdOptions &options,
      std::uint8_t failures)
      : BoardDmd (options, link->name ()), link_ (std::move (link)),
        failures_ (failures)
  {
  }

  /** Why the board refused the last command. */
  virtual std::string explain () = 0;

  /** Begins a job, which ends soon after a request to @p stop. */
  void begin (std::stop_token stop = {})
  {
    link_->begin (std::move (stop), options_.patience);
  }
  /** The version reply of a board that was just opened. */
  Result<Bytes> greet ();
  /** Data of the reply, at least @p min bytes. The main status tells whether
   * the board runs. */
  Result<Bytes> read (const HidCommand &command, std::size_t min = 1);
  Result<std::uint8_t> read_byte (const HidCommand &command);
  Result<void> write (const HidCommand &command, ByteView data);
  Result<void> write_byte (const HidCommand &command, std::uint8_t value);
  Result<void> write_all (const std::vector<Setting> &settings);

  /** Reads until the bits @p mask of a byte are @p value. */
  Result<void> await (const HidCommand &command, std::uint8_t mask,
      std::uint8_t value, const std::string &what);
  /** Changes the display mode and waits until the board reports it. */
  Result<void> enter (std::uint8_t mode);
  bool park () override;
  /** A board in standby takes no other command. */
  Result<void> wake ();
  /** Stops the sequencer and waits until it has stopped. */
  Result<void> halt ();
  /** Starts the sequencer, which does not run; it may take a moment. */
  Result<void> launch ();
  /** Leaves one whole exposure without masks, or without a trigger. */
  Result<void> pause_frame (const SlotPlan &plan);
  /** Fails if the hardware status reports a failure. */
  Result<void> check_health ();
  /** The state of the board, after the @p details of the driver. */
  Result<DmdStatus> state (decltype (DmdStatus::details) details);
  /** Takes over what the board can do. Error for options that it does not have.
   */
  Result<void> set_info (const BoardFacts &facts);
  Error error (const std::string &what, const std::string &reason) const
  {
    return link_->error (what, reason);
  }

  const std::unique_ptr<HidLink> link_;

private:
  Result<Bytes> data_of (const HidCommand &command, Result<HidReply> reply);
  bool healthy (std::uint8_t hardware) const;

  const std::uint8_t failures_;
};

} // namespace codedexposure
