/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A file of pictures for programs of the lab. docs/formats.md, "Stacks". */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gst/gst.h>

#include "schedule/timing.h"

namespace codedexposure::gst
{

/** What all pictures of a file have in common. */
struct StackFormat {
  int width = 0, height = 0;
  int bytes = 1;           ///< of a pixel
  int bits = 8;            ///< significant bits of a pixel
  FrameRate rate = {0, 1}; ///< of pictures; 0/1: unknown
  bool deflate = false;    ///< compressed without loss
  bool big = false;        ///< BigTIFF
};

/** What is known of one picture. Times are on the time axis of the recording;
 * GST_CLOCK_TIME_NONE: unknown. */
struct StackRow {
  std::optional<guint64> frame; ///< number of its coded frame
  int slot = -1;                ///< -1: a coded frame
  GstClockTime pts = GST_CLOCK_TIME_NONE;
  GstClockTime duration = GST_CLOCK_TIME_NONE;
  GstClockTime exposure = GST_CLOCK_TIME_NONE; ///< how long it was exposed
  std::optional<bool> synchronised;            ///< none: unknown
  bool corrupted = false;
  guint64 lost_before = 0; ///< coded frames
};

/** JSON that says of what the pictures were made, from one picture on. */
struct StackOrigin {
  guint64 picture = 0;
  std::string json;
};

/** The status of a file with all pictures until the stream broke off. */
inline constexpr const char *kBrokenOff =
    "unfinished: the stream stopped before its end";

/** A file that is being written. Functions throw Error; after that, only the
 * destructor may be called. A file without finish () says that it is
 * unfinished. */
class StackFile
{
public:
  virtual ~StackFile () = default;
  /** The next pictures, as @p json describes. */
  virtual void add_origin (const std::string &json) = 0;
  /** @p stride  bytes from a row to the next. */
  virtual void add (
      const StackRow &row, const guint8 *pixels, gsize stride) = 0;
  /** @p whole: the stream has ended. If not, the file says so. */
  virtual void finish (bool whole) = 0;
};

/** What opens such a file, or folder. Throws Error. */
std::unique_ptr<StackFile> open_ome_tiff (
    const std::string &path, const StackFormat &format);
std::unique_ptr<StackFile> open_hdf5 (
    const std::string &path, const StackFormat &format);
std::unique_ptr<StackFile> open_ome_zarr (
    const std::string &path, const StackFormat &format);

} // namespace codedexposure::gst
