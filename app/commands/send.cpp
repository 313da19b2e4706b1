/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure send: coded frames to other machines. */
#include "command.h"
#include "options/network.h"
#include "pipeline/program.h"
#include "pipeline/source.h"

namespace codedexposure::app
{

namespace
{

class Send
{
public:
  void declare (Options &options)
  {
    options.heading ("");
    address_.declare (
        options, "address to listen on; 0.0.0.0: all addresses", "TCP port");
    options.value ("--codec", codec_, "C",
        "raw, or ffv1: lossless, half of the data, but a good part of a core "
        "[raw for 8 bits, else ffv1]",
        one_of ({"raw", "ffv1"}));
    options.flag ("--second", second_,
        "also send the frames of a second camera, in the beam of the mirrors "
        "that are off, with those of the first that have the same exposure");
    beside_.declare (options);
    options.flag ("--no-wait", no_wait_,
        "start immediately; late receivers miss the beginning");
    source_.declare (options);
    run_.declare (options, false);
    beside_.declare_relations (options);
  }

  Exit run ()
  {
    if (second_)
      beside_.check (source_);
    if (!run_.print)
      address_.check ();
    start_gstreamer ();
    Job job ("send", run_);
    job.ends_by_signal = true;
    const SourcePlan plan = SourcePlan::make (source_);
    const std::string codec =
        codec_.value_or (plan.is_deep () ? "ffv1" : "raw");
    constexpr Nanoseconds kPatience = 200'000'000;
    Chain frames = second_ ? coded_pairs (job, source_, plan, Pace::live,
                                 beside_, kPatience)
                           : coded_source (job, source_, plan, Pace::live);
    job.counted = frames.to ("queue").last ();
    frames.to (
        "codedexposure-recordmux", {{"codec", codec}, {"streamable", true}});
    add_server (job, frames);
    return play (job).exit;
  }

private:
  /* A receiver for which 500 buffers wait, those of some 80 frames, is
   * disconnected, to limit the memory. */
  void add_server (Job &job, Chain &frames) const
  {
    frames.to ("tcpserversink",
        {{"host", address_.host ()}, {"port", address_.port ()},
            {"sync-method", "burst-keyframe"}, {"burst-format", "buffers"},
            {"burst-value", 50}, {"buffers-min", 100}, {"buffers-max", 500}});
    job.server = frames.last ();
    job.waits_for_receiver = !no_wait_;
  }

  SourceOptions source_;
  AddressOptions address_;
  RunOptions run_;
  std::optional<Text> codec_;
  SecondCamera beside_;
  bool no_wait_ = false, second_ = false;
};

} // namespace

Command
send_command ()
{
  return make_command<Send> ({.name = "send",
      .summary = "send the coded frames of a camera to other machines",
      .usage = "[option...]",
      .description = R"(
Sends coded frames to other machines. The stream (Matroska over TCP) has their
schedule and all that is known of each frame. It goes to any number of receivers
(codedexposure receive) and starts with the first.
The stream is neither encrypted nor authenticated: outside this machine, use a
private network or a tunnel (ssh -L 5000:localhost:5000 BENCH).
)",
      .notes = R"(
Exit status: 4 if nobody received the stream.

Examples:
  The simulated bench, for 2 s, to a receiver on this machine:
    codedexposure send --frames 50
  12 bits, through another port:
    codedexposure send --bits 12 --port 5001 --frames 50
  A camera, to receivers on any machine:
    codedexposure send --camera "Allied Vision-0123456789" --device usb: \
      --size 768x576 --host 0.0.0.0
)"});
}

} // namespace codedexposure::app
