/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The last seconds of coded frames, for a recording of what has just happened.
 */
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/result.h"
#include "common/raii.h"
#include "pipeline/job.h"
#include "stats/event_watch.h"

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

  /** What is kept without a key. */
  struct Rule {
    std::optional<EventRule> event = {};
    double after = 5; ///< s, for which frames still come after an event
    int bits = 0;     ///< significant, of a pixel; 0: as frames say
  };

  /** At @p pad, before the pipeline plays. Names of recordings begin with @p
   * name. */
  Keeper (GstPad *pad, std::string name, const Rule &rule);
  /** Waits for what is being written. */
  ~Keeper ();
  Keeper (const Keeper &) = delete;
  Keeper &operator= (const Keeper &) = delete;

  /** What was written, or why not, and events go to @p calls, on the main
   * thread. */
  void begin (Viewer::Calls calls) { calls_ = std::move (calls); }
  /** Writes what there is now as a recording in the current folder, from a
   * thread of its own. It is named by its first frame, and as no other file. An
   * error is said, as while the last one is still being written. */
  void keep ();
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
    bool failed = false, event = false;
  };

  static GstPadProbeReturn on_data (
      GstPad *, GstPadProbeInfo *info, gpointer self);
  void take (GstBuffer *frame);
  void watch (GstBuffer *frame);
  void follow (GstEvent *event);
  Result<void> begin_writing ();
  void run (Frames frames);
  void add (News news);
  void tell ();
  void on_event (const std::string &text);
  void wait (guint ms);
  void on_time ();

  const std::string name_;
  const guint after_; // ms
  const int bits_;
  const std::uint64_t most_bytes_;
  /* The thread of the stream: */
  std::optional<EventWatch> events_;
  std::optional<GstVideoInfo> info_;
  std::optional<std::uint64_t> last_; // number of a frame
  mutable std::mutex mutex_;
  /* Of the mutex: */
  Frames frames_;
  bool is_busy_ = false;
  std::deque<News> news_;

  Viewer::Calls calls_; ///< constant while the pipeline plays
  /* The main thread: */
  guint waiting_ = 0;        ///< source; an event is to be kept
  bool has_another_ = false; ///< event, while that one waits
  std::thread writer_;
};

} // namespace codedexposure::app
