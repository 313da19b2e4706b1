/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A source that fails, and is started anew. */
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <gst/gst.h>

#include "gstraii.h"

namespace cexp::gst
{

/** aravissrc keeps the camera that it found, dead or alive, until it is named
 * anew; so it is. Other sources are left alone. The source must not run. */
void forget_camera (GstElement *source);

/**
 * Starts a source anew that ended in an error of its own, as aravissrc does
 * when its camera is silent for two seconds or was unplugged.
 *
 * The element that the source feeds owns the keeper, and asks it at every event
 * and frame. The keeper stands between the source and its bus: errors that it
 * is going to mend get no further, everything else does. It stops and starts
 * the source from a thread of its own, once a second, until a frame comes or
 * the tries are over.
 *
 * Errors before the first frame are none of a camera that went away, and errors
 * of what comes behind the source neither.
 */
class SourceKeeper
{
public:
  struct Reports {
    /** The source failed; on whatever thread said so. */
    std::function<void (const std::string &why)> lost;
    /** The source is about to be stopped, and its memory to go. */
    std::function<void ()> stopping;
    /** It has clock and base time again, and is about to be started. */
    std::function<void ()> starting;
    /** All tries were in vain. */
    std::function<void (const std::string &why)> gave_up;
  };

  /** @p owner  has the clock that the source gets. @p tries  in a row. */
  static std::shared_ptr<SourceKeeper> keep (ObjectPtr<GstElement> source,
      GstElement *owner, guint tries, Reports reports);
  ~SourceKeeper ();
  /** Leaves the source as it is; returns when nothing is done to it any more.
   */
  void release ();
  SourceKeeper (const SourceKeeper &) = delete;
  SourceKeeper &operator= (const SourceKeeper &) = delete;

  /** Whether it failed, and no frame came since. */
  bool away () const;
  /** Whether an EOS is the one that follows the error. */
  bool take_eos ();
  /** A stream begins: what ends it is another matter. */
  void stream_started ();
  /** A frame came. Returns how many tries that took; 0: it was not away. */
  guint frame_came ();

private:
  struct Hook;
  SourceKeeper (ObjectPtr<GstElement> source, GstElement *owner, guint tries,
      Reports reports);
  static GstBusSyncReply take_message (
      GstBus *, GstMessage *message, gpointer hook);
  bool is_own_failure (GstMessage *message) const;
  bool note_failure (GstMessage *message);
  void work ();
  void restart ();

  const ObjectPtr<GstElement> source_;
  GstElement *const owner_;
  const guint tries_;
  const Reports reports_;
  const ObjectPtr<GstBus> bus_;   // the source's, while it is kept
  const ObjectPtr<GstBus> above_; // the one that it had

  mutable std::mutex lock_; // covers all below; held over no call
  std::condition_variable changed_;
  bool seen_ = false;    // a frame came
  bool away_ = false;    // it failed, and no frame came since
  bool eos_due_ = false; // of the stream that failed
  bool due_ = false;     // for a restart
  guint tried_ = 0;      // since the last frame
  std::string why_;      // the last try failed
  bool quit_ = false;

  std::thread thread_; // last: it uses all of the above
};

} // namespace cexp::gst
