/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The one writer of HTML pages: report, doctor and calibrate. A page holds its
 * style and its pictures, and needs no other file. */
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"

namespace codedexposure::app
{

/** Names and texts. */
using Rows = std::vector<std::pair<std::string, std::string>>;

/** @p text for HTML and SVG. */
std::string escaped (std::string_view text);
/** The same, for people: a number stays on the line of its unit and of its
 * error. */
std::string typeset (std::string_view text);
/** "2026-03-14T09:26:53Z" */
std::string utc_text (std::chrono::sys_seconds time);
/** A data: URL. @p type: "image/png". */
std::string data_url (std::string_view type, std::string_view bytes);
/** The file of a grey picture. */
std::string png_of (const Image<std::uint8_t> &picture);
/** The size of the PNG file with these bytes. */
Extent png_size (std::string_view png);
/** Between dark violet (0) and yellow (1), for early and late pictures. */
std::string shade (double part);

/** Points of a chart that belong together. */
struct Curve {
  enum class Kind { line, dots, bars };
  std::vector<Position> points = {};
  std::string colour = "#1f5fa8";
  Kind kind = Kind::line;
  std::string name = {}; ///< in the legend; empty: not there
  double width = 1.6;
};

/** A chart with two axes. */
struct Chart {
  std::string title, x_axis, y_axis;
  std::vector<Curve> curves = {};
  bool from_zero = false; ///< the y axis begins there
  /** Part of the x axis that is marked. */
  std::optional<std::pair<double, double>> marked = {};
  /** Places and texts of the x axis; none: numbers. */
  std::vector<std::pair<double, std::string>> ticks = {};

  /** An SVG file, which also fits into a page. */
  std::string svg () const;
};

/** A page that is being written. */
class Page
{
public:
  /** @p style is CSS beside that of all pages. */
  Page (const std::string &title, const std::string &style = {});

  /** HTML as it is. */
  Page &html (std::string_view text);
  Page &heading (std::string_view title); ///< of a section
  Page &rows (const Rows &all);
  /** A PNG file. @p overlay: SVG above it. */
  Page &picture (std::string_view png, const std::string &caption,
      const char *kind, const std::string &overlay = {});
  Page &chart (const Chart &chart, const std::string &caption,
      const std::string &kind = "chart");
  /** Lines of cells, of which each first is a head; texts are HTML. */
  Page &table (
      const std::vector<std::vector<std::string>> &lines, bool has_head = true);

  /** The whole. */
  std::string text () const { return text_ + "</body></html>\n"; }

private:
  std::string text_;
};

/** "<span class=badge>": a word on a coloured ground. */
std::string badge (
    const std::string &word, const std::string &kind = std::string ());

} // namespace codedexposure::app
