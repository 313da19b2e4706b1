/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The part of a pipeline that records, beside one that is watched. */
#pragma once

#include <atomic>
#include <vector>

#include <gst/gst.h>

#include "common/raii.h"

namespace codedexposure::app
{

/** All elements from a queue on. If one of them fails, such as on a full disk,
 * the branch can be cut off, and the rest of the pipeline goes on. */
class RecordingBranch
{
public:
  /** @p queue  the first element, which never blocks. */
  RecordingBranch (GstElement *pipeline, GstElement *queue);
  ~RecordingBranch ();
  RecordingBranch (const RecordingBranch &) = delete;
  RecordingBranch &operator= (const RecordingBranch &) = delete;

  /** Also those in its bins. */
  bool has (GstObject *element) const;
  /** Stops and removes all elements of the branch; they exist until this is
   * destroyed. On the thread of the main loop, after the error of one. */
  void remove ();
  bool is_removed () const { return removed_; }

private:
  void add (GstElement *element);
  void cut ();
  static void on_error (GstBus *, GstMessage *message, gpointer self);

  GstElement *pipeline_;
  GstBus *bus_;
  gulong handler_;
  gst::ObjectPtr<GstPad> entry_; // before the queue
  std::vector<gst::ObjectPtr<GstElement>> elements_;
  std::atomic<bool> cut_ = false;
  bool removed_ = false;
};

} // namespace codedexposure::app
