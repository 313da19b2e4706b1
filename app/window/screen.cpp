/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "screen.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include <dlfcn.h>
#include <glib.h>
#include <unistd.h>

namespace codedexposure::app
{

namespace
{

/* Null, and @has_all is false: there is none of that name. */
template <typename Function>
Function *
function_of (void *library, const char *name, bool &has_all)
{
  void *found = library ? dlsym (library, name) : nullptr;
  has_all &= found != nullptr;
  return reinterpret_cast<Function *> (found);
}

using XDisplay = void;
using XWindow = unsigned long;
using XAtom = unsigned long;

using OnError = int (XDisplay *, void *error);
using OnLost = void (XDisplay *, void *data);

/* XClientMessageEvent, as large as any XEvent. */
struct XMessage {
  int type;
  unsigned long serial;
  int send_event;
  XDisplay *display;
  XWindow window;
  XAtom message;
  int format;
  long data[5];
  long rest[12];
};

/* The functions of libX11 that are used here. It is where a sink for X is;
 * without one, no window needs it. */
struct X {
  void *library = dlopen ("libX11.so.6", RTLD_LAZY);
  bool has_all = true;
#define X_FUNCTION(type, name)                                                 \
  std::add_pointer_t<type> name =                                              \
      function_of<type> (library, "X" #name, has_all)
  X_FUNCTION (int (), InitThreads);
  X_FUNCTION (XDisplay *(const char *), OpenDisplay);
  X_FUNCTION (int (XDisplay *), CloseDisplay);
  X_FUNCTION (int (XDisplay *), DefaultScreen);
  X_FUNCTION (int (XDisplay *, int), DisplayWidth);
  X_FUNCTION (int (XDisplay *, int), DisplayHeight);
  X_FUNCTION (XWindow (XDisplay *), DefaultRootWindow);
  X_FUNCTION (XAtom (XDisplay *, const char *, int), InternAtom);
  X_FUNCTION (
      int (XDisplay *, XWindow, XWindow *, XWindow *, XWindow **, unsigned *),
      QueryTree);
  X_FUNCTION (int (XDisplay *, XWindow, XAtom, long, long, int, XAtom, XAtom *,
                  int *, unsigned long *, unsigned long *, unsigned char **),
      GetWindowProperty);
  X_FUNCTION (int (XDisplay *, XWindow, int, long, XMessage *), SendEvent);
  X_FUNCTION (int (void *), Free);
  X_FUNCTION (int (XDisplay *, int), Sync);
  X_FUNCTION (OnError *(OnError *), SetErrorHandler);
#undef X_FUNCTION
};

/* The process that says that it owns @window; 0: none. */
long
owner_of (const X &x, XDisplay *display, XWindow window)
{
  constexpr XAtom kAnyType = 0; // sinks disagree
  XAtom type = 0;
  int format = 0;
  unsigned long items = 0, rest = 0;
  unsigned char *data = nullptr;
  long owner = 0;
  x.GetWindowProperty (display, window,
      x.InternAtom (display, "_NET_WM_PID", 0), 0, 1, 0, kAnyType, &type,
      &format, &items, &rest, &data);
  if (data && items == 1)
    owner = *reinterpret_cast<long *> (data);
  if (data)
    x.Free (data);
  return owner;
}

/* Adds the windows of this process to @found; window managers put them into
 * windows of their own. */
void
find_windows (
    const X &x, XDisplay *display, XWindow within, std::vector<XWindow> &found)
{
  XWindow root = 0, parent = 0, *children = nullptr;
  unsigned count = 0;
  if (owner_of (x, display, within) == getpid ())
    found.push_back (within);
  if (!x.QueryTree (display, within, &root, &parent, &children, &count))
    return;
  for (unsigned k = 0; k < count; k++)
    find_windows (x, display, children[k], found);
  if (children)
    x.Free (children);
}

/* Of the main thread. */
std::function<void ()> on_lost;

void
tell_lost (XDisplay *display, void *library)
{
  bool ignored = true;
  /* The library has locked it, so that no other thread uses it until exit. */
  if (const auto unlock =
          function_of<void (XDisplay *)> (library, "XUnlockDisplay", ignored))
    unlock (display);
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
extern "C" [[gnu::visibility ("default")]] XDisplay *XOpenDisplay (
    const char *name);
XDisplay *
XOpenDisplay (const char *name)
{
  static void *library = dlopen ("libX11.so.6", RTLD_LAZY);
  bool ignored = true;
  const auto open =
      function_of<XDisplay *(const char *)> (library, "XOpenDisplay", ignored);
  const auto on_exit = function_of<void (XDisplay *, OnLost *, void *)> (
      library, "XSetIOErrorExitHandler", ignored);
  const auto on_error = function_of<void *(int (XDisplay *))> (
      library, "XSetIOErrorHandler", ignored);
  XDisplay *display = open ? open (name) : nullptr;
  if (display && on_exit && on_error) {
    on_error ([] (XDisplay *) { return 0; });
    on_exit (display, tell_lost, library);
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
  const X x;
  if (!x.has_all)
    return {};
  x.InitThreads ();
  XDisplay *display = x.OpenDisplay (nullptr);
  if (!display)
    return {.opens = false};
  const int screen = x.DefaultScreen (display);
  const Extent size{
      x.DisplayWidth (display, screen), x.DisplayHeight (display, screen)};
  x.CloseDisplay (display);
  return {.size = size};
}

/* Extended Window Manager Hints, "_NET_WM_STATE". */
bool
set_full_screen (bool full)
{
  constexpr int kClientMessage = 33;
  constexpr long kToRoot = (1L << 20) | (1L << 19); // substructure
  const X x;
  XDisplay *display = x.has_all ? x.OpenDisplay (nullptr) : nullptr;
  if (!display)
    return false;
  /* Windows of others that close meanwhile would end this program. */
  OnError *before = x.SetErrorHandler ([] (XDisplay *, void *) { return 0; });
  std::vector<XWindow> windows;
  const XWindow root = x.DefaultRootWindow (display);
  find_windows (x, display, root, windows);
  for (const XWindow window : windows) {
    XMessage message{.type = kClientMessage,
        .serial = 0,
        .send_event = 1,
        .display = display,
        .window = window,
        .message = x.InternAtom (display, "_NET_WM_STATE", 0),
        .format = 32,
        .data = {full ? 1 : 0,
            long (x.InternAtom (display, "_NET_WM_STATE_FULLSCREEN", 0)), 0, 1,
            0},
        .rest = {}};
    x.SendEvent (display, root, 0, kToRoot, &message);
  }
  x.Sync (display, 0);
  x.SetErrorHandler (before);
  x.CloseDisplay (display);
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
