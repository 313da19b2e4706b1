/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The source pads of a GstCodedFilter. */
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <gst/gst.h>

#include "element.h"
#include "raii.h"

GST_DEBUG_CATEGORY_EXTERN (coded_filter_debug);

namespace codedexposure::gst
{

/** Where the buffers of a pad come from. */
struct Allocation {
  PoolPtr pool;
  /** Activated at first use, because that allocates memory. */
  bool active = false;
  /** The peer reads strides and offsets from the GstVideoMeta. */
  bool video_meta = false;
};

/** What a pad pushes for each coded frame. */
enum class PadKind {
  coded,       ///< the coded frame
  all,         ///< all pictures, at the raised rate
  one,         ///< one picture, at the rate of coded frames
  region,      ///< all pictures of one region
  uncertainty, ///< of all pictures
};

struct CodedPad {
  PadKind kind = PadKind::all;
  int index = -1; ///< of the picture or the region

  /* Stream lock of the sink pad. */
  bool discont = true;
  guint64 offset = 0;
  std::optional<Allocation> allocation;

  /* Object lock of the element. */
  bool released = false;
  /** Running time before which a picture would be late. */
  GstClockTime earliest = GST_CLOCK_TIME_NONE;
  gdouble proportion = 1.0;
  GstClockTimeDiff jitter = 0;
};

struct GstCodedPad : Instance<GstPad, CodedPad> {
};
GType coded_pad_type ();

using PadRef = std::shared_ptr<GstCodedPad>;
/** Source pads by kind and index, in the order in which they are served. */
using PadMap = std::map<std::pair<PadKind, int>, PadRef>;
/** Null if there is no such pad. */
GstCodedPad *find_pad (const PadMap &pads, PadKind kind, int index = -1);

/** The kind of the pads of a template, by its name. */
PadKind kind_of_template (const std::string &name);
/** Names of numbered pads begin with it: "subframe_". */
std::string prefix_of (PadKind kind);

/** Caps of each kind of pad, and of each region. */
struct PadCaps : std::map<std::pair<PadKind, int>, CapsPtr> {
  CapsPtr &of (PadKind kind, int region = -1)
  {
    return (*this)[{kind, region}];
  }
  /** Null for a region that does not exist. */
  GstCaps *of (const CodedPad &pad) const;
};

/** The STREAM_START event of @p pad, one of several, for that of upstream. */
EventPtr stream_start_for (GstCodedPad *pad, GstEvent *upstream);

/** Whether a buffer pushed there is used, by a peer or by a blocking probe that
 * waits for data. */
bool is_wanted (GstPad *pad);

/** Whether the peer of @p pad reads strides and offsets from a GstVideoMeta. */
bool peer_reads_video_meta (GstPad *pad, GstCaps *caps);

/**
 * Asks the peer for a pool: the first time, after a RECONFIGURE event, and
 * after the allocation was reset. If the peer offers none, the pad has its own.
 * Sink pad's stream lock.
 *
 * @p at_once  buffers of the pool that are in use at the same time.
 */
void prepare_allocation (GstCodedPad *pad, GstCaps *caps, guint at_once);
/** A buffer from the pool of @p pad, which has been prepared. Only the @p first
 * picture of a coded frame waits for the pool: it may have no more buffers
 * before downstream gets those that are in use. @p info: of the picture. */
GstFlowReturn acquire (
    GstCodedPad *pad, const GstVideoInfo &info, bool first, BufferPtr &outbuf);

/** Pushes @p outbuf, which must be writable, with DURATION, OFFSET (a count of
 * buffers) and DISCONT (on the first buffer and after a break). */
GstFlowReturn push_picture (
    GstCodedPad *pad, BufferPtr outbuf, GstClockTime duration);

/** Stores the lateness from a QOS event: pictures due before the sink's current
 * time would be late, too. Object lock of the element. */
void note_lateness (GstCodedPad *pad, GstEvent *event);
void forget_lateness (GstCodedPad *pad);

} // namespace codedexposure::gst
