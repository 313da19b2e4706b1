/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What a Matroska file does not hold of decoded pictures: times in ns, flags,
 * metas, caps and tags. They are written to a file beside the video, and put
 * back when the video is read, so that the pictures become any other output.
 *
 * Lines of the file, in their order:
 *   caps CAPS
 *   segment START TIME, ns; TIME is that of the stream at START
 *   tags SCOPE TAGS
 *   picture PTS DURATION FLAGS META */
#pragma once

#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include <gst/gst.h>

#include "common/raii.h"

/** Writes the notes of all pictures that leave an element. */
class NoteWriter
{
public:
  /** @p element  outlives this. */
  NoteWriter (GstElement *element, const std::string &path);
  NoteWriter (const NoteWriter &) = delete;
  NoteWriter &operator= (const NoteWriter &) = delete;

  /** After the pipeline stopped. False: the file could not be written. */
  bool finish ();

private:
  void write_event (GstEvent *event);
  void write_picture (GstBuffer *picture);
  void write (const std::string &line);

  std::unique_ptr<std::FILE, int (*) (std::FILE *)> file_;
  bool failed_ = false;
};

/** The times of noted pictures, one after the other, without GStreamer. */
class NoteTimes
{
public:
  struct Times {
    GstClockTime pts, duration;
  };
  explicit NoteTimes (const std::string &path) : file_ (path) {}
  /** None at the end, or at a damaged line. */
  std::optional<Times> next ();

private:
  std::ifstream file_;
};

/** Whether @p read is the time @p noted after Matroska rounded it. */
bool is_rounded (GstClockTime read, GstClockTime noted);

/** Puts notes onto the pictures that come to an element, one after the other.
 */
class NoteReader
{
public:
  /** @p element  outlives this. */
  NoteReader (GstElement *element, const std::string &path);
  NoteReader (const NoteReader &) = delete;
  NoteReader &operator= (const NoteReader &) = delete;

  /** After the pipeline stopped. Why the notes are not those of the pictures;
   * empty: they are. */
  std::string finish ();

private:
  GstPadProbeReturn take_event (GstPadProbeInfo *info);
  void take_picture (GstPadProbeInfo *info);
  void push_tags ();
  void push_segment ();
  void next ();

  const codedexposure::gst::ObjectPtr<GstPad> src_;
  /* Streaming thread: */
  std::ifstream file_;
  std::string kind_, rest_; // of the next line; an empty kind: none
  std::string problem_;
};
