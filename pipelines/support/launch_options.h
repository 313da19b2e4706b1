/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The command line of codedexposure-launch. */
#pragma once

#include "frame_counter.h"

/** What a script asks for; a text that it leaves out is null. */
struct LaunchOptions {
  LaunchOptions () = default;
  ~LaunchOptions ();
  LaunchOptions (const LaunchOptions &) = delete;
  LaunchOptions &operator= (const LaunchOptions &) = delete;

  /** Reads the arguments and returns the pipeline; null, with a printed reason,
   * if they are invalid. */
  const char *parse (int argc, char **argv);

  gchar *what = nullptr;     // prefix of every line
  gchar *count = nullptr;    // element at whose sink pad frames are counted
  gint64 total = 0;          // expected coded frames, 0: unknown
  gchar *receiver = nullptr; // tcpserversink to wait for
  gdouble retry = 0;         // time for which to try to connect, s
  FrameCounter::Times times;
  gchar *excerpt = nullptr; // FROM:UNTIL:BEFORE:AFTER, of Excerpt
  gchar *ledger = nullptr;  // file for what came of each coded frame of it
  gchar *notes = nullptr; // file for the notes of the pictures of "output-kept"
  gchar *from_notes = nullptr; // file with those of "noted"
  gboolean salvage = FALSE;    // go on after damage of the container
  gchar *plain_text = nullptr; // element whose texts become plain
  gchar *need = nullptr;       // name of an element message that must come
  gboolean camera = FALSE;     // frames come all the time
  gboolean live = FALSE;       // frames come in real time
  gboolean no_result = FALSE;  // print no result
  gboolean force = FALSE;      // replace files that exist
  gboolean verbose = FALSE;    // also print messages and counters of elements
};
