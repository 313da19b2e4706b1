/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib, frame by frame: requests patterns, gives copies of frames to the
 * worker, draws the panel over the picture. Nothing here waits or solves. */
#include "common/events.h"
#include "common/meta.h"
#include "common/tag.h"
#include "state.h"

#define GST_CAT_DEFAULT moirecalib_debug

namespace codedexposure::gst::moire
{

namespace
{

/* A request holds for kLease frames and is renewed after kRenewal. */
constexpr guint64 kLease = 250, kRenewal = 100;
/* Frames that may wait for the worker; while they do, the pattern stays. */
constexpr std::size_t kMostSamples = 32;
/* Readings in a row that make an alignment: one second at 25 a second. */
constexpr int kSteady = 25;

GstBaseTransformClass *
base_class ()
{
  return GST_BASE_TRANSFORM_CLASS (g_type_class_peek (GST_TYPE_BASE_TRANSFORM));
}

gboolean
send_request (GstMoireCalib *self, const std::string &pattern)
{
  return gst_pad_push_event (GST_BASE_TRANSFORM_SINK_PAD (self),
      new_event (PatternRequest{pattern, kLease}));
}

/** Posts that no patterns are available, and @p why. Returns false. */
bool
refuse (GstMoireCalib *self, const std::string &why)
{
  GST_ELEMENT_ERROR (self, RESOURCE, NOT_FOUND,
      ("Nobody upstream shows patterns. Put a dmdsync with a device that takes "
       "masks at run time before moirecalib, or show a grating by other means "
       "and say which: pattern=%s.",
          live_grating ().text ().c_str ()),
      ("%s", why.c_str ()));
  return false;
}

/** Requests @p pattern; false, with an error posted, when upstream refuses. */
bool
ask (GstMoireCalib *self, const std::string &pattern)
{
  Stream &stream = state (self).stream;
  stream.asked = pattern;
  stream.frames = 0;
  return !settings_of (self).pattern.empty () || send_request (self, pattern) ||
         refuse (self, "the request for " + pattern + " was refused");
}

/** The next frame begins a new run. */
void
begin_anew (GstMoireCalib *self)
{
  Stream &stream = state (self).stream;
  stream.begun = false;
  stream.asked.clear ();
}

MirrorsAnswer
ask_mirrors (GstMoireCalib *self)
{
  const QueryPtr query (new_query<MirrorsAnswer> ());
  if (gst_pad_peer_query (GST_BASE_TRANSFORM_SINK_PAD (self), query.get ()))
    if (auto answer = parse_query<MirrorsAnswer> (query.get ()))
      return *answer;
  return {.reason = "no element upstream knows of mirrors"};
}

std::string
live_pattern (const Settings &settings)
{
  return settings.pattern.empty () ? live_grating ().text () : settings.pattern;
}

bool
begin_mapping (GstMoireCalib *self)
{
  CalibState &st = state (self);
  std::string first;
  std::size_t count = 0;
  {
    const std::lock_guard guard (st.exchange.lock);
    first = st.exchange.geometry->patterns.front ().text ();
    count = st.exchange.geometry->patterns.size ();
    st.exchange.live.reset ();
    st.exchange.stage = Stage::mapping;
  }
  st.stream.mapping = true;
  st.stream.next = 0;
  st.stream.taken = 0;
  set_stage (self, Stage::mapping);
  say_progress (self, GST_PROGRESS_TYPE_START,
      "mapping with " + std::to_string (count) + " patterns");
  return ask (self, first);
}

/** Gives the worker what a run begins with. */
void
begin_run (GstMoireCalib *self, const Settings &settings, Geometry geometry)
{
  CalibState &st = state (self);
  Stream &stream = st.stream;
  {
    const std::lock_guard guard (st.exchange.lock);
    if (geometry.mode == Mode::phase) {
      st.exchange.schedule.reset ();
      st.exchange.panel.reset ();
    }
    st.exchange.geometry = std::move (geometry);
    st.exchange.run++;
    st.exchange.live.reset ();
    st.exchange.samples.clear ();
    st.exchange.solve = false;
    st.exchange.stage = Stage::searching;
    st.exchange.confidence = 0.0;
    st.exchange.readings = 0;
    st.exchange.aligned_readings = 0;
  }
  stream.begun = true;
  stream.turn = settings.turn;
  stream.mapping = false;
  set_stage (self, Stage::searching);
}

/** Needs no patterns: the schedule itself shows the tile in the scene. */
bool
begin_phase (GstMoireCalib *self, const Settings &settings, int bits)
{
  Stream &stream = state (self).stream;
  if (!std::exchange (stream.asked, {}).empty ())
    release_mirrors (self);
  const Extent camera{stream.info->width, stream.info->height};
  std::optional<Schedule> said;
  if (stream.setup)
    said = stream.setup->schedule;
  begin_run (self, settings,
      {settings.mode, *stream.info, bits, camera, camera, {},
          std::move (said)});
  return true;
}

/** @p bits: significant ones, from the frame metadata. */
bool
begin (GstMoireCalib *self, const Settings &settings, int bits)
{
  const Stream &stream = state (self).stream;
  if (settings.mode == Mode::phase)
    return begin_phase (self, settings, bits);
  if (const auto shown = Pattern::parse (live_pattern (settings)); !shown) {
    GST_ELEMENT_ERROR (self, RESOURCE, SETTINGS,
        ("The pattern property cannot be read: %s",
            shown.error ().message.c_str ()),
        (nullptr));
    return false;
  }
  const MirrorsAnswer mirrors = ask_mirrors (self);
  if (settings.pattern.empty () && !mirrors.patterns)
    return refuse (self, mirrors.reason);
  Geometry geometry;
  geometry.mode = settings.mode;
  geometry.info = *stream.info;
  geometry.bits = bits;
  geometry.camera = {stream.info->width, stream.info->height};
  geometry.mirrors = mirrors.width > 0 && mirrors.height > 0
                         ? Extent{mirrors.width, mirrors.height}
                         : geometry.camera;
  geometry.patterns = calibration_patterns (geometry.mirrors, settings.period);
  begin_run (self, settings, std::move (geometry));
  return ask (self, live_pattern (settings));
}

Sample
copy_of (GstBuffer *buffer, const std::string &pattern, guint64 number)
{
  return {BufferPtr (gst_buffer_copy_deep (buffer)), pattern, number,
      GST_BUFFER_PTS (buffer)};
}

/** Gives the worker a frame if it is idle. Exchange's lock. */
void
offer (Exchange &exchange, GstBuffer *buffer, const std::string &pattern,
    guint64 number)
{
  if (exchange.busy || exchange.live)
    return;
  exchange.live = copy_of (buffer, pattern, number);
  exchange.changed.notify_all ();
}

/** A frame of the schedule. */
bool
find_phase (GstMoireCalib *self, GstBuffer *buffer, const FrameMeta &meta)
{
  Exchange &exchange = state (self).exchange;
  const std::lock_guard guard (exchange.lock);
  if (exchange.stage == Stage::searching && meta.pattern.empty ())
    offer (exchange, buffer, {}, meta.frame);
  return true;
}

/** A frame of the live grating. */
bool
align (GstMoireCalib *self, const Settings &settings, GstBuffer *buffer,
    const std::string &shown, guint64 number)
{
  CalibState &st = state (self);
  Stream &stream = st.stream;
  bool enough = false;
  if (shown == stream.asked) {
    const std::lock_guard guard (st.exchange.lock);
    offer (st.exchange, buffer, shown, number);
    /* The report shows the fringes of one reading. */
    enough = settings.mode == Mode::map
                 ? st.exchange.readings > 0
                 : settings.mode == Mode::automatic &&
                       st.exchange.aligned_readings >= kSteady;
  }
  if (enough && settings.pattern.empty ())
    return begin_mapping (self);
  if (++stream.frames >= kRenewal)
    return ask (self, stream.asked);
  return true;
}

/** A frame of a calibration pattern. */
bool
map (GstMoireCalib *self, const Settings &settings, GstBuffer *buffer,
    const std::string &shown, guint64 number)
{
  CalibState &st = state (self);
  Stream &stream = st.stream;
  if (stream.asked.empty ())
    return true;
  if (shown != stream.asked)
    return ++stream.frames < kRenewal || ask (self, stream.asked);

  std::string following;
  {
    const std::lock_guard guard (st.exchange.lock);
    if (st.exchange.samples.size () >= kMostSamples)
      return true;
    st.exchange.samples.push_back (copy_of (buffer, shown, number));
    if (++stream.taken >= settings.frames) {
      stream.taken = 0;
      const auto &patterns = st.exchange.geometry->patterns;
      if (++stream.next < patterns.size ())
        following = patterns[stream.next].text ();
      else
        st.exchange.solve = true;
    }
    st.exchange.changed.notify_all ();
  }
  if (stream.taken > 0)
    return true;
  if (!following.empty ())
    return ask (self, following);
  stream.asked.clear ();
  release_mirrors (self);
  return true;
}

void
overlay (GstMoireCalib *self, GstBuffer *buffer)
{
  CalibState &st = state (self);
  std::shared_ptr<const Panel> panel;
  {
    const std::lock_guard guard (st.exchange.lock);
    panel = st.exchange.panel;
  }
  const GstVideoInfo &info = *st.stream.info;
  if (!panel || panel->grey.width () != info.width ||
      panel->grey.height () != info.height)
    return;
  MappedFrame mapped (info, buffer, GstMapFlags (GST_MAP_READWRITE));
  if (!mapped)
    return;
  if (GST_VIDEO_INFO_FORMAT (&info) == GST_VIDEO_FORMAT_GRAY8)
    lay_over (*panel, view_of<guint8> (mapped));
  else
    lay_over (*panel, view_of<guint16> (mapped));
}

/** The setup from upstream with the phase or mapping that was found here.
 * Exchange's lock. */
std::optional<StreamSetup>
corrected_setup (const CalibState &st)
{
  std::optional<StreamSetup> setup = st.stream.setup;
  if (st.exchange.schedule)
    setup = StreamSetup{*st.exchange.schedule};
  else if (setup && st.exchange.mapping)
    setup->mapping = st.exchange.mapping;
  return setup;
}

/** Sends downstream the tag with the phase or mapping that was found. */
void
push_setup (GstMoireCalib *self)
{
  CalibState &st = state (self);
  std::optional<StreamSetup> setup;
  {
    const std::lock_guard guard (st.exchange.lock);
    if (!std::exchange (st.exchange.setup_due, false))
      return;
    setup = corrected_setup (st);
  }
  if (setup)
    gst_pad_push_event (
        GST_BASE_TRANSFORM_SRC_PAD (self), setup_to_event (*setup));
  else
    GST_INFO_OBJECT (self, "no schedule to send the mapping with");
}

/** Reads the setup from a tag, and puts into the tag what was found here. A new
 * schedule starts a new search for its phase. */
GstEvent *
take_tag (GstMoireCalib *self, GstEvent *event)
{
  CalibState &st = state (self);
  GstTagList *tags = nullptr;
  gst_event_parse_tag (event, &tags);
  const auto said = setup_from_tags (tags);
  if (!said || !*said)
    return event;
  const bool other =
      !st.stream.setup || st.stream.setup->schedule != said->value ().schedule;
  st.stream.setup = said->value ();
  std::optional<StreamSetup> setup;
  {
    const std::lock_guard guard (st.exchange.lock);
    if (other) {
      st.exchange.schedule.reset ();
      if (st.exchange.geometry && st.exchange.geometry->mode == Mode::phase) {
        st.exchange.run++;
        st.exchange.live.reset ();
        begin_anew (self);
      }
    }
    setup = corrected_setup (st);
  }
  if (setup == st.stream.setup)
    return event;
  return replace_setup (event, *setup);
}

/** At the end of the stream: waits for the worker, and warns about what is not
 * finished. */
void
finish (GstMoireCalib *self)
{
  CalibState &st = state (self);
  Exchange &exchange = st.exchange;
  std::size_t patterns = 0;
  bool lost_tile = false;
  double confidence = 0.0;
  {
    std::unique_lock guard (exchange.lock);
    exchange.changed.wait (guard, [&exchange] {
      return exchange.quit || (!exchange.busy && !exchange.solve &&
                                  !exchange.live && exchange.samples.empty ());
    });
    lost_tile = exchange.geometry && exchange.geometry->mode == Mode::phase &&
                exchange.stage == Stage::searching;
    confidence = exchange.confidence;
    if (exchange.geometry)
      patterns = exchange.geometry->patterns.size ();
  }
  push_setup (self);
  if (lost_tile)
    GST_ELEMENT_WARNING (self, STREAM, FAILED,
        ("The stream ended, and no frame told where the tile lies: a phase is "
         "taken from a probability of %g on, and %g was the most. Take a scene "
         "with more light in more of its parts, or calibrate.",
            CalibrationSession::kSure, confidence),
        (nullptr));
  if (st.stream.mapping && st.stream.next < patterns)
    GST_ELEMENT_WARNING (self, STREAM, FAILED,
        ("The stream ended after %d of %d patterns: there is no mapping.",
            int (st.stream.next), int (patterns)),
        (nullptr));
}

} // namespace

void
release_mirrors (GstMoireCalib *self)
{
  if (settings_of (self).pattern.empty ())
    send_request (self, "");
}

GstFlowReturn
transform_ip (GstBaseTransform *trans, GstBuffer *buffer) noexcept
{
  auto *self = GST_MOIRE_CALIB (trans);
  Stream &stream = state (self).stream;
  const Settings settings = settings_of (self);
  if (!stream.info)
    return GST_FLOW_NOT_NEGOTIATED;
  const FrameMeta meta = get_frame_meta (buffer).value_or (FrameMeta ());
  if ((!stream.begun || stream.turn != settings.turn) &&
      !begin (self, settings, meta.bits))
    return GST_FLOW_ERROR;

  const std::string shown =
      settings.pattern.empty () ? meta.pattern : settings.pattern;
  const bool went_on = settings.mode == Mode::phase
                           ? find_phase (self, buffer, meta)
                           : (stream.mapping ? map : align) (
                                 self, settings, buffer, shown, meta.frame);
  if (!went_on)
    return GST_FLOW_ERROR;
  push_setup (self);
  if (settings.lays_over () && gst_buffer_is_writable (buffer))
    overlay (self, buffer);
  return GST_FLOW_OK;
}

gboolean
set_caps (GstBaseTransform *trans, GstCaps *incaps, GstCaps *) noexcept
{
  auto *self = GST_MOIRE_CALIB (trans);
  GstVideoInfo info;
  if (!gst_video_info_from_caps (&info, incaps))
    return FALSE;
  begin_anew (self);
  state (self).stream.info = info;
  return TRUE;
}

gboolean
sink_event (GstBaseTransform *trans, GstEvent *event) noexcept
{
  auto *self = GST_MOIRE_CALIB (trans);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_TAG:
    event = take_tag (self, event);
    break;
  case GST_EVENT_FLUSH_STOP:
    begin_anew (self);
    break;
  case GST_EVENT_EOS:
    finish (self);
    break;
  default:
    break;
  }
  return base_class ()->sink_event (trans, event);
}

} // namespace codedexposure::gst::moire
