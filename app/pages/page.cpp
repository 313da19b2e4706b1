/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "page.h"

#include <ctime>
#include <regex>

#include <gst/video/video.h>

#include "common/raii.h"
#include "pipeline/messages.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

constexpr const char *kStyle =
    R"(body{font:15px/1.5 sans-serif;max-width:1200px;margin:1.5em auto;
  padding:0 1em;color:#222}
figure{margin:0} figcaption{color:#555;font-size:13px}
img{width:100%;image-rendering:pixelated}
.badge{font-size:13px;background:#e4572e;color:#fff;border-radius:4px;
  padding:2px 8px;vertical-align:middle}
.PASS{background:#2e7d32} .WARN{background:#b26a00} .FAIL{background:#c62828}
.SKIPPED,.UNKNOWN{background:#777} td .badge{font-size:11px}
dl{display:grid;grid-template-columns:max-content minmax(0,1fr);gap:2px 14px}
dd{margin:0;overflow-wrap:anywhere} dt{color:#555}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:12px;margin-top:12px}
.one,.many>figure{max-width:750px} .many>.grid{margin-top:8px}
.frame div{position:relative}
.over{position:absolute;inset:0;width:100%;height:100%}
.over line,.over rect{stroke:#e4572e;stroke-width:2;fill:none;
  vector-effect:non-scaling-stroke}
.over line{stroke-dasharray:6 4}
.chart svg{width:100%;height:auto}
.table{overflow-x:auto} table{border-collapse:collapse} pre{overflow-x:auto}
th,td{padding:2px 10px;text-align:right;border-bottom:1px solid #ddd}
td{white-space:nowrap} th:first-child{text-align:left}
tr:first-child th{white-space:nowrap} .words{white-space:normal;text-align:left}
@media(max-width:700px){.pair{grid-template-columns:1fr} th,td{padding:2px 5px}
  body{font-size:14px} table{font-size:13px} .chart text{font-size:17px}
  td{white-space:normal}}
@media(prefers-color-scheme:dark){body{background:#16181c;color:#ddd}
  dt,figcaption{color:#aaa} a{color:#8ab4f8} th,td{border-color:#444}
  .chart text{fill:#bbb} .chart path{stroke:#444}}
)";

} // namespace

std::string
escaped (std::string_view text)
{
  const CharPtr valid (g_utf8_make_valid (text.data (), gssize (text.size ())));
  return CharPtr (g_markup_escape_text (valid.get (), -1)).get ();
}

std::string
typeset (std::string_view text)
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
utc_text (std::chrono::sys_seconds time)
{
  const std::time_t seconds = std::chrono::system_clock::to_time_t (time);
  std::tm parts{};
  char text[32];
  const std::size_t length = std::strftime (
      text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", gmtime_r (&seconds, &parts));
  return {text, length};
}

std::string
data_url (std::string_view type, std::string_view bytes)
{
  const CharPtr text (g_base64_encode (
      reinterpret_cast<const guchar *> (bytes.data ()), bytes.size ()));
  return "data:" + std::string (type) + ";base64," + text.get ();
}

std::string
png_of (const Image<std::uint8_t> &picture)
{
  GstVideoInfo info;
  gst_video_info_set_format (&info, GST_VIDEO_FORMAT_GRAY8,
      guint (picture.width ()), guint (picture.height ()));
  const BufferPtr buffer (
      gst_buffer_new_allocate (nullptr, GST_VIDEO_INFO_SIZE (&info), nullptr));
  for (int y = 0; y < picture.height (); y++)
    gst_buffer_fill (buffer.get (), gsize (y * info.stride[0]),
        &picture.at (0, y), gsize (picture.width ()));
  const CapsPtr caps (gst_video_info_to_caps (&info)),
      wanted (gst_caps_new_empty_simple ("image/png"));
  const SamplePtr raw (
      gst_sample_new (buffer.get (), caps.get (), nullptr, nullptr));
  const SamplePtr png (gst_video_convert_sample (
      raw.get (), wanted.get (), GST_CLOCK_TIME_NONE, nullptr));
  if (!png)
    return {};
  GstBuffer *encoded = gst_sample_get_buffer (png.get ());
  std::string bytes (gst_buffer_get_size (encoded), '\0');
  gst_buffer_extract (encoded, 0, bytes.data (), bytes.size ());
  return bytes;
}

/* The chunk IHDR comes first. */
Extent
png_size (std::string_view png)
{
  constexpr std::size_t kWidth = 16, kHeight = 20, kEnd = 24;
  if (png.size () < kEnd)
    return {};
  return {int (GST_READ_UINT32_BE (png.data () + kWidth)),
      int (GST_READ_UINT32_BE (png.data () + kHeight))};
}

std::string
badge (const std::string &word, const std::string &kind)
{
  return "<span class=\"badge " + kind + "\">" + escaped (word) + "</span>";
}

Page::Page (const std::string &title, const std::string &style)
    : text_ ("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
             "<title>" +
             escaped (title) +
             "</title>\n<meta name=\"viewport\" "
             "content=\"width=device-width,initial-scale=1\">\n<style>" +
             kStyle + style + "</style></head><body>\n")
{
}

Page &
Page::html (std::string_view text)
{
  text_ += text;
  return *this;
}

Page &
Page::heading (std::string_view title)
{
  return html ("<h2>" + escaped (title) + "</h2>\n");
}

Page &
Page::rows (const Rows &all)
{
  text_ += "<dl>\n";
  for (const auto &[name, text] : all)
    text_ += "<dt>" + escaped (name) + "</dt><dd>" + typeset (text) + "</dd>\n";
  return html ("</dl>\n");
}

Page &
Page::picture (std::string_view png, const std::string &caption,
    const char *kind, const std::string &overlay)
{
  const std::string safe = escaped (caption);
  return html ("<figure class=\"" + std::string (kind) + "\"><div><img alt=\"" +
               safe + "\" src=\"" + data_url ("image/png", png) + "\">" +
               overlay + "</div><figcaption>" + safe +
               "</figcaption></figure>\n");
}

Page &
Page::chart (
    const Chart &chart, const std::string &caption, const std::string &kind)
{
  return html ("<figure class=\"" + kind + "\">" + chart.svg () +
               "<figcaption>" + escaped (caption) + "</figcaption></figure>\n");
}

Page &
Page::table (const std::vector<std::vector<std::string>> &lines, bool has_head)
{
  text_ += "<div class=\"table\"><table>\n";
  for (std::size_t y = 0; y < lines.size (); y++) {
    text_ += "<tr>";
    for (std::size_t x = 0; x < lines[y].size (); x++) {
      const std::string tag = x == 0 || (has_head && y == 0) ? "th" : "td";
      text_ += "<" + tag + ">" + lines[y][x] + "</" + tag + ">";
    }
    text_ += "</tr>\n";
  }
  return html ("</table></div>\n");
}

} // namespace codedexposure::app
