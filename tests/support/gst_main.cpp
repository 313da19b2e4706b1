/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* main () of the element tests. */
#include <gst/gst.h>

#include "run_tests.h"

int
main (int argc, char **argv)
{
  /* A forked registry scanner cannot load the plugin of a sanitizer build. */
  gst_registry_fork_set_enabled (FALSE);
  gst_init (&argc, &argv);
  /* GStreamer logs a warning if an element violates its rules. */
  g_log_set_always_fatal (GLogLevelFlags (
      G_LOG_FATAL_MASK | G_LOG_LEVEL_CRITICAL | G_LOG_LEVEL_WARNING));
  const int failed = codedexposure::test::run_tests (argc, argv);
  gst_deinit ();
  return failed;
}
