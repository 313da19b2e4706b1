/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure calibrate: aligns the camera with the mirrors and measures the
 * mapping. */
#include <cstdlib>
#include <filesystem>

#include "base/text.h"
#include "command.h"
#include "pipeline/guide.h"
#include "pipeline/program.h"
#include "pipeline/source.h"
#include "pipeline/video_output.h"

namespace codedexposure::app
{

namespace
{

/* Of a simulated bench, as a part of what saturates its camera. */
constexpr double kWhite = 0.8;

class Calibrate
{
public:
  void declare (Options &options)
  {
    declared_ = &options;
    options.heading ("");
    options.value ("--output", output_, "FILE.json",
        "the mapping [mapping.json]", file_ending_in (".json"));
    options.value ("--report", report_, "FILE.png",
        "picture of fringes, residuals and pixels [beside it]",
        file_ending_in (".png"));
    options.value ("--second", second_, "FILE.json",
        "also the mapping of a second camera, in the other beam, and a picture "
        "beside it",
        file_ending_in (".json"));
    beside_.declare (options);
    options.value ("--mode", mode_, "M",
        "auto, align (no mapping) or map (immediately) [auto]",
        one_of ({"auto", "align", "map"}));
    options.value ("--stage", stage_, "WHO",
        "who moves the stage: hand (you) or simulated (this program, only on "
        "the simulated bench) [simulated there]",
        one_of ({"hand", "simulated"}));
    options.value ("--mirror-pitch", mirror_pitch_, "UM",
        "stage travel for one mirror, µm [7.56]",
        real (1e-3, 1e6, "a number of micrometres"));
    options.value ("--tolerance", tolerance_, "M",
        "largest deviation of an aligned camera, mirrors [0.05]",
        real (0, 1e6, "a number of mirrors"));
    options.value ("--sink", sink_, "\"GST\"",
        "video sink [autovideosink; fakesink without a screen]");
    source_.declare (options);
    run_.declare (options);
    beside_.declare_relations (options);
  }

  Exit run ()
  {
    check ();
    const bool simulated = source_.is_simulated ();
    start_gstreamer ();
    if (simulated)
      set_up_bench ();
    const SourcePlan plan = SourcePlan::make (source_);
    if (simulated)
      set_up_device (plan);
    const std::string sink = this->sink ();
    const bool fast = sink.starts_with ("fakesink") &&
                      sink.find ("sync=true") == std::string::npos;
    Job job ("calibrate", run_);
    const Pace pace = fast ? Pace::fast : Pace::live;
    constexpr Nanoseconds kPatience = 200'000'000;
    Chain chain =
        second_ ? coded_pairs (job, source_, plan, pace, beside_, kPatience)
                : coded_source (job, source_, plan, pace);
    chain.to ("moirecalib", {{"mode", mode_}, {"mirror-pitch", mirror_pitch_},
                                {"tolerance", tolerance_}});
    GstElement *calib = chain.last ();
    job.counted = calib;
    if (mode_ != "align")
      write (job, calib);
    chain.queue (2, "downstream");
    add_view (chain, source_.bits);
    /* A window that is made larger shows a larger picture. */
    if (!sink_)
      chain.to ("videoscale");
    chain.to ("videoconvert").to (job.graph.add_text (sink));
    const bool moves =
        simulated && stage_.value_or ("simulated") == "simulated";
    return guide (job, calib, moves ? job.bench : nullptr);
  }

private:
  /* What the relations between options cannot say. */
  void check () const
  {
    if (stage_ == "simulated" && !source_.is_simulated ())
      usage_error ("--stage simulated needs the simulated bench; leave out "
                   "--camera and --source");
    for (const char *name : {"--output", "--report", "--second", "--force"})
      if (mode_ == "align" && declared_->has (name))
        usage_error (std::string (name) +
                     " is for a mapping, which --mode align "
                     "does not measure; leave one of them "
                     "out");
    if (second_)
      beside_.check (source_);
  }

  /* A bench that was just assembled, in white light that stays below the
   * largest value of the camera. */
  void set_up_bench ()
  {
    const std::string schedule = source_.schedule_text ();
    if (!source_.pattern && !source_.input && !source_.scene)
      source_.pattern = "white";
    if (!source_.gain && schedule.starts_with ("sequential:"))
      source_.gain =
          kWhite * value_of (Schedule::parse (schedule), Exit::usage).slots ();
    else if (!source_.gain && schedule.starts_with ("staircase:"))
      source_.gain = kWhite;
    if (source_.bench)
      return;
    source_.full_well = source_.full_well.value_or (10000);
    source_.read_noise = source_.read_noise.value_or (5);
    source_.psf_sigma = source_.psf_sigma.value_or (0.5);
    beside_.simulate = [this] (
                           SourceOptions &second) { set_up_second (second); };
    if (source_.shift_x || source_.shift_y || source_.rotation || source_.scale)
      return;
    source_.shift_x = 0.4;
    source_.shift_y = -0.3;
    source_.rotation = 0.5;
    source_.scale = 1.01;
  }

  /* It gets the light of all slots. */
  void set_up_second (SourceOptions &second) const
  {
    second.gain = kWhite;
    second.shift_x = -source_.shift_x.value_or (0);
    second.shift_y = source_.shift_y.value_or (0);
    second.rotation = -source_.rotation.value_or (0);
    second.scale = source_.scale;
  }

  void set_up_device (const SourcePlan &plan)
  {
    Extent mirrors = plan.size;
    if (plan.bench && plan.bench->mapping)
      mirrors = plan.bench->mapping->mirrors ();
    if (!source_.device)
      source_.device = "sim:bench,size=" + size_text (mirrors);
  }

  std::string sink () const
  {
    if (sink_)
      return *sink_;
    const bool has_screen =
        std::getenv ("DISPLAY") || std::getenv ("WAYLAND_DISPLAY");
    return has_screen ? "autovideosink" : "fakesink sync=true";
  }

  void write (Job &job, GstElement *calib) const
  {
    const auto picture_of = [] (const std::string &mapping) {
      return std::filesystem::path (mapping)
          .replace_extension (".png")
          .string ();
    };
    job.outputs.file (calib, "location", output_, {});
    job.outputs.file (
        calib, "report", report_.value_or (picture_of (output_)), {});
    if (!second_)
      return;
    job.outputs.file (calib, "second-location", *second_, {});
    job.outputs.file (calib, "second-report", picture_of (*second_), {});
  }

  const Options *declared_ = nullptr;
  SourceOptions source_;
  RunOptions run_;
  std::string output_ = "mapping.json";
  std::optional<Text> report_, second_, mode_, stage_, sink_;
  SecondCamera beside_; // whose mapping is second_
  std::optional<double> mirror_pitch_, tolerance_;
};

} // namespace

Command
calibrate_command ()
{
  return make_command<Calibrate> ({.name = "calibrate",
      .summary = "align the camera with the mirrors and measure the mapping",
      .usage = "[option...]",
      .description = R"(
Guides you through the alignment of camera and mirrors. It shows a grating on
the DMD and displays the fringes and the required stage travel, in a window and
on the terminal. When the camera is aligned, or when you press Enter, it shows
the calibration patterns, returns the mirrors to the schedule and writes the
mapping. The mapping corrects the remaining misalignment:
  codedexposure-demux mapping=FILE

Use a plain, bright, static target. Nothing may move in the picture.
By default, the simulated bench is misaligned and has noise; with --bench, it is
the one that was measured.
)",
      .notes = R"(
Examples:
  The simulated bench, which moves its own stage:
    codedexposure calibrate --size 384x288 --output simulated.json
  The mapping as the bench stands, without alignment:
    codedexposure calibrate --size 384x288 --mode map \
      --output mapping.json
  A camera and a DMD on the USB; you move the stage:
    codedexposure calibrate --camera "Allied Vision-0123456789" \
      --device usb: --size 768x576 --output camera.json
)"});
}

} // namespace codedexposure::app
