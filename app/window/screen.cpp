/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "screen.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <dlfcn.h>
#include <glib.h>
#include <unistd.h>

namespace codedexposure::app
{

namespace
{

/* The process that says that it owns @window; 0: none. */
long
owner_of (Display *display, Window window)
{
  Atom type = 0; // sinks disagree
  int format = 0;
  unsigned long items = 0, rest = 0;
  unsigned char *data = nullptr;
  long owner = 0;
  XGetWindowProperty (display, window,
      XInternAtom (display, "_NET_WM_PID", False), 0, 1, False, AnyPropertyType,
      &type, &format, &items, &rest, &data);
  if (data && items == 1)
    owner = *reinterpret_cast<long *> (data);
  if (data)
    XFree (data);
  return owner;
}

/* Adds the windows of this process to @found; window managers put them into
 * windows of their own. */
void
find_windows (Display *display, Window within, std::vector<Window> &found)
{
  Window root = 0, parent = 0, *children = nullptr;
  unsigned count = 0;
  if (owner_of (display, within) == getpid ())
    found.push_back (within);
  if (!XQueryTree (display, within, &root, &parent, &children, &count))
    return;
  for (unsigned k = 0; k < count; k++)
    find_windows (display, children[k], found);
  if (children)
    XFree (children);
}

/* Of the main thread. */
std::function<void ()> on_lost;

void
tell_lost (Display *display, void *)
{
  /* The library has locked it, so that no other thread uses it until exit. */
  XUnlockDisplay (display);
  g_idle_add (
      [] (gpointer) {
        if (const auto lost = std::exchange (on_lost, nullptr))
          lost ();
        return gboolean (G_SOURCE_REMOVE);
      },
      nullptr);
}

} // namespace

/* Stands for that of libX11 wherever this program opens a display, sinks
 * included: only a display that was just opened can be told not to exit. */
extern "C" [[gnu::visibility ("default")]] Display *
XOpenDisplay (const char *name)
{
  static const auto open = reinterpret_cast<decltype (&XOpenDisplay)> (
      dlsym (RTLD_NEXT, "XOpenDisplay"));
  Display *display = open ? open (name) : nullptr;
  if (display) {
    XSetIOErrorHandler ([] (Display *) { return 0; });
    XSetIOErrorExitHandler (display, tell_lost, nullptr);
  }
  return display;
}

void
watch_screen (std::function<void ()> lost)
{
  on_lost = std::move (lost);
}

Screen
find_screen ()
{
  XInitThreads ();
  Display *display = XOpenDisplay (nullptr);
  if (!display)
    return {.opens = false};
  const int screen = DefaultScreen (display);
  const Extent size{
      DisplayWidth (display, screen), DisplayHeight (display, screen)};
  XCloseDisplay (display);
  return {.size = size};
}

/* Extended Window Manager Hints, "_NET_WM_STATE". */
bool
set_full_screen (bool full)
{
  Display *display = XOpenDisplay (nullptr);
  if (!display)
    return false;
  /* Windows of others that close meanwhile would end this program. */
  const auto before =
      XSetErrorHandler ([] (Display *, XErrorEvent *) { return 0; });
  std::vector<Window> windows;
  const Window root = DefaultRootWindow (display);
  find_windows (display, root, windows);
  for (const Window window : windows) {
    XEvent event = {};
    XClientMessageEvent &message = event.xclient;
    message.type = ClientMessage;
    message.window = window;
    message.message_type = XInternAtom (display, "_NET_WM_STATE", False);
    message.format = 32;
    message.data.l[0] = full ? 1 : 0;
    message.data.l[1] =
        long (XInternAtom (display, "_NET_WM_STATE_FULLSCREEN", False));
    message.data.l[3] = 1; // the source is an application
    XSendEvent (display, root, False,
        SubstructureRedirectMask | SubstructureNotifyMask, &event);
  }
  XSync (display, False);
  XSetErrorHandler (before);
  XCloseDisplay (display);
  return !windows.empty ();
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
