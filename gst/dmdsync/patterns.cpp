/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Patterns that elements downstream request.
 *
 * An event requests one, from any thread; the runner sends it; the streaming
 * thread finds the first frame that shows it and names it in the meta of that
 * frame and the next ones. Nobody waits for the device.
 */
#include "base/statistics.h"
#include "calibrate/gratings.h"
#include "common/messages.h"
#include "common/meta.h"
#include "dmdsync.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace codedexposure::gst::sync
{

namespace
{

/* A request that is not renewed expires after this many frames: 10 s at 25
 * frames/s. */
constexpr guint64 kFrames = 250;

/** Why no pattern can be shown; "": it can. */
std::string
obstacle (const DmdRunner *runner)
{
  if (!runner)
    return "dmdsync drives no DMD; set its device property";
  const DmdInfo &info = runner->info ();
  if (!info.still_masks)
    return info.name +
           " takes no masks at run time; put the pattern on the device by its "
           "own software, and leave dmdsync's device empty";
  return "";
}

bool
refuse (GstDmdSync *self, const std::string &pattern, const std::string &why)
{
  POST_WARNING (self, RESOURCE, SETTINGS,
      "Cannot show the pattern " + pattern + ": " + why);
  return false;
}

/* False where there is no stream. */
bool
send (GstDmdSync *self, DmdRunner &runner, const Pattern &pattern,
    const std::string &text, guint64 frames)
{
  SyncState &st = state (self);
  const std::lock_guard order (st.pattern_order);
  std::optional<Timebase> time;
  int slots = 0;
  {
    const ObjectLock lock (self);
    time = st.time;
    slots = st.schedule.max_on_slots ();
    if (time && st.pattern && st.pattern->text == text) {
      st.pattern->frames_left = frames;
      return true;
    }
  }
  if (!time || runner.halted () || runner.failed ())
    return false;
  locked (self, [&] {
    st.pattern = ShownPattern{text, frames};
    st.switches++;
  });
  GST_INFO_OBJECT (self, "shows %s", text.c_str ());
  runner.show ({.name = "the pattern " + text,
                   .on = [pattern] (int x, int y) { return pattern.on (x, y); },
                   /* As bright as coded frames: no setting of the camera has to
                    * change. */
                   .slots = slots},
      time->plan);
  return true;
}

bool
show (GstDmdSync *self, const std::string &text, guint64 frames)
{
  const auto runner = runner_of (self);
  if (const std::string why = obstacle (runner.get ()); !why.empty ())
    return refuse (self, text, why);
  const Result<Pattern> pattern = Pattern::parse (text);
  if (!pattern)
    return refuse (self, text, pattern.error ().message);
  if (!send (self, *runner, *pattern, text, frames))
    return refuse (self, text, "there is no stream yet, or no more");
  return true;
}

/* The pattern that was shown and is no more; none where there was none. */
std::optional<std::string>
restore (GstDmdSync *self)
{
  SyncState &st = state (self);
  const std::lock_guard order (st.pattern_order);
  std::shared_ptr<DmdRunner> runner;
  std::string pattern;
  Schedule schedule;
  SlotPlan plan;
  {
    const ObjectLock lock (self);
    if (!st.pattern || !st.time || !st.runner)
      return std::nullopt;
    runner = st.runner;
    pattern = st.pattern->text;
    st.pattern.reset ();
    st.switches++;
    schedule = st.schedule;
    plan = st.time->plan;
  }
  runner->restore (schedule, plan);
  return pattern;
}

double
level_of (const GstVideoInfo &info, GstBuffer *buffer)
{
  MappedFrame mapped (info, buffer, GST_MAP_READ);
  if (!mapped)
    return 0.0;
  return read_pixels (mapped, [] (auto pixels) { return mean_of (pixels); });
}

} // namespace

bool
take_request (GstDmdSync *self, const PatternRequest &request)
{
  const std::string pattern = request.pattern.value_or ("");
  if (!pattern.empty ())
    return show (self, pattern,
        std::max<guint64> (1, request.frames.value_or (kFrames)));
  give_back (self, "asked");
  return true;
}

MirrorsAnswer
describe_mirrors (GstDmdSync *self)
{
  const auto runner = runner_of (self);
  const std::string why = obstacle (runner.get ());
  const Extent size = runner ? runner->info ().shown () : Extent{0, 0};
  return {size.width, size.height, why.empty (), why};
}

SwitchAnswer
describe_switch (GstDmdSync *self)
{
  const auto runner = runner_of (self);
  SyncState &st = state (self);
  if (!runner || !runner->info ().triggers_camera)
    return {};
  return {locked (self, [&st] { return st.switches != st.seen_switches; }),
      !runner->settled () && !runner->failed ()};
}

void
give_back (GstDmdSync *self, const char *reason)
{
  const std::optional<std::string> pattern = restore (self);
  if (!pattern)
    return;
  GST_INFO_OBJECT (self, "gives the mirrors back: %s", reason);
  post_message (self, PatternOver{*pattern, reason});
}

std::string
look_for_pattern (GstDmdSync *self, GstBuffer *buffer, const FrameStep &step,
    GstClockTime pts)
{
  SyncState &st = state (self);
  Stream &stream = st.stream;
  const auto [pattern, switches] =
      locked (self, [&st] { return std::pair (st.pattern, st.switches); });
  const bool changed = std::exchange (stream.switches, switches) != switches;
  if (stream.coded && !changed)
    return {};
  if (changed)
    stream.shown.begin ();
  stream.coded = false;

  const bool waited = stream.shown.waiting ();
  const bool shown = stream.shown.take (st.runner->settled (),
      level_of (stream.time->info, buffer), step.lost > 0);
  if (!shown)
    return kSwitch;
  locked (self, [&st, seen = switches] { st.seen_switches = seen; });
  if (!pattern) {
    stream.coded = true;
    begin_phase (self);
    return {};
  }
  if (waited)
    post_message (
        self, PatternShown{pattern->text, guint64 (step.number), pts});

  if (locked (self, [&] {
        return st.pattern && st.pattern->text == pattern->text &&
               --st.pattern->frames_left == 0;
      }))
    give_back (self, "frames");
  return pattern->text;
}

} // namespace codedexposure::gst::sync
