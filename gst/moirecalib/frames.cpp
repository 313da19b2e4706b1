/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* moirecalib, frame by frame: requests patterns, gives copies of frames to the
 * worker, draws the panel over the picture. Nothing here waits or solves. */
#include "common/events.h"
#include "common/meta.h"
#include "common/tag.h"
#include "moirecalib.h"

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
      ("No element upstream shows patterns. Put a dmdsync with a device that "
       "takes "
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
  stream.turn.reset ();
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

bool
begin_mapping (GstMoireCalib *self)
{
  CalibState &st = state (self);
  std::string first;
  std::size_t count = 0;
  locked (st.exchange.lock, [&] {
    first = st.exchange.geometry->patterns.front ().text ();
    count = st.exchange.geometry->patterns.size ();
    st.exchange.queue.live.reset ();
    st.exchange.progress.stage = Stage::mapping;
  });
  st.stream.mapping = true;
  st.stream.next = 0;
  st.stream.taken = 0;
  set_stage (self, Stage::mapping);
  post_progress (self, GST_PROGRESS_TYPE_START, "mapping",
      "mapping with " + std::to_string (count) + " patterns");
  return ask (self, first);
}

/** Gives the worker what a run begins with. */
void
begin_run (GstMoireCalib *self, const Settings &settings, Geometry geometry)
{
  CalibState &st = state (self);
  Stream &stream = st.stream;
  locked (st.exchange.lock, [&] {
    if (geometry.mode == Mode::phase) {
      st.exchange.found.schedule.reset ();
      st.exchange.panel.reset ();
    }
    st.exchange.geometry = std::move (geometry);
    st.exchange.run++;
    st.exchange.queue = {};
    st.exchange.progress = {};
  });
  stream.turn = settings.turn;
  stream.mapping = false;
  set_stage (self, Stage::searching);
}

/** Needs no patterns: the schedule itself shows the tile in the scene. */
void
begin_phase (GstMoireCalib *self, const Settings &settings, Geometry geometry)
{
  Stream &stream = state (self).stream;
  if (!std::exchange (stream.asked, {}).empty ())
    release_mirrors (self);
  if (stream.setup)
    geometry.schedule = stream.setup->schedule;
  begin_run (self, settings, std::move (geometry));
}

/** @p bits: significant ones, from the frame metadata. */
bool
begin (GstMoireCalib *self, const Settings &settings, int bits)
{
  Geometry geometry;
  geometry.mode = settings.mode;
  geometry.info = *state (self).stream.info;
  geometry.bits = bits;
  geometry.mirrors = geometry.camera ();
  const std::optional<StreamSetup> &setup = state (self).stream.setup;
  geometry.off_beam = settings.beam == Beam::kOff || (setup && setup->off_beam);
  if (settings.mode == Mode::phase) {
    begin_phase (self, settings, std::move (geometry));
    return true;
  }
  if (const auto shown = Pattern::parse (settings.live_pattern ()); !shown) {
    return refuse_settings (
        self, "The pattern property cannot be read: " + shown.error ().message);
  }
  const MirrorsAnswer mirrors = ask_mirrors (self);
  if (settings.pattern.empty () && !mirrors.patterns)
    return refuse (self, mirrors.reason);
  if (mirrors.width > 0 && mirrors.height > 0)
    geometry.mirrors = {mirrors.width, mirrors.height};
  geometry.patterns = calibration_patterns (geometry.mirrors, settings.period);
  begin_run (self, settings, std::move (geometry));
  return ask (self, settings.live_pattern ());
}

Sample
copy_of (GstBuffer *buffer, const std::string &pattern, guint64 number)
{
  auto partner = get_partner (buffer);
  if (partner)
    partner->buffer.reset (gst_buffer_copy_deep (partner->buffer.get ()));
  return {BufferPtr (gst_buffer_copy_deep (buffer)), std::move (partner),
      pattern, number, GST_BUFFER_PTS (buffer)};
}

/** Gives the worker a frame if it is idle. Exchange's lock. */
void
offer (Exchange &exchange, GstBuffer *buffer, const std::string &pattern,
    guint64 number)
{
  if (exchange.busy || exchange.queue.live)
    return;
  exchange.queue.live = copy_of (buffer, pattern, number);
  exchange.changed.notify_all ();
}

/** A frame of the schedule. */
bool
find_phase (GstMoireCalib *self, GstBuffer *buffer, const FrameMeta &meta)
{
  Exchange &exchange = state (self).exchange;
  const std::lock_guard guard (exchange.lock);
  if (exchange.progress.stage == Stage::searching && meta.pattern.empty ())
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
                 ? st.exchange.progress.readings > 0
                 : settings.mode == Mode::automatic &&
                       st.exchange.progress.aligned_readings >= kSteady;
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
    if (st.exchange.queue.samples.size () >= kMostSamples)
      return true;
    st.exchange.queue.samples.push_back (copy_of (buffer, shown, number));
    if (++stream.taken >= settings.frames) {
      stream.taken = 0;
      const auto &patterns = st.exchange.geometry->patterns;
      if (++stream.next < patterns.size ())
        following = patterns[stream.next].text ();
      else
        st.exchange.queue.solve = true;
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
overlay (GstMoireCalib *self, GstBuffer *buffer, int bits)
{
  CalibState &st = state (self);
  const std::shared_ptr<const Panel> panel =
      locked (st.exchange.lock, [&] { return st.exchange.panel; });
  const GstVideoInfo &info = *st.stream.info;
  if (!panel || panel->grey.width () != info.width ||
      panel->grey.height () != info.height)
    return;
  MappedFrame mapped (info, buffer, GstMapFlags (GST_MAP_READWRITE));
  if (!mapped)
    return;
  write_pixels (mapped, [&] (auto pixels) { lay_over (*panel, pixels, bits); });
}

/** The setup from upstream with the phase or mapping that was found here.
 * Exchange's lock. */
std::optional<StreamSetup>
corrected_setup (const CalibState &st)
{
  std::optional<StreamSetup> setup = st.stream.setup;
  if (st.exchange.found.schedule) {
    if (!setup)
      setup.emplace ();
    setup->schedule = *st.exchange.found.schedule;
    setup->mapping.reset (); // the phase is that of an aligned camera
  } else if (setup && st.exchange.found.mapping)
    setup->mapping = st.exchange.found.mapping;
  if (setup && setup->partner && st.exchange.found.second)
    setup->partner->mapping = st.exchange.found.second;
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
    if (!std::exchange (st.exchange.found.due, false))
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
  refuse_decoded (self, event);
  CalibState &st = state (self);
  GstTagList *tags = tags_of (event);
  const auto said = setup_from_tags (tags);
  if (!said || !*said)
    return event;
  const bool other =
      !st.stream.setup || st.stream.setup->schedule != said->value ().schedule;
  st.stream.setup = said->value ();
  std::optional<StreamSetup> setup;
  locked (st.exchange.lock, [&] {
    if (other) {
      st.exchange.found.schedule.reset ();
      if (st.exchange.geometry && st.exchange.geometry->mode == Mode::phase) {
        st.exchange.run++;
        st.exchange.queue.live.reset ();
        begin_anew (self);
      }
    }
    setup = corrected_setup (st);
  });
  if (setup == st.stream.setup)
    return event;
  return replace_setup (event, *setup);
}

void
set_flushing (GstMoireCalib *self, bool flushing)
{
  Exchange &exchange = state (self).exchange;
  locked (exchange.lock, [&] { exchange.flushing = flushing; });
  exchange.changed.notify_all ();
}

/** At the end of the stream: waits for the worker, unless a flush begins, and
 * warns about what is not finished. */
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
      return exchange.quit || exchange.flushing ||
             (!exchange.busy && exchange.queue.empty ());
    });
    if (exchange.flushing)
      return;
    lost_tile = exchange.geometry && exchange.geometry->mode == Mode::phase &&
                exchange.progress.stage == Stage::searching;
    confidence = exchange.progress.confidence;
    if (exchange.geometry)
      patterns = exchange.geometry->patterns.size ();
  }
  push_setup (self);
  if (lost_tile)
    GST_ELEMENT_WARNING (self, STREAM, FAILED,
        ("The stream ended before the phase of the tile was found: a phase "
         "needs "
         "a probability of %g, and the largest was %g. Use a scene that is "
         "bright in more of its parts, or calibrate.",
            CalibrationSession::kSure, confidence),
        (nullptr));
  if (st.stream.mapping && st.stream.next < patterns)
    POST_WARNING (self, STREAM, FAILED,
        "The stream ended after " + std::to_string (int (st.stream.next)) +
            " of " + std::to_string (int (patterns)) +
            " patterns: there is no mapping.");
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
  auto *self = as<GstMoireCalib> (trans);
  Stream &stream = state (self).stream;
  const Settings settings = settings_of (self);
  if (!stream.info)
    return GST_FLOW_NOT_NEGOTIATED;
  const FrameMeta meta = get_frame_meta (buffer).value_or (FrameMeta ());
  if (stream.turn != settings.turn && !begin (self, settings, meta.bits))
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
  /* Frames of the schedule are decoded downstream, and stay as they are. */
  if (settings.lays_over () && !shown.empty () &&
      gst_buffer_is_writable (buffer))
    overlay (self, buffer, settings.bits > 0 ? settings.bits : meta.bits);
  return GST_FLOW_OK;
}

gboolean
set_caps (GstBaseTransform *trans, GstCaps *incaps, GstCaps *) noexcept
{
  auto *self = as<GstMoireCalib> (trans);
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
  auto *self = as<GstMoireCalib> (trans);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_TAG:
    event = take_tag (self, event);
    break;
  case GST_EVENT_FLUSH_START:
    set_flushing (self, true);
    break;
  case GST_EVENT_FLUSH_STOP:
    set_flushing (self, false);
    begin_anew (self);
    break;
  case GST_EVENT_EOS:
    finish (self);
    break;
  default:
    break;
  }
  return base_transform_class ()->sink_event (trans, event);
}

} // namespace codedexposure::gst::moire
