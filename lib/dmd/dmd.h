/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What every digital micromirror device can do for a coded exposure. */
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "schedule/mirror_array.h"
#include "schedule/schedule.h"
#include "schedule/still_mask.h"

namespace codedexposure
{

/** What a device can do, in its own numbers. */
struct DmdInfo {
  std::string name;               ///< as the user wrote it, "sim:bench"
  Extent size = {};               ///< mirrors: columns by rows
  Nanoseconds minimum_active = 0; ///< shortest time a mask can be shown
  Nanoseconds minimum_switching = 0;
  int resident_masks = 0;       ///< masks the device holds at once
  bool still_masks = false;     ///< show () is served
  bool triggers_camera = false; ///< no frame is exposed while it is parked
  bool trigger_in = false;      ///< a camera can start its masks
  bool trigger_out = false;     ///< it can start a camera's exposures
  /** Shortest dark time between two masks, where there is any. */
  Nanoseconds minimum_dark = 0;
  Array array = Array::orthogonal;
  /** Mirrors that show masks, from the first that do; {}: all. */
  Extent region = {};

  Extent shown () const { return region == Extent () ? size : region; }
};

/** What a device says of itself now. */
struct DmdStatus {
  bool running = false;
  /** Names and values for people: firmware, errors, what its triggers do. */
  std::vector<std::pair<std::string, std::string>> details = {};
};

/** Called during upload with what is sent and what there is to send, in units
 * of about equal time: first with 0, last with all of it. */
using UploadProgress = std::function<void (int sent, int total)>;

/**
 * A device that shows the masks of a schedule, over and over, one slot each.
 *
 * Life: open (a Dmd is open) -> upload () -> start () -> stop (), again from
 * upload () or start (). The destructor parks the mirrors. Calls come from one
 * thread at a time and may block on hardware; DmdRunner keeps them off the
 * threads that must not.
 */
class Dmd
{
public:
  virtual ~Dmd () = default;

  virtual const DmdInfo &info () const = 0;
  /** Asks the device. */
  virtual Result<DmdStatus> status () { return DmdStatus{running ()}; }
  /** How long upload () is going to take at least, with what the device holds
   * already. A request to @p stop ends the reckoning, with too short a time. */
  virtual Nanoseconds upload_time (const Schedule &, std::stop_token = {})
  {
    return 0;
  }
  /**
   * Renders and sends every mask of the schedule; the mirrors are parked. Masks
   * do not depend on the frame rate. Masks that the device holds already need
   * not be sent again.
   *
   * @p stop  a request ends the upload within 100 ms, with an error.
   */
  virtual Result<void> upload (const Schedule &schedule, std::stop_token stop,
      const UploadProgress &progress) = 0;
  /**
   * Shows mask 0 from the start of an exposure on, each mask for its slot of
   * @p plan. After a stop () one whole exposure at least passes with the
   * mirrors parked (or, where the device triggers the camera, without a
   * trigger): whoever watches the frames sees where the masks began anew.
   *
   * @p stop  a request ends the start within 100 ms, with an error.
   */
  virtual Result<void> start (
      const SlotPlan &plan, std::stop_token stop = {}) = 0;
  /**
   * Sends one mask and shows it in the first slots of every exposure, at the
   * same trigger as a schedule's; like start (), after one whole exposure with
   * the mirrors parked. The masks of the schedule are lost: what follows is
   * another show (), or upload () and start ().
   *
   * @p plan  of the schedule in whose place it stands. @p stop as in upload ().
   */
  virtual Result<void> show (
      const StillMask &mask, const SlotPlan &plan, std::stop_token stop);
  /** Parks the mirrors, all off. */
  virtual void stop () = 0;
  /** Whether it shows masks, for all that is known: a device that did not
   * answer when it was told to stop still does. */
  virtual bool running () const = 0;
};

/**
 * Opens a device by name, "SCHEME:...". Error for a scheme that nobody serves,
 * naming those that there are.
 */
Result<std::unique_ptr<Dmd>> open_dmd (std::string_view device);

/** How devices are opened whose names begin with @p prefix. */
struct DmdScheme {
  std::string prefix; ///< "usb:"
  std::string usage;  ///< for people
  Result<std::unique_ptr<Dmd>> (*open) (std::string_view device);
};
/** From now on, open_dmd () serves that scheme as well. Thread-safe. */
void add_dmd_scheme (const DmdScheme &scheme);

/** Whether a device of that kind can show @p schedule in the slots of @p plan;
 * the error tells the numbers on both sides. */
Result<void> check_limits (
    const DmdInfo &info, const Schedule &schedule, const SlotPlan &plan);

} // namespace codedexposure
