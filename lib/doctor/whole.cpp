/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "whole": a recording with the schedule that the user has chosen. */
#include <algorithm>
#include <cmath>
#include <string>

#include "base/statistics.h"
#include "base/text.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "extract/extractor.h"

namespace codedexposure
{

namespace
{

/* Frames that take part in the comparison of slots, spread over the recording.
 */
constexpr int kCompared = 64;
/* Fewer say nothing of a recording. */
constexpr std::uint64_t kFewest = 10;
/* Delays between frames that a recording can do with, as part of a period. */
constexpr double kJitterWarn = 0.2;
/* Light that changes by that part is of another part of the cycle. */
constexpr double kOtherSlot = 0.3;
constexpr double kLongestWatch = 10.0; // s

/** Mean and standard deviation of numbers. */
Measured
spread_of (const std::vector<double> &values)
{
  const double count = double (values.size ());
  double mean = 0.0, squares = 0.0;
  for (const double value : values)
    mean += value / std::max (1.0, count);
  for (const double value : values)
    squares += (value - mean) * (value - mean);
  return {mean, std::sqrt (squares / std::max (1.0, count - 1.0))};
}

/** How often an exposure of half of a period saw another part of the cycle than
 * the first one, in @p seconds at most, where the second quarter is lit. A
 * recording of a still target does not show slips by whole slots. */
Result<std::uint64_t>
count_slips (Examination &examination, double seconds)
{
  constexpr int kFrames = 10; // in memory at a time
  const RigParts &parts = examination.rig.parts ();
  const double frames =
      std::min (seconds, kLongestWatch) * parts.rate.num / parts.rate.den;
  std::vector<double> levels;
  RETURN_IF_ERROR (with_exposure (
      examination, parts.rate.period () / 2, [&] () -> Result<void> {
        ASSIGN_OR_RETURN (
            auto seen, look (examination, lit (1, 1), 4, kFrames));
        while (!seen.empty ()) {
          for (const SeenFrame &frame : seen)
            if (!frame.damaged)
              levels.push_back (mean_of (frame.picture.view ()));
          if (double (levels.size ()) >= frames)
            break;
          ASSIGN_OR_RETURN (seen, examination.rig.watch (kFrames));
        }
        return {};
      }));
  if (levels.empty ())
    return std::uint64_t (0);
  const auto &black = examination.profile.black_level;
  const double first = levels.front ();
  const double other = kOtherSlot * (first - (black ? black->value : 0.0));
  return std::uint64_t (std::ranges::count_if (
      levels, [&] (double level) { return std::abs (level - first) > other; }));
}

struct Recording {
  std::uint64_t frames = 0, lost = 0, damaged = 0, unsynchronised = 0;
  std::vector<double> delays = {}; ///< arrival after the exposure, ns
  std::optional<Nanoseconds> uncertainty = {};
};

void
count (const RecordedFrame &frame, Recording &counts)
{
  counts.frames++;
  counts.lost += frame.lost_before;
  counts.damaged += frame.damaged;
  counts.unsynchronised += frame.synchronised == false;
  counts.delays.push_back (double (frame.arrival - frame.time));
  if (frame.uncertainty)
    counts.uncertainty = frame.uncertainty;
}

void
diagnose_losses (const Recording &counts, Finding &finding)
{
  const double root = std::sqrt (double (counts.lost));
  finding.readings.push_back ({"lost frames", {double (counts.lost), root},
      "of " + std::to_string (counts.frames + counts.lost), "0"});
  if (counts.frames == 0)
    finding.blame ("no-trigger", "no frame came");
  if (counts.lost + counts.damaged > 0)
    finding.blame ("lose", std::to_string (counts.lost) +
                               " frames were lost and " +
                               std::to_string (counts.damaged) + " damaged");
  if (counts.unsynchronised > 0)
    finding.blame ("slip", "masks and camera were out of step in " +
                               std::to_string (counts.unsynchronised) +
                               " frames");
}

void
diagnose_times (const Recording &counts, FrameRate rate, Finding &finding)
{
  if (counts.delays.size () < 2)
    return;
  const double jitter = spread_of (counts.delays).sigma;
  finding.readings.push_back ({"jitter of arrival",
      {jitter / 1e3, jitter / 1e3 / std::sqrt (2.0 * double (counts.frames))},
      "us"});
  if (counts.uncertainty)
    finding.readings.push_back (
        {"time uncertainty", {double (*counts.uncertainty) / 1e3, 0}, "us"});
  if (jitter > kJitterWarn * double (rate.period ()))
    finding.blame ("frame-jitter",
        "frames arrive with delays that differ by " + fixed (jitter / 1e3, 0) +
            " us (rms)",
        Verdict::warn);
}

void
diagnose_slots (const std::vector<std::vector<double>> &means, double black,
    Finding &finding)
{
  if (means.empty () || means.front ().size () < 2)
    return;
  std::vector<double> levels;
  for (const auto &slot : means)
    levels.push_back (spread_of (slot).value - black);
  const double all = spread_of (levels).value;
  std::size_t worst = 0;
  Plot plot{"Light of the slots", "slot", "part of the mean"};
  for (std::size_t slot = 0; slot < levels.size (); slot++) {
    plot.points.push_back ({double (slot + 1), levels[slot] / all});
    if (std::abs (levels[slot] - all) > std::abs (levels[worst] - all))
      worst = slot;
  }
  finding.plots.push_back (std::move (plot));
  const double part = levels[worst] / all - 1;
  const double sigma = spread_of (means[worst]).sigma / all /
                       std::sqrt (double (means[worst].size ()));
  finding.measure ("largest difference of a slot", {part, sigma},
      "slot " + std::to_string (worst + 1) + " of a still target is " +
          fixed (100 * std::abs (part), 1) + " % " +
          (part < 0 ? "darker" : "brighter") + " than the mean");
}

} // namespace

Result<Finding>
check_whole (Examination &examination)
{
  const RigParts &parts = examination.rig.parts ();
  const double seconds = examination.recording;
  Finding finding{"whole", "the schedule " + examination.schedule.text () +
                               ", for " + real_text (seconds) + " s"};
  ExtractOptions options;
  options.bits = parts.bits;
  ASSIGN_OR_RETURN (auto extractor,
      Extractor<std::uint16_t>::make (examination.schedule,
          parts.camera.size.width, parts.camera.size.height, options));
  std::vector<Image<std::uint16_t>> pictures;
  for (int slot = 0; slot < extractor.subframes (); slot++)
    pictures.emplace_back (
        extractor.subframe_size ().width, extractor.subframe_size ().height);
  std::vector<ImageView<std::uint16_t>> views;
  for (auto &picture : pictures)
    views.push_back (picture.view ());
  std::vector<std::vector<double>> means (views.size ()); // by slot
  Recording counts;
  ASSIGN_OR_RETURN (counts.unsynchronised, count_slips (examination, seconds));
  const double expected = seconds * parts.rate.num / parts.rate.den;
  const auto every = std::uint64_t (std::max (1.0, expected / kCompared));
  RETURN_IF_ERROR (examination.rig.record (
      examination.schedule, seconds, [&] (const RecordedFrame &frame) {
        const bool usable = !frame.damaged && frame.synchronised != false;
        if (usable && counts.frames % every == every / 2 &&
            extractor.run (frame.picture, views))
          for (std::size_t slot = 0; slot < views.size (); slot++)
            means[slot].push_back (mean_of (views[slot]));
        count (frame, counts);
      }));
  diagnose_losses (counts, finding);
  if (counts.frames < kFewest) {
    finding.readings.push_back ({"frames", {double (counts.frames), INFINITY},
        "", "at least " + std::to_string (kFewest)});
    return finding;
  }
  diagnose_times (counts, parts.rate, finding);
  const auto &black = examination.profile.black_level;
  diagnose_slots (means, black ? black->value : 0, finding);
  return finding;
}

} // namespace codedexposure
