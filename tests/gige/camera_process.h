/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The emulated camera as a process of its own, which can be killed. */
#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "child_process.h"

namespace codedexposure::test
{

/** Serves coded frames from its construction on, and ends with it. */
class CameraProcess : public ChildProcess
{
public:
  /** @p options  beyond the address, 127.0.0.1, and the frames: 256x192 pixels
   * of @p schedule, 100 a second. */
  explicit CameraProcess (
      const std::string &schedule, const std::vector<std::string> &options = {})
      : ChildProcess (command (schedule, options), STDERR_FILENO)
  {
    EXPECT_NE (await ("serving"), "") << "the camera never served";
  }

private:
  static std::vector<std::string> command (
      const std::string &schedule, const std::vector<std::string> &options)
  {
    std::vector<std::string> words{"env", "GST_PLUGIN_PATH_1_0=" PLUGIN_DIR,
        "GST_REGISTRY_1_0=" PLUGIN_REGISTRY, PROGRAM, "bench", "--address",
        "127.0.0.1", "--size", "256x192", "--frame-rate", "100", "--schedule",
        schedule};
    words.insert (words.end (), options.begin (), options.end ());
    return words;
  }
};

} // namespace codedexposure::test
