/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The pad of the part log that gives the partners of its frames, for a second
 * track of the recording. */
#pragma once

#include <optional>

#include <gst/gst.h>

#include "common/partner.h"
#include "setup/stream_setup.h"

namespace codedexposure::gst
{

/** Streaming thread, but for is_linked (). */
class PartnerOutput
{
public:
  /** @p pad: of the element. */
  void take_over (GstPad *pad) { pad_ = pad; }
  bool is_linked () const { return pad_ && gst_pad_is_linked (pad_); }

  /** Before a run. */
  void restart ();
  /** What goes to the partners as to the frames: the start and the end of the
   * stream, its segments and flushes; others are left out. */
  void follow (GstEvent *event);
  /** @p setup: of the frames; its partner is known. */
  void set_setup (const StreamSetup &setup);
  /** Frames of the second camera that are missing, by their numbers, before the
   * partner of @p frame, which is pushed next. */
  guint64 lost_before (GstBuffer *frame);
  /** Both tracks have a frame of each time, so that no reader and no muxer
   * waits for one: in place of a partner that @p frame does not have, the last
   * one goes again, or a black one, as a gap. Posts an error of @p element if
   * there is neither. @p caps, @p segment: of the frames. */
  GstFlowReturn push (GstElement *element, GstBuffer *frame, GstCaps *caps,
      const GstSegment &segment);

private:
  std::optional<Partner> stand_in (GstCaps *caps) const;
  void use_caps (const CapsPtr &caps);

  GstPad *pad_ = nullptr;
  std::optional<StreamSetup> setup_; ///< of the partners
  std::optional<Partner> last_;
  std::optional<guint64> last_number_; ///< of the second camera
  bool stream_sent_ = false, segment_sent_ = false, setup_sent_ = false;
  CapsPtr caps_; ///< that were sent
};

} // namespace codedexposure::gst
