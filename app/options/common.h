/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What all commands that run a pipeline take. */
#pragma once

#include "options.h"

namespace codedexposure::app
{

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
