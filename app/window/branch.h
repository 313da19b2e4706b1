/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The elements of a window: panes beside each other, and a panel below. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "common/raii.h"
#include "options/options.h"
#include "pipeline/graph.h"

namespace codedexposure::app
{

/** From the pictures of a stream to their place in the window. */
struct WindowPane {
  const char *caption = ""; ///< "camera"
  /** A queue that never blocks the stream. */
  GstElement *entry = nullptr;
  /** A queue that skips pictures for which the screen is too slow. */
  GstElement *late = nullptr;
  /** Scales values to 8 bits. */
  GstElement *view = nullptr;
  /** Scales to the size in the window. */
  GstElement *scale = nullptr;
  /** A filter for the size in the window. */
  GstElement *shown = nullptr;
  /** Of the compositor. */
  gst::ObjectPtr<GstPad> mixed;
};

struct WindowBranch {
  /** Camera, subframes, perhaps fused. */
  std::vector<WindowPane> panes;
  GstElement *compositor = nullptr;
  /** A filter for the size of the window. */
  GstElement *size = nullptr;
  GstElement *overlay = nullptr;
  /** An element, or the bin of --sink. */
  GstElement *sink = nullptr;
};

struct WindowOptions {
  std::optional<Text> sink;
  std::optional<Text> keep_on;      ///< an event
  std::optional<double> keep_after; ///< s
  const char *last = nullptr; ///< caption of the last picture; null: the usual

  /** @p comes  whether frames come, and are not read from a file. */
  void declare (Options &options, bool comes = true);
  /** Remembers the coded frames of @p chain, for the key K.
   * @p command  names recordings. */
  GstElement *add_keeper (
      Chain &chain, const std::string &command, std::optional<int> bits) const;
  /** What --help says of the keys. @p command  names snapshots. */
  static std::string keys_of (const std::string &command);
  /** Those of all windows. */
  static std::string common_keys (const std::string &command);
};

/** Shows the pictures of two or three chains: camera, subframes, perhaps fused.
 * @p bits  significant bits of the pixels; none: those of the frames.
 * @p paced  pictures of the window a second, "100/1", for which the stream
 * waits; empty: the window skips what it is too slow for. */
WindowBranch add_window_branch (const std::vector<Chain> &sources,
    const WindowOptions &options, std::optional<int> bits,
    const std::string &paced);

/** Throws Failure if there is no screen for @p branch. */
void need_screen (const WindowBranch &branch);

} // namespace codedexposure::app
