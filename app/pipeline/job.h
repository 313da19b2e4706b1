/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A pipeline, what it writes, and how it is played. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "failure.h"
#include "options/common.h"
#include "pipeline/cameras.h"
#include "pipeline/frame_counter.h"
#include "pipeline/graph.h"
#include "pipeline/outputs.h"
#include "pipeline/signals.h"

namespace codedexposure::app
{

/** A window that shows a run. All calls are on the main thread. */
class Viewer
{
public:
  struct Calls {
    GstElement *pipeline = nullptr;
    std::function<void ()> end; ///< as Ctrl-C does
    /** Files were written, of which @p more is said, such as " (2.5 s)". */
    std::function<void (
        const std::vector<std::string> &files, const std::string &more)>
        wrote;
    /** Something could not be done. */
    std::function<void (const std::string &why)> failed;
    /** Something has happened. */
    std::function<void (const std::string &text)> told;
  };
  virtual ~Viewer () = default;

  /** Before the pipeline plays. */
  virtual void begin (Calls calls) = 0;
  /** Five times a second: "100 coded frames, 1 lost", and whether that is bad.
   */
  virtual void tell (const std::string &frames, bool alarm) = 0;
  /** A message of the pipeline; whether nothing else is to be done for it. */
  virtual bool take (GstMessage *) { return false; }
  /** After the pipeline has ended, in the state READY. */
  virtual void finish () = 0;
};

/** How a run ended. */
struct RunResult {
  Exit exit = Exit::failed;
  gint64 frames = 0;
  bool container_damaged = false; ///< read it again with salvage
  bool interrupted = false;
};

/** What the functions that build a pipeline say of it. */
struct Job {
  explicit Job (std::string command_name, const RunOptions &run_options)
      : command (std::move (command_name)), options (run_options)
  {
  }

  std::string command; ///< "record": prefix of every line
  RunOptions options;
  Graph graph;
  Outputs outputs;

  /** Where the frames come from, for the summary: "the simulated bench". */
  std::string source;
  /** The element that simulates the bench; null: a camera or another source. */
  GstElement *bench = nullptr;
  /** Coded frames are counted where they enter this element. */
  GstElement *counted = nullptr;
  /** Where the frames of a new recording come in: positions in messages count
   * from the first; null: they are those of what is read. */
  GstElement *recorded = nullptr;
  /** Of the coded frames; none: not known. */
  std::optional<gint64> total;
  PlayTimes times;
  /** The element of a camera, which may fall silent without an error; null:
   * the frames are those of no camera. */
  GstElement *camera = nullptr;
  /** Its exposure times with which all slots are whole, us. */
  Between exposures;
  /** Remembers the last frames; null: nothing does. */
  GstElement *keeper = nullptr;
  /** Reads a recording or a stream of one: its own end is in it. */
  GstElement *reader = nullptr;
  /** The file of the reader was finished, and is as long as it was then. */
  bool is_finished = false;
  /** Frames may be missing at its end, which the others do not show. */
  bool is_cut_short = false;
  /** The recording is read from front to back, past damage. */
  bool salvage = false;
  /** The queues before encoder and disk of live recordings. */
  std::vector<GstElement *> buffers;
  /** Write recordings of a source, and count the frames that are missing in
   * them. */
  std::vector<GstElement *> recorders;
  /** If the recording behind the only buffer fails, the rest goes on. */
  bool buffer_may_fail = false;
  /** Elements of a display behind leaky queues: what they miss was skipped, and
   * is not lost. */
  std::vector<GstElement *> hurried;
  /** A tcpserversink. */
  GstElement *server = nullptr;
  /** Frames begin when the server has a receiver. */
  bool waits_for_receiver = false;
  /** Reads from a server: for how long to try to connect, s. */
  std::optional<double> retry;
  /** Of a command that runs more than this; null: they are those of the run. */
  Signals *signals = nullptr;
  /** Ctrl-C is the usual end, and not an interruption. */
  bool ends_by_signal = false;
  /** A person moves in the frames: they are not counted, and end at once. */
  bool is_moved_in = false;
  /** Shows "100 coded frames in 0:04" as they come. */
  bool has_progress = true;
  /** Warnings that were said, which are not said again; this run adds its own.
   * Null: all are said. */
  std::set<std::string> *said = nullptr;
  /** Prints "100 coded frames of ...; wrote ...". */
  bool has_result = true;
  /** Called with each element message, on the main thread. */
  std::function<void (const GstStructure *)> on_message;
  /** That was found in the frames; empty: none. */
  std::string schedule;
  /** How the run ended, by how its frames ended it; null: as they did. */
  std::function<Exit (const RunResult &)> judge;
  /** Shows the run, which an error of its sink ends well once it is closed. */
  std::unique_ptr<Viewer> window;
};

/** Plays @p job until its end and publishes its outputs; prints progress,
 * errors and the result. With --print, it prints the pipeline and does nothing.
 */
RunResult play (Job &job);

} // namespace codedexposure::app
