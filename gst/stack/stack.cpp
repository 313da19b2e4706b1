/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-stack
 * @title: codedexposure-stack
 * @short_description: Pictures in one file for programs of the lab
 *
 * Writes pictures to an OME-TIFF file (.ome.tif, .ome.tiff), an HDF5 file (.h5)
 * or an OME-Zarr folder (.ome.zarr), with the time, the slot, the number and
 * the synchronisation of each, and the schedule. No picture stays in memory.
 * The file is finished at the end of the stream; until then it says that it is
 * not, also if the stream breaks off, and then it has all pictures that came. A
 * folder .ome.zarr can be read at any moment, also after a kill.
 *
 * A flush, which a seek may bring, begins the file anew with the next picture,
 * and so does a run after the READY state; after the end of the stream, the
 * file is finished, and pictures that come then are an error.
 *
 * docs/formats.md describes the files.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 filesrc location=coded.mkv ! matroskademux ! avdec_ffv1 \
 *     ! codedexposure-demux ! queue ! codedexposure-stack location=fast.ome.tif
 * ]|
 *
 * Since: 0.2
 */
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <gst/base/gstbasesink.h>

#include "common/element.h"
#include "common/meta.h"
#include "common/tag.h"
#include "stack_file.h"

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

struct Stack {
  /* Object lock: */
  std::string location;
  bool deflate = false;
  guint64 classic = G_GUINT64_CONSTANT (4'000'000'000);
  std::string problem; // why the file could not be finished

  /* Streaming thread: */
  GstVideoInfo info = {};
  std::string origin;         // of the pictures that come
  std::string written_origin; // of those in the file
  int tagged_bits = 0;
  std::unique_ptr<StackFile> file;
  bool is_finished = false;
};

struct GstCodedExposureStack : Instance<GstBaseSink, Stack> {
};

/** A kind of file, by the ending of its name. */
struct Form {
  std::string_view ending;
  decltype (&open_ome_tiff) open; ///< null: this build has not its library
  const char *needs;              ///< which build again needs
};
#ifdef CODEDEXPOSURE_TIFF
constexpr auto kTiff = open_ome_tiff;
#else
constexpr decltype (&open_ome_tiff) kTiff = nullptr;
#endif
#ifdef CODEDEXPOSURE_HDF5
constexpr auto kHdf5 = open_hdf5;
#else
constexpr decltype (&open_hdf5) kHdf5 = nullptr;
#endif
#ifdef CODEDEXPOSURE_ZARR
constexpr auto kZarr = open_ome_zarr;
#else
constexpr decltype (&open_ome_zarr) kZarr = nullptr;
#endif
constexpr Form kForms[] = {{".ome.tif", kTiff, "libtiff-dev"},
    {".ome.tiff", kTiff, "libtiff-dev"}, {".h5", kHdf5, "libhdf5-dev"},
    {".ome.zarr", kZarr, "libzstd-dev"}};

constexpr auto &state_of = state_in<GstCodedExposureStack>;

/* Its name without the ending of a file that is not finished. */
std::string
final_name (const std::string &location)
{
  constexpr std::string_view kPart = ".part";
  return location.ends_with (kPart)
             ? location.substr (0, location.size () - kPart.size ())
             : location;
}

/* Null, with an error: this build, or nobody, writes such a file. */
const Form *
form_of (GstElement *self, const std::string &location)
{
  const std::string name = final_name (location);
  for (const Form &form : kForms) {
    if (!name.ends_with (form.ending))
      continue;
    if (form.open)
      return &form;
    POST_ERROR (self, RESOURCE, SETTINGS,
        "this build writes no " + std::string (form.ending) + "; install " +
            form.needs + " and build again, or choose another ending");
    return nullptr;
  }
  POST_ERROR (self, RESOURCE, SETTINGS,
      name + " has another ending than .ome.tif, .ome.tiff, .h5 or .ome.zarr; "
             "choose one of these");
  return nullptr;
}

/* The bytes that the stream will have without compression; none if its length
 * is not known. */
std::optional<double>
expected_size (GstBaseSink *sink, const StackFormat &format)
{
  constexpr double kDescription = 600; // bytes of a picture, at most
  const GstSegment &segment = sink->segment;
  gint64 length = 0;
  if (GST_CLOCK_TIME_IS_VALID (segment.stop))
    length = gint64 (segment.stop - segment.start);
  else if (!gst_pad_peer_query_duration (
               GST_BASE_SINK_PAD (sink), GST_FORMAT_TIME, &length))
    return std::nullopt;
  if (length <= 0 || format.rate.num <= 0)
    return std::nullopt;
  const double pictures =
      2 + 1e-9 * double (length) * format.rate.num / format.rate.den;
  return pictures *
         (double (format.width) * format.height * format.bytes + kDescription);
}

/* Whether the file needs the 64-bit form of TIFF; says so. */
bool
needs_big (GstBaseSink *sink, const StackFormat &format, guint64 classic)
{
  const auto size = expected_size (sink, format);
  if (size && *size <= double (classic))
    return false;
  POST_WARNING (sink, STREAM, FORMAT,
      std::string (size ? "the pictures may need more than 4 GiB"
                        : "the length of the stream is not known") +
          ", so the file is a BigTIFF, which ImageJ cannot open without "
          "Bio-Formats; write a shorter part for it, or .h5");
  return true;
}

GstFlowReturn
fail (GstBaseSink *sink, const Error &error)
{
  Stack &state = state_of (sink);
  state.file.reset ();
  post_write_error (GST_ELEMENT (sink), state.problem, error.message);
  return GST_FLOW_ERROR;
}

void
open_file (GstBaseSink *sink, GstBuffer *picture)
{
  Stack &state = state_of (sink);
  const GstVideoInfo &info = state.info;
  StackFormat format{.width = info.width,
      .height = info.height,
      .bytes = int (GST_VIDEO_INFO_COMP_DEPTH (&info, 0)) / 8,
      .bits = bits_of (picture, info, 0, state.tagged_bits),
      .rate = {info.fps_n, std::max (info.fps_d, 1)}};
  std::string location;
  guint64 classic = 0;
  locked (sink, [&] {
    location = state.location;
    classic = state.classic;
    format.deflate = state.deflate;
  });
  const Form *form = form_of (GST_ELEMENT (sink), location);
  format.big = form->open == kTiff && needs_big (sink, format, classic);
  state.file = form->open (location, format);
  state.written_origin.clear ();
}

StackRow
row_of (GstBaseSink *sink, GstBuffer *picture)
{
  StackRow row;
  row.pts = gst_segment_to_stream_time (
      &sink->segment, GST_FORMAT_TIME, GST_BUFFER_PTS (picture));
  row.duration = GST_BUFFER_DURATION (picture);
  row.corrupted = is_corrupted (picture);
  if (const auto meta = get_frame_meta (picture)) {
    row.frame = meta->frame;
    row.slot = meta->subframe;
    row.exposure = meta->exposure_duration;
    row.synchronised = meta->locked;
    row.lost_before = meta->lost_before;
  }
  return row;
}

GstFlowReturn
render (GstBaseSink *sink, GstBuffer *picture) noexcept
{
  Stack &state = state_of (sink);
  if (state.is_finished)
    return refuse_after_end (
        GST_ELEMENT (sink), locked (sink, [&] { return state.location; }));
  MappedFrame mapped (state.info, picture, GST_MAP_READ);
  if (!mapped)
    return refuse_buffer (sink, state.info, picture);
  try {
    if (!state.file)
      open_file (sink, picture);
    if (state.origin != state.written_origin) {
      state.file->add_origin (state.origin);
      state.written_origin = state.origin;
    }
    state.file->add (row_of (sink, picture),
        static_cast<const guint8 *> (
            GST_VIDEO_FRAME_PLANE_DATA (mapped.frame (), 0)),
        gsize (GST_VIDEO_FRAME_PLANE_STRIDE (mapped.frame (), 0)));
    return GST_FLOW_OK;
  } catch (const Error &error) {
    return fail (sink, error);
  } catch (const std::exception &error) {
    return fail (sink, Error{error.what ()});
  }
}

/* @whole: at the end of the stream. False, with an error: the file lacks
 * pictures. */
bool
finish (GstBaseSink *sink, bool whole)
{
  Stack &state = state_of (sink);
  try {
    if (const auto file = std::exchange (state.file, nullptr)) {
      file->finish (whole);
      state.is_finished = whole;
    }
    return true;
  } catch (const Error &error) {
    fail (sink, error);
  } catch (const std::exception &error) {
    fail (sink, Error{error.what ()});
  }
  return false;
}

/* Schedule and mapping of coded frames, or the provenance of pictures. */
void
take_origin (Stack &state, GstEvent *event)
{
  GstTagList *tags = tags_of (event);
  if (const auto provenance = provenance_from_tags (tags);
      provenance && *provenance)
    state.origin = (*provenance)->to_json ();
  else if (const auto setup = setup_from_tags (tags); setup && *setup)
    state.origin = (*setup)->to_json ();
}

gboolean
on_event (GstBaseSink *sink, GstEvent *event) noexcept
{
  if (GST_EVENT_TYPE (event) == GST_EVENT_TAG)
    take_origin (state_of (sink), event);
  follow_tagged_bits (event, state_of (sink).tagged_bits);
  if (GST_EVENT_TYPE (event) == GST_EVENT_FLUSH_STOP)
    state_of (sink).file.reset (); // what was written does not count
  if (GST_EVENT_TYPE (event) == GST_EVENT_EOS && !finish (sink, true)) {
    gst_event_unref (event);
    return FALSE;
  }
  return parent_class<GstBaseSinkClass> (sink)->event (sink, event);
}

gboolean
set_caps (GstBaseSink *sink, GstCaps *caps) noexcept
{
  Stack &state = state_of (sink);
  GstVideoInfo info;
  if (!gst_video_info_from_caps (&info, caps))
    return FALSE;
  if (state.file &&
      (info.width != state.info.width || info.height != state.info.height ||
          GST_VIDEO_INFO_FORMAT (&info) !=
              GST_VIDEO_INFO_FORMAT (&state.info))) {
    POST_ERROR (sink, STREAM, FORMAT,
        "the size or the depth of the pictures changes, but a stack has one "
        "for all; write a folder of pictures");
    return FALSE;
  }
  state.info = info;
  return TRUE;
}

gboolean
start (GstBaseSink *sink) noexcept
{
  Stack &state = state_of (sink);
  const std::string location = locked (sink, [&] {
    state.problem.clear ();
    return state.location;
  });
  state.origin.clear ();
  state.tagged_bits = 0;
  state.is_finished = false;
  return form_of (GST_ELEMENT (sink), location) != nullptr;
}

void
end_run (GstElement *element)
{
  finish (GST_BASE_SINK (element), false);
}

PropertyTable<Stack>
properties ()
{
  return {{"location", "File",
              "The file to write; its ending, .ome.tif, .ome.tiff, .h5 or "
              ".ome.zarr "
              "(a folder), selects the format. An ending .part after that is "
              "ignored",
              kReadWriteReady, &Stack::location},
      {"deflate", "Deflate",
          "Compress the pictures without loss (zstd in .ome.zarr): smaller "
          "files, slower to read and write",
          kReadWriteReady, &Stack::deflate},
      {"classic-size", "Largest classic TIFF",
          "Bytes from which on a TIFF file is a BigTIFF, which ImageJ cannot "
          "open without Bio-Formats",
          kReadWriteReady, &Stack::classic, guint64 (0),
          G_GUINT64_CONSTANT (4'000'000'000)},
      {"problem", "Problem",
          "Why the file could not be finished; empty: it was, or is still "
          "written",
          kReadOnly, [] (const Stack &state) { return state.problem; }}};
}

constexpr StateHooks kRun{.end = end_run};

void
set_up (gpointer klass)
{
  install_state<GstCodedExposureStack, properties> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Coded exposure stack", "Sink/File/Video",
      "Writes pictures with their times to OME-TIFF, HDF5 or OME-Zarr",
      {"sink"});
  auto *sink_class = GST_BASE_SINK_CLASS (klass);
  sink_class->set_caps = set_caps;
  sink_class->event = on_event;
  sink_class->render = render;
  sink_class->start = start;
}

void
set_up_instance (GstCodedExposureStack *self)
{
  gst_base_sink_set_sync (GST_BASE_SINK (self), FALSE);
}

} // namespace

static gboolean
plugin_init (GstPlugin *plugin)
{
  register_meta (kFrameMetaName);
  return gst_element_register (plugin, "codedexposure-stack", GST_RANK_NONE,
      type_of<GstCodedExposureStack, set_up, set_up_instance> (
          "GstCodedExposureStack", GST_TYPE_BASE_SINK));
}

GST_PLUGIN_DEFINE (GST_VERSION_MAJOR, GST_VERSION_MINOR, codedexposurestack,
    "Pictures of a coded exposure in files of the lab", plugin_init,
    PACKAGE_VERSION, "LGPL", PACKAGE, "Unknown package origin")
