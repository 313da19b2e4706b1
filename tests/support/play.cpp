/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Plays the pipeline that its arguments describe, to the end; the tests of
 * programs use it where gst-launch-1.0 would split the text or could wait for
 * ever after an early error. */
#include <cstdio>

#include <gst/gst.h>

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  GError *error = nullptr;
  GstElement *pipeline =
      argc == 2 ? gst_parse_launch (argv[1], &error) : nullptr;
  if (!pipeline || error) {
    std::fprintf (stderr, "play: %s\n", error ? error->message : "give a text");
    return 2;
  }
  gst_element_set_state (pipeline, GST_STATE_PLAYING);
  GstBus *bus = gst_element_get_bus (pipeline);
  constexpr auto kHeard = GstMessageType (
      GST_MESSAGE_ERROR | GST_MESSAGE_EOS | GST_MESSAGE_WARNING);
  GstMessage *message = nullptr;
  while (true) {
    message = gst_bus_timed_pop_filtered (bus, GST_CLOCK_TIME_NONE, kHeard);
    if (GST_MESSAGE_TYPE (message) != GST_MESSAGE_WARNING)
      break;
    gst_message_parse_warning (message, &error, nullptr);
    std::fprintf (stderr, "play: warning: %s\n", error->message);
    g_clear_error (&error);
    gst_message_unref (message);
  }
  const bool failed = GST_MESSAGE_TYPE (message) == GST_MESSAGE_ERROR;
  if (failed) {
    gchar *detail = nullptr;
    gst_message_parse_error (message, &error, &detail);
    std::fprintf (stderr, "play: %s: %s\n%s\n",
        GST_OBJECT_NAME (GST_MESSAGE_SRC (message)), error->message,
        detail ? detail : "");
    g_clear_error (&error);
    g_free (detail);
  }
  gst_message_unref (message);
  gst_object_unref (bus);
  gst_element_set_state (pipeline, GST_STATE_NULL);
  gst_object_unref (pipeline);
  return failed ? 1 : 0;
}
