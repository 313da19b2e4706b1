/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What DLPC350 and DLPC900 have in common: commands that are refused, a
 * sequencer that starts and stops, and messages that say why not. */
#pragma once

#include <functional>

#include "dmd/dlp_commands.h"
#include "dmd/dmd.h"
#include "dmd/hid_link.h"

namespace codedexposure
{

/** A controller's command set over a link. Not thread-safe. */
class DlpController
{
public:
  /** Says what was wrong with the last command, after a refusal. */
  using Explain = std::function<std::string (DlpController &)>;

  /** @p failures  bits of the hardware status that tell of one. */
  DlpController (
      std::unique_ptr<HidLink> link, std::uint8_t failures, Explain explain)
      : link_ (std::move (link)), failures_ (failures),
        explain_ (std::move (explain))
  {
  }

  /** Data of the reply, at least @p least bytes. */
  Result<Bytes> read (const HidCommand &command, std::size_t least = 1);
  /** The first byte of the reply. */
  Result<std::uint8_t> read_byte (const HidCommand &command);
  Result<void> write (const HidCommand &command, ByteView data);
  Result<void> write_byte (const HidCommand &command, std::uint8_t value);

  /** Reads until the bits @p mask of a byte are @p value. */
  Result<void> await (const HidCommand &command, std::uint8_t mask,
      std::uint8_t value, const std::string &what);

  /** Changes the display mode, and waits until it has. */
  Result<void> enter (std::uint8_t mode);
  /** Stops the sequencer, and waits until it stands. */
  Result<void> halt ();
  /**
   * Stops the sequencer in a short job of its own, which a board that does not
   * answer ends.
   *
   * @return false when it may be running on: it did not say that it stopped,
   * and is still there.
   */
  bool stop ();

  /** What all boards say of themselves. */
  Result<DmdStatus> status ();
  /** Error when the hardware status tells of a failure. */
  Result<void> check_health ();

  HidLink &link () { return *link_; }
  const HidLink &link () const { return *link_; }

private:
  bool healthy (std::uint8_t hardware) const
  {
    return (hardware & dlp::kInitialised) != 0 && (hardware & failures_) == 0;
  }

  std::unique_ptr<HidLink> link_;
  std::uint8_t failures_;
  Explain explain_;
};

} // namespace codedexposure
