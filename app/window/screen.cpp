/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "screen.h"

#include <algorithm>

#include <dlfcn.h>

namespace codedexposure::app
{

namespace
{

/* libX11 is where a sink for X is; without one, no window needs it. */
template <typename Function>
Function *
function_of (void *library, const char *name)
{
  return reinterpret_cast<Function *> (dlsym (library, name));
}

} // namespace

Screen
find_screen ()
{
  void *library = dlopen ("libX11.so.6", RTLD_LAZY);
  if (!library)
    return {};
  const auto prepare = function_of<int ()> (library, "XInitThreads");
  const auto open = function_of<void *(const char *)> (library, "XOpenDisplay");
  const auto close = function_of<int (void *)> (library, "XCloseDisplay");
  const auto number = function_of<int (void *)> (library, "XDefaultScreen");
  const auto width = function_of<int (void *, int)> (library, "XDisplayWidth");
  const auto height =
      function_of<int (void *, int)> (library, "XDisplayHeight");
  if (!prepare || !open || !close || !number || !width || !height)
    return {};
  prepare ();
  void *display = open (nullptr);
  if (!display)
    return {.opens = false};
  const int screen = number (display);
  const Extent size{width (display, screen), height (display, screen)};
  close (display);
  return {.size = size};
}

Extent
Screen::room () const
{
  constexpr Extent kFrame{16, 72}; // of a window, with the bars of a desktop
  constexpr Extent kSmall{1280, 720};
  Extent whole = size.value_or (kSmall);
  /* Monitors beside each other are one wide screen. */
  whole.width = std::min (whole.width, 5 * whole.height / 2);
  return {whole.width - kFrame.width, whole.height - kFrame.height};
}

} // namespace codedexposure::app
