/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Pictures of a window that become files. */
#pragma once

#include <deque>
#include <functional>
#include <mutex>
#include <string>

#include "base/result.h"
#include "window/paint.h"

namespace codedexposure::app
{

/** Drawn on one thread, and written by the main thread to PNG files of the
 * current folder. */
class Snapshots
{
public:
  using Said = std::function<void (const std::string &text, bool failed)>;

  Snapshots () = default;
  ~Snapshots ();
  Snapshots (const Snapshots &) = delete;
  Snapshots &operator= (const Snapshots &) = delete;

  /** The name of each file, or why it was not written, goes to @p said. */
  void begin (Said said) { said_ = std::move (said); }
  /** @p name  of the file, without its ending; if there is such a file, a
   * number is added. */
  void take (Surface picture, const std::string &name);
  /** Writes those that were not yet written. */
  void write ();

private:
  struct Snapshot {
    Surface picture;
    std::string name;
  };
  static Result<std::string> save (const Snapshot &snapshot);

  Said said_; ///< constant while the pipeline plays
  std::mutex mutex_;
  std::deque<Snapshot> taken_; ///< of the mutex
};

} // namespace codedexposure::app
