/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Numbered pictures, with a table of their times. */
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "common/meta.h"
#include "pipeline/outputs.h"

namespace codedexposure::app
{

/** "folder/prefix%06dsuffix": the names of numbered pictures. */
struct PictureNames {
  std::string folder; ///< empty: the present one
  std::string prefix, number, suffix;

  /** From the format of a multifilesink. An error if anything but one %d or
   * %06d in the last part would be formatted. */
  static Result<PictureNames> parse (const std::string &format);
  /** The pictures are all that the folder has: their names are only numbers. */
  bool fill_folder () const { return prefix.empty () && suffix == ".png"; }
  /** Whether @p file, without its folder, is such a picture or their table. */
  bool include (const std::string &file) const;
  std::string picture (gint index) const;
  /** The table of times: times.csv after the prefix. */
  std::string table () const { return prefix + "times.csv"; }
  std::string path (const std::string &file) const;
};

/** The pictures of a multifilesink and a table with a line for each: file,
 * frame, slot, time and what is known of it. The number of a picture is that of
 * its slot since the start of the recording, so lost frames leave a gap. */
class Pictures : public Output
{
public:
  /** @p coded  pad with the coded frames of the pictures, or null. */
  Pictures (GstElement *sink, GstPad *coded, const std::string &format);

  Result<void> check_name (bool replace) override;
  Result<void> claim (bool replace) override;
  void name_element () override;
  std::string table () const override;
  std::string unfinished () const override { return place () + ".part"; }
  std::string preparation () const override;
  Result<void> publish () override;
  bool has_content () const override;

private:
  bool fills_named_folder () const
  {
    return names_.fill_folder () && !names_.folder.empty ();
  }
  /** The folder that they fill, or the name of each, with a place for its
   * number. */
  std::string place () const;
  Result<void> check_unused () const;
  void watch_flags (GstPad *sink_pad);
  void add (GstPad *pad, GstBuffer *picture);
  gint next_index (GstPad *pad, const std::optional<gst::FrameMeta> &meta);
  void write_line (const std::string &line);
  void remove_earlier () const;

  GstElement *sink_; // of the pipeline, which outlives this
  GstPad *coded_;
  std::string format_;
  PictureNames names_;
  /* Streaming thread, and publish (), which comes after it: */
  std::unique_ptr<std::FILE, int (*) (std::FILE *)> table_{
      nullptr, std::fclose};
  bool table_failed_ = false;
  bool corrupted_ = false; // the picture that is being encoded
  std::string line_;       // of the last picture, which is being written
  std::string last_;       // its file
  std::set<gint> taken_;   // numbers
};

} // namespace codedexposure::app
