/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* dmdsync and a camera that goes away and comes back. */
#include "gstdmdsyncstate.h"

#define GST_CAT_DEFAULT dmdsync_debug

namespace cexp::gst::sync
{

namespace
{

void
say_lost (GstDmdSync *self, const std::string &why)
{
  gst_element_post_message (GST_ELEMENT (self),
      gst_message_new_element (
          GST_OBJECT (self), gst_structure_new ("dmdsync/camera-lost", "reason",
                                 G_TYPE_STRING, why.c_str (), nullptr)));
  GST_ELEMENT_WARNING (self, RESOURCE, READ,
      ("The camera is gone: %s Its source is started anew until it comes back "
       "(reconnect).",
          why.c_str ()),
      (nullptr));
}

/* On the keeper's thread: the stream that would end is no more. */
void
give_up (GstDmdSync *self, guint tries, const std::string &why)
{
  GST_ELEMENT_ERROR (self, RESOURCE, READ,
      ("The camera did not come back after %u tries to start it anew "
       "(reconnect): %s Look at its cable, its power and its trigger.",
          tries, why.c_str ()),
      (nullptr));
  GST_PAD_STREAM_LOCK (GST_BASE_TRANSFORM_SINK_PAD (self));
  gst_pad_push_event (GST_BASE_TRANSFORM_SRC_PAD (self), gst_event_new_eos ());
  GST_PAD_STREAM_UNLOCK (GST_BASE_TRANSFORM_SINK_PAD (self));
}

/* The camera's memory goes with the camera. */
void
let_go (GstDmdSync *self)
{
  SyncState &st = state (self);
  GST_PAD_STREAM_LOCK (GST_BASE_TRANSFORM_SINK_PAD (self));
  if (st.keeper)
    st.keeper->recall ();
  GST_PAD_STREAM_UNLOCK (GST_BASE_TRANSFORM_SINK_PAD (self));
}

bool
same_caps (GstDmdSync *self, GstEvent *event)
{
  GstCaps *caps = nullptr;
  gst_event_parse_caps (event, &caps);
  const CapsPtr before (
      gst_pad_get_current_caps (GST_BASE_TRANSFORM_SINK_PAD (self)));
  return before && gst_caps_is_equal (caps, before.get ());
}

bool
same_segment (GstDmdSync *self, GstEvent *event)
{
  const GstSegment *segment = nullptr;
  gst_event_parse_segment (event, &segment);
  return gst_segment_is_equal (segment, &GST_BASE_TRANSFORM (self)->segment);
}

} // namespace

std::vector<ObjectPtr<GstElement>>
elements_before (GstDmdSync *self)
{
  constexpr std::size_t kMost = 8;
  std::vector<ObjectPtr<GstElement>> found;
  ObjectPtr<GstPad> pad (
      GST_PAD (gst_object_ref (GST_BASE_TRANSFORM_SINK_PAD (self))));
  while (pad && found.size () < kMost) {
    const ObjectPtr<GstPad> peer (gst_pad_get_peer (pad.get ()));
    ObjectPtr<GstElement> element (
        peer ? gst_pad_get_parent_element (peer.get ()) : nullptr);
    if (!element)
      break;
    pad.reset (gst_element_get_static_pad (element.get (), "sink"));
    found.push_back (std::move (element));
  }
  return found;
}

bool
is_aravissrc (GstElement *element)
{
  return g_object_class_find_property (
      G_OBJECT_GET_CLASS (element), "num-arv-buffers");
}

/* Like every live source that stamps frames, aravissrc holds each until its
 * time has come by the pipeline's clock: ever longer, where the camera's is
 * fast. Without a clock it does not. */
void
free_source (GstDmdSync *self)
{
  {
    const ObjectLock lock (self);
    if (state (self).settings.timestamp_at != TimestampAt::device_clock)
      return;
  }
  for (const auto &element : elements_before (self))
    if (is_aravissrc (element.get ()))
      gst_element_set_clock (element.get (), nullptr);
}

void
keep_source (GstDmdSync *self)
{
  SyncState &st = state (self);
  guint tries = 0;
  {
    const ObjectLock lock (self);
    tries = st.settings.reconnect;
  }
  auto before = elements_before (self);
  /* It may have been started anew since the last run. */
  for (const auto &element : before)
    forget_camera (element.get ());
  if (tries == 0 || before.empty () ||
      !GST_OBJECT_FLAG_IS_SET (before.back ().get (), GST_ELEMENT_FLAG_SOURCE))
    return;
  st.source =
      SourceKeeper::keep (std::move (before.back ()), GST_ELEMENT (self), tries,
          {.lost = [self] (const std::string &why) { say_lost (self, why); },
              .stopping = [self] { let_go (self); },
              .starting = [self] { free_source (self); },
              .gave_up =
                  [self, tries] (
                      const std::string &why) { give_up (self, tries, why); }});
}

void
release_source (GstDmdSync *self)
{
  SyncState &st = state (self);
  if (st.source)
    st.source->release ();
}

bool
is_of_return (GstDmdSync *self, GstEvent *event)
{
  const auto &source = state (self).source;
  if (!source)
    return false;
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_EOS:
    return source->take_eos ();
  case GST_EVENT_STREAM_START:
    source->stream_started ();
    return source->away ();
  case GST_EVENT_CAPS:
    return source->away () && same_caps (self, event);
  case GST_EVENT_SEGMENT:
    return source->away () && same_segment (self, event);
  default:
    return false;
  }
}

bool
take_return (
    GstDmdSync *self, GstBuffer *frame, FrameStep &step, GstClockTime &time)
{
  SyncState &st = state (self);
  Stream &stream = st.stream;
  const guint tries = st.source ? st.source->frame_came () : 0;
  if (tries == 0)
    return false;
  const GstClockTime came = GST_BUFFER_PTS (frame);
  stream.device_clock.rejoin ();
  stream.rate_watch->resync ();
  stream.discont = true;
  begin_phase (self);
  time = pipeline_time (self, frame);

  const auto away = Nanoseconds (time - std::min (time, stream.last_time));
  const Nanoseconds period = stream.time->rate.period ();
  const auto periods = guint64 ((away + period / 2) / period);
  step = stream.sequence->take_after (
      Nanoseconds (came), periods - std::min<guint64> (periods, 1));
  {
    const ObjectLock lock (self);
    st.counters.reconnects++;
  }
  gst_element_post_message (GST_ELEMENT (self),
      gst_message_new_element (GST_OBJECT (self),
          gst_structure_new ("dmdsync/camera-back", "frame", G_TYPE_UINT64,
              guint64 (step.number), "lost", G_TYPE_UINT64, guint64 (step.lost),
              "tries", G_TYPE_UINT, tries, nullptr)));
  return true;
}

} // namespace cexp::gst::sync
