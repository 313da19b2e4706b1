/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure live: coded frames and subframes in a window. */
#include "command.h"
#include "options/picture.h"
#include "pipeline/plugin.h"
#include "pipeline/recording.h"
#include "pipeline/source.h"
#include "window/window.h"

namespace codedexposure::app
{

namespace
{

class Live : public Command
{
public:
  CommandText text () const override;
  void declare (Options &options) override;
  Exit run () override;

private:
  SourcePlan plan ();
  GstElement *add_recording (
      Job &job, Chain &chain, const SourcePlan &plan) const;
  std::vector<Chain> panes (Job &job, Chain &frames) const;

  SourceOptions source_;
  DecodeOptions decode_;
  WindowOptions window_;
  RunOptions run_;
  std::optional<Text> record_;
};

CommandText
Live::text () const
{
  return {.name = "live",
      .summary = "watch coded frames and subframes in a window",
      .usage = "[option...]",
      .description =
          "Shows coded frames and subframes in a window. The frames of the "
          "camera are on\nthe left, the subframes, at N times the frame rate, "
          "on the right; below are what\nis known of the frame, the losses, "
          "and the histogram of its exposure. Pictures\nare scaled so that the "
          "window fits the screen. Ends after --frames, with Ctrl-C\nor when "
          "the window is closed.\n"
          "Without another scene or a camera, the simulated bench looks at a "
          "liquid that is\npoured again every 1.5 s.\n\n" +
          WindowOptions::keys_of ("live"),
      .notes = "Exit status: 3 if frames were lost in the file of --record.\n",
      .examples =
          "  The simulated bench, whose camera looks at a candle:\n"
          "    codedexposure live --scene candle --frames 100\n"
          "  The same with the default scene, a liquid, which is also "
          "recorded:\n"
          "    codedexposure live --frames 100 --record watched.mkv\n"
          "  A camera, which a DMD on the USB triggers:\n"
          "    codedexposure live --camera \"Allied Vision-0123456789\" "
          "--device usb: \\\n      --size 768x576\n"};
}

void
Live::declare (Options &options)
{
  options.heading ("");
  decode_.declare_method (options, "the stream");
  options.value ("--fuse", decode_.fuse, "QUALITY",
      "also full-size frames, in a third picture: fast; if fusion is too slow, "
      "it skips coded frames",
      one_of ({"fast", "balanced", "best", "learned"}));
  options.value ("--record", record_, "FILE.mkv",
      "also record all coded frames", file_ending_in (".mkv"));
  window_.declare (options);
  source_.declare (options, SourceOptions::Kind::watched);
  run_.declare (options);
  options.need ({"--force"}, "--record");
}

/* A fast event that comes again. */
SourcePlan
Live::plan ()
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
GstElement *
Live::add_recording (Job &job, Chain &chain, const SourcePlan &plan) const
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

std::vector<Chain>
Live::panes (Job &job, Chain &frames) const
{
  Settings settings;
  set_if (settings, "method", decode_.method);
  set_if (settings, "mapping", decode_.mapping);
  GstElement *demux = frames.to ("codedexposure-demux", settings).last ();
  Chain coded = job.graph.from (demux, "coded");
  const Chain fast = job.graph.from (demux, "src");
  if (!decode_.fuse)
    return {coded, fast};
  GstElement *tee = coded.to ("tee").last ();
  Settings of_fuse{{"quality", *decode_.fuse}};
  set_if (of_fuse, "mapping", decode_.mapping);
  set_if (of_fuse, "full-well", source_.full_well);
  set_if (of_fuse, "read-noise", source_.read_noise);
  Chain full = job.graph.from (tee, "src_%u");
  full.to ("queue", {{"name", "fusing"}, {"leaky", "downstream"},
                        {"max-size-buffers", 4}})
      .to ("codedexposure-fuse", of_fuse);
  return {job.graph.from (tee, "src_%u"), fast, full};
}

Exit
Live::run ()
{
  constexpr int kWaiting = 8; // frames, for the demultiplexer
  start_gstreamer ();
  Job job ("live", run_);
  job.ends_by_signal = true;
  const SourcePlan plan = this->plan ();
  Chain frames = coded_source (job, source_, plan, Pace::live);
  if (record_)
    frames = job.graph.from (add_recording (job, frames, plan), "src_%u");
  job.keeper = window_.add_keeper (frames, "live", source_.bits);
  job.counted = frames.queue (kWaiting).last ();
  add_window (job, panes (job, frames), window_, source_.bits);
  return play (job).exit;
}

} // namespace

std::unique_ptr<Command>
live_command ()
{
  return make_command<Live> ();
}

} // namespace codedexposure::app
