/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure simulate: a video or a test picture through the simulated
 * bench. */
#include "command.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/source.h"

namespace codedexposure::app
{

namespace
{

class Simulate
{
public:
  void declare (Options &options)
  {
    options.heading ("");
    options.value ("--output", output_, "FILE.mkv", "the recording",
        file_ending_in (".mkv"));
    options.require ("--output", "FILE.mkv");
    source_.declare (options, SourceOptions::Kind::simulated);
    run_.declare (options);
  }

  Exit run ()
  {
    constexpr int kFrames = 100; // of a scene that has no end
    start_gstreamer ();
    if (!source_.input && !source_.frames)
      source_.frames = kFrames;
    Job job ("simulate", run_);
    const SourcePlan plan = SourcePlan::make (source_);
    Chain chain = simulation (job, source_, plan, Pace::fast);
    limit_frames (job, source_, chain);
    RecordingStyle style;
    style.rate = plan.frame_rate;
    write_recording (job, chain, *output_, style);
    return play (job).exit;
  }

private:
  SourceOptions source_;
  RunOptions run_;
  std::optional<Text> output_;
};

} // namespace

Command
simulate_command ()
{
  return make_command<Simulate> ({.name = "simulate",
      .summary = "record a scene through the simulated bench",
      .usage = "[option...] --output FILE.mkv",
      .description = R"(
Simulates the recording of a scene by a camera with a DMD. Writes coded frames
as lossless FFV1 in Matroska with the schedule, and FILE.jsonl with one line for
each frame. Needs no hardware.
)",
      .notes = R"(
Examples:
  A moving ball, for 2 s, seen by a camera with shot noise:
    codedexposure simulate --frames 50 --full-well 10000 \
      --output coded.mkv
  A candle that is blown out, with 12 bits:
    codedexposure simulate --scene blown-out --bits 12 \
      --output candle.mkv
  A video of your own; 8 of its frames become one coded frame:
    codedexposure simulate --input video.mp4 \
      --schedule sequential:4x2 --output video.mkv
)"});
}

} // namespace codedexposure::app
