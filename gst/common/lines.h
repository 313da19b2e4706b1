/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A file that an element writes line by line, a line a frame. */
#pragma once

#include <string>
#include <vector>

#include <gst/gst.h>

namespace codedexposure::gst
{

/**
 * Every line is handed to the system at once: a crash costs one line at most.
 * What fails is an error on the bus of the element.
 */
class LineFile
{
public:
  LineFile () = default;
  ~LineFile () { close (); }
  LineFile (const LineFile &) = delete;
  LineFile &operator= (const LineFile &) = delete;

  /** Begins the file of @p element anew, also where it exists. */
  bool open (gpointer element, const std::string &location);
  bool is_open () const { return file_ >= 0; }
  /** @p line without its end. */
  bool write (const std::string &line);
  void close ();

private:
  GstElement *element_ = nullptr;
  std::string location_;
  int file_ = -1;
};

/** Names of the flags of @p buffer that say how good it is: "discont",
 * "corrupted", "gap", "droppable". */
std::vector<const char *> flag_names (GstBuffer *buffer);

} // namespace codedexposure::gst
