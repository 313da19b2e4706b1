/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A pipeline whose frames the caller takes. */
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "pipeline/job.h"
#include "rig/frame_tap.h"

namespace codedexposure::app
{

class FramePipeline
{
public:
  /** Adds the elements, and returns the pad whose frames are taken. May throw
   * Failure. */
  using Build = std::function<gst::ObjectPtr<GstPad> (Job &)>;

  static Result<std::unique_ptr<FramePipeline>> make (const Build &build);
  /** Removes what was written. */
  ~FramePipeline ();
  FramePipeline (const FramePipeline &) = delete;
  FramePipeline &operator= (const FramePipeline &) = delete;

  /** Error with what the pipeline says where it cannot. */
  Result<void> set_state (GstState state);
  /** The error that an element posted, if there is one. That a camera was
   * silent is none. */
  std::optional<Error> take_error ();
  FrameTap &frames () { return *frames_; }
  /** Whether it is still on its way to PLAYING. */
  bool begins () const;
  /** By the monotonic clock. */
  Nanoseconds base_time () const;
  /** The only element of that kind; null: there is none. */
  GstElement *find (const char *factory) const;

private:
  FramePipeline () = default;
  GstElement *pipeline () const { return job_.graph.pipeline (); }

  Job job_{"doctor", RunOptions{}};
  std::optional<FrameTap> frames_;
};

} // namespace codedexposure::app
