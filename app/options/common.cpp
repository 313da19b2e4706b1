/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "common.h"

#include <cstdio>

#include <nlohmann/json.hpp>

namespace codedexposure::app
{

void
print_json (const nlohmann::ordered_json &json, int indent)
{
  using Json = nlohmann::ordered_json;
  std::printf ("%s\n",
      json.dump (indent, ' ', false, Json::error_handler_t::replace).c_str ());
}

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
      "print the pipeline as a line for gst-launch-1.0, and do not run it");
  options.flag (
      "--verbose", verbose, "also print messages and counters of the elements");
  options.exclude ({"--json"}, "--print");
}

} // namespace codedexposure::app
