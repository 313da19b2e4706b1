/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What DLPC350 and DLPC900 have in common: commands that are refused, a
 * sequencer that starts and stops, and messages that say why not. */
#pragma once

#include <functional>

#include "dmd/hid_link.h"

namespace cexp
{

/** A controller's command set over a link. Not thread-safe. */
class DlpController
{
public:
  /** Says what was wrong with the last command, after a refusal. */
  using Explain = std::function<std::string (DlpController &)>;

  DlpController (std::unique_ptr<HidLink> link, Explain explain)
      : link_ (std::move (link)), explain_ (std::move (explain))
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

  HidLink &link () { return *link_; }
  const HidLink &link () const { return *link_; }

private:
  std::unique_ptr<HidLink> link_;
  Explain explain_;
};

} // namespace cexp
