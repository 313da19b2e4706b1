/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "launch_options.h"

#include <cstdio>

#include "player.h"

LaunchOptions::~LaunchOptions ()
{
  for (gchar *text : {what, count, receiver, excerpt, ledger, notes, from_notes,
           plain_text, need})
    g_free (text);
}

const char *
LaunchOptions::parse (int argc, char **argv)
{
  const GOptionEntry entries[] = {
      {"what", 0, 0, G_OPTION_ARG_STRING, &what, "Prefix of every line",
          "WORD"},
      {"count", 0, 0, G_OPTION_ARG_STRING, &count,
          "Element at whose sink pad the coded frames are counted", "NAME"},
      {"total", 0, 0, G_OPTION_ARG_INT64, &total,
          "Expected number of coded frames", "N"},
      {"start-with-receiver", 0, 0, G_OPTION_ARG_STRING, &receiver,
          "Wait until this tcpserversink has a receiver", "NAME"},
      {"retry", 0, 0, G_OPTION_ARG_DOUBLE, &retry,
          "Time for which to try to connect; status 4 if nobody listens",
          "SECONDS"},
      {"start", 0, 0, G_OPTION_ARG_DOUBLE, &times.start,
          "Time of the stream at which to start", "SECONDS"},
      {"duration", 0, 0, G_OPTION_ARG_DOUBLE, &times.duration,
          "Duration to play", "SECONDS"},
      {"excerpt", 0, 0, G_OPTION_ARG_STRING, &excerpt,
          "Only the coded frames from FROM to UNTIL, ns, as in the whole "
          "stream",
          "FROM:UNTIL:BEFORE:AFTER"},
      {"ledger", 0, 0, G_OPTION_ARG_FILENAME, &ledger,
          "File for what came of each coded frame of the excerpt", "FILE"},
      {"notes", 0, 0, G_OPTION_ARG_FILENAME, &notes,
          "File for what Matroska does not hold of the pictures", "FILE"},
      {"from-notes", 0, 0, G_OPTION_ARG_FILENAME, &from_notes,
          "File with what Matroska does not hold of the pictures", "FILE"},
      {"keep-time", 0, 0, G_OPTION_ARG_NONE, &times.keep_time,
          "Times of the output are those of the recording", nullptr},
      {"salvage", 0, 0, G_OPTION_ARG_NONE, &salvage,
          "Go on with the frames that are left after damage of the container",
          nullptr},
      {"shift-to", 0, 0, G_OPTION_ARG_DOUBLE, &times.shift_to,
          "Running time for the first counted frame", "SECONDS"},
      {"need", 0, 0, G_OPTION_ARG_STRING, &need,
          "Element message without which the run has failed", "NAME"},
      {"camera", 0, 0, G_OPTION_ARG_NONE, &camera,
          "Warn if no frame comes for 5 s", nullptr},
      {"live", 0, 0, G_OPTION_ARG_NONE, &live,
          "Warn if the queue \"buffer\" fills", nullptr},
      {"plain-text", 0, 0, G_OPTION_ARG_STRING, &plain_text,
          "Element whose texts become plain", "NAME"},
      {"no-result", 0, 0, G_OPTION_ARG_NONE, &no_result,
          "Do not print the result", nullptr},
      {"force", 0, 0, G_OPTION_ARG_NONE, &force, "Replace files that exist",
          nullptr},
      {"verbose", 0, 0, G_OPTION_ARG_NONE, &verbose,
          "Print messages and counters of the elements", nullptr},
      {},
  };
  const char *pipeline =
      pipeline_argument ("codedexposure-launch", entries, argc, argv);
  if (!pipeline || !excerpt)
    return pipeline;
  times.excerpt = Excerpt::parse (excerpt);
  if (times.excerpt)
    return pipeline;
  std::fprintf (stderr,
      "codedexposure-launch: --excerpt %s is not FROM:UNTIL:BEFORE:AFTER\n",
      excerpt);
  return nullptr;
}
