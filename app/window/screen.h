/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The X screen that windows open on. */
#pragma once

#include <functional>
#include <optional>

#include "base/geometry.h"

namespace codedexposure::app
{

struct Screen {
  /** Whether the X display can be opened. GStreamer's sinks show nothing where
   * it cannot, or crash. */
  bool opens = true;
  /** In pixels; none: not known. */
  std::optional<Extent> size = {};

  /** The size of a window that surely fits, frame and bars included. */
  Extent room () const;
};

Screen find_screen ();

/** Calls @p lost in the main loop when the connection to the X server of a
 * window breaks. By itself, the X library would end the program, and with it a
 * recording. */
void watch_screen (std::function<void ()> lost);

/** Asks the desktop to let the X windows of this program fill the screen, or to
 * give them back their size. False: there is no such window. */
bool set_full_screen (bool full);

} // namespace codedexposure::app
