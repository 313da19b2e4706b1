/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The checks of a bench, in their order. */
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/try.h"
#include "doctor/finding.h"
#include "doctor/light_fit.h"
#include "doctor/rig.h"

namespace codedexposure
{

/** What is known of the machine that records. */
struct HostFacts {
  /** Sustained rate of writing, bytes/s. */
  std::optional<Measured> disk_rate = {};
  double socket_buffer = 0; ///< largest of a socket, bytes; 0: not known
};

/** What the checks before have found, for those after them. */
struct Examination {
  Rig &rig;
  HostFacts host = {};
  /** Filled as it is measured. */
  BenchProfile profile = {};
  /** Frames after show () that may still be of the mask before. */
  int lag = 4;
  /** The slots, of how many, that lie in the exposure as a whole; measured by
   * the check of the trigger. */
  struct Lit {
    int first = 0, slots = 1, of = 1;
  };
  Lit inside = {};
  /** Of the exposure's start, s rms; measured by the check of the trigger. */
  double jitter = 0.0;
  /** How the light changes; measured by the check of the trigger. */
  std::optional<LightFit> light = {};
  /** What the bench is to record, and for how many seconds the check of the
   * whole does. */
  Schedule schedule = {};
  double recording = 60.0;
  /** Pictures of the page, or only numbers. */
  bool exhibits = true;
};

/** Shows @p mask and returns @p frames of it: those after Examination::lag.
 * Fewer if frames do not come. */
Result<std::vector<SeenFrame>> look (
    Examination &examination, const StillMask &mask, int slots, int frames);

/** Calls @p take with the frames that come from now on, of which only some are
 * in memory at a time, and returns their number; fewer if frames do not come.
 */
Result<int> watch_each (
    Rig &rig, int frames, const std::function<void (SeenFrame &)> &take);

/**
 * Exposes for @p time while @p use () does its work, and as long as possible
 * afterwards. The exposure time changes with a later frame than the mask.
 */
template <typename Use>
auto
with_exposure (Examination &examination, Nanoseconds time, Use use)
    -> decltype (use ())
{
  Rig &rig = examination.rig;
  RETURN_IF_ERROR (rig.expose (time));
  RETURN_IF_ERROR (rig.watch (examination.lag));
  auto done = use ();
  RETURN_IF_ERROR (rig.expose (std::nullopt));
  RETURN_IF_ERROR (rig.watch (examination.lag));
  return done;
}

/** A number that could not be measured. */
inline constexpr Measured kNotMeasured{
    std::numeric_limits<double>::quiet_NaN (),
    std::numeric_limits<double>::quiet_NaN ()};

/** Every mirror on in slots [first, first + count) of an exposure. */
StillMask lit (int first, int count);

/** Every mirror is off. */
StillMask no_light ();

/** A check of the bench. An Error is a part that did not obey. */
struct Check {
  std::string name;  ///< such as "trigger", for --only
  std::string title; ///< such as "Trigger and exposure"
  /** Names of checks that must not have failed. */
  std::vector<std::string> needs;
  Result<Finding> (*run) (Examination &examination);
  bool of_two = false; ///< only with a second camera
};

/** What is found where a part cannot be opened: the camera, or the DMD. */
Finding part_missing (const Error &why, bool camera);

/** All checks, in their order. */
const std::vector<Check> &all_checks ();
/** Those of the comma-separated names @p only, and what they need; empty: all.
 * Error for a name that is none. @p two: there is a second camera. */
Result<std::vector<Check>> choose_checks (std::string_view only, bool two);
/** Runs @p check unless one that it needs has failed in @p before; its finding
 * is skipped then, and where a second camera that it needs is not there. */
Result<Finding> run_check (const Check &check, Examination &examination,
    const std::vector<Finding> &before);

Result<Finding> check_parts (Examination &examination);
Result<Finding> check_trigger (Examination &examination);
Result<Finding> check_light (Examination &examination);
Result<Finding> check_sensor (Examination &examination);
Result<Finding> check_mirrors (Examination &examination);
Result<Finding> check_optics (Examination &examination);
Result<Finding> check_second (Examination &examination);
Result<Finding> check_whole (Examination &examination);

} // namespace codedexposure
