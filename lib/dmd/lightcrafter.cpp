/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The first LightCrafter (DLP3000), over TCP. */
#include <algorithm>

#include "base/text.h"
#include "base/try.h"
#include "base/wait.h"
#include "dmd/bitmap.h"
#include "dmd/boards.h"
#include "dmd/drivers.h"
#include "dmd/lightcrafter_protocol.h"
#include "dmd/stop_guard.h"
#include "dmd/tcp_stream.h"

namespace codedexposure
{

namespace
{

using namespace lightcrafter;
using namespace std::chrono_literals;

constexpr std::uint32_t kCameraPulse = 100;
/** How long a job, and a stop, waits for a board that is silent or busy. */
constexpr std::chrono::milliseconds kPatience{2000};
constexpr std::chrono::milliseconds kStopPatience{800};
constexpr std::chrono::milliseconds kBusyPause{500};
constexpr std::uint8_t kBusy = 6; // error code
constexpr int kMaxStrayReplies = 16;
/** Of a mask of 52 kB over the board's network port, about. */
constexpr Nanoseconds kMaskTime = 50'000'000;

class Lightcrafter final : public BoardDmd
{
public:
  Lightcrafter (std::string host, int port, const DmdOptions &options)
      : BoardDmd (
            options, "lightcrafter:" + host + ":" + std::to_string (port)),
        host_ (std::move (host)), port_ (port)
  {
    info_.name = "lightcrafter:" + host_;
  }
  ~Lightcrafter () override
  {
    if (touched_)
      stop ();
  }

  Result<void> open ()
  {
    RETURN_IF_ERROR (begin ());
    const Bytes of_system{0x00};
    ASSIGN_OR_RETURN (
        const Bytes version, payload_of ("read its version",
                                 ask (PacketType::read, kVersion, of_system)));
    version_ = printable (std::string (
        version.begin (), std::find (version.begin (), version.end (), 0)));
    ASSIGN_OR_RETURN (DmdInfo info,
        with_prefix (
            board_info (*find_board ("dlp3000"), options_), info_.name + ": "));
    info.name = std::move (info_.name);
    info_ = std::move (info);
    return {};
  }

  Result<DmdStatus> status () override
  {
    // The board cannot be asked whether it runs.
    return DmdStatus{
        running_, {{"controller", "DLPC300"}, {"mirrors", "DLP3000"},
                      {"firmware", version_}}};
  }

  Nanoseconds upload_time (const Schedule &schedule, std::stop_token) override
  {
    return schedule.masks () * kMaskTime;
  }

  Result<void> upload (const Schedule &schedule, std::stop_token stop_token,
      const UploadProgress &progress) override
  {
    RETURN_IF_ERROR (check_masks (info_, schedule));
    RETURN_IF_ERROR (begin (std::move (stop_token)));
    touched_ = true;
    schedule_ = schedule;
    // A time that every board accepts, until start () knows the real one.
    const auto sent =
        send_masks ({10'000, std::uint32_t (options_.gap / 1000)}, progress);
    if (!sent) {
      schedule_.reset ();
      stop ();
    }
    return sent;
  }

  Result<void> start (const SlotPlan &plan, std::stop_token stop_token) override
  {
    if (!schedule_)
      return Error{info_.name + ": no masks to start; upload first"};
    ASSIGN_OR_RETURN (const PatternTime time,
        with_prefix (
            fit_equal_patterns (plan, *info_.patterns), info_.name + ": "));
    RETURN_IF_ERROR (watch ());
    RETURN_IF_ERROR (begin (std::move (stop_token)));
    if (time != time_)
      RETURN_IF_ERROR (send_masks (time, [] (int, int) {}));
    RETURN_IF_ERROR (write ("set up the trigger output", kCameraTrigger,
        encode_camera_trigger (options_.master == Master::dmd, kCameraPulse)));
    if (!wait_for (cancel_, std::chrono::nanoseconds (plan.frame_period ())))
      return error ("start the sequence", "cancelled", ErrorCode::cancelled);
    const Bytes on{1};
    auto reply = ask (PacketType::write, kRun, on);
    running_ = !reply || reply->refused == 0;
    RETURN_IF_ERROR (payload_of ("start the sequence", std::move (reply)));
    return {};
  }

private:
  struct Reply {
    std::uint8_t refused = 0; ///< error code, 0: done
    Bytes payload = {};
  };

  /** Begins a job, with a new connection if the last one failed. */
  Result<void> begin (std::stop_token stop_token = {},
      std::chrono::milliseconds patience = kPatience)
  {
    cancel_ = std::move (stop_token);
    patience_ = patience;
    if (!stream_) {
      ASSIGN_OR_RETURN (stream_,
          with_prefix (TcpStream::connect (host_, port_, patience_, cancel_),
              info_.name + ": "));
    }
    stream_->cancel_on (cancel_);
    return {};
  }

  bool park () override
  {
    const Bytes off{0};
    return begin ({}, kStopPatience) && write ("stop the sequence", kRun, off);
  }

  Error error (const char *what, const std::string &reason,
      ErrorCode code = ErrorCode::device) const
  {
    return Error{info_.name + ": cannot " + what + ": " + reason, code};
  }

  /** The reply to @p packet; replies to other commands are late ones. */
  Result<Reply> exchange (const Bytes &packet, std::uint16_t command)
  {
    RETURN_IF_ERROR (stream_->send (packet, patience_));
    for (int replies = 0; replies <= kMaxStrayReplies; replies++) {
      ASSIGN_OR_RETURN (Bytes answer, stream_->receive (kHeadSize, patience_));
      ASSIGN_OR_RETURN (const PacketHead head, parse_head (answer));
      ASSIGN_OR_RETURN (
          const Bytes rest, stream_->receive (head.payload + 1, patience_));
      append (answer, rest);
      if (!checksum_holds (answer))
        return Error{"the checksum of a reply is wrong", ErrorCode::device};
      if (head.command != command)
        continue;
      Reply reply{0, Bytes (rest.begin (), rest.end () - 1)};
      if (head.type == PacketType::busy)
        reply.refused = kBusy;
      if (head.type == PacketType::error)
        reply.refused =
            reply.payload.empty () ? std::uint8_t (1) : reply.payload.front ();
      return reply;
    }
    return Error{"it replies to other commands only", ErrorCode::device};
  }

  Result<Reply> ask (PacketType type, std::uint16_t command, ByteView payload)
  {
    const Bytes packet = encode_message (type, command, payload);
    for (;;) {
      auto reply = exchange (packet, command);
      if (!reply) // what follows on this connection may begin within a packet
        stream_.reset ();
      if (!reply || reply->refused != kBusy || patience_ <= kBusyPause)
        return reply;
      patience_ -= kBusyPause;
      if (!wait_for (cancel_, kBusyPause))
        return Error{"cancelled", ErrorCode::cancelled};
    }
  }

  /** The payload of a reply, or why the board cannot do @p what. */
  Result<Bytes> payload_of (const char *what, Result<Reply> reply) const
  {
    if (!reply)
      return error (what, reply.error ().message, reply.error ().code);
    if (reply->refused != 0)
      return error (what, error_text (reply->refused));
    return std::move (reply->payload);
  }

  Result<void> write (const char *what, std::uint16_t command, ByteView payload)
  {
    RETURN_IF_ERROR (
        payload_of (what, ask (PacketType::write, command, payload)));
    return {};
  }

  Result<void> set_sequence (const PatternTime &time)
  {
    Sequence sequence{.patterns = schedule_->masks (),
        .period = time.exposure + time.dark,
        .exposure = time.exposure};
    if (options_.master == Master::camera)
      sequence.trigger =
          options_.falling_edge ? Trigger::falling : Trigger::rising;
    constexpr std::uint8_t kNotSupported = 2, kInvalid = 3;
    // Older firmware knows older, shorter forms only.
    Result<Reply> reply =
        ask (PacketType::write, kSequence, encode_sequence (sequence, 19));
    for (const int bytes : {18, 17})
      if (reply &&
          (reply->refused == kNotSupported || reply->refused == kInvalid))
        reply = ask (
            PacketType::write, kSequenceOld, encode_sequence (sequence, bytes));
    RETURN_IF_ERROR (payload_of ("set up the sequence", std::move (reply)));
    return {};
  }

  /** The masks of a sequence follow its setting, which forgets them. */
  Result<void> send_masks (
      const PatternTime &time, const UploadProgress &progress)
  {
    const Bytes off{0}, sequence_mode{kModeSequence};
    RETURN_IF_ERROR (write ("stop the sequence", kRun, off));
    running_ = false;
    RETURN_IF_ERROR (
        write ("change the display mode", kDisplayMode, sequence_mode));
    time_ = {}; // until all is sent
    RETURN_IF_ERROR (set_sequence (time));

    const int masks = schedule_->masks ();
    const MaskRenderer renderer (*schedule_, info_.size, options_.placement);
    for (int mask = 0; mask < masks; mask++) {
      progress (mask, masks);
      if (cancel_.stop_requested ())
        return Error{info_.name + ": upload cancelled", ErrorCode::cancelled};
      Bytes payload{std::uint8_t (mask)};
      append (payload, encode_bitmap (renderer.render (mask)));
      RETURN_IF_ERROR (write ("send a mask", kPattern, payload));
    }
    progress (masks, masks);
    time_ = time;
    return {};
  }

  const std::string host_;
  const int port_;
  std::unique_ptr<TcpStream> stream_;
  std::string version_;
  std::stop_token cancel_;
  std::chrono::milliseconds patience_ = kPatience; // that is left to the job
  std::optional<Schedule> schedule_;               // on the board
  PatternTime time_;                               // of its masks
};

} // namespace

Result<std::unique_ptr<Dmd>>
open_lightcrafter (std::string_view device)
{
  ASSIGN_OR_RETURN (const DmdOptions options, DmdOptions::parse (device));
  const auto parts = split (options.which, ':');
  constexpr int kPort = 21845, kMaxPort = 65535;
  const auto port = parts.size () < 2 ? kPort : parse_int (parts[1]);
  if (parts.size () > 2 || !port || *port < 1 || *port > kMaxPort)
    return Error{"DMD " + in_quotes (device) +
                 ": write lightcrafter:ADDRESS or lightcrafter:ADDRESS:PORT"};
  const std::string host =
      parts[0].empty () ? "192.168.1.100" : std::string (parts[0]);
  auto dmd = std::make_unique<Lightcrafter> (host, *port, options);
  RETURN_IF_ERROR (dmd->open ());
  return std::unique_ptr<Dmd> (std::move (dmd));
}

} // namespace codedexposure
