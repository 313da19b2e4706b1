/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure decode: a recording to subframes, or to full-size frames. */
#include <atomic>
#include <cmath>

#include "command.h"
#include "common/messages.h"
#include "common/meta.h"
#include "options/picture.h"
#include "pipeline/decoder.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"
#include "pipeline/partner_seek.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/status.h"
#include "pipeline/video_output.h"
#include "record/matroska.h"

namespace codedexposure::app
{

namespace
{

class Decode
{
public:
  void declare (Options &options)
  {
    declared_ = &options;
    options.word ("RECORDING.mkv", recording_);
    options.heading ("");
    options.value ("--output", output_, "OUT", "subframes");
    options.value ("--coded", coded_, "OUT",
        "also write the coded frames, in one of the same formats");
    options.value ("--statistics", statistics_, "FILE",
        "also list and measure each picture of OUT: a line of CSV with its "
        "time, slot, losses and flags, and mean, minimum, maximum, entropy and "
        "saturated pixels");
    decode_.declare (options);
    options.value ("--second", second_, "FILE.mkv",
        "with --fuse: the recording of a second camera, in the beam of the "
        "mirrors that are off, at the same time",
        file_ending_in (".mkv"));
    options.value ("--uncertainty", uncertainty_, "OUT",
        "with --fuse: also write the uncertainty of each pixel: half the width "
        "of the interval that holds 68 % of the errors, in 1/65280 of white; "
        "16 bits, in the same formats but .mp4");
    options.value ("--region", region_, "I",
        "for a schedule with regions: the subframes of region I, from 0 on, "
        "instead of the background",
        whole (0, 63, "the number of a region"));
    options.flag ("--deflate", deflate_,
        "compress .ome.tif, .h5 and .ome.zarr, without loss");
    options.flag ("--view", view_,
        "scale pictures (PNG) to 8 bits; without it, they keep the pixel "
        "values, which many programs show dark");
    options.value ("--white", white_, "DN",
        "with --view and in .mp4: the pixel value that becomes white, for a "
        "dark scene [the largest of the bits]",
        whole (1, 65535, "a pixel value"));
    options.flag ("--find-phase", find_phase_,
        "find the phase of the tile of a staircase, for a recording without "
        "calibration, and print the --schedule with it; reads 10 s unless "
        "--duration is set");
    options.value ("--start", start_, "SECONDS",
        "begin with the first coded frame that is not before this position: "
        "the time since the first one [0]",
        seconds ());
    options.value ("--duration", duration_, "SECONDS",
        "duration to decode, exactly as in the whole recording: frames around "
        "it are read, too [all]",
        seconds (true));
    options.value ("--excerpt", excerpt_, "A-B",
        "the coded frames whose positions lie from A to before B (s; no B: to "
        "the end), in place of --start and --duration",
        excerpt_rule ());
    options.value ("--threads", threads_, "N",
        "threads of decoder, fusion and encoder; the pictures do not depend on "
        "it [one for each processor]",
        whole (1, 64));
    options.value ("--jobs", jobs_, "N",
        "decode on so many cores at the same time; the result is the same [1]",
        whole (1, 999));
    run_.declare (options);
    declare_relations (options);
  }

  Exit run ()
  {
    check ();
    start_gstreamer ();
    const RecordingInfo info = value_of (recording_info (recording_, false));
    if (second_ && info.head.has_partners ())
      usage_error (recording_ +
                   " has the frames of both cameras; leave out "
                   "--second " +
                   *second_);
    bool is_cut_short = info.is_cut_short;
    if (second_)
      is_cut_short |= value_of (recording_info (*second_, false)).is_cut_short;
    if (jobs_.value_or (1) > 1)
      decode_on_cores ();
    Status status ("decode", false);
    RunResult result = play_once (false, is_cut_short);
    if (run_.print)
      return result.exit;
    if (result.container_damaged && times ().is_part ()) {
      status.line (no_part_text (recording_));
      return Exit::failed;
    }
    if (result.container_damaged) {
      status.line (recording_ +
                   " is damaged between its frames; reading it from "
                   "front to back");
      result = play_once (true, is_cut_short);
    }
    if ((info.is_cut_short || info.is_open) && result.exit == Exit::failed &&
        result.frames == 0)
      status.line (
          recording_ + " is cut off and has no complete frame to decode");
    if (result.exit == Exit::damaged)
      status.line (
          recording_ + (second_ ? " or " + *second_ : "") +
          " is cut off or damaged; what could be decoded was" +
          (unflagged_ > 0 ? ""
                          : ", and pictures of damaged frames are flagged"));
    if (unflagged_ > 0)
      status.line (
          ".mp4 has no place for the flags of " + std::to_string (unflagged_) +
          " pictures of damaged or unsynchronised frames; add "
          "--statistics FILE.csv, which lists them, or use another form");
    return result.exit;
  }

private:
  void declare_relations (Options &options)
  {
    options.need ({"--uncertainty", "--second"}, "--fuse");
    options.need ({"--statistics"}, "--output");
    options.exclude ({"--region", "--method"}, "--fuse");
    options.exclude ({"--start", "--duration", "--find-phase"}, "--excerpt");
    options.exclude (
        {"--output", "--coded", "--uncertainty", "--method", "--mapping",
            "--bench", "--bits", "--fuse", "--region", "--force"},
        "--find-phase");
    options.exclude (
        {"--coded", "--uncertainty", "--start", "--duration", "--excerpt",
            "--find-phase", "--print", "--json", "--verbose", "--threads"},
        "--jobs");
  }

  /* What the relations between options cannot say. */
  void check () const
  {
    const auto is = [] (const std::optional<Text> &name, VideoForm form) {
      return name && form_of (*name) == form;
    };
    const auto any = [&] (VideoForm form) {
      return is (output_, form) || is (coded_, form) || is (uncertainty_, form);
    };
    if (!output_ && !coded_ && !find_phase_)
      usage_error ("set --output OUT");
    for (const char *name : {"--method", "--fuse", "--region", "--mapping"})
      if (declared_->has (name) && !output_ && !uncertainty_ && !second_)
        usage_error (name +
                     std::string (" is for pictures, and --coded keeps the "
                                  "frames as they are; set --output OUT, "
                                  "or leave ") +
                     name + " out");
    if (deflate_ && !any (VideoForm::stack))
      usage_error (
          "--deflate compresses .ome.tif, .h5 and .ome.zarr; set such an "
          "--output");
    if (view_ && !any (VideoForm::pictures))
      usage_error ("--view scales PNG to 8 bits; set such an --output");
    if (white_ && !view_ && !any (VideoForm::mp4))
      usage_error ("--white is for --view and .mp4; other files keep the pixel "
                   "values");
    if (is (uncertainty_, VideoForm::mp4))
      usage_error ("--uncertainty " + *uncertainty_ +
                   ": .mp4 does not keep values; end in .mkv, .ome.tif, .h5 or "
                   ".ome.zarr");
  }

  PlayTimes times () const
  {
    constexpr double kSearched = 10; // s
    const auto ns = [] (double value) {
      return GstClockTime (std::llround (value * 1e9));
    };
    PlayTimes times;
    if (excerpt_) {
      const auto [from, until] = excerpt_times (*excerpt_);
      times.start = ns (from);
      if (until)
        times.stop = ns (*until);
      return times;
    }
    std::optional<double> duration = duration_;
    if (find_phase_ && !duration)
      duration = kSearched;
    if (start_)
      times.start = ns (*start_);
    if (duration)
      times.stop = times.start.value_or (0) + ns (*duration);
    return times;
  }

  VideoStyle style () const
  {
    VideoStyle style;
    style.deflate = deflate_;
    style.view = view_;
    style.white = white_;
    style.bits = decode_.bits;
    style.threads = threads_;
    return style;
  }

  /* Of pictures that go to .mp4, which has no place for flags. */
  void count_flags (GstElement *queue, const std::string &output)
  {
    if (form_of (output) != VideoForm::mp4 || statistics_)
      return;
    watch_buffers (
        pad_of (queue, "src").get (), [this] (GstPad *, GstBuffer *picture) {
          const auto meta = gst::get_frame_meta (picture);
          if (gst::is_corrupted (picture) || (meta && meta->locked == false))
            unflagged_++;
        });
  }

  /* With those of the second camera, if there is one. */
  Chain read (Job &job) const
  {
    Chain frames = read_recording (job, recording_);
    if (!second_)
      return frames;
    GstElement *reader = job.reader;
    const bool is_finished = job.is_finished;
    Chain partners = read_recording (job, *second_);
    turn_seeks (
        partners.to ("identity").last (), pad_of (reader, "src").get ());
    job.reader = reader;
    job.source = recording_;
    job.is_finished &= is_finished;
    GstElement *pair = job.graph.add ("codedexposure-pair");
    partners.to (pair, "off");
    return frames.to (pair, "on");
  }

  void build (Job &job)
  {
    unflagged_ = 0;
    Chain frames = read (job);
    DecoderPads pads = decode_.fuse
                           ? add_fusion (job, frames, decode_, threads_)
                           : add_demux (job, frames, decode_, region_);
    job.times = times ();
    VideoStyle how = style ();
    how.coded = job.counted;
    if (output_) {
      Chain chain = pads.pictures;
      keep_times (chain.to ("queue").last ());
      count_flags (chain.last (), *output_);
      if (statistics_) {
        chain.to ("subframestats", {{"format", "csv"}, {"post-messages", false},
                                       {"bits", decode_.bits}});
        job.outputs.file (chain.last (), "location", *statistics_,
            {.frames = pad_of (chain.last (), "sink").get (), .sidecar = true});
      }
      write_video (job, chain, *output_, how);
    } else
      pads.pictures.to ("queue").to ("fakesink");
    if (coded_) {
      Chain chain = pads.coded ();
      keep_times (chain.to ("queue").last ());
      count_flags (chain.last (), *coded_);
      how.is_coded = true;
      write_video (job, chain, *coded_, how);
      how.is_coded = false;
    }
    if (uncertainty_) {
      Chain chain = pads.uncertainty ();
      how.view = false; // values keep their unit
      keep_times (chain.to ("queue").last ());
      write_video (job, chain, *uncertainty_, how);
    }
  }

  void build_search (Job &job) const
  {
    Chain chain = read_recording (job, recording_);
    chain.to ("moirecalib", {{"mode", "phase"}, {"overlay", false},
                                {"schedule", decode_.schedule}});
    job.counted = chain.last ();
    job.times = times ();
    chain.to ("fakesink");
  }

  RunResult play_once (bool salvage, bool is_cut_short)
  {
    Job job ("decode", run_);
    job.salvage = salvage;
    job.is_cut_short = is_cut_short;
    if (find_phase_)
      build_search (job);
    else
      build (job);
    if (threads_)
      g_object_set (job.reader, "threads", guint (*threads_), nullptr);
    job.on_message = [&job] (const GstStructure *message) {
      if (const auto phase = gst::from_structure<gst::MoirePhase> (message))
        job.schedule = phase->schedule;
    };
    job.judge = [this, &job] (const RunResult &run) {
      return run.exit == Exit::done && find_phase_ && job.schedule.empty ()
                 ? Exit::failed
                 : run.exit;
    };
    return play (job);
  }

  /* By the same chunks as an archive of this recording alone. */
  [[noreturn]] void decode_on_cores () const
  {
    if (!output_ || !form_of (*output_) || output_->ends_with (".png") ||
        output_->ends_with (".ome.zarr") || output_->ends_with (".ome.zarr/"))
      usage_error (
          "--jobs is for an --output that ends in .mkv, .mp4, .ome.tif, "
          ".h5 or /");
    std::vector<std::string> inputs{recording_};
    if (second_)
      inputs.push_back (*second_);
    for (const auto &written : {output_, statistics_}) {
      if (!written)
        continue;
      value_of (check_is_no_input (*written, inputs), Exit::usage);
      value_of (check_is_no_recording (*written), Exit::usage);
    }
    std::vector<std::string> words{"work", "decode", recording_, *output_,
        std::to_string (*jobs_), run_.force ? "1" : ""};
    for (const auto &given :
        {decode_.words (), declared_->given ({"--statistics", "--second",
                               "--region", "--white", "--view", "--deflate"})})
      words.insert (words.end (), given.begin (), given.end ());
    become_archive (words);
  }

  const Options *declared_ = nullptr;
  std::string recording_;
  DecodeOptions decode_;
  RunOptions run_;
  std::optional<Text> output_, coded_, second_, statistics_, uncertainty_,
      excerpt_;
  std::optional<double> start_, duration_;
  std::optional<int> region_, white_, threads_, jobs_;
  bool deflate_ = false, view_ = false, find_phase_ = false;
  /* Pictures whose flags are lost with their form. */
  std::atomic<guint64> unflagged_ = 0;
};

} // namespace

Command
decode_command ()
{
  return make_command<Decode> ({.name = "decode",
      .summary = "decode a recording to pictures at N times the frame rate",
      .usage = "[option...] RECORDING.mkv --output OUT\n"
               "       codedexposure decode [--schedule S] RECORDING.mkv "
               "--find-phase",
      .description = R"(
Splits the coded frames of a recording into subframes. The recording contains
the schedule. The ending of OUT selects the format: .mkv (FFV1, lossless), .mp4
(H.264, for viewing), .ome.tif (OME-TIFF), .h5 (HDF5) or .ome.zarr (OME-Zarr)
for other programs, FOLDER/ or NAME%06d.png (pictures).
)",
      .notes = R"(
Exit status: 0 all decoded, 1 failed, 2 wrong usage, 3 the recording is cut off
or damaged, and was decoded as far as possible, 4 no coded frame lies in the
part, 130 stopped before the end: what was decoded is in OUT.part.

Examples:
  A video of 100 frames/s, to look at:
    codedexposure decode coded.mkv --output fast.mp4
  A fifth of a second as single pictures:
    codedexposure decode coded.mkv --start 1 --duration 0.2 \
      --output pictures/
  Full-size frames, lossless:
    codedexposure decode coded.mkv --fuse balanced --duration 0.2 \
      --output full.mkv
)"});
}

} // namespace codedexposure::app
