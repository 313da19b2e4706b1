/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pipelines of the campaign. */
#pragma once

#include <memory>
#include <string>

#include "row.h"

namespace codedexposure::campaign
{

/** A pipeline that is watched until it ends. */
class Play
{
public:
  explicit Play (const std::string &line);
  ~Play ();
  Play (const Play &) = delete;
  Play &operator= (const Play &) = delete;

  void start ();
  void stop ();
  /** Plays the whole from its end on, or with the flags of a trick mode. */
  void start_at (double rate, GstSeekFlags flags);
  /** Collects what is told; waits until the pipeline ends, fails, or nothing
   * happens for @p patience. */
  void wait (GstClockTime patience = 20 * GST_SECOND);
  /** The same until a message named @p name comes; whether it came. */
  bool wait_for (const std::string &name, GstClockTime patience);

  gst::ObjectPtr<GstElement> find (const char *name) const;
  gst::ObjectPtr<GstPad> pad (const char *element, const char *name) const;

  Told told;
  std::string error; ///< that ended it
  bool hung = false;

  /** Collects what was told so far. False: an error ended it. */
  bool poll ();

  /** Whether a loss at the end of a recording was told. */
  bool told_of_the_end () const;

private:
  void note (GstMessage *message);

  gst::ObjectPtr<GstElement> pipeline_;
  gst::ObjectPtr<GstBus> bus_;
};

/**
 * The simulated bench: the scene, a camera that looks at it through the mirrors
 * of a simulated DMD, a cable on which frames may be changed, and dmdsync.
 */
class BenchPlay
{
public:
  struct Settings {
    std::string name = "bench"; ///< of the DMD; other ones may run beside it
    std::string schedule = "sequential:2x2,pilot=8";
    std::string slips = {}; ///< ",slip-at=..."
    std::string sync = {};  ///< more properties of dmdsync
    std::string tail =
        "codedexposure-demux ! fakesink name=out sync=false async=false";
    std::string optics = {}; ///< properties of codedexposure-sim
  };
  explicit BenchPlay (const Settings &settings);
  /** Plays, and waits until the mirrors show the schedule, as a camera that
   * dmdsync starts does. */
  void start ();

  /** Exposes the next frame and takes it off the camera. */
  gst::BufferPtr expose ();
  /** Sends a frame to dmdsync. False: it takes none any more. */
  bool send (gst::BufferPtr frame);
  /** Ends the stream and waits for it. */
  void end ();

  std::int64_t slots () const { return slot_; } ///< exposed
  Play play;

private:
  std::int64_t slot_ = 0;
  gst::ObjectPtr<GstElement> scene_, cable_, camera_;
};

} // namespace codedexposure::campaign
