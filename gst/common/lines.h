/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A text file that an element writes, one line a frame. */
#pragma once

#include <string>

#include <gst/gst.h>

namespace codedexposure::gst
{

/**
 * Lines are not buffered: a crash loses one line at most. Failures are posted
 * as errors of the element.
 */
class LineFile
{
public:
  LineFile () = default;
  ~LineFile () { close (); }
  LineFile (const LineFile &) = delete;
  LineFile &operator= (const LineFile &) = delete;

  /** Creates or overwrites the file @p location of @p element. */
  bool open (gpointer element, const std::string &location);
  bool is_open () const { return file_ >= 0; }
  /** @p line: without a line end. */
  bool write (const std::string &line);
  void close ();

private:
  GstElement *element_ = nullptr;
  std::string location_;
  int file_ = -1;
};

} // namespace codedexposure::gst
