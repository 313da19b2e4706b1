/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The files that a command writes, and those that it reads: an input is never
 * an output. */
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "base/part.h"
#include "common/raii.h"

namespace codedexposure::app
{

/** What an output is, and where its frames are counted. */
struct FileKind {
  GstPad *frames = nullptr; ///< each buffer is a frame
  bool sidecar = false;     ///< only describes the frames of other outputs
  bool recording = false;   ///< of coded frames, and may replace another one
  /** It is a folder to which nothing else is written; a file of this name in it
   * shows that it is of this kind, and may be replaced. */
  const char *folder_with = nullptr;
};

/** A file, or pictures, of one element. */
class Output
{
public:
  Output (std::string name, const FileKind &of_kind)
      : kind (of_kind), name_ (std::move (name))
  {
  }
  virtual ~Output () = default;

  const FileKind kind;

  /** Error: the name cannot be one of an output, or what has it may not be
   * replaced. */
  virtual Result<void> check_name (bool replace) = 0;
  /** After that, and before the element opens anything: lets the element write
   * beside the name. */
  virtual Result<void> claim (bool replace) = 0;
  /** Gives the element the name itself, for a pipeline that is printed. */
  virtual void name_element () = 0;
  /** After the element stopped. Error: the file could not be finished. */
  virtual Result<void> finished () const { return {}; }
  /** After that: gives the frames their name. */
  virtual Result<void> publish () = 0;
  /** After an error: frames that came may not be in the file. */
  virtual void recount () {}
  /** Removes what was written. */
  void discard () { part_->discard (); }
  /** Whether there are frames to publish. */
  virtual bool has_content () const = 0;

  const std::string &name () const { return name_; }
  /** Where it is written until it is published. */
  const std::string &part () const { return part_->path (); }
  guint64 frames () const { return frames_; }
  /** The name of part (), also before claim (). */
  virtual std::string unfinished () const { return name_ + ".part"; }
  /** A file that it also writes; empty: none. */
  virtual std::string table () const { return {}; }
  /** What a shell has to do before the element can write the name itself. */
  virtual std::string preparation () const { return {}; }

protected:
  std::string name_;
  std::unique_ptr<Part> part_; // not null after claim ()
  bool replace_ = false;
  /** Frames that the element got. */
  std::atomic<guint64> frames_ = 0;
};

/** The files of a command. */
class Outputs
{
public:
  Outputs ();
  ~Outputs ();

  /** A file that is read, but by no element of the pipeline. */
  void reads (const std::string &path) { inputs_.push_back (path); }

  /** @p element writes the file @p name, which it gets in its property @p
   * property. A pipe, or a name such as /dev/null, is written directly. */
  void file (GstElement *element, const char *property, const std::string &name,
      const FileKind &kind);
  /** @p sink, a multifilesink, writes numbered pictures of coded frames that
   * pass @p coded; @p format: "folder/%06d.png". */
  void pictures (GstElement *sink, GstPad *coded, const std::string &format);

  /** Error if one of them is an input of @p pipeline or a recording, if two
   * have the same name, or if one lies in another. */
  Result<void> check (GstElement *pipeline) const;
  /** Claims all of them. Errors: why they cannot be written, one for each;
   * nothing is left. */
  std::vector<std::string> claim (bool replace);
  bool empty () const { return outputs_.empty (); }
  /** A pipe that nobody reads; empty: none, and those that are read stay open
   * until this ends. */
  std::string unread_pipe ();

  /** For a pipeline that is printed and not played: elements write the names
   * themselves. Returns what a shell does before: "mkdir -p ... && ". Throws
   * Failure if a name may not be written. */
  std::string name_elements (bool replace);

  enum class Finish {
    publish, ///< those with frames get their names; the others go
    keep,    ///< those with frames stay beside their names, as .part
    discard,
  };
  /** After the pipeline has stopped, because it has @p failed or not. Errors:
   * what could not be published. */
  std::vector<std::string> finish (Finish how, bool failed = false);
  /** After finish (): "coded.mkv and fast.mkv (100 frames)", the outputs that
   * are there; with their frames if they are not @p usual. Empty: none. */
  std::string summary (std::optional<guint64> usual) const;
  /** The output that was added last has pictures, unless another one has. */
  void last_has_pictures ()
  {
    if (!pictures_)
      pictures_ = outputs_.back ().get ();
  }
  /** After finish (): the pictures that are there. */
  guint64 pictures () const
  {
    return std::ranges::count (kept_, pictures_) > 0 ? pictures_->frames () : 0;
  }
  /** After finish (): the names of the outputs that are there. */
  std::vector<std::string> names () const;

private:
  std::vector<std::string> inputs_;
  std::vector<std::unique_ptr<Output>> outputs_;
  std::vector<std::pair<std::string, int>> pipes_; // -1: nobody reads it yet
  std::vector<const Output *> kept_;
  const Output *pictures_ = nullptr;
  bool published_ = false;
};

/** Error if @p output is one of @p inputs, or lies in a folder that is one, by
 * inode: it would be replaced by itself. */
Result<void> check_is_no_input (
    const std::string &output, const std::vector<std::string> &inputs);
/** Error if @p output has the coded frames of an earlier run. */
Result<void> check_is_no_recording (const std::string &output);

} // namespace codedexposure::app
