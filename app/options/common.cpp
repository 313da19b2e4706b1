/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common.h"

namespace codedexposure::app
{

void
RunOptions::declare_result (Options &options, bool writes)
{
  options.heading ("");
  if (writes)
    options.flag ("--force", force, "replace files that exist");
  options.flag ("--json", json, "print the result as JSON on standard output");
}

void
RunOptions::declare (Options &options, bool writes)
{
  declare_result (options, writes);
  options.flag ("--print", print,
      "print the pipeline, as of gst-launch-1.0, and do not run it");
  options.flag (
      "--verbose", verbose, "also print messages and counters of the elements");
}

} // namespace codedexposure::app
