/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "doctor_page.h"

#include <algorithm>
#include <cmath>

#include "doctor/checks.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

namespace
{

std::string
coloured (const std::string &verdict)
{
  return badge (verdict, verdict);
}

Chart
chart_of (const Plot &plot)
{
  constexpr const char *kModel = "#e4572e";
  Chart chart{
      .title = plot.title, .x_axis = plot.x_axis, .y_axis = plot.y_axis};
  if (!plot.model.empty ())
    chart.curves.push_back (
        {.points = plot.model, .colour = kModel, .width = 1});
  chart.curves.push_back ({.points = plot.points,
      .kind = plot.model.empty () ? Curve::Kind::line : Curve::Kind::dots});
  return chart;
}

void
add_summary (Page &page, const std::vector<Finding> &findings)
{
  std::vector<std::vector<std::string>> lines;
  for (const Finding &finding : findings) {
    const std::string title = escaped (title_of (finding.check));
    const std::string cause = finding.skipped ? "a check before it failed"
                              : finding.diagnoses.empty ()
                                  ? ""
                                  : finding.diagnoses.front ().cause;
    lines.push_back ({finding.skipped ? title
                                      : "<a href=\"#" + finding.check + "\">" +
                                            title + "</a>",
        coloured (outcome_of (finding)),
        "<div class=\"words\">" + typeset (cause) + "</div>"});
  }
  page.table (lines, false);
}

void
add_finding (Page &page, const Finding &finding)
{
  page.html ("<h2 id=\"" + finding.check + "\">" +
             escaped (title_of (finding.check)) + " " +
             coloured (outcome_of (finding)) +
             "</h2>\n<p>Shown: " + escaped (finding.shown) +
             format (". It took %.0f\u00a0s.</p>\n", finding.seconds));
  for (const Diagnosis &diagnosis : finding.diagnoses)
    page.html ("<p>" + coloured (verdict_text (diagnosis.severity)) + " <b>" +
               escaped (diagnosis.id) + "</b>: " + typeset (diagnosis.cause) +
               ".<br>Try next: " + typeset (diagnosis.remedy) + ".</p>\n");
  std::vector<std::vector<std::string>> lines = {{"", "measured", "should be"}};
  for (const Reading &reading : finding.readings)
    lines.push_back ({escaped (reading.name), typeset (reading_text (reading)),
        escaped (reading.rule)});
  if (lines.size () > 1)
    page.table (lines);
  if (!finding.notes.empty ())
    page.rows (finding.notes);
  if (finding.plots.empty () && finding.exhibits.empty ())
    return;
  page.html ("<div class=\"pair\">\n");
  for (const Plot &plot : finding.plots)
    page.chart (chart_of (plot),
        plot.title +
            (plot.model.empty () ? "" : " (dots: measured; line: the model)"));
  for (const Exhibit &exhibit : finding.exhibits)
    page.picture (png_of (exhibit.picture), exhibit.title, "frame");
  page.html ("</div>\n");
}

} // namespace

std::string
title_of (const std::string &check)
{
  const auto found = std::ranges::find (all_checks (), check, &Check::name);
  return found == all_checks ().end () ? check : found->title;
}

std::string
outcome_of (const Finding &finding)
{
  return finding.skipped ? "SKIPPED" : verdict_text (finding.verdict ());
}

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
DoctorPage::html () const
{
  Page page ("Bench doctor");
  page.html ("<h1>Bench doctor" +
             (simulated ? " " + badge ("simulated") : std::string ()) +
             "</h1>\n");
  page.rows (head);
  add_summary (page, findings);
  for (const Finding &finding : findings)
    if (!finding.skipped)
      add_finding (page, finding);
  if (!profile.empty ())
    page.heading ("Bench profile").rows (profile);
  if (!next.empty ()) {
    page.heading ("What to do with it").html ("<pre>");
    for (const std::string &command : next)
      page.html (escaped (command) + "\n");
    page.html ("</pre>\n");
  }
  return page.text ();
}

} // namespace codedexposure::app
