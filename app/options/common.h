/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What all commands that run a pipeline take. */
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "options.h"

namespace codedexposure::app
{

/** Prints @p json on standard output. Names of files may have bytes that JSON
 * cannot hold; they become U+FFFD. @p indent -1: in one line. */
void print_json (const nlohmann::ordered_json &json, int indent = -1);

struct RunOptions {
  bool force = false;
  bool print = false;
  bool json = false;
  bool verbose = false;

  /** @p writes  whether the command writes files, so that --force has a
   * meaning. */
  void declare (Options &options, bool writes = true);
  /** --force and --json alone, of a command that prints no pipeline. */
  void declare_result (Options &options, bool writes = true);
};

} // namespace codedexposure::app
