/* SPDX-License-Identifier: LGPL-2.1-or-later */
/**
 * SECTION:element-codedexposure-filesink
 * @title: codedexposure-filesink
 * @short_description: A file for fast cameras
 *
 * Writes a stream to a file, as `filesink` does, for data rates near those of
 * the disk. The bytes go on to the disk at once and leave the page cache, so
 * the memory stays free. With #codedexposure-filesink:reserve, the file system
 * allocates the space before the stream begins, and a disk without it is an
 * error then and not when it is full.
 *
 * If the program is killed, all that came is in the file. A flush, which a seek
 * may bring, begins the file anew, and so does a run after the READY state;
 * after the end of the stream, the file is finished, and what comes then is an
 * error.
 *
 * ## Example pipeline
 * |[
 * gst-launch-1.0 -e videotestsrc num-buffers=100 \
 *     ! video/x-raw,format=GRAY8,framerate=100/1,width=2048,height=2048 \
 *     ! codedexposure-sim ! codedexposure-recordmux codec=raw \
 *     ! codedexposure-filesink location=fast.mkv
 * ]|
 *
 * Since: 0.2
 */
#include <memory>
#include <string>
#include <utility>

#include <gst/base/gstbasesink.h>

#include "common/element.h"
#include "common/elements.h"
#include "record/file_writer.h"

using namespace codedexposure;
using namespace codedexposure::gst;

namespace
{

struct FileState {
  /* Object lock: */
  std::string location;
  guint64 reserve = 0;
  std::string problem; // why the file could not be finished

  /* Streaming thread, and start and stop, which exclude it: */
  std::unique_ptr<FileWriter> file;
  bool is_finished = false;
};

struct GstCodedExposureFileSink : Instance<GstBaseSink, FileState> {
};

constexpr auto &state_of = state_in<GstCodedExposureFileSink>;

void
fail (GstBaseSink *sink, const Error &error)
{
  FileState &state = state_of (sink);
  state.file.reset ();
  post_write_error (GST_ELEMENT (sink), state.problem, error.message);
}

gboolean
start (GstBaseSink *sink) noexcept
{
  FileState &state = state_of (sink);
  const auto [location, reserve] = locked (sink, [&] {
    state.problem.clear ();
    state.is_finished = false;
    return std::pair (state.location, state.reserve);
  });
  if (location.empty ()) {
    POST_ERROR (sink, RESOURCE, NOT_FOUND,
        "codedexposure-filesink has no file to write; set location=FILE");
    return FALSE;
  }
  auto file = FileWriter::open (location, reserve);
  if (!file) {
    fail (sink, file.error ());
    return FALSE;
  }
  state.file = *std::move (file);
  return TRUE;
}

GstFlowReturn
render (GstBaseSink *sink, GstBuffer *buffer) noexcept
{
  FileState &state = state_of (sink);
  if (state.is_finished)
    return refuse_after_end (
        GST_ELEMENT (sink), locked (sink, [&] { return state.location; }));
  if (!state.file)
    return GST_FLOW_ERROR;
  /* To map all of them at once would copy them. */
  for (guint i = 0; i < gst_buffer_n_memory (buffer); i++) {
    GstMemory *memory = gst_buffer_peek_memory (buffer, i);
    GstMapInfo map;
    if (!gst_memory_map (memory, &map, GST_MAP_READ)) {
      POST_ERROR (
          sink, RESOURCE, READ, "The memory of a buffer is unreadable.");
      return GST_FLOW_ERROR;
    }
    const auto written = state.file->write (map.data, map.size);
    gst_memory_unmap (memory, &map);
    if (!written) {
      fail (sink, written.error ());
      return GST_FLOW_ERROR;
    }
  }
  return GST_FLOW_OK;
}

/* False, with an error: the file is not complete. */
bool
finish (GstBaseSink *sink)
{
  FileState &state = state_of (sink);
  const auto file = std::exchange (state.file, nullptr);
  if (!file)
    return true;
  const auto finished = file->finish ();
  if (!finished)
    fail (sink, finished.error ());
  return state.is_finished = finished.ok ();
}

/* What was written before a flush, or in a run that did not end, does not
 * count. False, with an error: the space cannot be reserved again. */
bool
begin_anew (GstElement *element)
{
  const FileState &state = state_of (element);
  if (!state.file)
    return true;
  const auto restarted = state.file->restart ();
  if (!restarted)
    fail (GST_BASE_SINK (element), restarted.error ());
  return restarted.ok ();
}

gboolean
on_event (GstBaseSink *sink, GstEvent *event) noexcept
{
  FileState &state = state_of (sink);
  if (GST_EVENT_TYPE (event) == GST_EVENT_SEGMENT && state.file) {
    const GstSegment *segment = segment_of (event);
    if (segment->format == GST_FORMAT_BYTES)
      state.file->seek (segment->start);
  }
  if (GST_EVENT_TYPE (event) == GST_EVENT_FLUSH_STOP)
    begin_anew (GST_ELEMENT (sink));
  if (GST_EVENT_TYPE (event) == GST_EVENT_EOS && !finish (sink)) {
    gst_event_unref (event);
    return FALSE;
  }
  return parent_class<GstBaseSinkClass> (sink)->event (sink, event);
}

/* A muxer asks whether it can go back and fill in sizes. */
gboolean
on_query (GstBaseSink *sink, GstQuery *query) noexcept
{
  GstFormat format = GST_FORMAT_UNDEFINED;
  if (GST_QUERY_TYPE (query) == GST_QUERY_SEEKING) {
    gst_query_parse_seeking (query, &format, nullptr, nullptr, nullptr);
    const bool bytes =
        format == GST_FORMAT_BYTES || format == GST_FORMAT_DEFAULT;
    gst_query_set_seeking (query, GST_FORMAT_BYTES, bytes, 0, -1);
    return TRUE;
  }
  return parent_class<GstBaseSinkClass> (sink)->query (sink, query);
}

gboolean
stop (GstBaseSink *sink) noexcept
{
  return finish (sink);
}

PropertyTable<FileState>
properties ()
{
  return {
      {"location", "File location", "File to write; overwritten when it exists",
          kReadWriteReady, &FileState::location},
      {"reserve", "Reserve",
          "Bytes that are allocated before the stream begins; what is not used "
          "is free again at the end",
          kReadWriteReady, &FileState::reserve, guint64 (0),
          guint64 (G_MAXINT64)},
      {"problem", "Problem",
          "Why the file could not be finished; empty: it was, or is still "
          "written",
          kReadOnly, [] (const FileState &state) { return state.problem; }}};
}

constexpr StateHooks kRun{.begin = begin_anew};

void
set_up (gpointer klass)
{
  install_state<GstCodedExposureFileSink, properties> (klass);
  install_run<kRun> (klass);
  describe_element (klass, "Coded exposure file sink", "Sink/File",
      "Writes a stream to a file at the speed of the disk", {});
  add_pad_template (klass, "sink", {.caps = "ANY"});
  auto *sink_class = GST_BASE_SINK_CLASS (klass);
  sink_class->start = start;
  sink_class->stop = stop;
  sink_class->event = on_event;
  sink_class->query = on_query;
  sink_class->render = render;
}

void
set_up_instance (GstCodedExposureFileSink *self)
{
  gst_base_sink_set_sync (GST_BASE_SINK (self), FALSE);
}

} // namespace

GST_ELEMENT_REGISTER_DEFINE (codedexposure_filesink, "codedexposure-filesink",
    GST_RANK_NONE,
    (type_of<GstCodedExposureFileSink, set_up, set_up_instance> (
        "GstCodedExposureFileSink", GST_TYPE_BASE_SINK)))
