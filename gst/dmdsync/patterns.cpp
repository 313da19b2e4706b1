/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync shows patterns that others ask for, and gives the mirrors back.
 *
 * An event from downstream asks for a pattern, from any thread; the runner
 * sends it; the streaming thread finds the frame from which on it is to be
 * seen, and says so in that frame's meta. Nobody waits for the device.
 */
#include <numeric>

#include "calibrate/gratings.h"
#include "state.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace codedexposure::gst::sync
{

namespace
{

constexpr const char *kRequest = "dmdsync/pattern";
constexpr const char *kMirrors = "dmdsync/mirrors";
/* Who asks and is gone leaves the mirrors for so long: 10 s at 25 a second. */
constexpr guint64 kFrames = 250;

/** Why no pattern can be shown; "": it can. */
std::string
obstacle (const SyncState &st)
{
  if (!st.runner)
    return "dmdsync drives no DMD; set its device property";
  const DmdInfo &info = st.runner->info ();
  if (!info.still_masks)
    return info.name +
           " takes no masks at run time; put the pattern on the device by its "
           "own software, and leave dmdsync's device empty";
  return "";
}

gboolean
refuse (GstDmdSync *self, const std::string &pattern, const std::string &why)
{
  GST_ELEMENT_WARNING (self, RESOURCE, SETTINGS,
      ("Cannot show the pattern %s: %s", pattern.c_str (), why.c_str ()),
      (nullptr));
  return FALSE;
}

/* False where there is no stream. The order's lock is given up before anybody
 * is told: who is told may ask for the next pattern at once. */
bool
send (GstDmdSync *self, const Pattern &pattern, const std::string &text,
    guint64 frames)
{
  SyncState &st = state (self);
  const std::lock_guard order (st.pattern_order);
  std::optional<Timebase> time;
  {
    const ObjectLock lock (self);
    time = st.time;
    if (time && st.pattern && st.pattern->text == text) {
      st.pattern->frames_left = frames;
      return true;
    }
  }
  if (!time || st.runner->halted () || st.runner->failed ())
    return false;
  {
    const ObjectLock lock (self);
    st.pattern = ShownPattern{text, frames};
    st.switches++;
  }
  GST_INFO_OBJECT (self, "shows %s", text.c_str ());
  st.runner->show (
      {.name = "the pattern " + text,
          .on = [pattern] (int x, int y) { return pattern.on (x, y); },
          /* As bright as coded frames: no setting of the camera has to
           * change. */
          .slots = st.schedule.max_on_slots ()},
      time->plan);
  return true;
}

gboolean
show (GstDmdSync *self, const std::string &text, guint64 frames)
{
  if (const std::string why = obstacle (state (self)); !why.empty ())
    return refuse (self, text, why);
  const Result<Pattern> pattern = Pattern::parse (text);
  if (!pattern)
    return refuse (self, text, pattern.error ().message);
  if (!send (self, *pattern, text, frames))
    return refuse (self, text, "there is no stream yet, or no more");
  return TRUE;
}

/* The pattern that was shown and is no more; none where there was none. */
std::optional<std::string>
restore (GstDmdSync *self)
{
  SyncState &st = state (self);
  const std::lock_guard order (st.pattern_order);
  std::string pattern;
  SlotPlan plan;
  {
    const ObjectLock lock (self);
    if (!st.pattern || !st.time)
      return std::nullopt;
    pattern = st.pattern->text;
    st.pattern.reset ();
    st.switches++;
    plan = st.time->plan;
  }
  st.runner->restore (st.schedule, plan);
  return pattern;
}

template <typename Pixel>
double
mean_of (ImageView<const Pixel> image)
{
  double sum = 0.0;
  for (int y = 0; y < image.height; y++)
    sum += double (std::accumulate (
        image.row (y), image.row (y) + image.width, std::uint64_t (0)));
  return sum / (double (image.width) * image.height);
}

double
level_of (const GstVideoInfo &info, GstBuffer *buffer)
{
  MappedFrame mapped (info, buffer, GST_MAP_READ);
  if (!mapped)
    return 0.0;
  if (GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY8)
    return mean_of (view_of<const guint8> (mapped));
  return mean_of (view_of<const guint16> (mapped));
}

void
say_shown (GstDmdSync *self, const std::string &pattern, const FrameStep &step,
    GstClockTime pts)
{
  gst_element_post_message (GST_ELEMENT (self),
      gst_message_new_element (GST_OBJECT (self),
          gst_structure_new ("dmdsync/pattern-shown", "pattern", G_TYPE_STRING,
              pattern.c_str (), "frame", G_TYPE_UINT64, guint64 (step.number),
              "pts", G_TYPE_UINT64, pts, nullptr)));
}

} // namespace

bool
is_pattern_event (GstEvent *event)
{
  return GST_EVENT_TYPE (event) == GST_EVENT_CUSTOM_UPSTREAM &&
         gst_event_has_name (event, kRequest);
}

gboolean
take_pattern_event (GstDmdSync *self, GstEvent *event)
{
  const EventPtr owned (event);
  const GstStructure *structure = gst_event_get_structure (event);
  const gchar *pattern = gst_structure_get_string (structure, "pattern");
  if (!pattern || !*pattern) {
    give_back (self, "asked");
    return TRUE;
  }
  guint64 frames = kFrames;
  gst_structure_get_uint64 (structure, "frames", &frames);
  return show (self, pattern, std::max<guint64> (1, frames));
}

bool
answer_mirrors (GstDmdSync *self, GstQuery *query)
{
  if (GST_QUERY_TYPE (query) != GST_QUERY_CUSTOM)
    return false;
  GstStructure *structure = gst_query_writable_structure (query);
  if (!gst_structure_has_name (structure, kMirrors))
    return false;
  const SyncState &st = state (self);
  const std::string why = obstacle (st);
  const Extent size = st.runner ? st.runner->info ().shown () : Extent ();
  gst_structure_set (structure, "width", G_TYPE_INT, size.width, "height",
      G_TYPE_INT, size.height, "patterns", G_TYPE_BOOLEAN,
      gboolean (why.empty ()), "reason", G_TYPE_STRING, why.c_str (), nullptr);
  return true;
}

void
give_back (GstDmdSync *self, const char *reason)
{
  const std::optional<std::string> pattern = restore (self);
  if (!pattern)
    return;
  GST_INFO_OBJECT (self, "gives the mirrors back: %s", reason);
  gst_element_post_message (GST_ELEMENT (self),
      gst_message_new_element (GST_OBJECT (self),
          gst_structure_new ("dmdsync/pattern-over", "pattern", G_TYPE_STRING,
              pattern->c_str (), "reason", G_TYPE_STRING, reason, nullptr)));
}

PatternSight
look_for_pattern (GstDmdSync *self, GstBuffer *buffer, const FrameStep &step,
    GstClockTime pts)
{
  SyncState &st = state (self);
  Stream &stream = st.stream;
  std::optional<ShownPattern> pattern;
  guint switches = 0;
  {
    const ObjectLock lock (self);
    pattern = st.pattern;
    switches = st.switches;
  }
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
    return {.coded = false};
  if (!pattern) {
    stream.coded = true;
    begin_phase (self);
    return {};
  }
  if (waited)
    say_shown (self, pattern->text, step, pts);

  bool over = false;
  {
    const ObjectLock lock (self);
    over = st.pattern && st.pattern->text == pattern->text &&
           --st.pattern->frames_left == 0;
  }
  if (over)
    give_back (self, "frames");
  return {.coded = false, .pattern = pattern->text};
}

} // namespace codedexposure::gst::sync
