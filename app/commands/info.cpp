/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure info: what a recording says of itself, without its pixels. */
#include "base/text.h"
#include "command.h"
#include "options/board.h"
#include "pipeline/messages.h"
#include "record/matroska.h"

namespace codedexposure::app
{

namespace
{

const char *
codec_text (MatroskaHead::Codec codec)
{
  return codec == MatroskaHead::Codec::ffv1  ? "ffv1"
         : codec == MatroskaHead::Codec::raw ? "raw"
                                             : "other";
}

class Info
{
public:
  void declare (Options &options)
  {
    options.words (paths_);
    options.heading ("");
    options.flag ("--times", times_, "also the times of all coded frames, ns");
    printing_.declare (options);
  }

  Exit run ()
  {
    if (paths_.empty ())
      usage_error ("give a RECORDING.mkv");
    Json list = Json::array ();
    bool good = true;
    for (const std::string &path : paths_) {
      const auto info = recording_info (path);
      good &= bool (info);
      list.push_back (
          info ? describe (path, *info)
               : Json{{"recording", path}, {"error", info.error ().message}});
    }
    printing_.print (list);
    return good ? Exit::done : Exit::failed;
  }

private:
  static bool has_all (const RecordingInfo &info)
  {
    return info.recorded == info.times.size () &&
           (!info.head.has_partners () || info.partners == *info.recorded);
  }
  Json describe (const std::string &path, const RecordingInfo &info) const
  {
    const bool is_damaged = info.is_cut_short || info.is_damaged;
    Json json{{"recording", path}, {"codec", codec_text (info.head.codec)},
        {"size", size_text (info.head.size)}, {"frames", info.times.size ()},
        {"damaged", is_damaged}, {"complete", !is_damaged && has_all (info)},
        {"track", info.head.lines != 0}, {"period_ns", info.head.duration}};
    if (info.start)
      json["start_ns"] = *info.start;
    if (!info.times.empty ()) {
      json["first_ns"] = info.times.front ();
      json["last_ns"] = info.times.back ();
    }
    if (info.recorded)
      json["recorded"] = *info.recorded;
    if (info.head.has_partners ()) {
      json["partners"] = info.partners - info.alone;
      json["alone"] = info.alone;
    }
    if (info.setup) {
      json["schedule"] = info.setup->schedule.text ();
      if (info.setup->rate)
        json["rate"] = std::to_string (info.setup->rate->num) + "/" +
                       std::to_string (info.setup->rate->den);
      json["simulated"] = info.setup->simulated;
      json["bench_profile"] = info.setup->bench.has_value ();
      json["mapping"] = info.setup->mapping.has_value ();
      if (info.setup->off_beam)
        json["beam"] = "off";
    }
    if (times_)
      json["times_ns"] = info.times;
    return json;
  }

  std::vector<std::string> paths_;
  bool times_ = false;
  Printing printing_;
};

} // namespace

Command
info_command ()
{
  return make_command<Info> ({.name = "info",
      .summary = "show what a recording says of itself",
      .usage = "[option...] RECORDING.mkv...",
      .description = R"(
Shows the codec, size, rate, length and schedule of recordings, without decoding
them. One that is cut off is damaged, too; a complete one is not, and has as
many frames, of each camera, as were recorded, by its last line. With --json,
a list with an object for each; one that is no recording has the key "error".
Exit status 1: one of them is none.
)",
      .notes = R"(
Examples:
  For people:
    codedexposure info coded.mkv
  All recordings of a day:
    codedexposure info day1/*.mkv
  For programs, with the time of each coded frame:
    codedexposure info --json --times coded.mkv
)"});
}

} // namespace codedexposure::app
