/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Coded frames that go on without the partners they were to have. */
#pragma once

#include <optional>

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
  void end (gpointer element);
  /** After a flush. */
  void forget () { open_.reset (); }

private:
  /** What is said at the end of the sequence, which goes on to the last frame.
   */
  std::optional<PartnerLost> open_;
};

} // namespace codedexposure::gst
