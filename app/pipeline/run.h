/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Plays a pipeline: for run.cpp and run_end.cpp only. */
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/buffer_watch.h"
#include "pipeline/job.h"
#include "pipeline/leaky_queue.h"
#include "pipeline/messages.h"
#include "pipeline/receivers.h"
#include "pipeline/recording_branch.h"
#include "pipeline/status.h"

namespace codedexposure::app
{

using Clock = std::chrono::steady_clock;

/** One run of a pipeline. All callbacks are on the thread of play (). */
class Run
{
public:
  explicit Run (Job &job);
  ~Run ();
  Run (const Run &) = delete;
  Run &operator= (const Run &) = delete;

  RunResult play ();

private:
  void prepare ();
  void watch_window ();
  bool claim_outputs ();
  /** False: the outputs could not be claimed, and nothing ran. */
  bool run_loop ();
  void begin ();
  void on_signal (int times);
  void on_message (GstMessage *message);
  void on_error (GstMessage *message);
  void on_element_message (const GstStructure *structure, GstMessage *message);
  void warn (const std::string &text);
  bool try_to_connect_again (std::string_view kind, const GError *error);
  bool is_closed_window (GstObject *source, const GError *error) const;
  void start_playing ();
  bool set_playing ();
  void end_when_received (Exit exit);
  void wait_for_receivers ();
  void end_after_error (GstObject *failed);
  void end (Exit exit);
  GstElement *pipeline () const { return job_.graph.pipeline (); }
  void stop () { gst_element_set_state (pipeline (), GST_STATE_NULL); }
  void tick ();
  void watch_for_silence (gint64 frames);
  RunResult finish ();
  void say_no_frame ();
  bool publish ();
  void print_result (const std::string &flaws, const std::string &wrote);
  void print_json (Exit exit, const std::string &flaws) const;
  void print_counters ();
  std::string flaws () const;
  gint64 frames () const { return counter_ ? counter_->frames ().load () : 0; }

  Job &job_;
  GMainLoop *loop_;
  Status status_;
  std::unique_ptr<FrameCounter> counter_;
  /** Position of the first frame of a new recording, ns. */
  std::atomic<GstClockTime> origin_ = 0;
  std::vector<std::unique_ptr<LeakyQueue>> leaky_queues_;
  std::vector<BufferWatch> buffer_watches_;
  std::unique_ptr<Receivers> receivers_;
  std::unique_ptr<RecordingBranch> recording_; // beside a window
  Exit exit_ = Exit::done;
  Clock::time_point began_ = Clock::now ();
  Clock::time_point heard_ = Clock::now (); // the last new frame
  Clock::time_point retry_until_ = Clock::now ();
  gint64 frames_before_ = -1; // at the last tick
  double cpu_at_start_ = 0;
  bool playing_ = false;
  bool waiting_ = false;   // for a receiver, or to try to connect again
  bool ending_ = false;    // the stream has ended
  bool silent_ = false;    // no frame came for a while, and that was said
  bool uploading_ = false; // masks are sent to the DMD
  bool interrupted_ = false;
  bool failed_ = false;        // the stream ends because of an error
  bool window_failed_ = false; // to do what was asked of it
  struct {
    std::string element, text;
  } error_; // the first
  std::string flaws_before_error_;
  guint patience_ = 0; // source that then ends it without its end; 0: none
  bool damaged_;       // frames are missing or damaged
  bool container_damaged_ = false;
  guint64 not_coded_ = 0, lost_ = 0; // coded frames
  guint64 missing_ = 0;              // in the recording, as far as it was read
  std::string noticed_;              // the last notice
  std::vector<std::string> wrote_;   // by the window
};

} // namespace codedexposure::app
