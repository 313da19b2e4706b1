/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor_page.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <regex>

#include <cairo.h>
#include <glib.h>

#include "pipeline/messages.h"
#include "pipeline/status.h"

using namespace codedexposure;
using codedexposure::app::format;

namespace
{

constexpr int kWide = 560, kHigh = 260; // a plot
constexpr int kLeft = 76, kRight = 26, kTop = 34, kBottom = 42;
constexpr int kTicks = 5;

std::string
escaped (const std::string &text)
{
  gchar *safe = g_markup_escape_text (text.c_str (), gssize (text.size ()));
  std::string result = safe;
  g_free (safe);
  return result;
}

/** For people: a number stays on the line of its unit and of its error. */
std::string
typeset (const std::string &text)
{
  static const std::regex unit ("([0-9]) (%|Hz|us|ms|DN|e-)(?![a-zA-Z])");
  static const std::regex micro ("([0-9]\u00a0)us"), plus_minus ("\\+-"),
      spaced (" \u00b1 ");
  const std::string together =
      std::regex_replace (escaped (text), unit, "$1\u00a0$2");
  const std::string symbols = std::regex_replace (
      std::regex_replace (together, micro, "$1µs"), plus_minus, "±");
  return std::regex_replace (symbols, spaced, "\u00a0±\u00a0");
}

std::string
row (const std::pair<std::string, std::string> &of)
{
  return "<dt>" + escaped (of.first) + "</dt><dd>" + typeset (of.second) +
         "</dd>\n";
}

std::string
rows (const std::vector<std::pair<std::string, std::string>> &all)
{
  std::string text = "<dl>\n";
  for (const auto &each : all)
    text += row (each);
  return text + "</dl>\n";
}

/* ------------------------------------------------------------- pictures -- */

cairo_status_t
append (void *to, const unsigned char *data, unsigned int size)
{
  static_cast<std::string *> (to)->append (
      reinterpret_cast<const char *> (data), size);
  return CAIRO_STATUS_SUCCESS;
}

/** A PNG in base64. */
std::string
png_of (const Image<std::uint8_t> &picture)
{
  struct Destroy {
    void operator() (cairo_surface_t *of) const { cairo_surface_destroy (of); }
  };
  const std::unique_ptr<cairo_surface_t, Destroy> surface (
      cairo_image_surface_create (
          CAIRO_FORMAT_RGB24, picture.width (), picture.height ()));
  unsigned char *data = cairo_image_surface_get_data (surface.get ());
  const int stride = cairo_image_surface_get_stride (surface.get ());
  for (int y = 0; y < picture.height (); y++)
    for (int x = 0; x < picture.width (); x++)
      std::fill_n (
          data + std::ptrdiff_t (y) * stride + 4 * x, 3, picture.at (x, y));
  cairo_surface_mark_dirty (surface.get ());
  std::string png;
  cairo_surface_write_to_png_stream (surface.get (), append, &png);
  gchar *text = g_base64_encode (
      reinterpret_cast<const guchar *> (png.data ()), png.size ());
  std::string result = text;
  g_free (text);
  return result;
}

std::string
figure_of (const Exhibit &exhibit)
{
  const std::string title = escaped (exhibit.title);
  return "<figure><div><img alt=\"" + title +
         "\" src=\"data:image/png;base64," + png_of (exhibit.picture) +
         "\"></div><figcaption>" + title + "</figcaption></figure>\n";
}

/* ---------------------------------------------------------------- plots -- */

struct Scale {
  double low = 0.0, high = 1.0, step = 1.0;

  double part (double value) const { return (value - low) / (high - low); }
};

/** Round numbers around @p low and @p high. */
Scale
scale_of (double low, double high)
{
  if (!(high > low)) {
    const double margin = std::max (std::abs (low) * 0.01, 1e-9);
    low -= margin;
    high += margin;
  }
  const double rough = (high - low) / kTicks;
  const double ten = std::pow (10.0, std::floor (std::log10 (rough)));
  double step = 10 * ten;
  for (const double nice : {5.0, 2.0, 1.0})
    if (nice * ten >= rough)
      step = nice * ten;
  return {std::floor (low / step) * step, std::ceil (high / step) * step, step};
}

Scale
scale_of (const Plot &plot, double Position::*axis)
{
  double low = 0, high = 0;
  bool first = true;
  for (const auto *curve : {&plot.points, &plot.model})
    for (const Position &point : *curve) {
      low = first ? point.*axis : std::min (low, point.*axis);
      high = first ? point.*axis : std::max (high, point.*axis);
      first = false;
    }
  return scale_of (low, high);
}

double
place_x (const Scale &x, double value)
{
  return kLeft + x.part (value) * (kWide - kLeft - kRight);
}

double
place_y (const Scale &y, double value)
{
  return kHigh - kBottom - y.part (value) * (kHigh - kTop - kBottom);
}

std::string
curve_of (const std::vector<Position> &points, const Scale &x, const Scale &y,
    const char *kind)
{
  std::string text = format ("<polyline class=\"%s\" points=\"", kind);
  for (const Position &point : points)
    if (std::isfinite (point.x) && std::isfinite (point.y))
      text += format ("%.1f,%.1f ", place_x (x, point.x), place_y (y, point.y));
  return text + "\"/>";
}

std::string
dots_of (const std::vector<Position> &points, const Scale &x, const Scale &y)
{
  std::string text;
  for (const Position &point : points)
    if (std::isfinite (point.x) && std::isfinite (point.y))
      text += format ("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3\"/>",
          place_x (x, point.x), place_y (y, point.y));
  return text;
}

std::string
ticks_of (const Scale &x, const Scale &y)
{
  std::string text;
  for (double at = x.low; at <= x.high + x.step / 2; at += x.step)
    text += format ("<path d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
                    "text-anchor=\"middle\">%.6g</text>",
        place_x (x, at), kTop, kHigh - kBottom, place_x (x, at),
        kHigh - kBottom + 16, std::abs (at) < x.step / 2 ? 0.0 : at);
  for (double at = y.low; at <= y.high + y.step / 2; at += y.step)
    text += format ("<path d=\"M%d %.1fH%d\"/><text x=\"%d\" y=\"%.1f\" "
                    "text-anchor=\"end\">%.6g</text>",
        kLeft, place_y (y, at), kWide - kRight, kLeft - 6, place_y (y, at) + 4,
        std::abs (at) < y.step / 2 ? 0.0 : at);
  return text;
}

std::string
figure_of (const Plot &plot)
{
  const Scale x = scale_of (plot, &Position::x);
  const Scale y = scale_of (plot, &Position::y);
  return format ("<figure class=\"curve\"><svg viewBox=\"0 0 %d %d\" "
                 "role=\"img\" aria-label=\"%s\">",
             kWide, kHigh, escaped (plot.title).c_str ()) +
         ticks_of (x, y) + curve_of (plot.model, x, y, "model") +
         (plot.model.empty () ? curve_of (plot.points, x, y, "seen")
                              : dots_of (plot.points, x, y)) +
         format ("<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>",
             (kLeft + kWide - kRight) / 2, kHigh - 6,
             escaped (plot.x_axis).c_str ()) +
         format ("<text x=\"6\" y=\"14\">%s</text>",
             escaped (plot.y_axis).c_str ()) +
         "</svg><figcaption>" + escaped (plot.title) +
         (plot.model.empty () ? "" : " (dots: measured; line: the model)") +
         "</figcaption></figure>\n";
}

/* --------------------------------------------------------------- checks -- */

const char *
outcome (const Finding &finding)
{
  return finding.skipped ? "SKIPPED" : verdict_text (finding.verdict ());
}

std::string
badge (const std::string &verdict)
{
  return "<span class=\"badge " + verdict + "\">" + verdict + "</span>";
}

std::string
title_of (const DoctorPage &page, const std::string &check)
{
  for (const auto &[name, title] : page.titles)
    if (name == check)
      return title;
  return check;
}

std::string
readings_of (const Finding &finding)
{
  if (finding.readings.empty ())
    return {};
  std::string text = "<div class=\"table\"><table><tr><th></th><th>measured"
                     "</th><th>should be</th></tr>\n";
  for (const Reading &reading : finding.readings)
    text += "<tr><th>" + escaped (reading.name) + "</th><td>" +
            typeset (reading_text (reading)) + "</td><td>" +
            escaped (reading.rule) + "</td></tr>\n";
  return text + "</table></div>\n";
}

std::string
diagnoses_of (const Finding &finding)
{
  std::string text;
  for (const Diagnosis &diagnosis : finding.diagnoses)
    text += "<p>" + badge (verdict_text (diagnosis.severity)) + " <b>" +
            escaped (diagnosis.id) + "</b>: " + typeset (diagnosis.cause) +
            ".<br>Try next: " + typeset (diagnosis.remedy) + ".</p>\n";
  return text;
}

std::string
section_of (const DoctorPage &page, const Finding &finding)
{
  std::string text = "<h2 id=\"" + finding.check + "\">" +
                     escaped (title_of (page, finding.check)) + " " +
                     badge (outcome (finding)) + "</h2>\n";
  text += "<p>Shown: " + escaped (finding.shown) + ".";
  if (!finding.skipped)
    text += format (" It took %.0f\u00a0s.", finding.seconds);
  text += "</p>\n";
  text += diagnoses_of (finding) + readings_of (finding);
  if (!finding.notes.empty ())
    text += rows (finding.notes);
  if (finding.plots.empty () && finding.exhibits.empty ())
    return text;
  text += "<div class=\"pair\">\n";
  for (const Plot &plot : finding.plots)
    text += figure_of (plot);
  for (const Exhibit &exhibit : finding.exhibits)
    text += figure_of (exhibit);
  return text + "</div>\n";
}

std::string
link_to (const DoctorPage &page, const Finding &finding)
{
  const std::string title = escaped (title_of (page, finding.check));
  return finding.skipped
             ? title
             : "<a href=\"#" + finding.check + "\">" + title + "</a>";
}

std::string
summary_of (const Finding &finding)
{
  if (finding.skipped)
    return "a check before it failed";
  return finding.diagnoses.empty ()
             ? std::string ()
             : typeset (finding.diagnoses.front ().cause);
}

std::string
summary_of (const DoctorPage &page)
{
  std::string text = "<div class=\"table\"><table>\n";
  for (const Finding &finding : page.findings)
    text += "<tr><th>" + link_to (page, finding) + "</th><td>" +
            badge (outcome (finding)) + "</td><td class=\"words\">" +
            summary_of (finding) + "</td></tr>\n";
  return text + "</table></div>\n";
}

constexpr const char *kStyle =
    ".PASS{background:#2e7d32} .WARN{background:#b26a00} "
    ".FAIL{background:#c62828} .SKIPPED,.UNKNOWN{background:#777}\n"
    ".badge{font-size:13px} .curve svg{width:100%;height:auto}\n"
    ".curve text{font:11px sans-serif;fill:#555} .curve path{stroke:#ddd}\n"
    "circle{fill:#1f5fa8} th:first-child{text-align:left} "
    "tr:first-child th{white-space:nowrap}\n"
    ".seen{fill:none;stroke:#1f5fa8;stroke-width:1.6} "
    ".model{fill:none;stroke:#e4572e;stroke-width:1}\n"
    ".words{white-space:normal;text-align:left}\n"
    "td .badge{font-size:11px} th{white-space:normal} pre{overflow-x:auto}\n"
    ".pair{margin-top:12px}\n"
    "@media(max-width:700px){.curve text{font-size:17px} "
    "td{white-space:normal}}\n"
    "@media(prefers-color-scheme:dark){body{background:#16181c;color:#ddd}\n"
    "dt,figcaption{color:#aaa} a{color:#8ab4f8} th,td{border-color:#444}\n"
    ".curve text{fill:#bbb} .curve path{stroke:#444} "
    ".seen{stroke:#6aa6e8} circle{fill:#6aa6e8}}\n";

} // namespace

std::string
reading_text (const Reading &reading)
{
  const auto [value, sigma] = reading.number;
  const std::string unit = reading.unit.empty () ? "" : " " + reading.unit;
  if (!(sigma > 0) || !std::isfinite (sigma))
    return format (std::floor (value) == value ? "%.0f" : "%.4g", value) + unit;
  const int digits =
      std::clamp (1 - int (std::floor (std::log10 (sigma))), 0, 9);
  return format ("%.*f ± %.*f", digits, value, digits, sigma) + unit;
}

std::string
html_of (const DoctorPage &page)
{
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<title>Bench doctor</title>\n<meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\">\n<style>" +
      page.style + kStyle + "</style></head><body>\n<h1>Bench doctor" +
      (page.simulated ? " <span class=\"badge\">simulated</span>" : "") +
      "</h1>\n" + rows (page.head) + summary_of (page);
  for (const Finding &finding : page.findings)
    if (!finding.skipped)
      text += section_of (page, finding);
  if (!page.profile.empty ())
    text += "<h2>Bench profile</h2>\n" + rows (page.profile);
  if (!page.next.empty ()) {
    text += "<h2>What to do with it</h2>\n<pre>";
    for (const std::string &command : page.next)
      text += escaped (command) + "\n";
    text += "</pre>\n";
  }
  return text + "</body></html>\n";
}
