/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Damaged recordings. */
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include "files.h"

namespace codedexposure::campaign
{

using namespace codedexposure::gst;

std::string
read_file (const std::string &path)
{
  std::ifstream file (path, std::ios::binary);
  return {std::istreambuf_iterator<char> (file), {}};
}

void
write_file (const std::string &path, const std::string &bytes)
{
  std::ofstream (path, std::ios::binary | std::ios::trunc) << bytes;
}

std::string
record_tail (const std::string &path)
{
  return "tee name=both ! queue ! codedexposure-recordmux ! filesink "
         "async=false location=" +
         path +
         " both. ! queue ! codedexposure-demux ! fakesink name=out sync=false "
         "async=false";
}

Recording
record (
    const std::string &path, int frames, int lost, const std::string &schedule)
{
  const Reading reading =
      schedule == kStaircase ? Reading::bits : Reading::exact;
  Judge judge ({.reading = reading, .slips = true});
  BenchPlay bench ({.schedule = schedule,
      .slips = ",slip-at=" + std::to_string (frames * 2 + 1),
      .tail = record_tail (path)});
  judge.watch (bench.play.pad ("out", "sink").get ());
  bench.start ();
  for (int i = 0; i < frames; i++) {
    BufferPtr frame = bench.expose ();
    if (i != lost)
      bench.send (std::move (frame));
  }
  bench.end ();
  bench.play.stop ();
  return {read_file (path), bench.slots (), reading, judge.unjudged_slots ()};
}

void
decode (Row &row, const std::string &path, const Recording &recording,
    const Reader &reader)
{
  row.runs++;
  Judge judge ({.reading = recording.reading,
      .unknown_slots = recording.unjudged,
      .any_order = reader.is_trick ()});
  Play play ("filesrc location=" + path + (reader.push_mode ? " ! queue" : "") +
             " ! codedexposure-recorddemux threads=1 ! " + reader.edit +
             " codedexposure-demux require-schedule=true ! fakesink name=out "
             "sync=false");
  judge.watch (play.pad ("out", "sink").get ());
  if (reader.is_trick ())
    play.start_at (reader.rate, reader.flags);
  else
    play.start ();
  play.wait ();
  play.stop ();
  judge.end (recording.slots, play.told_of_the_end ());
  Tally tally = judge.tally ();
  /* It is told that the track, or the time of the beginning, is unknown. */
  const bool all_unknown =
      std::ranges::any_of (play.told, [] (const auto &told) {
        return told.first.starts_with ("info: The frames are ") ||
               told.first.starts_with ("warning: The stream has no track");
      });
  if (all_unknown)
    tally.unjudged += std::exchange (tally.as_good, 0);
  row.tally += tally;
  row.refused += !play.error.empty ();
  row.hung += play.hung;
  for (const auto &[text, count] : play.told)
    row.told[text] += count;
  if (play.hung)
    row.note (path + " hangs");
  if (tally.as_good + tally.untold > 0)
    row.note (path + (reader.push_mode ? " (push)" : "") +
              (reader.edit.empty () ? "" : " " + reader.edit) + ": " +
              judge.evidence ());
}

namespace
{

/* Kept for a look if something is wrong with it. */
void
try_file (Row &row, const std::string &name, const std::string &bytes,
    const Recording &recording, bool push_mode)
{
  const std::string path = work_folder () + "/" + name + ".mkv";
  write_file (path, bytes);
  Row one;
  decode (one, path, recording, {.push_mode = push_mode});
  if (!one.passed () && g_getenv ("CAMPAIGN_KEEP"))
    std::filesystem::copy_file (path,
        std::string (g_getenv ("CAMPAIGN_KEEP")) + "/" + name + ".mkv",
        std::filesystem::copy_options::overwrite_existing);
  std::filesystem::remove (path);
  row.add (one);
}

std::vector<Row>
whole (Scale)
{
  Row row{.name = "a whole recording, read again"};
  const auto recording = record (work_folder () + "/whole.mkv", 40, 8);
  for (const bool push_mode : {false, true})
    decode (row, work_folder () + "/whole.mkv", recording,
        {.push_mode = push_mode});
  return {row};
}

/* All frames can be decoded alone, so all of them come. */
std::vector<Row>
tricks (Scale)
{
  Row reverse{.name = "a recording played in reverse"};
  Row keys{.name = "a recording played by key frames"};
  const std::string path = work_folder () + "/tricks.mkv";
  for (const char *schedule : {"sequential:2x2,pilot=8", kStaircase}) {
    const auto recording = record (path, 40, -1, schedule);
    decode (reverse, path, recording, {.rate = -1.0});
    decode (keys, path, recording,
        {.flags = GST_SEEK_FLAG_TRICKMODE_KEY_UNITS});
  }
  return {reverse, keys};
}

/* Size and rate stay as they are. */
std::vector<Row>
edits (Scale)
{
  Row row{.name = "other elements edit recorded frames"};
  const std::string path = work_folder () + "/edits.mkv";
  const auto recording = record (path, 40, -1);
  const std::string same = "video/x-raw,width=" + std::to_string (kWidth) +
                           ",height=" + std::to_string (kHeight) + " ! ";
  for (const std::string &edit :
      {std::string ("videoflip video-direction=180 !"),
          std::string ("videoflip video-direction=horiz !"),
          "videocrop top=2 ! videobox top=-2 ! " + same,
          "videoscale ! video/x-raw,width=24,height=20 ! videoscale ! " + same})
    decode (row, path, recording, {.edit = edit});
  return {row};
}

/* Every second flip is in the first or last part of the file, which the
 * frames would hide. */
std::size_t
flip_place (std::size_t size, int run, std::mt19937 &engine)
{
  constexpr std::size_t kStructure = 3000;
  if (run % 2 == 0 || size < 2 * kStructure)
    return engine () % size;
  const std::size_t place = engine () % (2 * kStructure);
  return place < kStructure ? place : size - 2 * kStructure + place;
}

std::vector<Row>
flips (Scale scale)
{
  Row row{.name = "a recording with one bit flipped"};
  const Recording recordings[] = {
      record (work_folder () + "/sequential.mkv", 32, 8),
      record (work_folder () + "/staircase.mkv", 32, 8, kStaircase)};
  std::mt19937 engine (1);
  for (int run = 0; run < (scale == Scale::full ? 1000 : 150); run++) {
    const Recording &recording = recordings[run / 4 % 2];
    std::string bytes = recording.bytes;
    const std::size_t place = flip_place (bytes.size (), run, engine);
    const int bit = int (engine () % 8);
    bytes[place] = char (bytes[place] ^ 1 << bit);
    try_file (row,
        "flip-" + std::to_string (place) + "-" + std::to_string (bit), bytes,
        recording, run / 2 % 2 == 1);
  }
  return {row};
}

std::vector<Row>
cuts (Scale scale)
{
  Row row{.name = "a recording cut short"};
  const auto recording = record (work_folder () + "/cuts.mkv", 32, 8);
  const int count = scale == Scale::full ? 200 : 40;
  for (int run = 0; run < count; run++) {
    const std::size_t size = recording.bytes.size () * std::size_t (run + 1) /
                             std::size_t (count + 1);
    try_file (row, "cut-" + std::to_string (size),
        recording.bytes.substr (0, size), recording, run % 2 == 1);
  }
  return {row};
}

} // namespace

std::vector<Case>
file_cases ()
{
  return {{"whole", whole}, {"tricks", tricks}, {"edits", edits},
      {"flips", flips}, {"cuts", cuts}};
}

} // namespace codedexposure::campaign
