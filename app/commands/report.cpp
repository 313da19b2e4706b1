/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure report: a page with pictures and figures of a recording. */
#include <algorithm>
#include <cinttypes>

#include <nlohmann/json.hpp>

#include "command.h"
#include "pages/folder.h"
#include "pages/measure.h"
#include "pages/report_page.h"
#include "pipeline/decoder.h"
#include "pipeline/messages.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/status.h"
#include "pipeline/video_output.h"
#include "record/matroska.h"
#include "stats/profile_line.h"

namespace codedexposure::app
{

namespace
{

/** A line that fits coded frames and subframes. */
Rule<Text>
line_rule ()
{
  return text_that (
      [] (const std::string &text) {
        const bool is_free = std::ranges::count (text, '/') > 0;
        return ProfileLine::parse (text) &&
               std::ranges::count (text, '%') == (is_free ? 4 : 1);
      },
      "row:50%, column:50% or 10%/20%/90%/80%, in percent");
}

class Report
{
public:
  void declare (Options &options)
  {
    options.word ("RECORDING.mkv", recording_);
    options.heading ("");
    options.value ("--output", output_, "FOLDER", "folder of the page");
    options.require ("--output", "FOLDER");
    options.value ("--at", at_, "SECONDS",
        "position of the coded frame to show: the time since the first one "
        "[the frame in which the intensity of the subframes changes most]",
        seconds ());
    options.value ("--line", line_, "LINE",
        "row:Y%, column:X% or X0%/Y0%/X1%/Y1%, percentages from the first "
        "pixel to the last [row:50%]",
        line_rule ());
    decode_.declare_method (options, "the recording");
    options.value ("--bench", decode_.bench, "FILE",
        "bench profile (JSON) with black level, leakage and mapping [that of "
        "the recording]");
    decode_.declare_frames (options, "the recording");
    run_.declare_result (options);
    options.flag ("--verbose", run_.verbose,
        "also print messages and counters of the elements");
  }

  Exit run ()
  {
    start_gstreamer ();
    const RecordingInfo info = value_of (recording_info (recording_, false));
    value_of (check_is_no_input (*output_, {recording_}), Exit::usage);
    MeasureOptions options{.recording = recording_,
        .decode = decode_,
        .line = line_.value_or ("row:50%"),
        .run = run_,
        .said = &said_};
    PageFolder folder (*output_, run_.force);
    options.coded_csv = folder.path ("coded.csv");
    options.subframes_csv = folder.path ("subframes.csv");
    const Measurement all = measure (options);
    check_end (all.result);
    if (all.coded.pictures.empty () || all.subframes.pictures.empty ())
      fail ("no subframe of " + recording_ + " could be decoded");
    const std::size_t shown = choose_frame (all);
    options.coded_csv = options.subframes_csv = "";
    options.times.start = all.coded.pictures[shown].pts;
    if (shown + 1 < all.coded.pictures.size ())
      options.times.stop = all.coded.pictures[shown + 1].pts;
    options.details = true;
    const Measurement frame = measure (options);
    check_end (frame.result);
    const ReportPage page (all, frame, options);
    write_pictures (folder, page, options.times, frame.salvaged, Kind::split);
    if (page.regions () > 0)
      write_pictures (folder, page, options.times, frame.salvaged, Kind::fused);
    if (frame.pairs > 0)
      write_pictures (folder, page, options.times, frame.salvaged, Kind::sum);
    page.write (folder);
    folder.publish ();
    const std::string name = *output_ + (output_->ends_with ("/") ? "" : "/");
    Status ("report", run_.verbose).line ("page: " + name + "index.html");
    damaged_ |= info.is_cut_short;
    const Exit exit = damaged_ ? Exit::damaged : Exit::done;
    if (run_.json) {
      const nlohmann::ordered_json json = {{"command", "report"},
          {"source", recording_}, {"frames", all.coded.pictures.size ()},
          {"outputs", {name + "index.html"}}, {"status", int (exit)}};
      print_json (json);
    }
    return exit;
  }

private:
  void check_end (const RunResult &result)
  {
    if (result.interrupted)
      fail ("stopped; no page was written", Exit::interrupted);
    if (result.container_damaged)
      fail (no_part_text (recording_) + "; no page was written");
    if (result.exit == Exit::damaged)
      damaged_ = true;
    else if (result.exit != Exit::done)
      fail (
          recording_ + " cannot be decoded; no page was written", result.exit);
  }

  /* The last one that begins before --at, or the one whose subframes differ
   * most. */
  std::size_t choose_frame (const Measurement &all) const
  {
    constexpr double kRounding = 500; // ns
    const auto &coded = all.coded.pictures;
    if (at_) {
      const double at = *at_ * 1e9 + kRounding;
      std::size_t shown = 0;
      while (shown + 1 < coded.size () && double (coded[shown + 1].pts) <= at)
        shown++;
      const double end = double (coded.back ().pts) +
                         page_period (all.coded, coded.size () - 1);
      if (at >= end)
        fail (
            format ("--at %.9g is after the end of the recording, which is at "
                    "%.9g s; set an earlier time",
                *at_, end / 1e9),
            Exit::nobody);
      return shown;
    }
    std::size_t best = 0, i = 0;
    double most = -1;
    for (auto begin = all.subframes.pictures.begin ();
         begin != all.subframes.pictures.end ();) {
      const auto end = std::find_if (begin, all.subframes.pictures.end (),
          [&] (const auto &of) { return of.frame != begin->frame; });
      const auto [low, high] =
          std::minmax_element (begin, end, [] (const auto &a, const auto &b) {
            return a.stats.mean < b.stats.mean;
          });
      while (i < coded.size () && coded[i].frame < begin->frame)
        i++;
      const double change = high->stats.mean - low->stats.mean;
      if (i < coded.size () && coded[i].frame == begin->frame &&
          change > most) {
        most = change;
        best = i;
      }
      begin = end;
    }
    return best;
  }

  /** What is written of the frame that is shown. */
  enum class Kind { split, fused, sum };

  void write_pictures (const PageFolder &folder, const ReportPage &page,
      const PlayTimes &times, bool salvage, Kind kind)
  {
    Job job ("report", run_);
    job.options.json = job.has_result = false;
    job.said = &said_;
    job.salvage = salvage;
    job.times = times;
    Chain frames = read_recording (job, recording_);
    VideoStyle style;
    style.view = true;
    style.white = page.white ();
    style.bits = decode_.bits;
    const auto write = [&] (Chain chain, const std::string &name) {
      style.coded = job.counted;
      write_video (job, chain.to ("queue"), folder.path (name + "/"), style);
    };
    if (kind == Kind::sum) {
      style.white.reset ();
      job.counted = frames.to ("codedexposure-sum").last ();
      write (frames, "sum");
    } else if (kind == Kind::fused) {
      DecodeOptions fast = decode_;
      fast.fuse = "fast";
      write (add_fusion (job, frames, fast, {}).pictures, "fused");
    } else {
      const DecoderPads pads = add_demux (job, frames, decode_, {});
      write (pads.pictures, "subframes");
      write (pads.coded (), "coded");
      for (std::size_t i = 0; i < page.regions (); i++) {
        const std::string name = std::to_string (i);
        write (job.graph.from (
                   pads.decoder, g_intern_string (("region_" + name).c_str ())),
            "region-" + name);
      }
    }
    check_end (play (job));
  }

  std::string recording_;
  std::optional<Text> output_, line_;
  std::optional<double> at_;
  DecodeOptions decode_;
  RunOptions run_;
  std::set<std::string> said_; // warnings
  bool damaged_ = false;
};

} // namespace

Command
report_command ()
{
  return make_command<Report> ({.name = "report",
      .summary = "write a page with pictures and figures of a recording",
      .usage = "[option...] RECORDING.mkv --output FOLDER",
      .description = R"(
Writes a page with measurements of a recording. FOLDER/index.html contains all
its pictures: one coded frame with its subframes, also in slow motion, the
intensity over the subframes, their profiles along a line, and the entropy of
the coded frame and of each subframe. The contrast of a dark scene is stretched,
as the page says. If the schedule has regions, the figures are those of the
background, and the page also shows the subframes of every part and the fused
frame. The folder also has the pictures (PNG, SVG) and the figures (CSV).
)",
      .notes = R"(
Exit status: 0 written, 1 failed, 2 wrong usage, 3 written, but the recording is
cut off or damaged, 4 no coded frame at that time, 130 stopped: no page was
written.

Examples:
  The frame in which most happens, and a profile along its middle row:
    codedexposure report coded.mkv --output report
  The frame at 1 s, and a profile along a column:
    codedexposure report coded.mkv --at 1 --line column:30% --output at-1-s
  A profile along an oblique line:
    codedexposure report coded.mkv --line 10%/20%/90%/80% --output oblique
)"});
}

} // namespace codedexposure::app
