/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure record: coded frames of a camera, or of the simulated bench, to
 * a file. */
#include "command.h"
#include "pipeline/codec_choice.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/source.h"

namespace codedexposure::app
{

namespace
{

class Record
{
public:
  void declare (Options &options)
  {
    options.heading ("");
    options.value ("--output", output_, "FILE.mkv", "the recording",
        file_ending_in (".mkv"));
    options.require ("--output", "FILE.mkv");
    options.value ("--codec", codec_, "C",
        "ffv1: half of the space, but a core for 0.03 GB/s; raw: as fast as "
        "the disk; auto: measures for some seconds, takes ffv1 if it is fast "
        "enough, else raw [ffv1]",
        one_of ({"ffv1", "raw", "auto"}));
    options.value ("--threads", threads_, "N",
        "threads of ffv1; pixels do not depend on them [one for each "
        "processor]",
        whole (1, 64));
    options.value ("--second", second_, "FILE.mkv",
        "also the recording of a second camera, in the beam of the mirrors "
        "that are off",
        file_ending_in (".mkv"));
    options.flag ("--both", both_,
        "the recording also has the frames of a second camera, with those of "
        "the first that have the same exposure");
    beside_.declare (options);
    options.flag (
        "--fast", fast_, "run the bench as fast as possible, not in real time");
    source_.declare (options);
    options.exclude ({"--fast"}, "--camera");
    options.exclude ({"--source", "--both"}, "--second");
    options.exclude ({"--source"}, "--both");
    run_.declare (options);
  }

  Exit run ()
  {
    if (second_ || both_)
      beside_.check (source_);
    else if (beside_.camera || beside_.bench)
      usage_error ("--second-camera and --second-bench are for two cameras: "
                   "set --both, or --second for a recording of its own");
    if (threads_ && codec_ == "raw")
      usage_error ("--threads is for ffv1; leave it or --codec raw out");
    start_gstreamer ();
    Job job ("record", run_);
    job.ends_by_signal = true;
    const SourcePlan plan = SourcePlan::make (source_);
    constexpr Nanoseconds kPatience = 1'000'000'000; // nobody looks on
    const Pace pace = fast_ ? Pace::fast : Pace::live;
    if (second_)
      return record_both (job, plan, pace);
    Chain chain =
        both_ ? coded_pairs (job, source_, plan, pace, beside_, kPatience)
              : coded_source (job, source_, plan, pace);
    write_recording (job, chain, *output_, style (plan, pace));
    return play (job).exit;
  }

private:
  Exit record_both (Job &job, const SourcePlan &plan, Pace pace) const
  {
    auto [first, other] = coded_sources (job, source_, plan, pace, beside_);
    const RecordingStyle style = this->style (plan, pace);
    write_recording (job, first, *output_, style);
    write_recording (job, other, *second_, style);
    return play (job).exit;
  }

  RecordingStyle style (const SourcePlan &plan, Pace pace) const
  {
    /* A frame has a line in the track and an entry in the index. */
    constexpr std::uint64_t kBeside = 4096;
    RecordingStyle style{.codec = codec_.value_or ("ffv1"),
        .threads = threads_,
        .live = is_live (source_, pace),
        .rate = plan.frame_rate};
    const bool size_is_known = source_.size || !source_.source;
    if (style.codec == "auto") {
      if (!size_is_known)
        usage_error ("--codec auto measures with frames of the camera; set "
                     "their --size");
      Status status ("record", run_.verbose);
      style.codec = choose_codec (plan, *output_, status);
    }
    if (source_.frames && size_is_known)
      style.bytes =
          std::uint64_t (*source_.frames) * (plan.frame_bytes () + kBeside);
    return style;
  }

  SourceOptions source_;
  RunOptions run_;
  std::optional<Text> output_, codec_, second_;
  SecondCamera beside_; // whose recording is second_, or of both
  std::optional<int> threads_;
  bool fast_ = false, both_ = false;
};

} // namespace

Command
record_command ()
{
  return make_command<Record> ({.name = "record",
      .summary = "record the coded frames of a camera",
      .usage = "[option...] --output FILE.mkv",
      .description = R"(
Records coded frames of a camera or of the simulated bench. Writes them without
loss in Matroska with the schedule, and FILE.jsonl with one line for each frame
(number, time, synchronisation, losses). Ends after --frames, at the end of the
scene or with Ctrl-C. "codedexposure decode" decodes the recording later, with
any method; "codedexposure pack" turns a raw one into FFV1.
)",
      .notes = R"(
Exit status: 0 recorded, 1 failed, 2 wrong usage, 3 recorded, but frames were
lost, 130 stopped before the first frame.

Examples:
  The simulated bench, for 2 s:
    codedexposure record --frames 50 --output bench.mkv
  12 bits and the code of the paper, as fast as possible:
    codedexposure record --fast --bits 12 \
      --schedule staircase:2x2 --frames 50 --output staircase.mkv
  A camera, which a DMD on the USB triggers, with the codec for which this
  machine is fast enough:
    codedexposure record --camera "Allied Vision-0123456789" \
      --device usb: --size 768x576 --codec auto --output camera.mkv
)"});
}

} // namespace codedexposure::app
