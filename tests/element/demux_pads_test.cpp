/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux: pads that are added and removed, their events and their
 * combined flow. */
#include "harness.h"

#include <atomic>
#include <thread>

#include "common/tag.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr GstClockTime kPeriod = 40 * GST_MSECOND;
constexpr char kLine[] = "codedexposure-demux schedule=sequential:2x2";

BufferPtr
coded_frame (guint64 number)
{
  return frame_of (draw<std::uint8_t> (
                       16, 16, [&] (int x, int y) { return x + 16 * (y % 8); }),
      number * kPeriod);
}

void
start_stream (ElementHarness &demux, const char *id = "stream")
{
  demux.push_event (gst_event_new_stream_start (id));
  demux.set_caps (gray_caps (16, 16));
}

ObjectPtr<GstPad>
request (ElementHarness &demux, const char *name)
{
  return ObjectPtr<GstPad> (
      gst_element_request_pad_simple (demux.element (), name));
}

/* A sink pad that records buffers and returns a given flow. */
class FlowSink
{
public:
  FlowSink (ElementHarness &demux, const std::string &name,
      std::vector<std::string> *log = nullptr)
      : name_ (name), log_ (log), pad_ (gst_pad_new ("sink", GST_PAD_SINK)),
        src_ (name == "src"
                  ? gst_element_get_static_pad (demux.element (), "src")
                  : gst_element_request_pad_simple (
                        demux.element (), name.c_str ())),
        element_ (demux.element ())
  {
    gst_object_ref_sink (pad_.get ());
    gst_pad_set_element_private (pad_.get (), this);
    gst_pad_set_chain_function (pad_.get (), take);
    gst_pad_set_active (pad_.get (), TRUE);
    EXPECT_EQ (gst_pad_link (src_.get (), pad_.get ()), GST_PAD_LINK_OK);
  }
  ~FlowSink ()
  {
    gst_pad_set_active (pad_.get (), FALSE);
    gst_pad_unlink (src_.get (), pad_.get ());
    if (name_ != "src")
      gst_element_release_request_pad (element_, src_.get ());
  }

  GstFlowReturn flow = GST_FLOW_OK;
  int buffers = 0;

private:
  static GstFlowReturn take (GstPad *pad, GstObject *, GstBuffer *buffer)
  {
    const BufferPtr owned (buffer);
    auto *self = static_cast<FlowSink *> (gst_pad_get_element_private (pad));
    self->buffers++;
    if (self->log_)
      self->log_->push_back (
          self->name_ + " " +
          std::to_string (GST_BUFFER_PTS (buffer) / GST_MSECOND));
    return self->flow;
  }

  std::string name_;
  std::vector<std::string> *log_;
  ObjectPtr<GstPad> pad_;
  ObjectPtr<GstPad> src_;
  GstElement *element_;
};

/* --------------------------------------------------------------- names -- */

TEST (DemuxPads, AreNumberedFromTheLowestFreeIndex)
{
  ElementHarness demux (kLine);
  const auto name = [&] (const char *asked) {
    const ObjectPtr<GstPad> pad = request (demux, asked);
    return pad ? std::string (GST_PAD_NAME (pad.get ())) : "";
  };
  EXPECT_EQ (name ("subframe_1"), "subframe_1");
  EXPECT_EQ (name ("subframe_%u"), "subframe_0");
  EXPECT_EQ (name ("subframe_%u"), "subframe_2");
  EXPECT_EQ (name ("coded"), "coded");
}

TEST (DemuxPads, HaveAnIndexThatASubframeCanHave)
{
  ElementHarness demux (kLine);
  EXPECT_TRUE (request (demux, "subframe_255"));
  EXPECT_FALSE (request (demux, "subframe_256"));
  EXPECT_NE (demux.warning ().find ("subframe_255"), std::string::npos);
}

TEST (DemuxPads, CanBeAskedForAgainAfterTheirRelease)
{
  ElementHarness demux (kLine);
  for (const char *name : {"coded", "subframe_1"}) {
    const ObjectPtr<GstPad> pad = request (demux, name);
    ASSERT_TRUE (pad);
    gst_element_release_request_pad (demux.element (), pad.get ());
    EXPECT_TRUE (request (demux, name)) << name;
  }
}

TEST (DemuxPads, AreLinkedInsideToTheSink)
{
  ElementHarness demux (kLine);
  const ObjectPtr<GstPad> sink (
      gst_element_get_static_pad (demux.element (), "sink"));
  const ObjectPtr<GstPad> src (
      gst_element_get_static_pad (demux.element (), "src"));
  for (GstPad *pad : {src.get (), request (demux, "coded").get ()}) {
    GstIterator *links = gst_pad_iterate_internal_links (pad);
    GValue item = G_VALUE_INIT;
    ASSERT_EQ (gst_iterator_next (links, &item), GST_ITERATOR_OK);
    EXPECT_EQ (g_value_get_object (&item), sink.get ());
    g_value_reset (&item);
    EXPECT_EQ (gst_iterator_next (links, &item), GST_ITERATOR_DONE);
    g_value_unset (&item);
    gst_iterator_free (links);
  }
}

/* -------------------------------------------------------- sticky events -- */

std::string
stream_id (GstPad *pad)
{
  return CharPtr (gst_pad_get_stream_id (pad)).get ();
}

TEST (DemuxPads, StreamIdsAreThatOfUpstreamAndThePadsName)
{
  ElementHarness demux (kLine);
  GstHarness *one = demux.request ("subframe_1");
  GstHarness *coded = demux.request ("coded");
  GstEvent *start = gst_event_new_stream_start ("camera-7");
  gst_event_set_group_id (start, 42);
  gst_event_set_stream_flags (start, GST_STREAM_FLAG_SELECT);
  const guint32 number = gst_event_get_seqnum (start);
  demux.push_event (start);
  EXPECT_EQ (stream_id (demux.get ()->sinkpad), "camera-7/src");
  EXPECT_EQ (stream_id (one->sinkpad), "camera-7/subframe_1");
  EXPECT_EQ (stream_id (coded->sinkpad), "camera-7/coded");

  const EventPtr event (
      gst_pad_get_sticky_event (one->sinkpad, GST_EVENT_STREAM_START, 0));
  guint group = 0;
  GstStreamFlags flags = GST_STREAM_FLAG_NONE;
  EXPECT_TRUE (gst_event_parse_group_id (event.get (), &group));
  gst_event_parse_stream_flags (event.get (), &flags);
  EXPECT_EQ (group, 42u);
  EXPECT_EQ (flags, GST_STREAM_FLAG_SELECT);
  EXPECT_EQ (gst_event_get_seqnum (event.get ()), number);
}

std::vector<std::string>
event_names (GstHarness *h)
{
  std::vector<std::string> names;
  while (GstEvent *event = gst_harness_try_pull_event (h)) {
    const EventPtr owned (event);
    if (GST_EVENT_TYPE (event) != GST_EVENT_RECONFIGURE)
      names.emplace_back (GST_EVENT_TYPE_NAME (event));
  }
  return names;
}

const std::vector<std::string> kAllSticky = {
    "stream-start", "caps", "segment", "tag"};

TEST (DemuxPads, LatePadIsToldWhatTheOthersWereTold)
{
  ElementHarness demux (kLine);
  start_stream (demux);
  demux.push_event (schedule_to_event (Schedule ()));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);

  GstHarness *late = demux.request ("subframe_2");
  GstHarness *coded = demux.request ("coded");
  ASSERT_EQ (demux.push (coded_frame (1)), GST_FLOW_OK);
  EXPECT_EQ (event_names (late), kAllSticky);
  EXPECT_EQ (event_names (coded), kAllSticky);
  EXPECT_EQ (stream_id (late->sinkpad), "stream/subframe_2");
  EXPECT_TRUE (same_caps (demux.pad_caps ("subframe_2").get (),
      gray_caps (8, 8, "25/1") + ",pixel-aspect-ratio=1/1"));
  EXPECT_TRUE (same_caps (demux.pad_caps ("coded").get (), gray_caps (16, 16)));

  const BufferPtr first = demux.pull ("subframe_2");
  ASSERT_TRUE (first);
  EXPECT_EQ (GST_BUFFER_PTS (first.get ()), kPeriod + kPeriod / 2);
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (first.get ()));
  EXPECT_EQ (GST_BUFFER_OFFSET (first.get ()), 0u);
  EXPECT_TRUE (GST_BUFFER_IS_DISCONT (demux.pull ("coded").get ()));
}

TEST (DemuxPads, PadBetweenCapsAndTheFirstFrameIsToldInOrder)
{
  ElementHarness demux (kLine);
  start_stream (demux);
  GstHarness *late = demux.request ("subframe_2");
  demux.push_event (schedule_to_event (Schedule ()));
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  EXPECT_EQ (event_names (late), kAllSticky);
  EXPECT_TRUE (demux.pull ("subframe_2"));
}

TEST (DemuxPads, PadThatComesAfterTheEndIsToldOfIt)
{
  ElementHarness demux (kLine);
  start_stream (demux);
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  demux.push_event (gst_event_new_eos ());
  const ObjectPtr<GstPad> late = request (demux, "subframe_2");
  for (GstEventType type : {GST_EVENT_STREAM_START, GST_EVENT_CAPS,
           GST_EVENT_SEGMENT, GST_EVENT_EOS}) {
    const EventPtr event (gst_pad_get_sticky_event (late.get (), type, 0));
    EXPECT_TRUE (event) << gst_event_type_get_name (type);
  }
}

TEST (DemuxPads, CustomStickyAndUnserialisedEventsReachEveryPad)
{
  ElementHarness demux (kLine);
  demux.request ("coded");
  start_stream (demux);
  ASSERT_EQ (demux.push (coded_frame (0)), GST_FLOW_OK);
  demux.push_event (gst_event_new_custom (GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
      gst_structure_new_empty ("calibration")));
  demux.push_event (gst_event_new_custom (
      GST_EVENT_CUSTOM_DOWNSTREAM_OOB, gst_structure_new_empty ("shout")));
  for (const char *pad : {"", "coded"}) {
    EXPECT_TRUE (demux.pull_event (GST_EVENT_CUSTOM_DOWNSTREAM_STICKY, pad));
    EXPECT_TRUE (demux.pull_event (GST_EVENT_CUSTOM_DOWNSTREAM_OOB, pad));
  }
}

/* ----------------------------------------------------------------- flow -- */

TEST (DemuxPads, CodedIsServedFirstThenSubframesInOrder)
{
  ElementHarness demux (kLine, "sink", nullptr);
  std::vector<std::string> log;
  FlowSink src (demux, "src", &log), second (demux, "subframe_1", &log),
      coded (demux, "coded", &log);
  start_stream (demux);
  ASSERT_EQ (demux.push (coded_frame (1)), GST_FLOW_OK);
  EXPECT_EQ (log, (std::vector<std::string>{"coded 40", "src 40", "src 50",
                      "subframe_1 50", "src 60", "src 70"}));
}

struct FlowCase {
  GstFlowReturn src, one, coded, together;
};

class DemuxFlow : public ::testing::TestWithParam<FlowCase>
{
};

constexpr GstFlowReturn kOk = GST_FLOW_OK, kUnlinked = GST_FLOW_NOT_LINKED,
                        kEos = GST_FLOW_EOS, kFlushing = GST_FLOW_FLUSHING,
                        kError = GST_FLOW_ERROR,
                        kRefused = GST_FLOW_NOT_NEGOTIATED;

INSTANTIATE_TEST_SUITE_P (Combinations, DemuxFlow,
    ::testing::Values (FlowCase{kOk, kOk, kOk, kOk},
        FlowCase{kUnlinked, kOk, kUnlinked, kOk},
        FlowCase{kOk, kUnlinked, kUnlinked, kOk},
        FlowCase{kUnlinked, kUnlinked, kOk, kOk},
        FlowCase{kUnlinked, kUnlinked, kUnlinked, kUnlinked},
        FlowCase{kEos, kOk, kOk, kOk}, FlowCase{kEos, kEos, kOk, kOk},
        FlowCase{kEos, kEos, kEos, kEos},
        FlowCase{kEos, kUnlinked, kUnlinked, kEos},
        FlowCase{kOk, kOk, kError, kError}, FlowCase{kOk, kError, kOk, kError},
        FlowCase{kError, kEos, kOk, kError},
        FlowCase{kOk, kFlushing, kOk, kFlushing},
        FlowCase{kOk, kRefused, kUnlinked, kRefused}));

TEST_P (DemuxFlow, OfAllPadsTogether)
{
  const FlowCase &c = GetParam ();
  ElementHarness demux (kLine, "sink", nullptr);
  FlowSink src (demux, "src"), one (demux, "subframe_1"),
      coded (demux, "coded");
  src.flow = c.src;
  one.flow = c.one;
  coded.flow = c.coded;
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), c.together);
  if (c.together == kOk) {
    EXPECT_EQ (src.buffers, 4);
    EXPECT_EQ (one.buffers, 1);
    EXPECT_EQ (coded.buffers, 1);
  }
}

TEST_P (DemuxFlow, OfPadsThatAreReallyNotLinked)
{
  const FlowCase &c = GetParam ();
  ElementHarness demux (kLine, "sink", nullptr);
  std::unique_ptr<FlowSink> sinks[3];
  ObjectPtr<GstPad> loose[3];
  const char *names[] = {"src", "subframe_1", "coded"};
  const GstFlowReturn flows[] = {c.src, c.one, c.coded};
  for (int i = 0; i < 3; i++) {
    if (flows[i] == kUnlinked) {
      if (i > 0)
        loose[i] = request (demux, names[i]);
      continue;
    }
    sinks[i] = std::make_unique<FlowSink> (demux, names[i]);
    sinks[i]->flow = flows[i];
  }
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), c.together);
}

TEST (DemuxPads, FatalFlowStopsTheFrame)
{
  ElementHarness demux (kLine, "sink", nullptr);
  FlowSink src (demux, "src"), coded (demux, "coded");
  coded.flow = kError;
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), kError);
  EXPECT_EQ (src.buffers, 0);
}

TEST (DemuxPads, FlushMakesThePadsForgetTheirEnd)
{
  ElementHarness demux (kLine, "sink", nullptr);
  FlowSink src (demux, "src");
  src.flow = kEos;
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), kEos);
  demux.push_event (gst_event_new_flush_start ());
  demux.push_event (gst_event_new_flush_stop (TRUE));
  start_stream (demux);
  src.flow = kOk;
  EXPECT_EQ (demux.push (coded_frame (0)), kOk);
}

TEST (DemuxPads, FlushMakesThePadsForgetThatTheyWereFlushing)
{
  ElementHarness demux (kLine, "sink", nullptr);
  FlowSink src (demux, "src"), one (demux, "subframe_1");
  one.flow = kFlushing;
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), kFlushing);
  demux.push_event (gst_event_new_flush_start ());
  demux.push_event (gst_event_new_flush_stop (TRUE));
  start_stream (demux);
  one.flow = kOk;
  EXPECT_EQ (demux.push (coded_frame (0)), kOk);
  EXPECT_EQ (one.buffers, 2);
}

TEST (DemuxPads, PadThatIsLinkedLaterGetsTheNextFrame)
{
  ElementHarness demux (kLine, "sink", nullptr);
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), kUnlinked);
  FlowSink src (demux, "src");
  EXPECT_EQ (demux.push (coded_frame (1)), kOk);
  EXPECT_EQ (src.buffers, 4);
}

TEST (DemuxPads, ReleasedPadHasNoSay)
{
  ElementHarness demux (kLine, "sink", nullptr);
  FlowSink src (demux, "src");
  auto bad = std::make_unique<FlowSink> (demux, "subframe_1");
  bad->flow = kError;
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), kError);
  bad.reset ();
  EXPECT_EQ (demux.push (coded_frame (1)), kOk);
}

/* An application that waits for data on a pad blocks it and links it then. */
TEST (DemuxPads, BlockedPadGetsItsBuffers)
{
  ElementHarness demux (kLine, "sink", nullptr);
  const ObjectPtr<GstPad> src (
      gst_element_get_static_pad (demux.element (), "src"));
  int seen = 0;
  gst_pad_add_probe (
      src.get (),
      GstPadProbeType (GST_PAD_PROBE_TYPE_BLOCK | GST_PAD_PROBE_TYPE_BUFFER),
      [] (GstPad *, GstPadProbeInfo *, gpointer count) {
        (*static_cast<int *> (count))++;
        return GST_PAD_PROBE_DROP;
      },
      &seen, nullptr);
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), kOk);
  EXPECT_EQ (seen, 4);
}

TEST (DemuxPads, PadMayBeReleasedFromInsideItsOwnPush)
{
  ElementHarness demux (kLine);
  const ObjectPtr<GstPad> pad = request (demux, "subframe_1");
  gst_pad_add_probe (
      pad.get (), GST_PAD_PROBE_TYPE_BUFFER,
      [] (GstPad *src, GstPadProbeInfo *, gpointer element) {
        gst_element_release_request_pad (GST_ELEMENT (element), src);
        return GST_PAD_PROBE_DROP;
      },
      demux.element (), nullptr);
  gst_pad_add_probe (
      pad.get (), GST_PAD_PROBE_TYPE_BLOCK,
      [] (GstPad *, GstPadProbeInfo *, gpointer) { return GST_PAD_PROBE_PASS; },
      nullptr, nullptr);
  start_stream (demux);
  EXPECT_EQ (demux.push (coded_frame (0)), kOk);
  EXPECT_EQ (demux.push (coded_frame (1)), kOk);
}

/* --------------------------------------------------------------- stress -- */

constexpr guint64 kStressFrames = 3000;

TEST (DemuxStress, PadsComeAndGoWhileFramesPass)
{
  ElementHarness demux (kLine);
  gst_harness_set_drop_buffers (demux.get (), TRUE);
  start_stream (demux);
  GstPadTemplate *templ =
      gst_element_get_pad_template (demux.element (), "subframe_%u");
  GstPadTemplate *coded_templ =
      gst_element_get_pad_template (demux.element (), "coded");
  GstHarnessThread *ones = gst_harness_stress_requestpad_start_full (
      demux.get (), templ, "subframe_2", nullptr, TRUE, 0);
  GstHarnessThread *codeds = gst_harness_stress_requestpad_start_full (
      demux.get (), coded_templ, "coded", nullptr, TRUE, 0);
  for (guint64 frame = 0; frame < kStressFrames; frame++)
    ASSERT_EQ (demux.push (coded_frame (frame)), GST_FLOW_OK);
  EXPECT_GT (gst_harness_stress_thread_stop (ones), 1u);
  EXPECT_GT (gst_harness_stress_thread_stop (codeds), 1u);
  EXPECT_EQ (counter_of (demux.element (), "frames-in"), kStressFrames);
  EXPECT_EQ (demux.error (), "");
}

GstHarnessThread *
stress_property (ElementHarness &demux, const char *name, const char *text)
{
  GValue value = G_VALUE_INIT;
  GParamSpec *spec = g_object_class_find_property (
      G_OBJECT_GET_CLASS (demux.element ()), name);
  g_value_init (&value, spec->value_type);
  EXPECT_TRUE (gst_value_deserialize (&value, text)) << name;
  GstHarnessThread *thread =
      gst_harness_stress_property_start_full (demux.get (), name, &value, 0);
  g_value_unset (&value);
  return thread;
}

TEST (DemuxStress, PropertiesChangeWhileFramesPass)
{
  ElementHarness demux (kLine);
  gst_harness_set_drop_buffers (demux.get (), TRUE);
  start_stream (demux);
  GstHarnessThread *threads[] = {
      stress_property (demux, "schedule", "staircase:2x2"),
      stress_property (demux, "schedule", "sequential:4x4"),
      stress_property (demux, "method", "rank"),
      stress_property (demux, "gain", "2.5"),
      stress_property (demux, "qos", "true")};
  for (guint64 frame = 0; frame < kStressFrames; frame++)
    ASSERT_EQ (demux.push (coded_frame (frame)), GST_FLOW_OK);
  for (GstHarnessThread *thread : threads)
    EXPECT_GT (gst_harness_stress_thread_stop (thread), 1u);
  EXPECT_EQ (demux.error (), "");
  EXPECT_EQ (counter_of (demux.element (), "frames-lost"), 0u);
}

TEST (DemuxStress, ReportsAreReadWhileFramesPass)
{
  ElementHarness demux (kLine);
  gst_harness_set_drop_buffers (demux.get (), TRUE);
  start_stream (demux);
  std::atomic<bool> stop = false;
  std::thread reader ([&] {
    guint64 last = 0;
    while (!stop) {
      const StructurePtr stats (
          property<GstStructure *> (demux.element (), "stats"));
      guint64 out = 0;
      gst_structure_get_uint64 (stats.get (), "subframes-out", &out);
      EXPECT_GE (out, last);
      last = out;
      text_property (demux.element (), "schedule-in-force");
    }
  });
  for (guint64 frame = 0; frame < kStressFrames; frame++)
    ASSERT_EQ (demux.push (coded_frame (frame)), GST_FLOW_OK);
  stop = true;
  reader.join ();
}

} // namespace
