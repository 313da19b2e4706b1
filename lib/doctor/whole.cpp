/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "whole": a recording with the schedule that the user has chosen. */
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "base/text.h"
#include "base/try.h"
#include "doctor/checks.h"
#include "doctor/level.h"
#include "extract/extractor.h"

namespace codedexposure
{

namespace
{

/* Slots of a still target may differ in their mean by this part. */
constexpr double kSlotsWarn = 0.02, kSlotsFail = 0.1;
/* Frames that take part in the comparison of slots, spread over the recording.
 */
constexpr int kCompared = 64;
/* Delays between frames that a recording can do with, as part of a period. */
constexpr double kJitterWarn = 0.2;
/* Light that changes by that part is of another part of the cycle. */
constexpr double kOtherSlot = 0.3;
constexpr double kLongestWatch = 10.0; // s

double
mean_of (const std::vector<double> &values)
{
  return std::accumulate (values.begin (), values.end (), 0.0) /
         double (std::max<std::size_t> (1, values.size ()));
}

double
deviation_of (const std::vector<double> &values)
{
  const double mean = mean_of (values);
  double sum = 0;
  for (const double value : values)
    sum += (value - mean) * (value - mean);
  return std::sqrt (
      sum / double (std::max<std::size_t> (2, values.size ()) - 1));
}

/** Mean light of each slot, frame by frame. */
class SlotMeans
{
public:
  static Result<SlotMeans> make (
      const Schedule &schedule, const RigParts &parts)
  {
    ExtractOptions options;
    options.bits = parts.bits;
    ASSIGN_OR_RETURN (auto extractor,
        Extractor<std::uint16_t>::make (schedule, parts.camera.size.width,
            parts.camera.size.height, options));
    return SlotMeans (std::move (extractor));
  }

  void take (ImageView<const std::uint16_t> coded)
  {
    std::vector<ImageView<std::uint16_t>> views;
    for (auto &picture : pictures_)
      views.push_back (picture.view ());
    if (!extractor_.run (coded, views))
      return;
    for (std::size_t slot = 0; slot < pictures_.size (); slot++) {
      double sum = 0;
      for (int y = 0; y < pictures_[slot].height (); y++)
        for (int x = 0; x < pictures_[slot].width (); x++)
          sum += pictures_[slot].at (x, y);
      means_[slot].push_back (
          sum / pictures_[slot].width () / pictures_[slot].height ());
    }
  }

  const std::vector<std::vector<double>> &means () const { return means_; }

private:
  explicit SlotMeans (Extractor<std::uint16_t> extractor)
      : extractor_ (std::move (extractor)),
        means_ (std::size_t (extractor_.subframes ()))
  {
    const auto [width, height] = extractor_.subframe_size ();
    for (int slot = 0; slot < extractor_.subframes (); slot++)
      pictures_.emplace_back (width, height);
  }

  Extractor<std::uint16_t> extractor_;
  std::vector<Image<std::uint16_t>> pictures_;
  std::vector<std::vector<double>> means_; // by slot
};

/** How often an exposure of half of a period saw another part of the cycle than
 * the first one, in @p seconds at most, where the second quarter is lit. A
 * recording of a still target does not show slips by whole slots. */
Result<std::uint64_t>
count_slips (Examination &examination, double seconds)
{
  constexpr int kFrames = 10; // in memory at a time
  Rig &rig = examination.rig;
  const RigParts &parts = rig.parts ();
  const double frames =
      std::min (seconds, kLongestWatch) * parts.rate.num / parts.rate.den;
  RETURN_IF_ERROR (rig.expose (parts.rate.period () / 2));
  ASSIGN_OR_RETURN (auto seen, look (examination, lit (1, 1), 4, kFrames));
  std::vector<double> levels;
  while (!seen.empty ()) {
    for (const SeenFrame &frame : seen)
      if (!frame.damaged)
        levels.push_back (
            level_of (frame.picture.view (), (1 << parts.bits) - 1).mean);
    if (double (levels.size ()) >= frames)
      break;
    ASSIGN_OR_RETURN (seen, rig.watch (kFrames));
  }
  RETURN_IF_ERROR (rig.expose (std::nullopt));
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
    finding.diagnoses.push_back ({"no-trigger", Verdict::fail, "no frame came",
        "repeat the check of the trigger"});
  if (counts.lost + counts.damaged > 0)
    finding.diagnoses.push_back ({"lose", Verdict::fail,
        std::to_string (counts.lost) + " frames were lost and " +
            std::to_string (counts.damaged) + " damaged",
        "connect the camera to a network interface of its own and stop other "
        "programs"});
  if (counts.unsynchronised > 0)
    finding.diagnoses.push_back ({"slip", Verdict::fail,
        "masks and camera were out of step in " +
            std::to_string (counts.unsynchronised) + " frames",
        "check the trigger cable for a loose contact, and its level"});
}

void
diagnose_times (const Recording &counts, FrameRate rate, Finding &finding)
{
  if (counts.delays.size () < 2)
    return;
  const double jitter = deviation_of (counts.delays);
  finding.readings.push_back ({"jitter of arrival",
      {jitter / 1e3, jitter / 1e3 / std::sqrt (2.0 * double (counts.frames))},
      "us"});
  if (counts.uncertainty)
    finding.readings.push_back (
        {"time uncertainty", {double (*counts.uncertainty) / 1e3, 0}, "us"});
  if (jitter > kJitterWarn * double (rate.period ()))
    finding.diagnoses.push_back ({"frame-jitter", Verdict::warn,
        "frames arrive with delays that differ by " +
            real_text (std::round (jitter / 1e3)) + " us (rms)",
        "stop other programs that use the network or the disk"});
}

void
diagnose_slots (const std::vector<std::vector<double>> &means, double black,
    Finding &finding)
{
  if (means.empty () || means.front ().size () < 2)
    return;
  std::vector<double> levels;
  for (const auto &slot : means)
    levels.push_back (mean_of (slot) - black);
  const double all = mean_of (levels);
  std::size_t worst = 0;
  Plot plot{"Light of the slots", "slot", "part of the mean"};
  for (std::size_t slot = 0; slot < levels.size (); slot++) {
    plot.points.push_back ({double (slot + 1), levels[slot] / all});
    if (std::abs (levels[slot] - all) > std::abs (levels[worst] - all))
      worst = slot;
  }
  finding.plots.push_back (std::move (plot));
  const double part = levels[worst] / all - 1;
  const double sigma = deviation_of (means[worst]) / all /
                       std::sqrt (double (means[worst].size ()));
  finding.readings.push_back ({"largest difference of a slot", {part, sigma},
      "of the mean", "at most " + real_text (kSlotsWarn)});
  if (std::abs (part) < kSlotsWarn + 2 * sigma)
    return;
  const std::string text = real_text (std::round (std::abs (part) * 1e3) / 10);
  finding.diagnoses.push_back ({"slots-differ",
      std::abs (part) < kSlotsFail ? Verdict::warn : Verdict::fail,
      "slot " + std::to_string (worst + 1) + " of a still target is " + text +
          " % " + (part < 0 ? "darker" : "brighter") + " than the mean",
      "check that nothing moves or flickers; if it is the first or last slot, "
      "give the schedule a readout time"});
}

} // namespace

Result<Finding>
check_whole (Examination &examination)
{
  const RigParts &parts = examination.rig.parts ();
  const double seconds = examination.recording;
  Finding finding{"whole", "the schedule " + examination.schedule.text () +
                               ", for " + real_text (seconds) + " s"};
  ASSIGN_OR_RETURN (auto slots, SlotMeans::make (examination.schedule, parts));
  Recording counts;
  ASSIGN_OR_RETURN (counts.unsynchronised, count_slips (examination, seconds));
  const double expected = seconds * parts.rate.num / parts.rate.den;
  const auto every = std::uint64_t (std::max (1.0, expected / kCompared));
  RETURN_IF_ERROR (examination.rig.record (
      examination.schedule, seconds, [&] (const RecordedFrame &frame) {
        const bool usable = !frame.damaged && frame.synchronised != false;
        if (usable && counts.frames % every == every / 2)
          slots.take (frame.picture);
        count (frame, counts);
      }));
  diagnose_losses (counts, finding);
  diagnose_times (counts, parts.rate, finding);
  const auto &black = examination.profile.black_level;
  diagnose_slots (slots.means (), black ? black->value : 0, finding);
  return finding;
}

} // namespace codedexposure
