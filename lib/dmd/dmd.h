/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The interface of all digital micromirror devices. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "dmd/pattern_timing.h"
#include "schedule/mirror_array.h"
#include "schedule/schedule.h"
#include "schedule/still_mask.h"

namespace codedexposure
{

/** The properties and limits of a device. */
struct DmdInfo {
  std::string name;               ///< such as "sim:bench"
  Extent size = {};               ///< mirrors: columns by rows
  Nanoseconds minimum_active = 0; ///< min time of a mask
  Nanoseconds minimum_switching = 0;
  int resident_masks = 0;       ///< masks the device holds at once
  int most_slots = 0;           ///< of an exposure; 0: as many as it has masks
  bool still_masks = false;     ///< show () is served
  bool triggers_camera = false; ///< no frame is exposed while it is parked
  bool trigger_in = false;      ///< a camera can start its masks
  bool trigger_out = false;     ///< it can start a camera's exposures
  /** How its controller times masks; none: it shows any slots. */
  std::optional<PatternRule> patterns = {};
  Array array = Array::orthogonal;
  /** Size of the region that shows masks; {}: all mirrors. */
  Extent region = {};

  std::string serial = {}; ///< empty: not known

  Extent shown () const { return region == Extent () ? size : region; }
};

/** The state that a device reports. */
struct DmdStatus {
  bool running = false;
  /** Names and values for people, such as firmware and errors. */
  std::vector<std::pair<std::string, std::string>> details = {};
};

/** Called during upload with the sent and the total units, each of about the
 * same time: first with 0, last with the total. */
using UploadProgress = std::function<void (int sent, int total)>;

/**
 * A device that repeats the masks of a schedule, one slot each.
 *
 * An object is an open device; then upload () -> start () -> stop (), again
 * from upload () or start (). The destructor parks the mirrors. Calls come from
 * one thread at a time and may wait for hardware; DmdRunner makes them from a
 * thread of its own.
 */
class Dmd
{
public:
  virtual ~Dmd () = default;

  virtual const DmdInfo &info () const = 0;
  /** Asks the device. */
  virtual Result<DmdStatus> status () { return DmdStatus{running ()}; }
  /** Min time of upload (), given the masks that the device holds. A request to
   * @p stop ends the calculation, with too short a time. */
  virtual Nanoseconds upload_time (const Schedule &, std::stop_token = {})
  {
    return 0;
  }
  /**
   * Renders and sends every mask of the schedule that the device does not hold;
   * the mirrors are parked. Masks do not depend on the frame rate.
   *
   * @p stop  a request ends the upload within 100 ms, with an error.
   */
  virtual Result<void> upload (const Schedule &schedule, std::stop_token stop,
      const UploadProgress &progress) = 0;
  /**
   * Shows each mask for its slot of @p plan, with mask 0 at the start of an
   * exposure. After a stop (), at least one whole exposure passes with the
   * mirrors parked (or without a trigger, if the device triggers the camera),
   * so that frames show where the masks started again.
   *
   * @p stop  a request ends the start within 100 ms, with an error.
   */
  virtual Result<void> start (
      const SlotPlan &plan, std::stop_token stop = {}) = 0;
  /**
   * Sends one mask and shows it in its slots of every exposure, with the
   * trigger of a schedule; like start (), after one whole exposure with the
   * mirrors parked. The masks of the schedule are lost: another show (), or
   * upload () and start () follow.
   *
   * @p plan  of the schedule that it replaces. @p stop as in upload ().
   */
  virtual Result<void> show (
      const StillMask &mask, const SlotPlan &plan, std::stop_token stop);
  /** Parks the mirrors, all off. */
  virtual void stop () = 0;
  /** Whether it may show masks: a device that did not acknowledge the stop
   * still does. */
  virtual bool running () const = 0;
};

/** Opens a device by name, "SCHEME:...". Fails for an unknown scheme, with the
 * list of the known ones. */
Result<std::unique_ptr<Dmd>> open_dmd (std::string_view device);

/** How devices are opened whose names begin with prefix. */
struct DmdScheme {
  const char *prefix; ///< "usb:"
  const char *usage;  ///< for people
  Result<std::unique_ptr<Dmd>> (*open) (std::string_view device);
};

/** Whether the device can hold the masks of @p schedule. */
Result<void> check_masks (const DmdInfo &info, const Schedule &schedule);
/** Whether a device of that kind can show @p schedule in the slots of @p plan;
 * the error names the limit and the value. */
Result<void> check_limits (
    const DmdInfo &info, const Schedule &schedule, const SlotPlan &plan);

} // namespace codedexposure
