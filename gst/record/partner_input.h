/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pad of the part restore that takes the partners of its frames, from the
 * second camera's tracks of a recording. */
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

#include <gst/gst.h>

#include "common/alone.h"
#include "common/partner.h"

namespace codedexposure::gst
{

/** Partners come in a streaming thread of their own, which waits while some are
 * not taken. */
class PartnerInput
{
public:
  /** @p pad: of the element. */
  void take_over (GstPad *pad);

  /* Any thread: */

  bool is_linked () const { return gst_pad_is_linked (pad_); }
  /** Before a run. */
  void restart ();
  /** Nothing waits until @p waits again. */
  void let_wait (bool waits);

  /* Streaming thread of the frames: */

  /** Gives @p frame of @p element its partner, for which it waits as long as
   * partners come. One that is damaged, or stands in for one that was never
   * there, is of no use, but to be recorded again with frames that are @p
   * encoded. */
  void attach (GstElement *element, GstBuffer *frame, bool encoded);
  /** After a flush. */
  void forget () { alone_.forget (); }
  /** No frame of @p element follows: partners are dropped. */
  void end (GstElement *element);

private:
  static GstFlowReturn chain (
      GstPad *pad, GstObject *parent, GstBuffer *buffer) noexcept;
  static gboolean event (
      GstPad *pad, GstObject *parent, GstEvent *event) noexcept;
  static gboolean activate (GstPad *pad, GstObject *parent, GstPadMode mode,
      gboolean active) noexcept;

  /** That with the time @p pts; those before it are dropped. */
  std::optional<Partner> take (GstClockTime pts);

  GstPad *pad_ = nullptr;
  AloneFrames alone_;

  std::mutex lock_;               ///< of the rest; never held while pushing
  std::condition_variable moved_; ///< any of it
  std::deque<Partner> partners_;
  CapsPtr caps_;
  bool frames_wait_ = true; ///< false: of the frames' thread, for flushes
  bool is_flushing_ = false;
  bool has_ended_ = false; ///< no partner follows
  bool frames_ended_ = false;
  bool is_stalled_ = false; ///< none came for too long
};

} // namespace codedexposure::gst
