/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Recorders that are killed, full disks and displays that stand still. */
#include <sys/mount.h>
#include <sys/wait.h>

#include <csignal>
#include <filesystem>

#include "child.h"
#include "files.h"

namespace codedexposure::campaign
{

using namespace codedexposure::gst;

namespace
{

/** Reads what is left of a recording; it has to be told that it was cut. */
void
decode_rest (Row &row, const std::string &path, bool push_mode)
{
  Row one;
  decode (one, path, {}, {.push_mode = push_mode});
  if (!one.told.count ("codedexposure/stream-cut") && one.refused == 0) {
    one.mute++;
    one.note (path + ": no codedexposure/stream-cut");
  }
  row.add (one);
}

std::vector<Row>
killed (Scale scale)
{
  Row row{.name = "the recorder is killed (SIGKILL)"};
  const std::string path = work_folder () + "/killed.mkv";
  const int runs = scale == Scale::full ? 50 : 5;
  for (int run = 0; run < runs; run++) {
    std::filesystem::remove (path);
    {
      Child child ("record", {path});
      const std::uintmax_t size = 20'000u + unsigned (run) * 7'919u;
      std::error_code error;
      for (int tries = 0; tries < 100'000; tries++) {
        const auto now = std::filesystem::file_size (path, error);
        if (!error && now >= size)
          break;
        g_usleep (100);
      }
      child.end (SIGKILL);
    }
    decode_rest (row, path, run % 2 == 1);
  }
  std::filesystem::remove (path);
  return {row};
}

std::vector<Row>
full_disk (Scale scale)
{
  Row row{.name = "the disk is full"};
  if (!is_isolated ()) {
    row.skipped = "no file system of its own is allowed here";
    return {row};
  }
  const std::string disk = work_folder () + "/disk";
  for (int run = 0; run < (scale == Scale::full ? 20 : 3); run++) {
    std::filesystem::create_directory (disk);
    const std::string size = "size=" + std::to_string (80 + run * 12) + "k";
    if (mount ("campaign", disk.c_str (), "tmpfs", 0, size.c_str ()) != 0) {
      row.skipped = "no file system can be mounted here";
      return {row};
    }
    BenchPlay bench ({.tail = record_tail (disk + "/full.mkv")});
    bench.start ();
    for (int frame = 0; frame < 1000; frame++)
      if (!bench.send (bench.expose ()))
        break;
    bench.play.poll ();
    bench.play.stop ();
    for (const auto &[text, count] : bench.play.told)
      row.told[text] += count;
    if (bench.play.error.empty ()) {
      row.mute++;
      row.note ("no error on a full disk");
    }
    decode_rest (row, disk + "/full.mkv", false);
    umount (disk.c_str ());
  }
  return {row};
}

GstPadProbeReturn
hold (GstPad *, GstPadProbeInfo *, gpointer)
{
  return GST_PAD_PROBE_OK;
}

/* It shows what it can, and the recording beside it has everything. */
std::vector<Row>
stalled (Scale scale)
{
  Row shown{.name = "a display that stands still: the display"};
  Row recorded{.name = "a display that stands still: the recording"};
  const std::string path = work_folder () + "/stalled.mkv";
  const int frames = scale == Scale::full ? 2000 : 120;
  Judge judge;
  BenchPlay bench (
      {.tail = "tee name=both ! queue ! codedexposure-recordmux ! filesink "
               "async=false location=" +
               path +
               " both. ! queue leaky=downstream max-size-buffers=2 ! "
               "codedexposure-demux ! fakesink name=out sync=false "
               "async=false"});
  const auto pad = bench.play.pad ("out", "sink");
  judge.watch (pad.get ());
  bench.start ();
  gulong held = 0;
  for (int frame = 0; frame < frames; frame++) {
    if (frame % 60 == 20)
      held = gst_pad_add_probe (pad.get (), GST_PAD_PROBE_TYPE_BLOCK_DOWNSTREAM,
          hold, nullptr, nullptr);
    if (frame % 60 == 50)
      gst_pad_remove_probe (pad.get (), std::exchange (held, 0));
    bench.send (bench.expose ());
  }
  if (held)
    gst_pad_remove_probe (pad.get (), held);
  bench.end ();
  bench.play.stop ();
  shown.runs = 1;
  shown.tally = judge.tally ();
  shown.hung += bench.play.hung;
  shown.told = bench.play.told;
  shown.note (judge.evidence ());
  decode (recorded, path, {.bytes = {}, .slots = bench.slots ()}, {});
  if (recorded.tally.missing > 0 || shown.tally.missing == 0) {
    recorded.mute++;
    recorded.note (
        "frames are missing in the recording, or none on the display");
  }
  return {shown, recorded};
}

/** Records to @p path until it is killed. */
int
record_for_ever (const std::string &path)
{
  BenchPlay bench ({.tail = record_tail (path)});
  bench.start ();
  while (bench.send (bench.expose ()))
    ;
  return 1;
}

} // namespace

int
run_child (const std::string &part, const std::vector<std::string> &words)
{
  if (part == "record" && words.size () == 1)
    return record_for_ever (words[0]);
#ifdef CAMPAIGN_CAMERA
  if (part == "camera" && words.size () == 2)
    return run_camera (words);
#endif
  return 2;
}

std::vector<Case>
process_cases ()
{
  return {{"killed", killed}, {"full-disk", full_disk}, {"stalled", stalled}};
}

#ifndef CAMPAIGN_CAMERA
std::vector<Case>
camera_cases ()
{
  return {};
}
#endif

} // namespace codedexposure::campaign
