/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure play: a recording in a window, to move in. */
#include <algorithm>

#include "base/text.h"
#include "command.h"
#include "options/picture.h"
#include "pipeline/decoder.h"
#include "pipeline/program.h"
#include "pipeline/recording.h"
#include "record/matroska.h"
#include "window/window.h"

namespace codedexposure::app
{

namespace
{

class Play
{
public:
  void declare (Options &options)
  {
    options.word ("RECORDING.mkv", recording_);
    options.heading ("");
    decode_.declare (options);
    options.value ("--export", export_, "FORM",
        "what E writes: mp4, mkv, ome.tif, h5, ome.zarr or png [mp4]",
        one_of ({"mp4", "mkv", "ome.tif", "h5", "ome.zarr", "png"}));
    window_.declare (options, false);
    run_.declare (options, false);
  }

  Exit run ()
  {
    start_gstreamer ();
    Played played = this->played ();
    Job job ("play", run_);
    job.is_moved_in = true;
    job.has_result = false;
    const std::vector<Chain> shown = panes (job);
    add_window (job, shown, window_, decode_.bits, std::move (played));
    return play (job).exit;
  }

private:
  Played played () const
  {
    const RecordingInfo info = value_of (recording_info (recording_, true));
    if (info.times.empty ())
      fail (recording_ + " has no complete frame to show");
    if (info.is_damaged)
      fail (recording_ +
            " is damaged between its frames, so a window cannot move in it; "
            "\"codedexposure decode\" reads it from front to back");
    std::optional<Schedule> schedule;
    if (decode_.schedule)
      schedule = value_of (Schedule::parse (*decode_.schedule), Exit::usage);
    else if (info.setup)
      schedule = info.setup->schedule;
    else
      fail (recording_ +
                " does not say its schedule; set --schedule, or give the "
                "recording itself if these pictures were decoded from it",
          Exit::usage);
    Played played;
    played.recording = recording_;
    played.slots = schedule->slots ();
    if (info.setup && info.setup->rate)
      played.rate = *info.setup->rate;
    for (const Nanoseconds time : info.times)
      played.positions.push_back (time - *info.start);
    std::sort (played.positions.begin (), played.positions.end ());
    const std::string form = export_ ? std::string (*export_) : "mp4";
    played.pictures = decode_.fuse ? "fused" : "subframes";
    played.form = form == "png" ? "/" : "." + form;
    played.decode = decode_.words ();
    return played;
  }

  std::vector<Chain> panes (Job &job) const
  {
    Chain frames = read_recording (job, recording_);
    const DecoderPads pads = decode_.fuse
                                 ? add_fusion (job, frames, decode_, {})
                                 : add_demux (job, frames, decode_);
    return {pads.coded (), pads.pictures};
  }

  std::string recording_;
  DecodeOptions decode_;
  WindowOptions window_;
  RunOptions run_;
  std::optional<Text> export_;
};

} // namespace

Command
play_command ()
{
  return make_command<Play> ({.name = "play",
      .summary = "watch a recording in a window, and move in it",
      .usage = "[option...] RECORDING.mkv",
      .description = R"(
Shows the coded frames and the subframes of a recording beside each other, as
live does, without decoding it first: at any speed, subframe by subframe, or a
marked stretch again and again, which can be exported. After the last frame it
waits for a key.

)" + Player::keys_of (),
      .notes = R"(
What is exported has the pixels that decode gives. The window skips subframes if
the screen or the fusion is too slow for the speed; pauses and steps skip none.

Examples:
  Subframes:
    codedexposure play coded.mkv
  Full-size frames in their place; stretches become folders of PNG files:
    codedexposure play coded.mkv --fuse best --export png
  In a window of another video sink:
    codedexposure play coded.mkv --sink ximagesink
)"});
}

} // namespace codedexposure::app
