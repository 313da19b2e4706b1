/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pad of the part restore that takes the partners of its frames, from the
 * second camera's tracks of a recording. */
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>

#include <gst/gst.h>

#include "common/alone.h"
#include "common/partner.h"
#include "segment.h"

namespace codedexposure::gst
{

/** Partners come in a streaming thread of their own, which waits while some are
 * not taken. */
class PartnerInput : public PadBeside<PartnerInput>
{
public:
  /** Frames of a camera that a demuxer may read ahead. */
  static constexpr guint kQueued = 8;

  /** Adds the signal "frames-queued" to the class of the element. It is emitted
   * when no partner, or no frame for those that came, has come for seconds; the
   * handler returns how many frames wait in their queue, kQueued at most. */
  static void add_signal (gpointer klass);

  /** @p pad: of the element. */
  void take_over (GstPad *pad);

  /* Any thread: */

  /** Before a run. */
  void restart ();
  /** Frames wait for their partners; not while a flush or a stop begins. */
  void let_wait (bool waits);

  /* Streaming thread of the frames: */

  /** Gives @p frame of @p element its partner, and waits until it comes. A
   * damaged partner, or one that stands in for a lost one, is only given to
   * frames that are @p encoded, to be recorded again with them.
   * @p wanted: the setup says that frames have partners; if not, those that
   * come are dropped, which a warning says.
   * @return GST_FLOW_OK; else the frame goes no further: GST_FLOW_FLUSHING: a
   * flush or a stop began; kBrokenOff: a seek left it without its partner. */
  GstFlowReturn attach (
      GstElement *element, GstBuffer *frame, bool wanted, bool encoded);
  static constexpr GstFlowReturn kBrokenOff = GST_FLOW_CUSTOM_SUCCESS;
  /** The frames reach @p segment; partners before it are forgotten. */
  void next_segment (GstEvent *segment);
  /** After a flush. */
  void forget ();
  /** No frame of @p element follows. Waits for the end of the partners: what is
   * said of them is said before the end of the stream. */
  void end (GstElement *element);

private:
  friend PadBeside;
  GstFlowReturn chain (GstObject *element, BufferPtr buffer);
  void follow (GstEvent *event);
  static gboolean activate (GstPad *pad, GstObject *parent, GstPadMode mode,
      gboolean active) noexcept;

  guint frames_queued (
      std::unique_lock<std::mutex> &lock, gpointer element) const;
  void want (bool wanted);
  /** That with the time @p pts, if there is one; those before it are dropped.
   * As attach (). */
  GstFlowReturn take (
      GstElement *element, GstBuffer *frame, std::optional<Partner> &to);
  /** A seek left @p frame without its partner. */
  bool is_broken_off (GstBuffer *frame) const;

  AloneFrames alone_;
  bool is_other_said_ = false; ///< kOtherVideo

  /* The lock: */
  std::condition_variable moved_; ///< any of it
  struct Waiting : Partner {
    guint64 segment; ///< its number
  };
  std::deque<Waiting> partners_;
  /** Segments that the demuxer has left, but the frames have not, by seqnum. */
  std::map<guint32, SegmentLeft> left_;
  CapsPtr caps_;
  bool may_wait_ = true;     ///< let_wait ()
  bool is_flushing_ = false; ///< the pad is flushed, or not active
  bool is_wanted_ = true;    ///< by the frames
  /** As their tag says; others are frames of another camera. */
  bool is_off_beam_ = false;
  bool has_ended_ = false;  ///< no partner follows
  bool is_stalled_ = false; ///< none came while frames filled their queue
  bool is_ahead_ = false;   ///< no frames came while these filled theirs
};

} // namespace codedexposure::gst
