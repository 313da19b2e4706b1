/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The page of "codedexposure report". */
#pragma once

#include <optional>
#include <string>

#include "pages/folder.h"
#include "pages/measure.h"
#include "pages/page.h"

namespace codedexposure::app
{

/** From one picture of @p stream to the next, ns. */
double page_period (const MeasuredStream &stream, std::size_t i);

/** The figures of a recording, and the pictures of one of its frames. */
class ReportPage
{
public:
  /** @p all the recording, @p frame  the one that is shown, with details, as
   * @p measured says; these outlive this. */
  ReportPage (const Measurement &all, const Measurement &frame,
      const MeasureOptions &measured);

  /** The pixel value that is shown as white, in a dark scene. */
  std::optional<int> white () const { return white_; }
  /** Regions of the schedule. */
  std::size_t regions () const;
  /** Writes page and figures. The pictures lie in coded/, subframes/, region-I/
   * fused/ and sum/ of @p folder. */
  void write (const PageFolder &folder) const;

private:
  void choose_contrast ();
  std::string contrast () const;
  std::string losses () const;
  Rows head () const;
  std::string links (const PageFolder &folder) const;
  std::string profiles_csv () const;
  std::string animation (const PageFolder &folder) const;
  double seconds_each () const;
  void add_sum (Page &page, const PageFolder &folder) const;
  void add_pictures (Page &page, const PageFolder &folder) const;
  void add_regions (Page &page, const PageFolder &folder) const;
  void add_charts (Page &page, const PageFolder &folder) const;
  Chart whole_chart (bool entropy) const;
  Chart frame_chart (bool entropy) const;
  Chart profile_chart () const;
  std::vector<std::vector<std::string>> table () const;

  const MeasuredPicture &coded () const
  {
    return frame_.coded.pictures.front ();
  }
  /** Subframes of the frame. */
  std::size_t slots () const { return frame_.subframes.pictures.size (); }
  double rate () const
  {
    return double (all_.coded.rate.num) / std::max (all_.coded.rate.den, 1);
  }

  const Measurement &all_, &frame_;
  const MeasureOptions &measured_;
  const Provenance provenance_;
  std::vector<double> counts_; ///< of pixels, for each `bin_` of their values
  double bin_ = 1;
  std::optional<int> white_;
};

} // namespace codedexposure::app
