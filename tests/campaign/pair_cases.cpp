/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Faults of either of two cameras, before codedexposure-pair. A row counts
 * coded frames: wrong are those whose partner is of another exposure, which is
 * always as good; flagged are those without one. */
#include <random>

#include <gst/app/gstappsrc.h>

#include "common/meta.h"
#include "common/partner.h"
#include "play.h"

namespace codedexposure::campaign
{

using namespace codedexposure::gst;

namespace
{

/* Without losses at begin and end, which nothing tells from those. */
constexpr int kWhole = 20;

/** What a camera sends of exposure @p frame: at which time; none: nothing. */
using Sends = std::function<std::optional<GstClockTime> (int frame)>;

GstClockTime
time_of (int frame)
{
  return GstClockTime (frame + 1) * kPeriod;
}

Sends
all ()
{
  return [] (int frame) { return time_of (frame); };
}

int
light (int frame, bool off_beam, int x, int y)
{
  const std::int64_t first = std::int64_t (frame) * kSlots;
  const int own = x % 2 + y % 2 * 2;
  if (!off_beam)
    return coded_pixel (first, x, y);
  int sum = 0;
  for (int slot = 0; slot < kSlots; slot++)
    if (slot != own) // coded_pixel () has the slot of its place
      sum += coded_pixel (first + slot - own, x, y);
  return sum / (kSlots - 1);
}

class Cameras
{
public:
  Cameras ()
      : play_ (source ("on") + source ("off") +
               "codedexposure-pair name=pair ! fakesink name=out sync=false "
               "async=false")
  {
    gst_pad_add_probe (
        play_.pad ("out", "sink").get (), GST_PAD_PROBE_TYPE_BUFFER,
        [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
          static_cast<Cameras *> (self)->judge (
              GST_PAD_PROBE_INFO_BUFFER (info));
          return GST_PAD_PROBE_OK;
        },
        this, nullptr);
  }

  /** Adds what came of it to @p row. */
  void run (Row &row, int frames, const Sends &on, const Sends &off)
  {
    play_.start ();
    const std::pair<const char *, const Sends &> cameras[] = {
        {"on", on}, {"off", off}};
    std::map<std::string, guint64> lost;
    for (int frame = 0; frame < frames; frame++)
      for (const auto &[name, sends] : cameras)
        if (const auto time = kWhole <= frame && frame < frames - kWhole
                                  ? sends (frame)
                                  : all () (frame))
          send (name, frame, *time);
        else
          lost[name]++;
    for (const auto &[name, sends] : cameras)
      gst_app_src_end_of_stream (GST_APP_SRC (play_.find (name).get ()));
    play_.wait ();
    for (const auto &[name, count] : lost) {
      tally_.missing += count;
      tally_.untold += count - std::min (count, lost_of (name));
    }
    tally_.untold +=
        tally_.flagged - std::min (tally_.flagged, frames_alone ());
    row.runs++;
    row.tally += tally_;
    row.refused += !play_.error.empty ();
    row.hung += play_.hung;
    for (const auto &[text, count] : play_.told)
      row.told[text] += count;
    if (tally_.flagged > 0 && !play_.told.count ("codedexposure/partner-lost"))
      row.mute++;
    row.note (evidence_);
  }

private:
  static std::string source (const std::string &name)
  {
    return "appsrc name=" + name +
           " format=time max-buffers=0 max-bytes=0 "
           "caps=\"video/x-raw,format=GRAY8,width=" +
           std::to_string (kWidth) + ",height=" + std::to_string (kScene) +
           ",framerate=25/1\" ! dmdsync name=sync-" + name + " beam=" + name +
           " schedule=sequential:2x2 ! queue max-size-buffers=0 "
           "max-size-bytes=0 "
           "max-size-time=0 ! pair." +
           name + " ";
  }

  guint64 frames_alone () const
  {
    guint64 value = 0;
    g_object_get (play_.find ("pair").get (), "frames-alone", &value, nullptr);
    return value;
  }

  guint64 lost_of (const std::string &camera) const
  {
    GstStructure *stats = nullptr;
    g_object_get (play_.find (("sync-" + camera).c_str ()).get (), "stats",
        &stats, nullptr);
    guint64 value = 0;
    gst_structure_get_uint64 (stats, "frames-lost", &value);
    gst_structure_free (stats);
    return value;
  }

  void send (const char *camera, int frame, GstClockTime time)
  {
    GstBuffer *buffer =
        gst_buffer_new_allocate (nullptr, kWidth * kScene, nullptr);
    GST_BUFFER_PTS (buffer) = time;
    GST_BUFFER_DURATION (buffer) = kPeriod;
    GstMapInfo map;
    gst_buffer_map (buffer, &map, GST_MAP_WRITE);
    for (int y = 0; y < kScene; y++)
      for (int x = 0; x < kWidth; x++)
        map.data[y * kWidth + x] =
            std::uint8_t (light (frame, camera[1] == 'f', x, y));
    gst_buffer_unmap (buffer, &map);
    gst_app_src_push_buffer (GST_APP_SRC (play_.find (camera).get ()), buffer);
  }

  void judge (GstBuffer *coded)
  {
    tally_.delivered++;
    const auto partner = get_partner (coded);
    if (!partner) {
      tally_.flagged++;
      return;
    }
    const int own = shown_in (coded, false);
    const int its = shown_in (partner->buffer.get (), true);
    if (own >= 0 && own == its)
      return;
    tally_.wrong++;
    tally_.as_good++;
    evidence_ = "frame " + std::to_string (own) + " has the partner of " +
                std::to_string (its);
  }

  /** The exposure that @p buffer shows, of those at about its time; -1: none.
   */
  static int shown_in (GstBuffer *buffer, bool off_beam)
  {
    constexpr int kAbout = 4;
    const int about = int (GST_BUFFER_PTS (buffer) / kPeriod) - 1;
    GstMapInfo map;
    gst_buffer_map (buffer, &map, GST_MAP_READ);
    int shown = -1;
    for (int frame = about - kAbout; frame <= about + kAbout; frame++) {
      bool same = frame >= 0;
      for (int x = 0; same && x < kWidth; x++)
        same = map.data[x] == light (frame, off_beam, x, 0);
      if (same)
        shown = frame;
    }
    gst_buffer_unmap (buffer, &map);
    return shown;
  }

  Play play_;
  Tally tally_;
  std::string evidence_;
};

Sends
losing (double part, unsigned seed)
{
  auto engine = std::make_shared<std::mt19937> (seed);
  return [=] (int frame) -> std::optional<GstClockTime> {
    if (std::uniform_real_distribution (0.0, 1.0) (*engine) < part)
      return std::nullopt;
    return time_of (frame);
  };
}

Sends
shaking (unsigned seed)
{
  auto engine = std::make_shared<std::mt19937> (seed);
  return [=] (int frame) -> std::optional<GstClockTime> {
    return time_of (frame) + (*engine) () % (9 * GST_MSECOND);
  };
}

/** Nothing from frame @p from on, before @p to; later frames come @p late. */
Sends
away (int from, int to, GstClockTimeDiff late)
{
  return [=] (int frame) -> std::optional<GstClockTime> {
    if (frame >= from && frame < to)
      return std::nullopt;
    return time_of (frame) + GstClockTime (frame >= to ? late : 0);
  };
}

std::vector<Row>
pairs (Scale scale)
{
  const int frames = scale == Scale::full ? 10'000 : 400;
  std::vector<Row> rows;
  const auto add = [&] (const std::string &name,
                       const std::vector<std::pair<Sends, Sends>> &runs) {
    rows.push_back ({.name = "two cameras: " + name});
    for (const auto &[on, off] : runs)
      Cameras ().run (rows.back (), frames, on, off);
  };
  for (const double percent : {0.1, 1.0, 10.0}) {
    const double part = percent / 100;
    char name[64];
    std::snprintf (name, sizeof name, "one or both lose %g %%", percent);
    add (name, {{losing (part, 1), all ()}, {all (), losing (part, 2)},
                   {losing (part, 3), losing (part, 4)}});
  }
  add ("times jitter by 9 ms", {{shaking (5), all ()}, {all (), shaking (6)},
                                   {shaking (7), shaking (8)}});
  add ("one is away for 3 s",
      {{away (100, 175, 0), all ()}, {all (), away (100, 175, 0)}});
  const auto period = GstClockTimeDiff (kPeriod);
  add ("one restarts, a frame behind or ahead",
      {{all (), away (100, 103, period)}, {all (), away (100, 103, -period)},
          {away (100, 103, period), all ()}});
  return rows;
}

} // namespace

std::vector<Case>
pair_cases ()
{
  return {{"pairs", pairs}};
}

} // namespace codedexposure::campaign
