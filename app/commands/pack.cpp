/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure pack: a raw recording becomes FFV1, and is replaced once all
 * frames are checked. */
#include <filesystem>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "base/part.h"
#include "command.h"
#include "common/partner.h"
#include "common/record.h"
#include "pipeline/messages.h"
#include "pipeline/pads.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "pipeline/status.h"
#include "record/matroska.h"

namespace codedexposure::app
{

using namespace gst;
namespace fs = std::filesystem;

namespace
{

/* Adds to @lines what is known of each frame that passes, and of its partner,
 * with the hashes of their pixels, until the pipeline has stopped. */
void
log_frames (GstElement *element, std::vector<std::string> &lines)
{
  const auto add = [&lines] (GstPad *pad, GstBuffer *frame) {
    auto info = video_at (pad);
    const auto segment = segment_at (pad);
    if (!info || !segment)
      return;
    const auto line = [&] (GstBuffer *of) {
      return record_of (of, *info, *segment, 0, lines.size ()).to_json ();
    };
    lines.push_back (line (frame));
    const auto partner = get_partner (frame);
    if (partner && gst_video_info_from_caps (&*info, partner->caps.get ()))
      lines.back () += line (partner->buffer.get ());
  };
  watch_buffers (pad_of (element, "sink").get (), add);
}

class Pack
{
public:
  void declare (Options &options)
  {
    options.word ("RECORDING.mkv", recording_);
    options.heading ("");
    options.value ("--output", output_, "OUT.mkv",
        "write this file instead; RECORDING.mkv stays",
        file_ending_in (".mkv"));
    options.value ("--threads", threads_, "N",
        "threads of the encoder; pixels do not depend on them [one for each "
        "processor]",
        whole (1, 64));
    run_.declare (options);
  }

  Exit run ()
  {
    signals_.emplace ();
    start_gstreamer ();
    const RecordingInfo info = value_of (recording_info (recording_));
    std::error_code ignored;
    const std::string recording = fs::canonical (recording_, ignored);
    const std::string output = output_.value_or (recording);
    check_names (recording, output);
    if (info.head.codec == MatroskaHead::Codec::none)
      fail (recording +
            " cannot be read: the head of the file, which lists its tracks, is "
            "damaged or cut off; use another copy of the recording");
    if (info.head.codec != MatroskaHead::Codec::raw) {
      if (output_)
        fail (recording + " is FFV1 already; copy it");
      status_.line (recording + " is FFV1 already");
      return end (Exit::done, info.times.size ());
    }
    if (run_.print) {
      if (!output_)
        usage_error (
            "--print shows a line that checks nothing, and so must not "
            "replace " +
            recording_ + "; set --output to another file");
      encode (recording, output, false);
      return Exit::done;
    }
    check_extras (info.extras);
    lock (recording);

    const Seen before = look_through (recording);
    if (before.result.interrupted)
      fail ("stopped; " + recording_ + " is as it was", Exit::interrupted);
    if (before.lines.empty () ||
        (!before.is_sound () && before.result.exit != Exit::damaged))
      fail (recording + " cannot be read");
    if (!before.is_sound () && !output_ && !run_.force) {
      status_.line (recording +
                    " is cut off or damaged, and stays as it is; set "
                    "--output or --force to pack what can be read");
      return end (Exit::damaged, before.lines.size ());
    }
    const fs::path whole = fs::absolute (output, ignored);
    Part part (output, Part::kFile,
        whole.parent_path () / ("." + whole.filename ().string () + ".part"));
    value_of (part.claim (true));
    const RunResult encoded = encode (recording, part.path (), before.salvage);
    if (encoded.interrupted)
      give_up (part, "stopped", Exit::interrupted);
    if (encoded.exit != before.result.exit)
      give_up (part, "could not encode");
    const Seen after = look_through (part.path ());
    if (after.result.interrupted)
      give_up (part, "stopped", Exit::interrupted);
    if (after.lines != before.lines)
      give_up (part, "the packed frames differ from those of the recording");
    publish (part, recording, before.lines.size ());
    if (!before.is_sound ())
      status_.line (recording +
                    " is cut off or damaged; what could be read was "
                    "packed, and damaged frames stay damaged");
    return end (before.is_sound () ? Exit::done : Exit::damaged,
        before.lines.size (), {part.name ()});
  }

private:
  struct Seen {
    RunResult result;
    bool salvage; // how they were read; another way may read other frames
    std::vector<std::string> lines;
    bool is_sound () const { return result.exit == Exit::done; }
  };

  void check_names (const std::string &recording, const std::string &output)
  {
    if (!output_)
      return;
    std::error_code ignored;
    value_of (check_is_no_input (output, {recording}), Exit::usage);
    if (!run_.force && fs::exists (fs::symlink_status (output, ignored)))
      fail (output +
            " exists; choose another name, or set --force to replace it");
  }

  /* A file of another program, or one to which something was added. */
  void check_extras (const std::vector<std::string> &extras)
  {
    const std::string all = joined (extras);
    if (all.empty ())
      return;
    if (!output_)
      fail (recording_ + " also has " + all +
            ", which FFV1 frames would replace; "
            "set --output to keep it beside the packed one");
    status_.line ("only " + recording_ + " has " + all);
  }

  void lock (const std::string &recording)
  {
    lock_ = open (recording.c_str (), O_RDONLY | O_CLOEXEC);
    if (lock_ < 0 || flock (lock_, LOCK_EX | LOCK_NB) != 0)
      fail ("another run is packing " + recording + "; wait for its end");
  }

  Pack::Seen look_through (const std::string &file)
  {
    for (bool salvage = false;; salvage = true) {
      Job job ("pack", run_);
      job.options.print = job.options.json = job.has_result = false;
      job.signals = &*signals_;
      job.salvage = salvage;
      Chain chain = read_recording (job, file);
      chain.to ("fakesink", {{"sync", false}});
      job.counted = chain.last ();
      std::vector<std::string> lines;
      log_frames (chain.last (), lines);
      const RunResult result = play (job);
      if (!result.container_damaged || result.interrupted || salvage)
        return {result, salvage, std::move (lines)};
    }
  }

  RunResult encode (
      const std::string &recording, const std::string &to, bool salvage)
  {
    Job job ("pack", run_);
    job.options.json = job.has_result = false;
    job.signals = &*signals_;
    job.salvage = salvage;
    Chain chain = read_recording (job, recording);
    chain.queue (8);
    job.counted = chain.last ();
    chain.to ("codedexposure-recordmux", {{"threads", threads_}})
        .to ("filesink", {{"location", to}});
    return play (job);
  }

  /* The name changes only when the data is on the disk. */
  void publish (Part &part, const std::string &recording, std::size_t frames)
  {
    std::error_code error;
    const double raw = double (fs::file_size (recording, error));
    const double size = double (fs::file_size (part.path (), error));
    fs::permissions (
        part.path (), fs::status (recording, error).permissions (), error);
    if (const auto published = part.publish (run_.force || !output_);
        !published)
      give_up (part, published.error ().message);
    status_.line (
        "wrote " + part.name () + ": " + coded_frames (frames) +
        format (", %.0f %% of the raw size, all checked", 100 * size / raw));
  }

  Exit end (Exit exit, std::size_t frames,
      const std::vector<std::string> &outputs = {}) const
  {
    if (run_.json)
      print_json ({{"command", "pack"}, {"source", recording_},
          {"frames", frames}, {"outputs", outputs}, {"status", int (exit)}});
    return exit;
  }

  [[noreturn]] void give_up (
      Part &part, const std::string &why, Exit exit = Exit::failed)
  {
    part.discard ();
    fail (why + "; " + recording_ + " is as it was", exit);
  }

  std::string recording_;
  std::optional<Text> output_;
  std::optional<int> threads_;
  RunOptions run_;
  Status status_{"pack", false};
  std::optional<Signals> signals_; // from the first pass to the last
  int lock_ = -1;                  // open and locked until the program ends
};

} // namespace

Command
pack_command ()
{
  return make_command<Pack> ({.name = "pack",
      .summary = "turn a raw recording into FFV1, checked frame by frame",
      .usage = "[option...] RECORDING.mkv",
      .description = R"(
Turns a raw recording into lossless FFV1, which takes about half of the space.
Reads the result back and compares every frame with that of the raw recording
and with the hash in its track: pixels, time and flags. Only then replaces the
recording. A recording that is FFV1 stays as it is, and so does one that is cut
off or damaged, because another program may read more of it; --output and
--force pack what can be read, and damaged frames stay damaged.
)",
      .notes = R"(
Exit status: 0 packed, or FFV1 already; 1 failed, and the recording is as it
was; 2 wrong usage; 3 the recording is cut off or damaged; 130 stopped, and the
recording is as it was.

Examples:
  A recording, in its place:
    codedexposure pack fast.mkv
  A copy on another disk:
    codedexposure pack fast.mkv --output /archive/fast.mkv
  All recordings of a folder, two at a time:
    parallel -j2 codedexposure pack --threads 1 ::: recordings/*.mkv
)"});
}

} // namespace codedexposure::app
