/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "player.h"

#include "screen.h"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <glib-unix.h>

using namespace codedexposure::gst;
using report::format;

namespace
{

bool
has_window (GstElement *pipeline)
{
  const std::unique_ptr<GstIterator, FreeWith<gst_iterator_free>> elements (
      gst_bin_iterate_recurse (GST_BIN (pipeline)));
  bool found = false;
  const auto look = [] (const GValue *value, gpointer data) {
    GstElementFactory *factory =
        gst_element_get_factory (GST_ELEMENT (g_value_get_object (value)));
    for (const char *sink :
        {"autovideosink", "glimagesink", "ximagesink", "xvimagesink"})
      *static_cast<bool *> (data) |=
          factory && g_str_equal (GST_OBJECT_NAME (factory), sink);
  };
  gst_iterator_foreach (elements.get (), look, &found);
  return found;
}

bool
is_ignored (int signal)
{
  struct sigaction action = {};
  return sigaction (signal, nullptr, &action) == 0 &&
         action.sa_handler == SIG_IGN;
}

} // namespace

Player::Player (const char *what, bool verbose)
    : status_ (what, verbose), loop_ (g_main_loop_new (nullptr, FALSE))
{
}

Player::~Player ()
{
  g_main_loop_unref (loop_);
}

bool
Player::parse (const char *description)
{
  GError *error = nullptr;
  GstParseContext *context = gst_parse_context_new ();
  GstElement *parsed = gst_parse_launch_full (
      description, context, GST_PARSE_FLAG_FATAL_ERRORS, &error);
  if (!parsed && !say_missing (context))
    status_.line (format ("the pipeline is invalid: %s", error->message));
  g_clear_error (&error);
  gst_parse_context_free (context);
  if (!parsed)
    return false;
  if (!GST_IS_PIPELINE (parsed)) { // a lone element is not wrapped
    GstElement *pipeline = gst_pipeline_new (nullptr);
    gst_bin_add (GST_BIN (pipeline), parsed);
    parsed = pipeline;
  }
  pipeline_.reset (GST_ELEMENT (gst_object_ref_sink (parsed)));
  return has_screen ();
}

/* False, with a printed reason, if a window has no screen. A sink for Wayland
 * needs no X display. */
bool
Player::has_screen ()
{
  const char *display = std::getenv ("DISPLAY");
  if (std::getenv ("WAYLAND_DISPLAY") || !display ||
      !has_window (pipeline_.get ()) || find_screen ().opens)
    return true;
  status_.line (format ("error: the screen DISPLAY=%s cannot be opened. Run "
                        "this in a desktop session or through ssh -X, or "
                        "record and decode instead.",
      display));
  return false;
}

/* Prints the missing elements and their packages. The context also lists
 * elements that exist but could not be set up. */
bool
Player::say_missing (GstParseContext *context)
{
  bool said = false;
  gchar **names = gst_parse_context_get_missing_elements (context);
  for (gchar **name = names; name && *name; name++) {
    if (const ObjectPtr<GstElementFactory> found{
            gst_element_factory_find (*name)})
      continue;
    const std::string package = report::package_of (*name);
    status_.line (format ("the element \"%s\" is missing%s%s", *name,
        package.empty () ? "" : "; run apt-get install ", package.c_str ()));
    said = true;
  }
  g_strfreev (names);
  return said;
}

bool
Player::claim_outputs (bool replace, GstPad *coded)
{
  const auto errors = outputs_.claim (pipeline_.get (), coded, replace);
  for (const std::string &error : errors)
    status_.line ("error: " + error);
  return errors.empty ();
}

bool
Player::finish_outputs (bool publish)
{
  stop ();
  const auto errors = outputs_.finish (publish);
  for (const std::string &error : errors)
    status_.line ("error: " + error);
  return errors.empty ();
}

/* A script passes a signal on that its terminal has sent here as well; only the
 * same signal again is another one. */
gboolean
Player::on_unix_signal (gpointer data)
{
  auto *signal = static_cast<Signal *> (data);
  signal->player->on_signal (++signal->times);
  return G_SOURCE_CONTINUE;
}

int
Player::loop ()
{
  const auto on_bus = [] (GstBus *, GstMessage *message, gpointer self) {
    static_cast<Player *> (self)->on_message (message);
    return gboolean (G_SOURCE_CONTINUE);
  };
  const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline_.get ()));
  gst_bus_add_watch (bus.get (), on_bus, this);
  /* The reader of the messages may be gone. */
  std::signal (SIGPIPE, SIG_IGN);
  Signal signals[] = {{this, SIGINT}, {this, SIGTERM}, {this, SIGHUP}};
  std::vector<guint> sources;
  for (Signal &signal : signals)
    if (signal.number != SIGHUP || !is_ignored (SIGHUP)) // nohup
      sources.push_back (
          g_unix_signal_add (signal.number, on_unix_signal, &signal));
  begin ();
  g_main_loop_run (loop_);
  for (const guint source : sources)
    g_source_remove (source);
  gst_bus_remove_watch (bus.get ());
  return code_;
}

void
Player::stop ()
{
  if (pipeline_)
    gst_element_set_state (pipeline_.get (), GST_STATE_NULL);
}

void
Player::quit (int code)
{
  code_ = code;
  g_main_loop_quit (loop_);
}

ObjectPtr<GstElement>
Player::find (const char *name) const
{
  return ObjectPtr<GstElement> (
      name ? gst_bin_get_by_name (GST_BIN (pipeline_.get ()), name) : nullptr);
}

const char *
pipeline_argument (
    const char *program, const GOptionEntry *entries, int argc, char **argv)
{
  GOptionContext *context = g_option_context_new ("PIPELINE");
  g_option_context_add_main_entries (context, entries, nullptr);
  g_option_context_add_group (context, gst_init_get_option_group ());
  GError *error = nullptr;
  const bool parsed = g_option_context_parse (context, &argc, &argv, &error);
  g_option_context_free (context);
  if (parsed && argc == 2)
    return argv[1];
  std::fprintf (stderr, "%s: %s\n", program,
      error ? error->message : "give one PIPELINE");
  g_clear_error (&error);
  return nullptr;
}
