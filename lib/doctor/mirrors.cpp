/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Check "mirrors": off-state leakage, switching, orientation, stuck mirrors. */
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "base/statistics.h"
#include "base/try.h"
#include "doctor/defects.h"
#include "doctor/off_light.h"
#include "doctor/stack.h"
#include "doctor/switching.h"
#include "doctor/view.h"

namespace codedexposure
{

namespace
{

constexpr int kFrames = 16;
constexpr int kOffFrames = 24;             // of each exposure time
constexpr int kLooks = 4;                  // at mirrors that go off, at most
constexpr Nanoseconds kShortest = 110'000; // of a slot
constexpr double kFull = 0.002; // part of the values that may be the largest
constexpr double kLightError = 0.0001; // of the light that leaks, relative
/* Stuck mirrors, of those seen. */
constexpr double kStuckFail = 1e-3;

class MirrorRun
{
public:
  explicit MirrorRun (Examination &examination) : examination_ (examination) {}

  Result<Finding> run ()
  {
    RETURN_IF_ERROR (see_light ());
    const auto view = look_where (
        examination_, off_.mean, on_.mean, defects_.good.view (), exposed_);
    if (view) {
      view_ = *view;
      const double mirror = view_.pixels_per_mirror ();
      defects_ = find_defects (off_.mean, on_.mean,
          examination_.rig.parts ().largest (), mirror * mirror);
      diagnose_orientation ();
    } else if (view.error ().code != ErrorCode::invalid_argument) {
      return view.error ();
    } else {
      finding_.blame ("no-picture", view.error ().message);
      return std::move (finding_);
    }
    diagnose_stuck ("off", defects_.stuck_off);
    diagnose_stuck ("on", defects_.stuck_on);
    RETURN_IF_ERROR (measure_leak ());
    RETURN_IF_ERROR (see_switching ());
    RETURN_IF_ERROR (see_black ());
    finding_.sort ();
    if (examination_.exhibits) {
      const int largest = examination_.rig.parts ().largest ();
      finding_.exhibits.push_back (
          {"All mirrors on", picture_of (on_.mean, 0.0, largest)});
      const double dark = value_or (examination_.profile.black_level, 0.0);
      finding_.exhibits.push_back (
          {"All mirrors off, 20 times as bright; black: no light",
              picture_of (off_.mean, dark, dark + 0.05 * largest)});
    }
    return std::move (finding_);
  }

private:
  Result<void> see_light ()
  {
    ASSIGN_OR_RETURN (
        off_, look_at_light (examination_, no_light (), 1, kFrames));
    const int largest = examination_.rig.parts ().largest ();
    const Examination::Lit &inside = examination_.inside;
    const double period = double (examination_.rig.parts ().rate.period ());
    const double exposure = value_or (examination_.profile.exposure, period);
    ASSIGN_OR_RETURN (
        on_, look_at_light (examination_, lit (0, 1), 1, kFrames, &off_.mean));
    defects_ = find_defects (off_.mean, on_.mean, largest);
    for (int slots = inside.slots; slots > 0; slots /= 2) {
      if (means_of (on_, defects_.good.view ()).full < kFull)
        break;
      ASSIGN_OR_RETURN (
          on_, look_at_light (examination_, lit (inside.first, slots),
                   inside.of, kFrames, &off_.mean));
      exposed_ = slots * period / inside.of / exposure;
      defects_ = find_defects (off_.mean, on_.mean, largest);
    }
    return {};
  }

  Result<void> measure_leak ()
  {
    const StackMeans off = means_of (off_, defects_.good.view ());
    const StackMeans on = means_of (on_, defects_.good.view ());
    const Examination::Lit fine = fine_slots (examination_, kShortest);
    const double light = std::max (1e-3, on.mean - off.mean);
    const double slot = light / exposed_ / fine.of;
    /* Without a gain, a small part of the range must do as a pedestal. */
    const double gain = value_or (examination_.profile.conversion_gain,
        0.3 * examination_.rig.parts ().largest ());
    const int pedestal =
        pedestal_for (fine, slot, gain, off.variance > 0.3 ? 1.0 : 0.0);
    ASSIGN_OR_RETURN (const OffLight found,
        measure_off_light (examination_, kOffFrames, fine, pedestal,
            defects_.good.view (), off_.mean,
            light_parts (off_.mean, on_.mean, defects_.good.view ()),
            pedestal * slot));
    /* Light with the mirrors on for all of the exposure. */
    const double whole = light / exposed_ + found.light.value;
    const Measured leak = {found.light.value / whole,
        std::hypot (found.light.sigma, kLightError * found.light.value) /
            whole};
    examination_.profile.leak = {std::clamp (leak.value, 0.0, 0.5), leak.sigma};
    finding_.measure ("off-state leakage", scaled (leak, 100.0));
    const double least = std::max (1e-6, leak.value);
    finding_.readings.push_back (
        {"contrast ratio", {1.0 / least, leak.sigma / (least * least)}, ": 1"});
    return {};
  }

  void diagnose_orientation ()
  {
    const ViewOrientation is = view_.orientation ();
    const std::string flipped =
        std::string (is.flipped_x ? "flipped in x, " : "") +
        (is.flipped_y ? "flipped in y, " : "");
    finding_.notes.push_back ({"orientation",
        flipped + (is.turned == 0 ? "upright"
                                  : "turned by " + std::to_string (is.turned) +
                                        " degrees")});
    if (is.turned != 0)
      finding_.blame ("turned",
          "the camera is turned against the mirrors by " +
              std::to_string (is.turned) + " degrees",
          Verdict::fail,
          is.turned == 180
              ? "set ReverseX=true and ReverseY=true of the camera, or turn it"
              : "turn the camera by 90 degrees");
    for (const auto &[mirrored, id, side, feature] :
        {std::tuple{is.flipped_x, "flipped-x", "left to right", "ReverseX"},
            std::tuple{is.flipped_y, "flipped-y", "top to bottom", "ReverseY"}})
      if (mirrored)
        finding_.blame (id, std::string ("the picture is mirrored, ") + side,
            Verdict::fail,
            std::string ("change ") + feature +
                " of the camera, or count the mirrors of the light path: an "
                "odd "
                "number flips the picture");
  }

  void diagnose_stuck (
      const std::string &what, const std::vector<DefectSpot> &spots)
  {
    const double mirror = view_.pixels_per_mirror ();
    double light = 0.0;
    std::vector<Position> places;
    for (const DefectSpot &spot : spots) {
      light += std::max (1.0, std::round (spot.light / (mirror * mirror)));
      places.push_back (view_.mirror_at (spot.centre));
    }
    const std::string name = "mirrors that are stuck " + what;
    finding_.readings.push_back ({name, {light, 0.0}, "", "0"});
    if (spots.empty ())
      return;
    finding_.notes.push_back ({name + ", about", places_text (places)});
    const double seen =
        std::abs (view_.area ()) * off_.mean.width () * off_.mean.height ();
    finding_.blame ("stuck-" + what,
        fixed (light, 0) + " of the mirrors that the camera sees are stuck " +
            what,
        light > kStuckFail * seen ? Verdict::fail : Verdict::warn);
  }

  Result<void> see_switching ()
  {
    std::vector<SwitchPoint> points;
    Result<Measured> time = kNotMeasured;
    /* What is not clear is looked at again: light that flickers in step with
     * the frames has another phase then. */
    for (int look = 0; look < kLooks; look++) {
      time = measure_switching (
          examination_, off_.mean, defects_.good.view (), points);
      if (!time || verdict_of ("switching time", scaled (*time, 1e6)) !=
                       Verdict::unknown)
        break;
    }
    if (!time && time.error ().code == ErrorCode::unsupported) {
      finding_.notes.push_back ({"switching", time.error ().message});
      return {};
    }
    if (!time)
      return time.error ();
    Plot plot{"Mirrors that go off", "time, ms", "mean, DN"};
    for (const SwitchPoint &point : points)
      plot.points.push_back ({1e3 * point.time, point.light});
    finding_.plots.push_back (std::move (plot));
    finding_.measure ("switching time", scaled (*time, 1e6));
    diagnose_early (*time);
    return {};
  }

  /* With light on half of the mirrors, pixels of the other half get no less
   * than in the dark, unless the camera moves its black level. */
  Result<void> see_black ()
  {
    constexpr double kFewPixels = 500;
    constexpr double kRounding = 0.3; // rms, DN
    const int middle = examination_.rig.parts ().dmd.shown ().width / 2;
    const StillMask half = {.name = "half of the mirrors",
        .on = [middle] (int x, int) { return x < middle; }};
    ASSIGN_OR_RETURN (
        const Stack seen, look_at_light (examination_, half, 1, kFrames));
    double below = 0.0, variance = 0.0, count = 0.0, light = 1.0;
    each_pixel (seen.mean, [&] (int x, int y) {
      const double full =
          double (on_.mean.at (x, y) - off_.mean.at (x, y)) / exposed_;
      const double more = double (seen.mean.at (x, y) - off_.mean.at (x, y));
      light = std::max (light, full);
      if (defects_.good.at (x, y) == 0 || more > 0.02 * full)
        return;
      below -= more;
      variance += double (seen.variance.at (x, y)) / seen.frames +
                  double (off_.variance.at (x, y)) / off_.frames;
      count++;
    });
    Measured fall = kNotMeasured;
    if (count >= kFewPixels)
      fall = scaled (
          {below / count, std::sqrt (variance) / count + 0.1 * kRounding},
          100.0 / light);
    finding_.measure ("fall of the black level", fall);
    return {};
  }

  /* Mirrors that take @p switching, s, make the exposure look early by half of
   * that. */
  void diagnose_early (const Measured &switching)
  {
    constexpr double kEarly = 100e-6; // s
    const auto &delay = examination_.profile.trigger_delay;
    if (!delay)
      return;
    const double early = -1e-9 * delay->value - 0.5 * switching.value;
    if (early >
        kEarly + 2.0 * std::hypot (1e-9 * delay->sigma, switching.sigma))
      finding_.blame ("trigger-edge", "the exposure begins " +
                                          fixed (1e6 * early, 0) +
                                          " us before the trigger, as it does "
                                          "with the end of a pulse in the "
                                          "period before");
  }

  Examination &examination_;
  Finding finding_ = {"mirrors",
      "all mirrors off and on, ramps in x and y, and mirrors that go off while "
      "the camera exposes"};
  Stack off_, on_;
  double exposed_ = 1.0; // part of the exposure in which on_ has light
  Defects defects_;
  CoarseView view_;
};

} // namespace

Result<Finding>
check_mirrors (Examination &examination)
{
  return or_no_frames (MirrorRun (examination).run (), "mirrors");
}

} // namespace codedexposure
