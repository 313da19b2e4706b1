/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlp_controller.h"

namespace codedexposure
{

namespace
{

using namespace dlp;
using namespace std::chrono_literals;

constexpr auto kPollPause = 10ms;
/** Of a stop, in all and for each of two attempts. */
constexpr auto kStopPatience = 800ms;
constexpr auto kStopTimeout = 400ms;

} // namespace

Result<Bytes>
DlpController::read (const HidCommand &command, std::size_t least)
{
  auto reply = link_->read (command);
  if (!reply)
    return reply.error ();
  if (reply->refused)
    return link_->error (command.name, explain_ (*this));
  if (reply->data.size () < least)
    return link_->error (
        command.name, "the reply has " + std::to_string (reply->data.size ()) +
                          " bytes instead of " + std::to_string (least));
  return std::move (reply->data);
}

Result<std::uint8_t>
DlpController::read_byte (const HidCommand &command)
{
  const auto data = read (command);
  return data ? Result<std::uint8_t> (data->front ()) : data.error ();
}

Result<void>
DlpController::write (const HidCommand &command, ByteView data)
{
  const auto reply = link_->write (command, data);
  if (!reply)
    return reply.error ();
  if (reply->refused)
    return link_->error (command.name, explain_ (*this));
  return {};
}

Result<void>
DlpController::write_byte (const HidCommand &command, std::uint8_t value)
{
  return write (command, ByteView (&value, 1));
}

Result<void>
DlpController::await (const HidCommand &command, std::uint8_t mask,
    std::uint8_t value, const std::string &what)
{
  do {
    const auto byte = read_byte (command);
    if (!byte)
      return byte.error ();
    if ((*byte & mask) == value)
      return {};
  } while (link_->wait (kPollPause));
  return link_->error (
      what, link_->cancelled () ? "cancelled" : "it takes too long");
}

Result<void>
DlpController::enter (std::uint8_t mode)
{
  if (const auto set = write_byte (kDisplayMode, mode); !set)
    return set;
  return await (kDisplayMode, 0xFF, mode, "change the display mode");
}

Result<void>
DlpController::halt ()
{
  if (const auto stopped = write_byte (kRun, kRunStop); !stopped)
    return stopped;
  return await (kMainStatus, kSequencerRuns, 0, "stop the patterns");
}

bool
DlpController::stop ()
{
  link_->begin ({}, kStopPatience);
  HidCommand run = kRun;
  run.timeout = kStopTimeout;
  for (int attempt = 0; attempt < 2 && !link_->gone (); attempt++)
    if (write_byte (run, kRunStop))
      return true;
  return link_->gone ();
}

Result<DmdStatus>
DlpController::status ()
{
  const auto main = read_byte (kMainStatus);
  const auto hardware = main ? read_byte (kHardwareStatus) : main;
  if (!hardware)
    return hardware.error ();
  return DmdStatus{(*main & kSequencerRuns) != 0,
      {{"health",
           healthy (*hardware) ? "good" : "hardware status reports a failure"},
          {"parked", (*main & kParked) != 0 ? "yes" : "no"}}};
}

Result<void>
DlpController::check_health ()
{
  const auto hardware = read_byte (kHardwareStatus);
  if (!hardware)
    return hardware.error ();
  if (!healthy (*hardware))
    return link_->error (
        "show masks", "its hardware status is " + std::to_string (*hardware) +
                          ", which tells of a failure; switch it off and on");
  return {};
}

} // namespace codedexposure
