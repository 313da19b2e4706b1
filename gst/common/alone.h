/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames that go on without the partners they were to have. */
#pragma once

#include "messages.h"

namespace codedexposure::gst
{

/** Posts PartnerLost when a sequence of them begins and ends. Streaming
 * thread. */
class AloneFrames
{
public:
  /** A frame at @p pts of @p element. @p reason: that of PartnerLost; null: it
   * has its partner. */
  void add (gpointer element, GstClockTime pts, const char *reason);
  /** No frame follows. */
  void end (gpointer element) { close (element, last_); }
  /** After a flush. */
  void forget () { frames_ = 0; }

private:
  void close (gpointer element, GstClockTime to);

  guint64 frames_ = 0;      ///< in a row; 0: none
  GstClockTime from_ = 0;   ///< PTS of the first
  GstClockTime last_ = 0;   ///< PTS of the last
  const char *reason_ = ""; ///< of the first
};

} // namespace codedexposure::gst
