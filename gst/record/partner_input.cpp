/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "partner_input.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/meta.h"
#include "common/tag.h"
#include "parts.h"

namespace codedexposure::gst
{

namespace
{

/* Partners that wait for their frames. */
constexpr std::size_t kMost = 8;

/* A recording has a partner of the time of each frame. In a damaged one, none
 * may come any more, or no frame. If the demuxer has filled the queue of the
 * others by then, which it would wait for, they go on without after this time.
 */
constexpr std::chrono::seconds kPatience (5);

} // namespace

/* ------------------------------------------------------------------- pad -- */

void
PartnerInput::add_signal (gpointer klass)
{
  g_signal_new ("frames-queued", G_TYPE_FROM_CLASS (klass), G_SIGNAL_RUN_LAST,
      0, nullptr, nullptr, nullptr, G_TYPE_UINT, 0);
}

void
PartnerInput::take_over (GstPad *pad)
{
  PadBeside::take_over (pad);
  gst_pad_set_activatemode_function (pad, activate);
}

/* A thread that waits in the pad would not let it be deactivated. */
gboolean
PartnerInput::activate (
    GstPad *pad, GstObject *, GstPadMode, gboolean active) noexcept
{
  PartnerInput &self = of (pad);
  locked (self.lock_, [&] { return self.is_flushing_ = !active; });
  self.moved_.notify_all ();
  return TRUE;
}

/* The lock is not held while it is emitted. */
guint
PartnerInput::frames_queued (
    std::unique_lock<std::mutex> &lock, gpointer element) const
{
  guint queued = 0;
  lock.unlock ();
  g_signal_emit_by_name (element, "frames-queued", &queued);
  lock.lock ();
  return queued;
}

/* ------------------------------------------------ thread of the partners -- */

GstFlowReturn
PartnerInput::chain (GstObject *element, BufferPtr buffer)
{
  std::unique_lock lock (lock_);
  const auto is_left = [&] {
    return segments_.own.count < segments_.frames.count;
  };
  const auto has_room = [&] {
    return partners_.size () < kMost || !is_wanted_ || is_flushing_ ||
           is_left ();
  };
  while (!has_room ()) {
    if (!is_ahead_ && moved_.wait_for (lock, kPatience, has_room))
      break;
    is_ahead_ = frames_queued (lock, element) == 0;
    if (is_ahead_ && !has_room ())
      partners_.pop_front (); // its frame is missing
  }
  if (is_flushing_)
    return GST_FLOW_FLUSHING;
  if (!is_wanted_ || !caps_ || is_left ())
    return GST_FLOW_OK;
  is_stalled_ = false;
  moved_.notify_all ();
  if (!is_off_beam_) {
    has_ended_ = true; // none of them is a partner
    return GST_FLOW_OK;
  }
  partners_.push_back (
      {{std::move (buffer), CapsPtr (gst_caps_ref (caps_.get ()))},
          segments_.own.count});
  return GST_FLOW_OK;
}

void
PartnerInput::follow (GstEvent *event)
{
  const std::lock_guard lock (lock_);
  switch (GST_EVENT_TYPE (event)) {
  case GST_EVENT_STREAM_START:
    has_ended_ = false;
    break;
  case GST_EVENT_CAPS:
    caps_.reset (gst_caps_ref (caps_of (event)));
    break;
  case GST_EVENT_TAG:
    if (const auto setup = setup_from_tags (tags_of (event)); setup && *setup) {
      is_off_beam_ = setup->value ().off_beam;
      has_ended_ = false;
    }
    break;
  case GST_EVENT_SEGMENT:
    segments_.own.follow (event);
    break;
  case GST_EVENT_CUSTOM_DOWNSTREAM_OOB:
    if (const auto left = parse_event<SegmentLeft> (event))
      left_[left->seqnum] = *left;
    break;
  case GST_EVENT_EOS:
    has_ended_ = true;
    break;
  case GST_EVENT_FLUSH_START:
    is_flushing_ = true;
    break;
  case GST_EVENT_FLUSH_STOP:
    is_flushing_ = has_ended_ = false;
    is_wanted_ = true;
    partners_.clear ();
    segments_.own = {};
    left_.clear ();
    break;
  default:
    break;
  }
  moved_.notify_all ();
}

/* -------------------------------------------------- thread of the frames -- */

void
PartnerInput::restart ()
{
  const std::lock_guard lock (lock_);
  partners_.clear ();
  left_.clear ();
  caps_.reset ();
  may_wait_ = is_wanted_ = true;
  is_other_said_ = false;
  is_off_beam_ = has_ended_ = is_stalled_ = is_ahead_ = false;
  segments_ = {};
}

void
PartnerInput::next_segment (GstEvent *segment)
{
  locked (lock_, [&] {
    if (segments_.frames.seqnum != gst_event_get_seqnum (segment))
      left_.erase (segments_.frames.seqnum);
    segments_.frames.follow (segment);
    while (!partners_.empty () &&
           partners_.front ().segment < segments_.frames.count)
      partners_.pop_front ();
  });
  moved_.notify_all ();
}

void
PartnerInput::forget ()
{
  alone_.forget ();
  locked (lock_, [&] { return segments_.frames = {}; });
}

void
PartnerInput::let_wait (bool waits)
{
  locked (lock_, [&] { return may_wait_ = waits; });
  moved_.notify_all ();
}

bool
PartnerInput::is_broken_off (GstBuffer *frame) const
{
  const GstClockTime duration =
      GST_BUFFER_DURATION_IS_VALID (frame) ? GST_BUFFER_DURATION (frame) : 0;
  const auto left = left_.find (segments_.frames.seqnum);
  return segments_.is_ahead () ||
         (left != left_.end () &&
             left->second.is_behind (GST_BUFFER_PTS (frame), duration / 2));
}

/* A frame that came late when it was recorded is in the place of its partner,
 * too. */
GstFlowReturn
PartnerInput::take (
    GstElement *element, GstBuffer *frame, std::optional<Partner> &to)
{
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  std::unique_lock lock (lock_);
  is_ahead_ = false;
  const auto time_of = [this] (const Waiting &partner) {
    return partner.segment > segments_.frames.count
               ? GST_CLOCK_TIME_NONE
               : GST_BUFFER_PTS (partner.buffer.get ());
  };
  const auto own = [&] { return std::ranges::find (partners_, pts, time_of); };
  /* Of frames that are missing. */
  const auto drop_before = [&] {
    while (partners_.size () >= kMost && time_of (partners_.front ()) < pts &&
           own () == partners_.end ()) {
      partners_.pop_front ();
      moved_.notify_all ();
    }
  };
  const auto is_settled = [&] {
    drop_before ();
    return !gst_pad_is_linked (pad_) || own () != partners_.end () ||
           partners_.size () >= kMost ||
           std::ranges::any_of (partners_,
               [&] (const Waiting &one) { return time_of (one) > pts; }) ||
           is_broken_off (frame) || has_ended_ || is_flushing_ || !may_wait_;
  };
  while (!is_stalled_ && !moved_.wait_for (lock, kPatience, is_settled))
    is_stalled_ = frames_queued (lock, element) >= kQueued && !is_settled ();
  const auto found = own ();
  if (found == partners_.end () && (!may_wait_ || is_flushing_))
    return GST_FLOW_FLUSHING;
  if (found == partners_.end ())
    return is_broken_off (frame) ? kBrokenOff : GST_FLOW_OK;
  to = std::move (*found);
  partners_.erase (partners_.begin (), std::next (found));
  moved_.notify_all ();
  return GST_FLOW_OK;
}

GstFlowReturn
PartnerInput::attach (
    GstElement *element, GstBuffer *frame, bool wanted, bool encoded)
{
  want (wanted);
  if (!wanted) {
    if (gst_pad_is_linked (pad_) && !std::exchange (is_other_said_, true))
      POST_WARNING (element, STREAM, DEMUX, kOtherVideo);
    return GST_FLOW_OK;
  }
  const GstClockTime pts = GST_BUFFER_PTS (frame);
  std::optional<Partner> partner;
  if (const GstFlowReturn flow = take (element, frame, partner);
      flow != GST_FLOW_OK)
    return flow;
  GstBuffer *buffer = partner ? partner->buffer.get () : nullptr;
  const bool is_missing =
      !buffer || GST_BUFFER_FLAG_IS_SET (buffer, GST_BUFFER_FLAG_GAP);
  const bool is_of_use = buffer && !is_corrupted (buffer);
  if (is_of_use || (buffer && encoded))
    set_partner (frame, *partner);
  alone_.add (element, pts,
      is_of_use    ? nullptr
      : is_missing ? "missing"
                   : "damaged");
  return GST_FLOW_OK;
}

void
PartnerInput::want (bool wanted)
{
  locked (lock_, [&] {
    if (!wanted)
      partners_.clear ();
    return is_wanted_ = wanted;
  });
  moved_.notify_all ();
}

void
PartnerInput::end (GstElement *element)
{
  alone_.end (element);
  want (false);
  std::unique_lock lock (lock_);
  moved_.wait (lock, [&] {
    return !gst_pad_is_linked (pad_) || has_ended_ || is_flushing_ ||
           !may_wait_;
  });
}

} // namespace codedexposure::gst
