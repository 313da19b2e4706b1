/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The last seconds of coded frames, for a recording of what has just happened.
 */
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/result.h"
#include "common/raii.h"

namespace codedexposure::app
{

/**
 * Keeps references to the last coded frames at a pad, and writes them as a
 * recording when something has happened that is worth it, as high-speed cameras
 * do. The stream does not wait for it.
 *
 * Frames of one format and setup are kept; with others, it begins anew.
 */
class Keeper
{
public:
  static constexpr GstClockTime kLength = 10 * GST_SECOND;

  using Said = std::function<void (const std::string &text, bool failed)>;

  /** At @p pad, before the pipeline plays. */
  explicit Keeper (GstPad *pad);
  /** Waits for what is being written. */
  ~Keeper ();
  Keeper (const Keeper &) = delete;
  Keeper &operator= (const Keeper &) = delete;

  /** What was written, or why not, goes to @p said, on the main thread. */
  void begin (Said said) { said_ = std::move (said); }
  /** Writes what there is now as a recording in the current folder, from a
   * thread of its own. Its name begins with @p begin and the number of the
   * first frame, and is that of no other file. An error while the last one is
   * still being written. */
  Result<void> keep (const std::string &begin);
  /** Waits for what is being written, and says it. */
  void finish ();

private:
  struct Frames {
    gst::CapsPtr caps;
    gst::EventPtr tag; ///< of the setup; null: there was none
    std::deque<gst::BufferPtr> buffers;
    std::uint64_t bytes = 0;

    GstClockTime length () const;
  };

  struct News {
    std::string text;
    bool failed = false;
  };

  static GstPadProbeReturn on_data (
      GstPad *, GstPadProbeInfo *info, gpointer self);
  void take (GstBuffer *frame);
  void follow (GstEvent *event);
  void run (const std::string &begin, Frames frames);
  void tell ();

  const std::uint64_t most_bytes_;
  mutable std::mutex mutex_;
  /* Of the mutex: */
  Frames frames_;
  bool is_busy_ = false;
  std::optional<News> news_;

  Said said_; ///< constant while the pipeline plays
  std::thread writer_;
};

} // namespace codedexposure::app
