/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "report_page.h"

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <filesystem>

#include "base/file.h"
#include "base/text.h"
#include "pipeline/messages.h"
#include "stats/profile_line.h"

namespace codedexposure::app
{

namespace fs = std::filesystem;

namespace
{

/* Larger tables are linked as files beside the page, not put into it. */
constexpr std::size_t kMostCsv = 1'000'000;
constexpr int kColumns = 10; // those after them are lists

constexpr const char *kCodedBlue = "#4a7ebb";

std::string
time_text (GstClockTime time)
{
  return format (
      "%" PRIu64 ".%09" PRIu64, time / GST_SECOND, time % GST_SECOND);
}

std::string
content_of (const std::string &path)
{
  std::error_code ignored;
  return value_of (read_file (path, fs::file_size (path, ignored)));
}

/** The pictures of a folder, in their order. */
std::vector<std::string>
pictures_in (const std::string &folder)
{
  std::vector<std::string> names, pictures;
  std::error_code ignored;
  for (const auto &entry : fs::directory_iterator (folder, ignored))
    if (entry.path ().extension () == ".png")
      names.push_back (entry.path ());
  std::sort (names.begin (), names.end ());
  for (const std::string &name : names)
    pictures.push_back (content_of (name));
  return pictures;
}

/** The first columns of a table. */
std::string
without_lists (const std::string &csv)
{
  std::string cut;
  for (const auto line : split (csv, '\n')) {
    int columns = 0;
    std::size_t end = 0;
    for (; end < line.size (); end++)
      if (line[end] == ',' && ++columns == kColumns)
        break;
    if (!line.empty ())
      cut += std::string (line.substr (0, end)) + "\n";
  }
  return cut;
}

std::string
overlay (const std::string &shapes, double width, double height)
{
  return format ("<svg class=\"over\" viewBox=\"0 0 %g %g\" "
                 "preserveAspectRatio=\"none\">",
             width, height) +
         shapes + "</svg>";
}

/** The line of the profiles. */
std::string
line_over (const std::string &text)
{
  const auto line = value_of (ProfileLine::parse (text));
  const auto points = value_of (line.points ({1001, 1001}));
  const Position from = points.front (), to = points.back ();
  return overlay (format ("<line x1=\"%g\" y1=\"%g\" x2=\"%g\" y2=\"%g\"/>",
                      from.x / 10, from.y / 10, to.x / 10, to.y / 10),
      100, 100);
}

std::string
rate_text (double rate)
{
  return format ("%.6g", rate);
}

} // namespace

double
page_period (const MeasuredStream &stream, std::size_t i)
{
  const auto &pictures = stream.pictures;
  if (i + 1 < pictures.size ())
    return double (pictures[i + 1].pts - pictures[i].pts);
  if (stream.rate.num > 0)
    return double (stream.rate.time_of (1000)) / 1000;
  return i > 0 ? double (pictures[i].pts - pictures[i - 1].pts) : 4e7;
}

ReportPage::ReportPage (const Measurement &all, const Measurement &frame,
    const MeasureOptions &measured)
    : all_ (all), frame_ (frame), measured_ (measured),
      provenance_ (all.subframes.provenance.value_or (Provenance{}))
{
  if (frame.coded.pictures.empty () || frame.subframes.pictures.empty ())
    fail ("the frame could not be decoded");
  choose_contrast ();
}

std::size_t
ReportPage::regions () const
{
  return provenance_.setup.schedule.regions ().size ();
}

/* A scene is dark if 999 of 1,000 pixels are below half of the largest value.
 */
void
ReportPage::choose_contrast ()
{
  const auto add = [this] (const MeasuredPicture &picture) {
    const auto &counts = picture.stats.histogram;
    counts_.resize (std::max (counts_.size (), counts.size ()));
    for (std::size_t i = 0; i < counts.size (); i++)
      counts_[i] += double (counts[i]);
  };
  add (coded ());
  for (const auto &picture : frame_.subframes.pictures)
    add (picture);
  if (counts_.empty ())
    return;
  const double levels = std::exp2 (frame_.coded.bits);
  bin_ = std::max (levels / double (counts_.size ()), 1.0);
  double all = 0, sum = 0;
  for (const double count : counts_)
    all += count;
  std::size_t i = 0;
  while (i < counts_.size () && sum < 0.999 * all)
    sum += counts_[i++];
  const double last = double (i) * bin_ - 1;
  if (last < (levels - 1) / 2)
    white_ = std::max (int (last), 1);
}

std::string
ReportPage::contrast () const
{
  const double most = std::exp2 (frame_.coded.bits) - 1;
  if (!white_)
    return format (
        "pixel values from 0 to %.0f are shown from black to white", most);
  double all = 0, above = 0;
  for (std::size_t i = 0; i < counts_.size (); i++) {
    all += counts_[i];
    if (double (i) * bin_ > *white_)
      above += counts_[i];
  }
  return format ("stretched %.3g times, because the scene is dark: pixel "
                 "values from 0 to %d are shown from black to white, and %.2g "
                 "%% of the pixels are brighter. The numbers are those of the "
                 "recording",
      most / *white_, *white_, 100 * above / all);
}

std::string
ReportPage::losses () const
{
  const auto &frames = all_.coded.pictures;
  const guint64 lost =
      frames.back ().frame - frames.front ().frame + 1 - frames.size ();
  const auto damaged = std::count_if (frames.begin (), frames.end (),
      [] (const auto &frame) { return frame.damaged; });
  if (lost == 0 && damaged == 0)
    return "none";
  return coded_frames (lost) + format (" lost, %d damaged", int (damaged));
}

Rows
ReportPage::head () const
{
  const StreamSetup &setup = provenance_.setup;
  Rows rows = {
      {"Schedule", setup.schedule.text () +
                       (measured_.decode.schedule ? " (--schedule)" : "")},
      {"Coded frames",
          format ("%zu of %s pixels, %d bits, %s frames/s",
              all_.coded.pictures.size (), size_text (all_.coded.size).c_str (),
              frame_.coded.bits, rate_text (rate ()).c_str ())},
      {"Subframes",
          format ("%zu for each coded frame, %s pixels, %s subframes/s",
              slots (), size_text (all_.subframes.size).c_str (),
              rate_text (double (slots ()) * rate ()).c_str ())},
      {"Method", provenance_.method + " (--method " +
                     measured_.decode.method.value_or ("auto") + ")"}};
  if (all_.pairs > 0)
    rows.emplace_back ("Cameras",
        format ("two; %zu of %zu coded frames have one of the second camera",
            all_.pairs, all_.coded.pictures.size ()));
  if (setup.simulated)
    rows.emplace_back ("Source", "simulated bench; no camera recorded this");
  if (setup.bench)
    rows.emplace_back (
        "Bench", "profile measured " + utc_text (setup.bench->measured));
  rows.emplace_back ("Losses", losses ());
  rows.emplace_back (
      "Shown", format ("coded frame %" PRIu64 ", from ", coded ().frame) +
                   time_text (coded ().pts) + " s on");
  rows.emplace_back ("Contrast", contrast ());
  rows.emplace_back ("Made by", "report of codedexposure " VERSION);
  return rows;
}

std::string
ReportPage::links (const PageFolder &folder) const
{
  std::string text = "<p>Numbers:";
  for (const char *name : {"coded.csv", "subframes.csv", "profiles.csv"}) {
    const std::string table = without_lists (content_of (folder.path (name)));
    text += std::string (" <a download=\"") + name + "\" href=\"" +
            (table.size () <= kMostCsv ? data_url ("text/csv", table) : name) +
            "\">" + name + "</a>";
  }
  return text + "</p>\n";
}

/* Positions are pixels of the coded frame; a subframe has fewer values. */
std::string
ReportPage::profiles_csv () const
{
  std::string text = "picture,position,value\n";
  const Chart chart = profile_chart ();
  for (std::size_t k = 0; k < chart.curves.size (); k++)
    for (const Position &point : chart.curves[k].points)
      text += (k > 0 ? "I" + std::to_string (k) : "coded") +
              format (",%.6g,", point.x) + real_text (point.y) + "\n";
  return text;
}

double
ReportPage::seconds_each () const
{
  return std::clamp (3.0 / double (slots ()), 0.04, 0.4);
}

/* The subframes one after the other, with their own pixels: no encoder. */
std::string
ReportPage::animation (const PageFolder &folder) const
{
  constexpr int kCaption = 30;
  const auto pictures = pictures_in (folder.path ("subframes"));
  const Extent size = all_.coded.size;
  const int width = slots () > 64 ? 240 : 480;
  const int height = std::max (width * size.height / size.width, 1);
  const auto n = double (pictures.size ());
  std::string text = format ("<svg xmlns=\"http://www.w3.org/2000/svg\" "
                             "viewBox=\"0 0 %d %d\" font-size=\"15\" "
                             "font-family=\"sans-serif\" fill=\"#777\">\n",
      width, height + kCaption);
  for (std::size_t k = 0; k < pictures.size (); k++) {
    const auto &subframe = frame_.subframes.pictures;
    text += format ("<g visibility=\"%s\"><animate attributeName=\"visibility\""
                    " values=\"hidden;visible;hidden\" keyTimes=\"0;%.6f;%.6f\""
                    " dur=\"%.3fs\" calcMode=\"discrete\" "
                    "repeatCount=\"indefinite\"/><image width=\"%d\" "
                    "height=\"%d\" preserveAspectRatio=\"none\" "
                    "style=\"image-rendering:pixelated\" href=\"",
                k == 0 ? "visible" : "hidden", double (k) / n,
                double (k + 1) / n, n * seconds_each (), width, height) +
            data_url ("image/png", pictures[k]) +
            format ("\"/><text x=\"4\" y=\"%d\">I%zu   %.6f s</text></g>\n",
                height + 20, k + 1,
                k < subframe.size () ? double (subframe[k].pts) / 1e9 : 0.0);
  }
  return text + "</svg>";
}

/* Of two cameras. */
void
ReportPage::add_sum (Page &page, const PageFolder &folder) const
{
  const auto sum = pictures_in (folder.path ("sum"));
  if (sum.empty ())
    return;
  page.heading ("Both cameras");
  page.picture (sum.front (),
      "The sum of both: the picture of the whole exposure, with all of the "
      "light",
      "frame");
}

void
ReportPage::add_pictures (Page &page, const PageFolder &folder) const
{
  const auto coded = pictures_in (folder.path ("coded"));
  const auto subframes = pictures_in (folder.path ("subframes"));
  page.heading ("One coded frame and its subframes");
  page.html (
      slots () <= 16 ? "<div class=\"pair\">\n" : "<div class=\"many\">\n");
  for (const std::string &picture : coded)
    page.picture (picture, "Coded frame; dashed: the line of the profiles",
        "frame", line_over (measured_.line));
  page.html ("<div class=\"grid\">\n");
  for (std::size_t k = 0; k < subframes.size (); k++)
    page.picture (subframes[k],
        format ("I%zu, %.6f s", k + 1,
            double (frame_.subframes.pictures[std::min (k, slots () - 1)].pts) /
                1e9),
        "frame");
  page.html ("</div></div>\n").heading ("In slow motion");
  const std::string moving = animation (folder);
  folder.write ("animation.svg", moving);
  page.html ("<figure class=\"one slow\">" + moving + "<figcaption>" +
             format ("The subframes one after the other, %.3g times slower "
                     "than they were exposed",
                 seconds_each () * rate () * double (slots ())) +
             "</figcaption></figure>\n");
}

void
ReportPage::add_regions (Page &page, const PageFolder &folder) const
{
  const auto fused = pictures_in (folder.path ("fused"));
  const auto coded = pictures_in (folder.path ("coded"));
  if (fused.empty () || coded.empty ())
    return;
  const auto pace = [&] (std::size_t count) {
    return rate_text (double (count) * rate ()) + " frames/s";
  };
  const Extent size = png_size (fused.front ());
  std::string rects;
  for (const Region &region : provenance_.setup.schedule.regions ())
    rects += format ("<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\"/>",
        region.rect.x, region.rect.y, region.rect.width, region.rect.height);
  page.heading ("Regions").html ("<div class=\"pair\">\n");
  page.picture (coded.front (), "One coded frame, " + pace (1), "frame");
  page.picture (fused.front (),
      "All parts in one picture, " + pace (fused.size ()) +
          ": first slot, fused; red: regions",
      "frame", overlay (rects, size.width, size.height));
  page.html ("</div>\n");
  const auto strip = [&] (const std::string &name, const std::string &title,
                         Extent shape) {
    const auto pictures = pictures_in (folder.path (name));
    page.html ("<h3>" + escaped (title) +
               format (": %zu subframes, ", pictures.size ()) +
               pace (pictures.size ()) +
               "</h3>\n<div class=\"grid parts\" style=\"--shape:" +
               format ("%d/%d", shape.width, shape.height) + "\">\n");
    for (std::size_t k = 0; k < pictures.size (); k++)
      page.picture (pictures[k], "I" + std::to_string (k + 1), "part");
    page.html ("</div>\n");
  };
  strip ("subframes", "Background", all_.coded.size);
  int i = 0;
  for (const Region &region : provenance_.setup.schedule.regions ()) {
    const std::string number = std::to_string (i++);
    strip ("region-" + number,
        "Region " + number + ", " + rect_text (region.rect),
        {region.rect.width, region.rect.height});
  }
}

Chart
ReportPage::whole_chart (bool entropy) const
{
  const auto curve = [&] (const MeasuredStream &stream, double middle) {
    Curve points;
    for (const auto &picture : stream.pictures)
      points.points.push_back ({double (picture.pts) / 1e9 + middle,
          entropy ? picture.stats.entropy : picture.stats.mean});
    return points;
  };
  const double from = double (coded ().pts) / 1e9;
  std::size_t shown = 0;
  while (shown + 1 < all_.coded.pictures.size () &&
         all_.coded.pictures[shown].pts < coded ().pts)
    shown++;
  const double period = page_period (all_.coded, shown) / 1e9;
  Curve fast = curve (all_.subframes, period / 2 / double (slots ()));
  fast.colour = "#d65f2b";
  fast.name = "subframes";
  fast.width = 1;
  Curve slow = curve (all_.coded, period / 2);
  slow.colour = kCodedBlue;
  slow.name = "coded frames";
  slow.kind = Curve::Kind::dots;
  return {.title = "The whole recording",
      .x_axis = "time, middle of the exposure (s)",
      .y_axis = entropy ? "entropy (bits per pixel)" : "mean pixel value (DN)",
      .curves = {fast, slow},
      .marked = std::pair{from, from + period}};
}

Chart
ReportPage::frame_chart (bool entropy) const
{
  Chart chart{.title = "The coded frame and its subframes",
      .x_axis = "subframe",
      .y_axis = entropy ? "entropy (bits per pixel)" : "mean pixel value (DN)",
      .from_zero = true,
      .ticks = {{0, "coded"}}};
  const auto add = [&] (double x, const PictureStats &stats,
                       const std::string &colour) {
    chart.curves.push_back (
        {.points = {{x, entropy ? stats.entropy : stats.mean}},
            .colour = colour,
            .kind = Curve::Kind::bars});
  };
  const std::size_t n = slots ();
  const std::size_t step = n > 64 ? 32 : n > 20 ? 8 : n > 8 ? 2 : 1;
  add (0, coded ().stats, kCodedBlue);
  for (std::size_t k = 0; k < n; k++) {
    add (double (k + 1), frame_.subframes.pictures[k].stats,
        shade (n > 1 ? double (k) / double (n - 1) : 0));
    if (k % step == 0)
      chart.ticks.emplace_back (double (k + 1), "I" + std::to_string (k + 1));
  }
  return chart;
}

Chart
ReportPage::profile_chart () const
{
  Chart chart{.title = "Profiles along the line",
      .x_axis = "position along the line (pixels of the coded frame)",
      .y_axis = "pixel value (DN)",
      .from_zero = true};
  const double all = double (coded ().stats.profile.size ()) - 1;
  const auto add = [&] (const PictureStats &stats, const std::string &colour,
                       const std::string &name) {
    Curve curve{.colour = colour, .name = name, .width = 1.2};
    const auto count = double (stats.profile.size ());
    for (const double value : stats.profile)
      curve.points.push_back (
          {count > 1 ? double (curve.points.size ()) * all / (count - 1) : 0,
              value});
    chart.curves.push_back (std::move (curve));
  };
  const std::size_t n = slots (), step = n > 64 ? 32 : n > 8 ? 8 : 1;
  add (coded ().stats, "#c8c8c8", "coded");
  for (std::size_t k = 0; k < n; k++)
    add (frame_.subframes.pictures[k].stats,
        shade (n > 1 ? double (k) / double (n - 1) : 0),
        k % step == 0 ? "I" + std::to_string (k + 1) : "");
  return chart;
}

std::vector<std::vector<std::string>>
ReportPage::table () const
{
  std::vector<std::vector<std::string>> lines = {{"", "time (s)", "mean (DN)",
      "min", "max", "entropy (bits)", "saturated"}};
  const auto add = [&] (const std::string &name, const MeasuredPicture &of) {
    const PictureStats &stats = of.stats;
    lines.push_back ({name, format ("%.6f", double (of.pts) / 1e9),
        format ("%.2f", stats.mean), format ("%u", stats.minimum),
        format ("%u", stats.maximum), format ("%.3f", stats.entropy),
        format ("%.2f %%",
            100 * double (stats.saturated) /
                double (std::max<std::uint64_t> (stats.pixels, 1)))});
  };
  add ("coded frame", coded ());
  for (std::size_t k = 0; k < slots (); k++)
    add (format ("I<sub>%zu</sub>", k + 1), frame_.subframes.pictures[k]);
  return lines;
}

void
ReportPage::add_charts (Page &page, const PageFolder &folder) const
{
  const auto add = [&] (const char *name, const Chart &chart,
                       const std::string &caption, const char *kind = "chart") {
    folder.write (std::string (name) + ".svg", chart.svg ());
    page.chart (chart, caption, kind);
  };
  page.heading ("Intensity over subframes").html ("<div class=\"pair\">\n");
  add ("intensity", whole_chart (false),
      "Mean pixel value of every picture; the frame shown above is marked.");
  add ("intensity-frame", frame_chart (false),
      "Mean pixel values of that frame.");
  page.html ("</div>\n").heading ("Line profiles");
  add ("profile", profile_chart (),
      "Pixel values along " + measured_.line + ", from the first to the last.",
      "chart one");
  page.heading ("Entropy").html ("<div class=\"pair\">\n");
  add ("entropy", whole_chart (true),
      "Shannon entropy of the grey levels; exposure and noise increase it as "
      "well.");
  add ("entropy-frame", frame_chart (true), "Entropy of that frame.");
  page.html ("</div>\n").heading ("Figures of the frame").table (table ());
}

void
ReportPage::write (const PageFolder &folder) const
{
  const int columns = std::max (int (std::ceil (std::sqrt (slots ()))), 1);
  const Extent size = all_.coded.size;
  const std::string title = fs::path (measured_.recording).filename ();
  folder.write ("profiles.csv", profiles_csv ());
  Page page (
      title, format (".grid{display:grid;gap:8px;align-content:start;"
                     "grid-template-columns:repeat(auto-fill,minmax(max(84px,"
                     "calc((100%% - %dpx)/%d)),1fr))}\n"
                     ".frame img{display:block;aspect-ratio:%d/%d}\n"
                     ".parts{grid-template-columns:repeat(auto-fill,"
                     "minmax(140px,240px))}\n"
                     ".part img{display:block;aspect-ratio:var(--shape)}\n"
                     ".slow svg{width:100%%}\n",
                 8 * (columns - 1), columns, size.width, size.height));
  page.html ("<h1>" + escaped (title) +
             (provenance_.setup.simulated ? " " + badge ("simulated") : "") +
             "</h1>\n");
  page.rows (head ()).html (links (folder));
  add_pictures (page, folder);
  add_sum (page, folder);
  if (regions () > 0)
    add_regions (page, folder);
  add_charts (page, folder);
  folder.write ("index.html", page.text ());
}

} // namespace codedexposure::app
