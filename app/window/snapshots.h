/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pictures of a window that become files. */
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "window/detail.h"
#include "window/paint.h"

namespace codedexposure::app
{

struct Snapshot {
  Surface window;
  /** Of the files, without their ending; if there are such files, a number is
   * added. */
  std::string name;
  /** Of the panes, by what they show. */
  std::vector<std::pair<std::string, std::shared_ptr<const FullPicture>>>
      pictures;
};

/** Drawn on one thread, and written by the main thread to PNG files of the
 * current folder. */
class Snapshots
{
public:
  using Wrote = std::function<void (const std::vector<std::string> &files)>;
  using Failed = std::function<void (const std::string &why)>;

  Snapshots () = default;
  ~Snapshots ();
  Snapshots (const Snapshots &) = delete;
  Snapshots &operator= (const Snapshots &) = delete;

  /** The names of the files, that of the window last, go to @p wrote; why they
   * were not written, to @p failed. */
  void begin (Wrote wrote, Failed failed)
  {
    wrote_ = std::move (wrote);
    failed_ = std::move (failed);
  }
  void take (Snapshot snapshot);
  /** Writes those that were not yet written. */
  void write ();

private:
  Wrote wrote_; ///< constant while the pipeline plays, as the next
  Failed failed_;
  std::mutex mutex_;
  std::deque<Snapshot> taken_; ///< of the mutex
};

} // namespace codedexposure::app
