/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor/lag.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "base/try.h"
#include "doctor/statistics.h"

namespace codedexposure
{

namespace
{

constexpr int kChanges = 12, kFramesOfChange = 10;
constexpr int kTiles = 8;
/* A frame is of the brighter mask above this part of the step to it: light that
 * flickers changes a bright frame by more than a dark one. */
constexpr double kBrighter = 0.3;
/* Levels of frames of one mask alone differ less, as parts of the step. */
constexpr double kSameLevel = 0.2;
/* Light of all mirrors by which a run of an eighth can be measured, part of the
 * range. */
constexpr double kFaint = 0.05;
/* A mean that is so near to the largest DN is one of pixels that are full. */
constexpr double kBright = 0.95;

/** What shows when the exposure began, from the start of the frames. */
struct Change {
  std::optional<int> late = {}; ///< frames after the pause with the old mask
  int old = 0;                  ///< frames after show () with the old mask
  int lost = 0;                 ///< frames that did not come
  bool mixed = false;           ///< the old mask came again after the new one
};

/** Shows all mirrors on in the whole period, or in one tile of the middle. */
Result<std::vector<SeenFrame>>
change_mask (Rig &rig, bool all)
{
  RETURN_IF_ERROR (
      rig.show (all ? lit (0, kTiles) : lit (kTiles / 2, 1), kTiles));
  ASSIGN_OR_RETURN (auto seen, rig.watch (kFramesOfChange));
  std::erase_if (seen, &SeenFrame::damaged);
  return seen;
}

/** @p before, @p after: levels of the masks. @p last: stamp of the frame before
 * the change. */
Change
change_of (const std::vector<SeenFrame> &seen, double before, double after,
    Nanoseconds last, const RigParts &parts)
{
  const auto cycles = [&parts] (Nanoseconds a, Nanoseconds b) {
    return std::lround (1e-9 * double (b - a) / parts.period ());
  };
  // A show () leaves out a cycle at least; frames before that pause, the last
  // of which may be cut short, are of the mask before.
  std::size_t pause = 0;
  long longest = 0;
  for (std::size_t i = 0; i < seen.size (); i++) {
    const long step = cycles (i > 0 ? seen[i - 1].time : last, seen[i].time);
    if (step > longest) {
      longest = step;
      pause = i;
    }
  }
  Change change{.old = int (pause)};
  int late = 0;
  bool turned = false;
  const double between =
      std::min (before, after) + kBrighter * std::abs (before - after);
  for (std::size_t i = pause; i < seen.size (); i++) {
    const double mean =
        level_of (seen[i].picture.view (), parts.largest ()).mean;
    const double off =
        std::abs (mean - after) / std::max (1e-9, std::abs (before - after));
    const bool is_old = (mean > between) == (before > after);
    // A frame that was cut short lies between the masks, and is not new.
    if (off > kSameLevel)
      change.old = int (i) + 1;
    change.mixed |= is_old && turned;
    if (i > 0 && i != pause)
      change.lost += int (cycles (seen[i - 1].time, seen[i].time)) - 1;
    turned |= !is_old;
    late += !turned;
  }
  // A bright frame that was cut short may look like the darker mask.
  if (longest >= 2 && after > before)
    change.late = late;
  return change;
}

void
diagnose_lag (const std::vector<Change> &changes, Examination &examination,
    Finding &finding)
{
  int old = 1, lost = 0, number = 0;
  bool mixed = false;
  std::map<int, int> counts; // of changes by how late they are
  double sum = 0.0;
  for (const Change &change : changes) {
    old = std::max (old, change.old);
    lost += change.lost;
    mixed |= change.mixed;
    if (!change.late)
      continue;
    counts[*change.late]++;
    sum += *change.late;
    number++;
  }
  examination.lag = old + 1;
  if (number == 0)
    return;
  const auto usual = std::ranges::max_element (
      counts, {}, [] (const auto &count) { return count.second; });
  const int low = counts.begin ()->first, high = counts.rbegin ()->first;
  finding.add ("lag", {sum / number, 0.5 * (high - low)});
  // A frame that is lost after the pause takes one from the count.
  const int fewer = high == usual->first ? (lost > 0 ? 2 : 1) : 0;
  if (mixed || number - usual->second > fewer)
    finding.blame ("frame-late-varies",
        "a new mask shows " + std::to_string (low) + " to " +
            std::to_string (high) +
            " frames late: the camera or the network holds frames back");
  else if (usual->first > 0)
    finding.blame ("frame-late",
        "every frame shows the mask of " + std::to_string (usual->first) +
            (usual->first > 1 ? " frames" : " frame") + " before");
}

} // namespace

Result<bool>
check_lag (Examination &examination, Nanoseconds last, Finding &finding)
{
  Rig &rig = examination.rig;
  const int largest = rig.parts ().largest ();
  double levels[2] = {};
  std::vector<Change> changes;
  for (int i = 0; i < kChanges + 2; i++) {
    ASSIGN_OR_RETURN (const auto seen, change_mask (rig, i % 2 == 0));
    if (seen.empty ()) {
      finding.blame ("no-trigger", "frames ended after a change of the mask");
      return false;
    }
    const Level level = level_of (seen.back ().picture.view (), largest);
    const double before = levels[(i + 1) % 2];
    levels[i % 2] = level.mean;
    if (i >= 2)
      changes.push_back (
          change_of (seen, before, level.mean, last, rig.parts ()));
    last = seen.back ().time;
    if (i != 1)
      continue;
    const double step = levels[0] - levels[1];
    if (level.saturated > 0.5)
      finding.blame ("bright",
          "an eighth of the frame period is enough light to saturate the "
          "camera");
    else if (step >= kFaint * largest)
      continue;
    else if (levels[0] > kBright * largest)
      finding.blame ("bright",
          "all mirrors on instead of an eighth of the time make no more than " +
              shown (levels[0]) + " of " + std::to_string (largest) + " DN");
    else
      finding.blame (
          "dark", "all mirrors on instead of an eighth of the time add " +
                      shown (step) + " of " + std::to_string (largest) + " DN");
    return false;
  }
  diagnose_lag (changes, examination, finding);
  return true;
}

} // namespace codedexposure
