/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "excerpt.h"

#include <cinttypes>
#include <cstring>

#include "each_element.h"
#include "report.h"

using namespace codedexposure::gst;
using report::format;

namespace
{

/* Recordings round times to a microsecond. */
constexpr GstClockTime kRounding = 10 * GST_USECOND;

} // namespace

std::optional<Excerpt>
Excerpt::parse (const std::string &text)
{
  Excerpt excerpt;
  int length = 0;
  if (std::sscanf (text.c_str (), "%" SCNu64 ":%n", &excerpt.from, &length) < 1)
    return std::nullopt;
  const char *rest = text.c_str () + length;
  if (length == 0 || std::strchr (text.c_str (), '-'))
    return std::nullopt;
  if (*rest != ':' &&
      std::sscanf (rest, "%" SCNu64 "%n", &excerpt.until, &length) == 1)
    rest += length;
  length = 0;
  const bool complete = std::sscanf (rest, ":%u:%u%n", &excerpt.before,
                            &excerpt.after, &length) == 2 &&
                        rest[length] == '\0';
  return complete && excerpt.from < excerpt.until ? std::optional (excerpt)
                                                  : std::nullopt;
}

/* A neighbouring excerpt rounds the same. */
bool
Excerpt::holds (GstClockTime coded_pts) const
{
  return coded_pts + kRounding >= from &&
         (!GST_CLOCK_TIME_IS_VALID (until) || coded_pts + kRounding < until);
}

/* A period more at both ends: times vary, and the last frame of a segment may
 * be cut. */
std::pair<GstClockTime, GstClockTime>
Excerpt::read (GstClockTime period) const
{
  const GstClockTime early = (before + 1) * period;
  return {from > early ? from - early : 0, GST_CLOCK_TIME_IS_VALID (until)
                                               ? until + (after + 1) * period
                                               : GST_CLOCK_TIME_NONE};
}

/** Of one output. */
struct ExcerptFilter::Gate {
  ExcerptFilter *filter;
  std::string name;
  /* Streaming thread: */
  bool open = false;
  bool in_order = true;
  guint64 frame = 0;
  GstClockTime pts = 0; ///< of the coded frame
  gint pictures = 0;    ///< of the coded frame so far

  bool take (GstBuffer *picture);
  void end_frame ();
};

/* Writes what came of a coded frame. */
void
ExcerptFilter::Gate::end_frame ()
{
  if (open && pictures > 0)
    filter->write ("pictures", pts,
        format ("%" G_GUINT64_FORMAT " %d %s %s", frame, pictures,
            in_order ? "in-order" : "out-of-order", name.c_str ()));
  pictures = 0;
}

/* The first picture of a coded frame decides for all of them: its time is that
 * of the coded frame. */
bool
ExcerptFilter::Gate::take (GstBuffer *picture)
{
  static const char *const kMeta = "CodedExposureFrame";
  GstCustomMeta *meta = gst_meta_get_info (kMeta)
                            ? gst_buffer_get_custom_meta (picture, kMeta)
                            : nullptr;
  guint64 number = frame + 1;
  gint slot = -1;
  if (meta) {
    const GstStructure *fields = gst_custom_meta_get_structure (meta);
    gst_structure_get_uint64 (fields, "frame", &number);
    gst_structure_get_int (fields, "subframe", &slot);
  }
  if (slot <= 0 || number != frame || pictures == 0) {
    end_frame ();
    frame = number;
    pts = GST_BUFFER_PTS (picture);
    open = filter->excerpt_.holds (pts);
    in_order = true;
  }
  in_order &= slot == (slot < 0 ? -1 : pictures);
  pictures++;
  return open;
}

ExcerptFilter::ExcerptFilter (GstElement *pipeline, GstPad *coded,
    const Excerpt &excerpt, const std::string &ledger)
    : excerpt_ (excerpt)
{
  if (!ledger.empty ()) {
    ledger_.reset (std::fopen (ledger.c_str (), "w"));
    failed_ = !ledger_;
  }
  for_each_element (pipeline, [this] (GstElement *element) {
    if (std::string_view (GST_OBJECT_NAME (element)).ends_with (kName))
      add_gate (element);
  });
  gst_pad_add_probe (
      coded, GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
        auto *filter = static_cast<ExcerptFilter *> (self);
        const GstClockTime pts =
            GST_BUFFER_PTS (GST_PAD_PROBE_INFO_BUFFER (info));
        if (filter->excerpt_.holds (pts))
          filter->write ("coded", pts, "");
        return GST_PAD_PROBE_OK;
      },
      this, nullptr);
}

ExcerptFilter::~ExcerptFilter () = default;

void
ExcerptFilter::add_gate (GstElement *identity)
{
  auto &gate = gates_.emplace_back (
      std::make_unique<Gate> (Gate{this, GST_OBJECT_NAME (identity)}));
  const ObjectPtr<GstPad> pad (gst_element_get_static_pad (identity, "src"));
  gst_pad_add_probe (
      pad.get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *, GstPadProbeInfo *info, gpointer self) {
        return static_cast<Gate *> (self)->take (
                   GST_PAD_PROBE_INFO_BUFFER (info))
                   ? GST_PAD_PROBE_OK
                   : GST_PAD_PROBE_DROP;
      },
      gate.get (), nullptr);
}

/* From the threads of all pads; stdio locks. */
void
ExcerptFilter::write (
    const char *kind, GstClockTime pts, const std::string &rest)
{
  if (ledger_ && std::fprintf (ledger_.get (), "%s %" G_GUINT64_FORMAT "%s%s\n",
                     kind, pts, rest.empty () ? "" : " ", rest.c_str ()) < 0)
    failed_ = true;
}

bool
ExcerptFilter::finish ()
{
  for (const auto &gate : gates_)
    gate->end_frame ();
  return (!ledger_ || std::fclose (ledger_.release ()) == 0) && !failed_;
}
