/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-recordmux
 * @title: codedexposure-recordmux
 * @short_description: Coded frames to the bytes of a recording
 *
 * Takes coded frames and gives a recording: Matroska with the frames, lossless,
 * and a text track that has one line of JSON for each: number, time, exposure,
 * synchronisation, lost frames, flags, a hash of the pixels, and the schedule
 * and mapping. #codedexposure-recorddemux reads it.
 *
 * FFV1 cannot keep frames of one row or column; they are stored raw.
 *
 * The element encodes in one thread of its own and writes in that of its
 * encoder. Put a `queue` in front of it if the source must not wait; frames
 * that such a queue drops (`leaky=downstream`) are counted as lost in the line
 * of the next frame, by the numbers of the frames, and in
 * #codedexposure-recordmux:stats.
 *
 * With #codedexposure-recordmux:streamable, the bytes are for a network:
 * without an index, and receivers can join late.
 *
 * A frame that begins before the segment, as after a seek to within it, is not
 * recorded; one that ends after the segment is. Frames that come backwards are
 * refused.
 *
 * A flush, which a seek may bring, begins another recording: with the frames
 * after it, in place of those before.
 *
 * `splitmuxsink muxer-factory=codedexposure-recordmux` writes a recording in
 * segments. Each is a recording of its own.
 *
 * Frames with partners (codedexposure-pair) are recorded with them, in two
 * tracks more: those of the second camera and their lines. The stream tag must
 * say that there are partners before the first frame. A frame that is alone has
 * the partner before in the place of its own, as a gap.
 *
 * #codedexposure-recordmux:log-location writes the lines to a second file, for
 * other programs: first the schedule in its JSON form, then the mapping, if
 * there is one, then the frames. Each line goes to the system at once: a crash
 * loses one line at most.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 -e videotestsrc num-buffers=100 \
 *     ! video/x-raw,format=GRAY8,framerate=100/1 ! codedexposure-sim \
 *     ! codedexposure-recordmux ! filesink location=coded.mkv
 * ]|
 *
 * Since: 0.2
 */
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gst/gst.h>

#include "common/element.h"
#include "common/elements.h"
#include "common/raii.h"
#include "common/tag.h"
#include "muxer.h"
#include "parts.h"

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

constexpr const char *kRequested = "video_0";

enum class Codec { ffv1, raw, copy };

struct Settings {
  Codec codec = Codec::ffv1;
  guint threads = 0;
  bool is_streamable = false;
  std::string log_location;
};

/** What makes the two tracks of a camera. */
struct Branch : MuxerInput {
  GstElement *log = nullptr; ///< null: there is no such camera
  GstElement *frames = nullptr, *lines = nullptr;
  GstElement *encoder = nullptr; ///< null: frames are raw, or it is missing
};

struct RecordMuxState {
  /* Object lock: */
  Settings settings;

  /* Of the bin: */
  GstElement *mux = nullptr; ///< null: matroskamux is missing
  Branch coded, partner;

  MuxerOutput output; ///< streaming thread

  /* Streaming thread of the sink pad, and changes of the state: */
  bool has_begun = false;   ///< a frame came: no track can be added
  bool was_flushed = false; ///< after it
};

struct GstCodedExposureRecordMux : Instance<GstBin, RecordMuxState> {
};
using Self = GstCodedExposureRecordMux;

G_DEFINE_ENUM_TYPE (GstCodedExposureRecordCodec,
    gst_coded_exposure_record_codec,
    {int (Codec::ffv1), "Lossless, about half of the data", "ffv1"},
    {int (Codec::raw), "Not compressed", "raw"},
    {int (Codec::copy), "As they come, encoded", "copy"});

/* -------------------------------------------------------------- encoder -- */

/* Pixels of the shorter side. */
int
shorter_side (const GstCaps *caps)
{
  int width = 0, height = 0;
  gst_structure_get (gst_caps_get_structure (caps, 0), "width", G_TYPE_INT,
      &width, "height", G_TYPE_INT, &height, nullptr);
  return std::min (width, height);
}

/* Four slices are two rows of two, and pixels of a slice of one row or column
 * are lost as well. */
GstPadProbeReturn
set_slices (GstPad *, GstPadProbeInfo *info, gpointer encoder) noexcept
{
  GstEvent *event = GST_PAD_PROBE_INFO_EVENT (info);
  if (GST_EVENT_TYPE (event) == GST_EVENT_CAPS)
    g_object_set (
        encoder, "slices", shorter_side (caps_of (event)) < 4 ? 1 : 4, nullptr);
  return GST_PAD_PROBE_OK;
}

/* All of its frames can be decoded alone, and its bytes do not depend on
 * @threads (0: one for each processor). Null: it is not installed. */
GstElement *
make_ffv1_encoder (guint threads)
{
  GstElement *encoder = gst_element_factory_make ("avenc_ffv1", nullptr);
  if (!encoder)
    return nullptr;
  g_object_set (encoder, "gop-size", 1, nullptr);
  gst_util_set_object_arg (G_OBJECT (encoder), "threads",
      threads == 0 ? "auto" : std::to_string (threads).c_str ());
  gst_pad_add_probe (pad_of (encoder, "sink").get (),
      GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, set_slices, encoder, nullptr);
  return encoder;
}

/* ---------------------------------------------------------- inner muxer -- */

GstPadProbeReturn
on_output (GstPad *, GstPadProbeInfo *info, gpointer self) noexcept
{
  state_in<Self> (self).output.rewrite (info);
  return GST_PAD_PROBE_OK;
}

/* Its times are exact to 1 ns. Each frame, which can be decoded alone, has a
 * cluster of its own, also one that is late: times in a cluster are within 33
 * us of its own. */
void
add_muxer (Self *self)
{
  RecordMuxState &state = self->state;
  state.mux = gst_element_factory_make ("matroskamux", nullptr);
  if (!state.mux)
    return;
  g_object_set (state.mux, "timecodescale", gint64 (1), "min-cluster-duration",
      gint64 (0), nullptr);
  gst_bin_add (GST_BIN (self), state.mux);
  gst_pad_add_probe (pad_of (state.mux, "src").get (),
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
      on_output, self, nullptr);
}

/* ------------------------------------------------------------- branches -- */

/* A check would ask upstream for caps: splitmuxsink starts a muxer while it
 * holds the pad before it, so that the answer would never come. */
bool
link_frames (const Branch &branch, GstPad *sink)
{
  return gst_pad_link_full (pad_of (branch.frames, "src").get (), sink,
             GST_PAD_LINK_CHECK_NOTHING) == GST_PAD_LINK_OK;
}

/* Frames are hashed and encoded in two threads. Lines are much smaller, and the
 * muxer waits for their frames. */
void
add_branch (GstElement *self, Branch &branch)
{
  const auto &state = state_in<Self> (self);
  branch.log = make_part (gst_coded_exposure_log_get_type ());
  branch.frames = make_queue (2);
  branch.lines = make_queue (0);
  gst_bin_add_many (
      GST_BIN (self), branch.log, branch.frames, branch.lines, nullptr);
  gst_element_link_pads (branch.log, "src", branch.frames, "sink");
  gst_element_link_pads (branch.log, "track", branch.lines, "sink");
  if (!state.mux)
    return;
  branch.request_from (state.mux);
  gst_pad_link (pad_of (branch.lines, "src").get (), branch.text);
  link_frames (branch, branch.video);
}

bool
add_encoder (GstElement *self, Branch &branch, guint threads)
{
  branch.encoder = make_ffv1_encoder (threads);
  if (!branch.encoder) {
    POST_ERROR (self, CORE, MISSING_PLUGIN, missing ("avenc_ffv1"));
    return false;
  }
  gst_bin_add (GST_BIN (self), branch.encoder);
  gst_pad_unlink (pad_of (branch.frames, "src").get (), branch.video);
  return link_frames (branch, pad_of (branch.encoder, "sink").get ()) &&
         gst_pad_link (pad_of (branch.encoder, "src").get (), branch.video) ==
             GST_PAD_LINK_OK;
}

bool
begin_branch (GstElement *self, Branch &branch, const Settings &settings)
{
  branch.restart ();
  return settings.codec != Codec::ffv1 ||
         add_encoder (self, branch, settings.threads);
}

/* Of pads that are not linked, gst_parse_bin_from_description () would make
 * those of its bin. */
void
end_encoder (GstElement *self, Branch &branch)
{
  if (!branch.encoder)
    return;
  remove_part (self, branch.encoder);
  link_frames (branch, branch.video);
}

/* That of the second camera; frames with partners come, and none came yet. */
void
add_partner (GstElement *self)
{
  auto &state = state_in<Self> (self);
  Branch &branch = state.partner;
  add_branch (self, branch);
  Settings settings = settings_of (as<Self> (self));
  if (!state.coded.encoder)
    settings.codec = Codec::raw;
  if (!begin_branch (self, branch, settings))
    return;
  for (GstElement *part :
      {branch.lines, branch.encoder, branch.frames, branch.log})
    if (part)
      gst_element_sync_state_with_parent (part);
  gst_element_link_pads (state.coded.log, "partner", branch.log, "sink");
}

void
remove_partner (GstElement *self)
{
  auto &state = state_in<Self> (self);
  Branch &branch = state.partner;
  if (!branch.log)
    return;
  end_encoder (self, branch);
  for (GstElement **part : {&branch.log, &branch.frames, &branch.lines})
    remove_part (self, *part);
  for (GstPad *pad : {branch.video, branch.text})
    gst_element_release_request_pad (state.mux, pad);
  branch = {};
}

/* A sink that is flushed forgets the head of the file, so the next frame begins
 * another one. Nothing is on its way to the muxer. A pad that is linked again
 * gets all sticky events. */
void
begin_anew (GstElement *self)
{
  auto &state = state_in<Self> (self);
  std::vector<std::pair<GstPad *, ObjectPtr<GstPad>>> links;
  for (Branch *branch : {&state.coded, &state.partner}) {
    branch->restart ();
    for (GstPad *pad : {branch->video, branch->text})
      if (pad)
        links.emplace_back (pad, gst_pad_get_peer (pad));
  }
  for (const auto &[pad, peer] : links)
    gst_pad_unlink (peer.get (), pad);
  state.has_begun = false;
  gst_element_set_locked_state (state.mux, TRUE);
  gst_element_set_state (state.mux, GST_STATE_READY);
  state.output.restart ();
  gst_element_set_locked_state (state.mux, FALSE);
  gst_element_sync_state_with_parent (state.mux);
  for (const auto &[pad, peer] : links)
    gst_pad_link (peer.get (), pad);
}

/* A file begins with the list of its tracks. */
void
follow_tags (GstElement *self, GstEvent *event)
{
  const auto &state = state_in<Self> (self);
  if (state.has_begun || state.partner.log)
    return;
  const auto setup = setup_from_tags (tags_of (event));
  if (setup && *setup && setup->value ().partner)
    add_partner (self);
}

/* "The width of the frames changes from 64 to 32"; empty: nothing changes that
 * a recording has once. */
std::string
change_of_video (const GstCaps *before, const GstCaps *after)
{
  const auto text_in = [] (const GstCaps *caps, const char *field,
                           const char *without) {
    const GValue *value =
        gst_structure_get_value (gst_caps_get_structure (caps, 0), field);
    const CharPtr text (value ? gst_value_serialize (value) : nullptr);
    return std::string (text ? text.get () : without);
  };
  constexpr std::pair<const char *, const char *> kFields[] = {{"format", ""},
      {"width", ""}, {"height", ""}, {"framerate", ""},
      {"interlace-mode", "progressive"}};
  for (const auto &[field, without] : kFields) {
    const std::string was = text_in (before, field, without);
    const std::string is = text_in (after, field, without);
    if (!was.empty () && !is.empty () && was != is)
      return std::string ("The ") + field + " of the frames changes from " +
             was + " to " + is;
  }
  return "";
}

/* Of coded frames, which are grey, it says nothing. */
CapsPtr
without_colorimetry (GstCaps *caps)
{
  return without_fields (caps, {"colorimetry", "chroma-site"});
}

/* FFmpeg 5.1 loses the pixels of FFV1 frames of one row or column, which are
 * kept raw. Caps that tell the muxer, which takes no others, nothing new are
 * dropped. */
GstPadProbeReturn
follow_caps (GstElement *self, GstEvent *event)
{
  auto &state = state_in<Self> (self);
  Branch &branch = state.coded;
  const CapsPtr before (
      gst_pad_get_current_caps (pad_of (branch.log, "sink").get ()));
  const bool can_change = state.has_begun && before;
  if (can_change &&
      gst_caps_is_equal (without_colorimetry (before.get ()).get (),
          without_colorimetry (caps_of (event)).get ()))
    return GST_PAD_PROBE_DROP;
  const std::string change =
      can_change ? change_of_video (before.get (), caps_of (event)) : "";
  if (!change.empty ())
    POST_ERROR (self, STREAM, FORMAT,
        change + ", but a recording has one for all. Begin another recording.");
  if (is_encoded (caps_of (event)) &&
      settings_of (as<Self> (self)).codec != Codec::copy)
    POST_ERROR (self, STREAM, FORMAT,
        "The frames are encoded already. Set codec=copy to record them as they "
        "come, or decode them before this element.");
  if (!state.has_begun && shorter_side (caps_of (event)) < 2)
    end_encoder (self, branch);
  return GST_PAD_PROBE_OK;
}

/* All are taken, so that follow_caps () says what is wrong. */
GstPadProbeReturn
take_caps_query (GstPadProbeInfo *info)
{
  GstQuery *query = GST_PAD_PROBE_INFO_QUERY (info);
  if (GST_QUERY_TYPE (query) != GST_QUERY_CAPS ||
      !(GST_PAD_PROBE_INFO_TYPE (info) & GST_PAD_PROBE_TYPE_PUSH))
    return GST_PAD_PROBE_OK;
  answer_caps (query, CapsPtr (gst_caps_from_string (kPartCaps)));
  return GST_PAD_PROBE_HANDLED;
}

/* The start of a flush comes beside a frame, and touches nothing. */
GstPadProbeReturn
on_input (GstPad *, GstPadProbeInfo *info, gpointer data) noexcept
{
  auto *self = as<GstElement> (data);
  auto &state = state_in<Self> (self);
  const auto type = GST_PAD_PROBE_INFO_TYPE (info);
  if (type & GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM)
    return take_caps_query (info);
  const bool is_frame = type & GST_PAD_PROBE_TYPE_BUFFER;
  GstEvent *event = is_frame ? nullptr : GST_PAD_PROBE_INFO_EVENT (info);
  if (event && GST_EVENT_TYPE (event) == GST_EVENT_FLUSH_STOP)
    state.was_flushed = state.has_begun;
  else if (!event || gst_event_type_get_flags (GST_EVENT_TYPE (event)) &
                         GST_EVENT_TYPE_SERIALIZED)
    if (std::exchange (state.was_flushed, false))
      begin_anew (self);
  if (event && GST_EVENT_TYPE (event) == GST_EVENT_CAPS)
    return follow_caps (self, event);
  if (event && GST_EVENT_TYPE (event) == GST_EVENT_TAG)
    follow_tags (self, event);
  if (is_frame)
    state.has_begun = true;
  return GST_PAD_PROBE_OK;
}

/* ------------------------------------------------------------------ bin -- */

bool
begin_run (GstElement *self)
{
  auto &state = state_in<Self> (self);
  if (!state.mux) {
    POST_ERROR (self, CORE, MISSING_PLUGIN, missing ("matroskamux"));
    return false;
  }
  const Settings settings = settings_of (as<Self> (self));
  g_object_set (
      state.coded.log, "location", settings.log_location.c_str (), nullptr);
  g_object_set (state.mux, "streamable", gboolean (settings.is_streamable),
      "creation-time", nullptr, nullptr);
  state.output.restart ();
  state.has_begun = state.was_flushed = false;
  return begin_branch (self, state.coded, settings);
}

void
end_run (GstElement *self)
{
  remove_partner (self);
  end_encoder (self, state_in<Self> (self).coded);
}

/* The inner muxer refuses seeks, which are for the source of the frames; it
 * does not look at times before its first frame. */
gboolean
src_event (GstPad *pad, GstObject *parent, GstEvent *event) noexcept
{
  if (GST_EVENT_TYPE (event) != GST_EVENT_SEEK)
    return gst_pad_event_default (pad, parent, event);
  auto *self = as<GstElement> (parent);
  const auto requested = pad_of (self, kRequested);
  const auto sink = pad_of (self, "sink");
  return gst_pad_push_event (requested ? requested.get () : sink.get (), event);
}

/* splitmuxsink asks for the pad of the video, which it gets in place of the
 * sink pad. */
GstPad *
request_new_pad (GstElement *self, GstPadTemplate *templ, const gchar *,
    const GstCaps *) noexcept
{
  if (pad_of (self, kRequested))
    return nullptr;
  gst_ghost_pad_set_target (
      GST_GHOST_PAD (pad_of (self, "sink").get ()), nullptr);
  GstPad *pad = gst_ghost_pad_new_from_template (kRequested,
      pad_of (state_in<Self> (self).coded.log, "sink").get (), templ);
  gst_pad_set_active (pad, TRUE);
  gst_element_add_pad (self, pad);
  return pad;
}

/* A bin that is disposed of has no elements any more. */
void
release_pad (GstElement *self, GstPad *pad) noexcept
{
  gst_element_remove_pad (self, pad);
  if (GST_BIN_NUMCHILDREN (self) > 0)
    gst_ghost_pad_set_target (GST_GHOST_PAD (pad_of (self, "sink").get ()),
        pad_of (state_in<Self> (self).coded.log, "sink").get ());
}

StructurePtr
stats_of (const RecordMuxState &state)
{
  GstStructure *stats = nullptr;
  g_object_get (state.coded.log, "counters", &stats, nullptr);
  gst_structure_set_name (stats, "application/x-codedexposure-recordmux-stats");
  return StructurePtr (stats);
}

PropertyTable<RecordMuxState>
properties ()
{
  static const auto set = [] (auto member) {
    return within (&RecordMuxState::settings, member);
  };
  return {
      {"codec", "Kind of video", "How the frames are stored", kReadWriteReady,
          set (&Settings::codec), gst_coded_exposure_record_codec_get_type ()},
      {"threads", "Threads",
          "Threads of the encoder; the bytes do not depend on them; 0: one for "
          "each processor",
          kReadWriteReady, set (&Settings::threads), 0u, 64u},
      {"streamable", "Streamable",
          "Write for a network, without an index and without going back",
          kReadWriteReady, set (&Settings::is_streamable)},
      {"log-location", "Location of the log",
          "File to write beside the recording, one line of JSON a coded frame; "
          "overwritten when it exists; empty: none",
          kReadWriteReady, set (&Settings::log_location)},
      {"stats", "Statistics",
          "Counters: frames-lost, the coded frames, and those of a second "
          "camera, that are missing before frames that came, by their numbers, "
          "and the frames of a second camera that came too late to be recorded",
          kReadOnly, stats_of}};
}

void
set_up_instance (Self *self)
{
  RecordMuxState &state = self->state;
  add_muxer (self);
  add_branch (GST_ELEMENT (self), state.coded);
  gst_pad_add_probe (pad_of (state.coded.log, "sink").get (),
      GstPadProbeType (
          GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM |
          GST_PAD_PROBE_TYPE_EVENT_FLUSH | GST_PAD_PROBE_TYPE_QUERY_DOWNSTREAM),
      on_input, self, nullptr);
  add_ghost_pad (GST_ELEMENT (self), "sink", state.coded.log);
  gst_pad_set_event_function (
      add_ghost_pad (GST_ELEMENT (self), "src", state.mux), src_event);
}

constexpr StateHooks kRun{.begin = begin_run, .end = end_run};

void
set_up (gpointer klass)
{
  install_state<GstCodedExposureRecordMux, properties> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Coded exposure recording muxer", "Codec/Muxer",
      "Coded frames to a recording: lossless video, and all that is known of "
      "each frame",
      {});
  add_pad_template (klass, "sink", {.caps = kPartCaps});
  add_pad_template (klass, "src", {.caps = "video/x-matroska"});
  add_pad_template (klass, "video_%u",
      {.presence = GST_PAD_REQUEST, .direction = GST_PAD_SINK});
  GST_ELEMENT_CLASS (klass)->request_new_pad = request_new_pad;
  GST_ELEMENT_CLASS (klass)->release_pad = release_pad;
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_recordmux, "codedexposure-recordmux",
    GST_RANK_NONE,
    (type_of<Self, set_up, set_up_instance> (
        "GstCodedExposureRecordMux", GST_TYPE_BIN)))
