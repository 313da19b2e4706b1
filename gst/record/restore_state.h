/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What the part restore holds. */
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include <gst/gst.h>
#include <gst/video/video.h>

#include "common/tag.h"
#include "damage.h"
#include "partner_input.h"
#include "segment.h"
#include "track_sink.h"

namespace codedexposure::gst
{

/** A frame, or a serialised event that came after one that waits. */
using Item = std::variant<BufferPtr, EventPtr>;

/** What waits for the line of its first frame. */
struct HeldItems {
  std::deque<Item> items;
  bool is_first_left = false; ///< a seek came before its line

  /** Null: the first item is none. */
  GstBuffer *first_frame () const
  {
    const auto *frame =
        items.empty () ? nullptr : std::get_if<BufferPtr> (&items.front ());
    return frame ? frame->get () : nullptr;
  }
  Item take_first ()
  {
    Item item = std::move (items.front ());
    items.pop_front ();
    is_first_left = false;
    return item;
  }
  void add_left (BufferPtr frame)
  {
    items.push_back (std::move (frame));
    is_first_left = true;
  }
  /** If @p frame is the one that was left or before it, the demuxer went back,
   * and that one comes again. */
  void add (BufferPtr frame)
  {
    if (is_first_left &&
        GST_BUFFER_PTS (frame.get ()) <= GST_BUFFER_PTS (first_frame ()))
      take_first ();
    items.push_back (std::move (frame));
  }
};

/** What is forgotten before a run. Stream lock of the sink pad. */
struct Run {
  GstVideoInfo info = {};
  bool encoded = false; ///< there are no pixels to be checked
  GstSegment segment = {};
  HeldItems held;
  guint32 segment_seqnum = GST_SEQNUM_INVALID; ///< of the segment
  bool is_complete = true;                     ///< all its frames are to come
  bool is_unwanted = false; ///< no more frames are to reach downstream
  std::optional<StreamSetup> container;     ///< setup of the container's tags
  std::vector<StreamSetup> others;          ///< those before it
  std::shared_ptr<const StreamSetup> setup; ///< in force
  std::optional<guint64> last_frame;        ///< the largest number
  GstClockTime last_pts = 0;                ///< of the newest frame
  bool announced = false; ///< the container's tags say that there is a track
  bool found_line = false;
  /** No seek: the first frame is that of the stream, the last one its last. */
  bool whole = true;
  bool said_no_track = false;
  bool said_moved = false;
  bool said_setups_differ = false;
};

struct RestoreState : Run {
  explicit RestoreState (GstElement *element = nullptr) : damage (element) {}

  GstPad *sink = nullptr, *src = nullptr; ///< the element's
  guint64 tick = 1; ///< object lock; to which the container rounds times, ns
  TrackSink track;
  PartnerInput partners;
  DamageReport damage;
};

} // namespace codedexposure::gst
