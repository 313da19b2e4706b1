/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Faults between camera and dmdsync, and slips of the DMD. */
#include <algorithm>
#include <random>
#include <thread>

#include "play.h"

namespace codedexposure::campaign
{

using namespace codedexposure::gst;

namespace
{

/** Sends a frame of the camera, changed, or several, or none. */
using Send = std::function<void (BufferPtr)>;
using Fault = std::function<void (int frame, BufferPtr, const Send &)>;

BufferPtr
copy_of (const BufferPtr &frame)
{
  return BufferPtr (gst_buffer_copy (frame.get ()));
}

/** The times that the camera said. Its clock is the only one there is: a
 * subframe is right if it shows what was exposed in the frame of that time. */
class Claims
{
public:
  void add (GstClockTime pts, int frame)
  {
    const std::lock_guard guard (lock_);
    frames_.emplace (pts, frame);
  }
  std::vector<std::int64_t> slots_at (GstClockTime pts) const
  {
    const std::lock_guard guard (lock_);
    std::vector<std::int64_t> slots;
    const GstClockTime latest = pts + kSlotTime / 2;
    for (auto claim = frames_.upper_bound (latest);
         claim != frames_.begin ();) {
      const auto &[said, frame] = *--claim;
      const auto slot = std::int64_t ((latest - said) / kSlotTime);
      if (slot >= kSlots)
        break;
      slots.push_back (frame * kSlots + slot);
    }
    return slots;
  }

private:
  mutable std::mutex lock_;
  std::multimap<GstClockTime, int> frames_;
};

struct Run {
  int frames = 1000;
  BenchPlay::Settings bench = {};
  Fault fault = {};
  Judge::Options judge = {};
  std::string need = {};  ///< message that must come
  std::string label = {}; ///< of the fault
};

void
add_run (Row &row, Run run)
{
  row.runs++;
  Claims claims;
  if (run.bench.sync.empty ())
    run.judge.slots_at = [&] (GstClockTime pts) {
      return claims.slots_at (pts);
    };
  Judge judge (run.judge);
  BenchPlay bench (run.bench);
  judge.watch (bench.play.pad ("out", "sink").get ());
  bench.start ();
  int exposed = 0;
  const Send send = [&] (BufferPtr frame) {
    claims.add (
        GST_BUFFER_PTS (frame.get ()), int (GST_BUFFER_OFFSET (frame.get ())));
    bench.send (std::move (frame));
  };
  for (; exposed < run.frames; exposed++) {
    BufferPtr frame = bench.expose ();
    if (!frame)
      break;
    GST_BUFFER_OFFSET (frame.get ()) = guint64 (exposed);
    if (run.fault)
      run.fault (exposed, std::move (frame), send);
    else
      send (std::move (frame));
  }
  bench.end ();
  bench.play.stop ();
  /* Frames that were lost last may still come, for all that dmdsync knows. */
  judge.end (bench.slots () - 8 * kSlots, bench.play.told_of_the_end ());
  Tally tally = judge.tally ();
  const auto dropped = bench.play.told.find ("dmdsync/frame-dropped");
  if (dropped != bench.play.told.end ())
    tally.untold -=
        std::min (tally.untold, std::uint64_t (dropped->second) * kSlots);
  row.tally += tally;
  row.refused += !bench.play.error.empty ();
  row.hung += bench.play.hung;
  for (const auto &[text, count] : bench.play.told)
    row.told[text] += count;
  if (!run.need.empty () && !bench.play.told.count (run.need)) {
    row.mute++;
    row.note (
        run.label + run.bench.schedule + run.bench.slips + ": no " + run.need);
  }
  if (tally.as_good + tally.untold > 0)
    row.note (run.label + run.bench.schedule + run.bench.slips + ": " +
              judge.evidence ());
}

/** A part of frames for which @p fault stands in. */
Fault
sometimes (double part, unsigned seed, Fault fault)
{
  auto engine = std::make_shared<std::mt19937> (seed);
  return [=] (int frame, BufferPtr buffer, const Send &send) {
    if (std::uniform_real_distribution (0.0, 1.0) (*engine) < part)
      fault (frame, std::move (buffer), send);
    else
      send (std::move (buffer));
  };
}

void
lose (int, BufferPtr, const Send &)
{
}

void
duplicate (int, BufferPtr frame, const Send &send)
{
  send (copy_of (frame));
  send (std::move (frame));
}

/* The camera's memory has the picture before, with the new time. */
Fault
stale (int at)
{
  auto before = std::make_shared<BufferPtr> ();
  return [=] (int frame, BufferPtr buffer, const Send &send) {
    if (frame == at) {
      BufferPtr old = copy_of (*before);
      GST_BUFFER_PTS (old.get ()) = GST_BUFFER_PTS (buffer.get ());
      GST_BUFFER_OFFSET (old.get ()) = GST_BUFFER_OFFSET (buffer.get ());
      return send (std::move (old));
    }
    *before = copy_of (buffer);
    send (std::move (buffer));
  };
}

Fault
swap_some (double part)
{
  auto held = std::make_shared<BufferPtr> ();
  auto engine = std::make_shared<std::mt19937> (7);
  return [=] (int, BufferPtr buffer, const Send &send) {
    if (!*held && std::uniform_real_distribution (0.0, 1.0) (*engine) < part) {
      *held = std::move (buffer);
      return;
    }
    send (std::move (buffer));
    if (*held)
      send (std::move (*held));
  };
}

void
send_half (int, BufferPtr frame, const Send &send)
{
  gst_buffer_resize (frame.get (), 0, kWidth * kHeight / 2);
  send (std::move (frame));
}

/** From frame @p from to before @p to, times are later by @p by. */
Fault
shift (int from, int to, GstClockTimeDiff by)
{
  return [=] (int frame, BufferPtr buffer, const Send &send) {
    if (frame >= from && frame < to)
      GST_BUFFER_PTS (buffer.get ()) =
          GstClockTime (GstClockTimeDiff (GST_BUFFER_PTS (buffer.get ())) + by);
    send (std::move (buffer));
  };
}

void
drift (int, BufferPtr frame, const Send &send)
{
  GST_BUFFER_PTS (frame.get ()) += GST_BUFFER_PTS (frame.get ()) / 5000;
  send (std::move (frame));
}

constexpr int kForEver = G_MAXINT;

std::vector<Row>
losses (Scale scale)
{
  std::vector<Row> rows;
  for (const double percent : {0.1, 1.0, 10.0}) {
    char name[32];
    std::snprintf (name, sizeof name, "camera loses %g %%", percent);
    rows.push_back ({.name = name});
    for (const char *schedule : {"sequential:2x2", "sequential:2x2,pilot=8"})
      for (const char *sync : {"", "on-loss=repeat"})
        add_run (
            rows.back (), {.frames = scale == Scale::full ? 10'000 : 600,
                              .bench = {.schedule = schedule, .sync = sync},
                              .fault = sometimes (percent / 100, 11, lose),
                              .need = percent < 1 && scale == Scale::brief
                                          ? ""
                                          : "codedexposure/frames-lost"});
  }
  return rows;
}

std::vector<Row>
orders (Scale scale)
{
  const int frames = scale == Scale::full ? 10'000 : 400;
  Row twice{.name = "1 % of frames twice"};
  Row old{.name = "an old picture with a new time"};
  Row swapped{.name = "1 % of frames after the next one"};
  Row half{.name = "1 % of frames incomplete"};
  for (const char *schedule : {"sequential:2x2", "sequential:2x2,pilot=8"}) {
    const BenchPlay::Settings bench{.schedule = schedule};
    add_run (twice, {.frames = frames,
                        .bench = bench,
                        .fault = sometimes (0.01, 3, duplicate)});
    add_run (
        swapped, {.frames = frames, .bench = bench, .fault = swap_some (0.01)});
    add_run (half, {.frames = frames,
                       .bench = bench,
                       .fault = sometimes (0.01, 5, send_half),
                       .need = "dmdsync/frame-incomplete"});
  }
  add_run (old, {.frames = 100, .fault = stale (30), .judge = {.slips = true}});
  add_run (old, {.frames = 100, .fault = stale (31), .judge = {.slips = true}});
  return {twice, old, swapped, half};
}

std::vector<Row>
times (Scale scale)
{
  Row once{.name = "the time of one frame jumps"};
  Row jump{.name = "the camera's clock jumps"};
  Row drifting{.name = "the camera's clock is 200 ppm fast"};
  const auto ms = [] (int value) {
    return value * GstClockTimeDiff (GST_MSECOND);
  };
  for (const char *schedule : {"sequential:2x2", "sequential:2x2,pilot=8"}) {
    const BenchPlay::Settings bench{.schedule = schedule};
    for (const int by : {-200, -40, -13, -3, 3, 13, 40, 200, 5000}) {
      add_run (once, {.frames = 120,
                         .bench = bench,
                         .fault = shift (60, 61, ms (by)),
                         .label = std::to_string (by) + " ms: "});
      add_run (jump, {.frames = 120,
                         .bench = bench,
                         .fault = shift (60, kForEver, ms (by)),
                         .label = std::to_string (by) + " ms: "});
    }
    add_run (drifting, {.frames = scale == Scale::full ? 90'000 : 1500,
                           .bench = bench,
                           .fault = drift});
  }
  return {once, jump, drifting};
}

/** Whether a slip by @p by slots in slot @p slot of an exposure changes a mask:
 * masks repeat with the frame, and the pilot with two. */
bool
is_slip (int slot, int by)
{
  return by % kSlots != 0 || (slot != 0 && by % (2 * kSlots) != 0);
}

std::vector<Row>
slips (Scale scale)
{
  struct Kind {
    const char *name, *schedule;
    bool always_seen;
    Reading reading;
  };
  const Kind kinds[] = {
      {"slips, sequential with a pilot", "sequential:2x2,pilot=8", true,
          Reading::exact},
      {"slips, staircase with a pilot", "staircase:2x2,pilot=8", true,
          Reading::bits},
      {"slips, s-matrix with a pilot", "s-matrix:2x2,pilot=8", true,
          Reading::bits},
      {"slips, staircase alone", "staircase:2x2", false, Reading::bits},
      {"slips, s-matrix alone", "s-matrix:2x2", false, Reading::bits},
      {"slips, sequential alone", "sequential:2x2", false, Reading::exact},
  };
  std::vector<Row> rows;
  const int reach = scale == Scale::full ? 8 : 2;
  for (const Kind &kind : kinds) {
    rows.push_back ({.name = kind.name});
    for (int slot = 0; slot < kSlots; slot++)
      for (int by = -reach; by <= reach; by++)
        if (by != 0)
          add_run (rows.back (),
              {.frames = 60,
                  .bench = {.schedule = kind.schedule,
                      .slips = ",slip-at=" + std::to_string (120 + slot) + ":" +
                               std::to_string (by)},
                  .judge = {.reading = kind.reading, .slips = true},
                  .need = kind.always_seen && is_slip (slot, by)
                              ? "dmdsync/slip"
                              : ""});
  }
  return rows;
}

/** Everything at once, for as long as it takes. */
Fault
everything (unsigned seed)
{
  auto engine = std::make_shared<std::mt19937> (seed);
  return [=] (int frame, BufferPtr buffer, const Send &send) {
    switch ((*engine) () % 400) {
    case 0:
    case 1:
      return;
    case 2:
      return duplicate (frame, std::move (buffer), send);
    case 3:
      return send_half (frame, std::move (buffer), send);
    default:
      return send (std::move (buffer));
    }
  };
}

std::string
many_slips (int frames, unsigned seed)
{
  std::mt19937 engine (seed);
  std::string text;
  for (int slot = 200; slot < frames * kSlots;
       slot += 400 + int (engine () % 99))
    text += ",slip-at=" + std::to_string (slot) + ":" +
            std::to_string (engine () % 2 ? 1 : -1);
  return text;
}

Run
faulty_run (unsigned seed, int frames)
{
  return {.frames = frames,
      .bench = {.name = "bench" + std::to_string (seed),
          .slips = many_slips (frames, seed)},
      .fault = everything (seed),
      .judge = {.slips = true},
      .need = "dmdsync/slip"};
}

std::vector<Row>
eight (Scale scale)
{
  Row parts[8];
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < 8; i++)
      threads.emplace_back ([&parts, i, scale] {
        add_run (parts[i], faulty_run (i, scale == Scale::full ? 5000 : 200));
      });
  }
  Row row{.name = "8 streams at once, losses and slips"};
  for (const Row &part : parts)
    row.add (part);
  return {row};
}

/** Resident memory, kB. */
long
memory ()
{
  long pages = 0;
  if (FILE *file = std::fopen ("/proc/self/statm", "r")) {
    if (std::fscanf (file, "%*d %ld", &pages) != 1)
      pages = 0;
    std::fclose (file);
  }
  return pages * (sysconf (_SC_PAGESIZE) / 1024);
}

/* Bench time: an hour has 90,000 frames. */
std::vector<Row>
soak (Scale scale)
{
  Row row{.name = "soak: losses, duplicates and slips"};
  const int frames = scale == Scale::full ? 90'000 : 1500;
  add_run (row, faulty_run (90, frames / 10));
  const long before = memory ();
  add_run (row, faulty_run (91, frames));
  const long grown = std::max (0L, memory () - before);
  row.told["memory grew by " + std::to_string (grown / 1024) + " MB"] = 1;
  if (grown > 32 * 1024) {
    row.mute++;
    row.note ("memory grew by " + std::to_string (grown) + " kB");
  }
  return {row};
}

} // namespace

std::vector<Case>
stream_cases ()
{
  return {{"losses", losses}, {"orders", orders}, {"times", times},
      {"slips", slips}, {"eight", eight}, {"soak", soak}};
}

} // namespace codedexposure::campaign
