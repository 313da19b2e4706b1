/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/dlp_controller.h"

namespace cexp
{

namespace
{

using namespace std::chrono_literals;

constexpr auto kPollPause = 10ms;
constexpr int kPolls = 100;

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
  for (int poll = 0; poll < kPolls; poll++) {
    const auto byte = read_byte (command);
    if (!byte)
      return byte.error ();
    if ((*byte & mask) == value)
      return {};
    link_->pause (kPollPause);
  }
  return link_->error (what, "it did not within " +
                                 std::to_string (kPolls * kPollPause.count ()) +
                                 " ms");
}

} // namespace cexp
