/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* How coded frames become pictures. */
#pragma once

#include <utility>

#include "options.h"

namespace codedexposure::app
{

class DecodeOptions
{
public:
  std::optional<Text> method, mapping, fuse, bench, schedule;
  std::optional<double> full_well, read_noise;
  std::optional<int> bits, range, overlap;
  bool refine = false;

  void declare (Options &options);
  /** Some of them. @p origin  of the frames: "the recording". */
  void declare_method (Options &options, const std::string &origin);
  void declare_frames (Options &options, const std::string &origin);

  /** Those that are set, as words of another command line. After declare (). */
  std::vector<std::string> words () const;

private:
  const Options *declared_ = nullptr;
};

/** "A-B" in seconds; no B: to the end. */
Rule<Text> excerpt_rule ();
std::pair<double, std::optional<double>> excerpt_times (
    const std::string &excerpt);

} // namespace codedexposure::app
