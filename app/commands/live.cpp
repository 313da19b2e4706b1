/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure live: coded frames and subframes in a window. */
#include "command.h"
#include "options/picture.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/source.h"
#include "window/window.h"

namespace codedexposure::app
{

namespace
{

class Live
{
public:
  void declare (Options &options)
  {
    options.heading ("");
    decode_.declare_method (options, "the stream");
    options.value ("--fuse", decode_.fuse, "QUALITY",
        "also full-size frames, in a third picture: fast; if fusion is too "
        "slow, it skips coded frames",
        one_of ({"fast", "balanced", "best", "learned"}));
    options.value ("--record", record_, "FILE.mkv",
        "also record all coded frames, with --second those of both cameras",
        file_ending_in (".mkv"));
    window_.declare (options);
    options.flag ("--second", second_,
        "also look through a second camera, in the beam of the mirrors that "
        "are off: a last picture is the sum of both, and --fuse has both");
    beside_.declare (options);
    source_.declare (options, SourceOptions::Kind::watched);
    run_.declare (options);
    options.need ({"--force"}, "--record");
    beside_.declare_relations (options);
  }

  Exit run ()
  {
    constexpr int kWaiting = 8; // frames, for the demultiplexer
    constexpr Nanoseconds kPatience = 100'000'000;
    if (second_)
      beside_.check (source_);
    start_gstreamer ();
    Job job ("live", run_);
    job.ends_by_signal = true;
    const SourcePlan plan = this->plan ();
    Chain frames = second_ ? coded_pairs (job, source_, plan, Pace::live,
                                 beside_, kPatience)
                           : coded_source (job, source_, plan, Pace::live);
    if (record_)
      frames = job.graph.from (add_recording (job, frames, plan), "src_%u");
    job.keeper = window_.add_keeper (frames, "live", source_.bits);
    job.counted = frames.queue (kWaiting).last ();
    if (second_)
      window_.last = "sum";
    add_window (job, panes (job, frames), window_, source_.bits);
    return play (job).exit;
  }

private:
  /* A fast event that comes again. */
  SourcePlan plan ()
  {
    constexpr std::uint64_t kRepeat = 1'500'000'000; // ns
    if (source_.is_simulated () && !source_.input && !source_.pattern)
      source_.scene = source_.scene.value_or ("pour");
    SourcePlan plan = SourcePlan::make (source_);
    if (source_.scene && *source_.scene != "candle")
      plan.scene_repeat = kRepeat;
    return plan;
  }

  /* Returns the tee before the recording. If that fails, the window goes on. */
  GstElement *add_recording (
      Job &job, Chain &chain, const SourcePlan &plan) const
  {
    GstElement *tee = chain.to ("tee").last ();
    Chain recorded = job.graph.from (tee, "src_%u");
    RecordingStyle style;
    style.live = is_live (source_, Pace::live);
    style.rate = plan.frame_rate;
    write_recording (job, recorded, *record_, style);
    job.buffer_may_fail = true;
    return tee;
  }

  /* Frames of both cameras go to what needs both before they are split. */
  std::vector<Chain> panes (Job &job, Chain &frames) const
  {
    GstElement *both = second_ ? frames.to ("tee").last () : nullptr;
    Chain split = both ? job.graph.from (both, "src_%u") : frames;
    GstElement *demux =
        split
            .to ("codedexposure-demux",
                {{"method", decode_.method}, {"mapping", decode_.mapping}})
            .last ();
    Chain coded = job.graph.from (demux, "coded");
    const Chain fast = job.graph.from (demux, "src");
    if (!both && !decode_.fuse)
      return {coded, fast};
    GstElement *tee = both ? both : coded.to ("tee").last ();
    std::vector<Chain> panes{
        both ? coded : job.graph.from (tee, "src_%u"), fast};
    add_fused (job, tee, panes);
    return panes;
  }

  void add_fused (Job &job, GstElement *tee, std::vector<Chain> &panes) const
  {
    const auto branch = [&] (const char *name) -> Chain & {
      return panes.emplace_back (job.graph.from (tee, "src_%u"))
          .to ("queue", {{"name", name}, {"leaky", "downstream"},
                            {"max-size-buffers", 4}});
    };
    if (decode_.fuse)
      job.hurried.push_back (
          branch ("fusing")
              .to ("codedexposure-fuse",
                  {{"quality", decode_.fuse}, {"mapping", decode_.mapping},
                      {"full-well", source_.full_well},
                      {"read-noise", source_.read_noise}})
              .last ());
    if (second_)
      job.hurried.push_back (
          branch ("adding").to ("codedexposure-sum").last ());
  }

  SourceOptions source_;
  DecodeOptions decode_;
  WindowOptions window_;
  RunOptions run_;
  std::optional<Text> record_;
  bool second_ = false;
  SecondCamera beside_;
};

} // namespace

Command
live_command ()
{
  return make_command<Live> ({.name = "live",
      .summary = "watch coded frames and subframes in a window",
      .usage = "[option...]",
      .description = R"(
Shows coded frames and subframes in a window. The frames of the camera are on
the left, the subframes, at N times the frame rate, on the right; below are what
is known of the frame, the losses, and the histogram of its exposure. Pictures
are scaled so that the window fits the screen. Ends after --frames, with Ctrl-C
or when the window is closed.
Without another scene or a camera, the simulated bench looks at a liquid that is
poured again every 1.5 s.

)" + WindowOptions::keys_of ("live"),
      .notes = R"(
Exit status: 1 if what was to be kept could not be written, or --keep-on could
see no event; 3 if frames were lost in the file of --record.

Examples:
  The simulated bench, whose camera looks at a candle:
    codedexposure live --scene candle --frames 100
  The same with the default scene, a liquid, which is also recorded:
    codedexposure live --frames 100 --record watched.mkv
  A camera, which a DMD on the USB triggers:
    codedexposure live --camera "Allied Vision-0123456789" --device usb: \
      --size 768x576
)"});
}

} // namespace codedexposure::app
