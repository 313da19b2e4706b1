/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlpc_board.h"

#include "base/try.h"

namespace codedexposure
{

using namespace dlp;
using namespace std::chrono_literals;

Result<void>
DlpcBoard::set_info (const BoardFacts &facts)
{
  const std::string name = link_->name () + " (" + facts.mirrors + ")";
  ASSIGN_OR_RETURN (
      info_, with_prefix (board_info (facts, options_), name + ": "));
  info_.name = name;
  info_.serial = link_->serial ();
  return {};
}

Result<Bytes>
DlpcBoard::data_of (const HidCommand &command, Result<HidReply> reply)
{
  if (!reply)
    return reply.error ();
  if (reply->refused)
    return error (command.name, explain ());
  return std::move (reply->data);
}

Result<Bytes>
DlpcBoard::read (const HidCommand &command, std::size_t min)
{
  auto data = data_of (command, link_->read (command));
  if (data && data->size () < min)
    return error (
        command.name, "the reply has " + std::to_string (data->size ()) +
                          " bytes instead of " + std::to_string (min));
  if (data && command.word == kMainStatus.word)
    running_ = (data->front () & kSequencerRuns) != 0;
  return data;
}

Result<Bytes>
DlpcBoard::greet ()
{
  begin ();
  auto version = read (kVersion, kVersionSize);
  if (version || version.error ().code != ErrorCode::timeout)
    return version;
  // A program that was killed may have left the board within a message.
  if (!link_->realign ())
    return version;
  begin ();
  return read (kVersion, kVersionSize);
}

Result<std::uint8_t>
DlpcBoard::read_byte (const HidCommand &command)
{
  ASSIGN_OR_RETURN (const Bytes data, read (command));
  return data.front ();
}

Result<void>
DlpcBoard::write (const HidCommand &command, ByteView data)
{
  RETURN_IF_ERROR (data_of (command, link_->write (command, data)));
  return {};
}

Result<void>
DlpcBoard::write_byte (const HidCommand &command, std::uint8_t value)
{
  return write (command, ByteView (&value, 1));
}

Result<void>
DlpcBoard::write_all (const std::vector<Setting> &settings)
{
  for (const auto &[command, data] : settings)
    RETURN_IF_ERROR (write (command, data));
  return {};
}

Result<void>
DlpcBoard::await (const HidCommand &command, std::uint8_t mask,
    std::uint8_t value, const std::string &what)
{
  do {
    ASSIGN_OR_RETURN (const std::uint8_t byte, read_byte (command));
    if ((byte & mask) == value)
      return {};
  } while (link_->wait (10ms));
  return error (what, link_->cancelled () ? "cancelled" : "it takes too long");
}

Result<void>
DlpcBoard::enter (std::uint8_t mode)
{
  RETURN_IF_ERROR (write_byte (kDisplayMode, mode));
  return await (kDisplayMode, 0xFF, mode, "change the display mode");
}

Result<void>
DlpcBoard::wake ()
{
  ASSIGN_OR_RETURN (const std::uint8_t power, read_byte (kPowerMode));
  if (power == kPowerNormal)
    return {};
  RETURN_IF_ERROR (write_byte (kPower, kPowerNormal));
  return await (kPowerMode, 0xFF, kPowerNormal, kPower.name);
}

Result<void>
DlpcBoard::halt ()
{
  RETURN_IF_ERROR (write_byte (kRun, kRunStop));
  return await (kMainStatus, kSequencerRuns, 0, "stop the patterns");
}

Result<void>
DlpcBoard::launch ()
{
  auto reply = link_->write (kRun, Bytes{kRunStart});
  running_ = !reply || !reply->refused;
  RETURN_IF_ERROR (data_of (kRun, std::move (reply)));
  return {};
}

bool
DlpcBoard::park ()
{
  constexpr int kAttempts = 2;
  link_->begin ({}, kAttempts * kRun.timeout);
  bool stopped = false;
  for (int i = 0; i < kAttempts && !stopped && !link_->gone (); i++)
    stopped = write_byte (kRun, kRunStop).ok ();
  return stopped || link_->gone ();
}

Result<void>
DlpcBoard::pause_frame (const SlotPlan &plan)
{
  return link_->pause (
      std::chrono::milliseconds (plan.frame_period () / 1'000'000 + 1));
}

bool
DlpcBoard::healthy (std::uint8_t hardware) const
{
  return (hardware & kInitialised) != 0 && (hardware & failures_) == 0;
}

Result<DmdStatus>
DlpcBoard::state (decltype (DmdStatus::details) details)
{
  ASSIGN_OR_RETURN (const std::uint8_t main, read_byte (kMainStatus));
  ASSIGN_OR_RETURN (const std::uint8_t hardware, read_byte (kHardwareStatus));
  details.emplace_back ("health",
      healthy (hardware) ? "good" : "hardware status reports a failure");
  details.emplace_back ("parked", (main & kParked) != 0 ? "yes" : "no");
  return DmdStatus{(main & kSequencerRuns) != 0, std::move (details)};
}

Result<void>
DlpcBoard::check_health ()
{
  ASSIGN_OR_RETURN (const std::uint8_t hardware, read_byte (kHardwareStatus));
  if (healthy (hardware))
    return {};
  return error (
      "show masks", "its hardware status is " + std::to_string (hardware) +
                        ", which reports a failure; switch it off and on");
}

} // namespace codedexposure
