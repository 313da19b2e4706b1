/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A part of a recording that is decoded as in the whole. */
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gst/gst.h>

#include "common/raii.h"

/** The coded frames whose times lie in [from, until), ns. Frames before and
 * after them are read, because decoding depends on them, and their pictures are
 * dropped. */
struct Excerpt {
  GstClockTime from = 0;
  GstClockTime until = GST_CLOCK_TIME_NONE; ///< none: to the end
  guint before = 1, after = 1;              ///< coded frames to read

  /** "FROM:UNTIL:BEFORE:AFTER"; UNTIL may be empty. None if it is not that. */
  static std::optional<Excerpt> parse (const std::string &text);

  bool holds (GstClockTime coded_pts) const;
  /** Start and stop of what is read, of frames with this period. */
  std::pair<GstClockTime, GstClockTime> read (GstClockTime period) const;
};

/** Lets the pictures of an excerpt through, and writes a ledger: a line for
 * each coded frame of the excerpt, and one for its pictures on each pad. */
class ExcerptFilter
{
public:
  /** The last part of the name of identities in front of outputs, which the
   * pictures pass. */
  static constexpr const char *kName = "kept";

  /** @p coded   pad that all coded frames pass; it outlives this.
   *  @p ledger  file, or empty. */
  ExcerptFilter (GstElement *pipeline, GstPad *coded, const Excerpt &excerpt,
      const std::string &ledger);
  ~ExcerptFilter ();
  ExcerptFilter (const ExcerptFilter &) = delete;
  ExcerptFilter &operator= (const ExcerptFilter &) = delete;

  /** After the pipeline stopped. False: the ledger could not be written. */
  bool finish ();

private:
  struct Gate;
  void add_gate (GstElement *identity);
  void write (const char *kind, GstClockTime pts, const std::string &rest);

  const Excerpt excerpt_;
  std::vector<std::unique_ptr<Gate>> gates_;
  std::unique_ptr<std::FILE, int (*) (std::FILE *)> ledger_{
      nullptr, std::fclose};
  bool failed_ = false;
};
