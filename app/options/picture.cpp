/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "picture.h"

#include "base/text.h"

namespace codedexposure::app
{

void
DecodeOptions::declare_method (Options &options, const std::string &origin)
{
  options.value ("--method", method, "M", "auto, rank, select or decode [auto]",
      one_of ({"auto", "rank", "select", "decode"}));
  options.value ("--mapping", mapping, "FILE",
      "mapping from calibrate [that of " + origin + "]");
}

void
DecodeOptions::declare_frames (Options &options, const std::string &origin)
{
  options.value ("--schedule", schedule, "S", "instead of that of " + origin);
  options.value ("--bits", bits, "N",
      "significant bits of the pixels [those of " + origin + "]",
      whole (1, 16));
}

void
DecodeOptions::declare (Options &options)
{
  const Rule<double> at_least_0 = real (0, 1e9, "a number of at least 0");
  declared_ = &options;
  declare_method (options, "the recording");
  options.value ("--fuse", fuse, "QUALITY",
      "full-size frames instead of subframes: fast, balanced, best, or learned "
      "(best --refine)",
      one_of ({"fast", "balanced", "best", "learned"}));
  options.flag ("--refine", refine,
      "after --fuse: corrects its frames by a network that learned from "
      "pictures");
  options.value ("--overlap", overlap, "N",
      "after --fuse: exposures that are fused for each coded frame; beyond 1, "
      "those between two frames make the first and last slots as true as the "
      "others, in N times the time; no more than there are slots count [1]",
      whole (1, 8));
  options.value ("--bench", bench, "FILE",
      "bench profile (JSON) with noise, black level, leakage and mapping; "
      "other options win [that of the recording]");
  options.value ("--full-well", full_well, "E",
      "noise of the camera, for --fuse: electrons at white, e-; 0: no noise "
      "[by the bench profile; 0]",
      at_least_0);
  options.value ("--read-noise", read_noise, "E",
      "noise of the camera, for --fuse: e- rms [by the bench profile; 0]",
      at_least_0);
  options.value ("--range", range, "N",
      "of a recording of two cameras, for --fuse: white of the pictures in "
      "whites of the first camera, whose saturated pixels are seen by the "
      "second behind a filter [1]",
      whole (1, 16));
  declare_frames (options, "the recording");
  options.need (
      {"--refine", "--overlap", "--full-well", "--read-noise", "--range"},
      "--fuse");
}

std::vector<std::string>
DecodeOptions::words () const
{
  return declared_->given (
      {"--method", "--mapping", "--fuse", "--refine", "--overlap", "--bench",
          "--full-well", "--read-noise", "--range", "--schedule", "--bits"});
}

namespace
{

std::optional<double>
time_of (std::string_view text)
{
  return text.find ('-') == text.npos ? seconds ().read (std::string (text))
                                      : std::nullopt;
}

} // namespace

Rule<Text>
excerpt_rule ()
{
  return text_that (
      [] (const std::string &text) {
        const auto parts = split (text, '-');
        if (parts.size () != 2 || !time_of (parts[0]))
          return false;
        const auto until = time_of (parts[1]);
        return parts[1].empty () || (until && *until > *time_of (parts[0]));
      },
      "FROM-UNTIL in seconds, UNTIL after FROM, such as 10-20 or 10-");
}

std::pair<double, std::optional<double>>
excerpt_times (const std::string &excerpt)
{
  const auto parts = split (excerpt, '-');
  return {*time_of (parts[0]),
      parts[1].empty () ? std::nullopt : time_of (parts[1])};
}

} // namespace codedexposure::app
