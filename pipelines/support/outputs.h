/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The files that a pipeline writes. */
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "common/raii.h"
#include "part.h"

/** A file, or pictures, of one element. */
class Output
{
public:
  virtual ~Output () = default;

  /** Before the element opens anything: refuses a name that exists, unless @p
   * replace, and lets the element write beside it. */
  virtual codedexposure::Result<void> claim (bool replace) = 0;
  /** After the element stopped: gives the frames their name. */
  virtual codedexposure::Result<void> publish () = 0;
  /** Removes what was written. */
  virtual void discard () = 0;
  /** Whether there are frames to publish. */
  virtual bool has_content () const = 0;

  virtual const std::string &name () const = 0;
  guint64 frames () const { return frames_; }
  /** Whether it only describes the frames that other outputs have. */
  virtual bool is_sidecar () const { return false; }

protected:
  /** Frames that the element got. */
  std::atomic<guint64> frames_ = 0;
};

/** The outputs of a pipeline. */
class Outputs
{
public:
  /** Claims the outputs of all elements of @p pipeline, in its state NULL.
   * @p coded is the pad with the coded frames, or null. Errors: why they cannot
   * be written, one for each; nothing is left. */
  std::vector<std::string> claim (
      GstElement *pipeline, GstPad *coded, bool replace);
  bool empty () const { return outputs_.empty (); }
  /** Publishes the outputs with frames, if @p publish, and discards the others,
   * after the pipeline has stopped. Errors: what could not be published. */
  std::vector<std::string> finish (bool publish);
  /** After finish (): "coded.mkv and fast.mkv (100 frames)", the outputs that
   * were published; with their frames if they are not @p usual. Empty: none. */
  std::string summary (std::optional<guint64> usual) const;

private:
  std::vector<std::unique_ptr<Output>> outputs_;
  std::vector<const Output *> published_;
};
