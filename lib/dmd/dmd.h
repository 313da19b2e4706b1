/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What every digital micromirror device can do for a coded exposure. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"
#include "schedule/schedule.h"

namespace cexp
{

/** What a device can do, in its own numbers. */
struct DmdInfo {
  std::string name;               ///< as the user wrote it, "sim:bench"
  Extent size;                    ///< mirrors: columns by rows
  Nanoseconds minimum_active = 0; ///< shortest time a mask can be shown
  Nanoseconds minimum_switching = 0;
  int resident_masks = 0;      ///< masks the device holds at once
  bool run_time_upload = true; ///< masks can be sent while it is open
};

/** Called during upload with masks sent and masks in all; false cancels. */
using UploadProgress = std::function<bool (int sent, int total)>;

/**
 * A device that shows the masks of a schedule, over and over, one slot each.
 *
 * Life: open (a Dmd is open) -> upload () -> start () -> stop (), again from
 * upload () or start (). The destructor stops. Calls come from one thread at a
 * time and may block on hardware; never call them on a streaming thread.
 */
class Dmd
{
public:
  virtual ~Dmd () = default;

  virtual const DmdInfo &info () const = 0;
  /** Renders and sends every mask of the schedule. Error when the device cannot
   * hold or show them; slots are checked against the device's limits. */
  virtual Result<void> upload (const Schedule &schedule, FrameRate rate,
      const UploadProgress &progress = {}) = 0;
  /** Shows mask 0 at the start of the next exposure, and goes on. */
  virtual Result<void> start () = 0;
  /** Parks the mirrors, all off. */
  virtual void stop () = 0;
  virtual bool running () const = 0;
};

/** Opens "sim:NAME". Error for a scheme that nobody serves, naming those that
 * there are. */
Result<std::unique_ptr<Dmd>> open_dmd (std::string_view device);

} // namespace cexp
