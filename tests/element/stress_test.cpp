/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Every element between threads that do everything at once: state changes,
 * frames, events, flushes, properties, queries and request pads. Afterwards the
 * element works as ever. STRESS_ROUNDS is the number of state changes. */
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <thread>

#include <unistd.h>

#include "common/tag.h"
#include "harness.h"
#include "schedule_tags.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

int
rounds ()
{
  const char *text = std::getenv ("STRESS_ROUNDS");
  return text ? std::atoi (text) : 8;
}

struct Subject {
  const char *name;
  std::string line;
  const char *sink = "sink";
  bool requests = false; ///< it has request pads
};

/* Removed at the end of the program. */
struct Folder {
  Folder ()
  {
    char made[] = "/tmp/stress-XXXXXX";
    path = ::mkdtemp (made);
  }
  ~Folder ()
  {
    for (const char *name : {"/log", "/stats"})
      ::unlink ((path + name).c_str ());
    ::rmdir (path.c_str ());
  }
  std::string path;
};

const Folder &
folder ()
{
  static const Folder made;
  return made;
}

/* All but codedexposure-camerasrc, which looks for cameras in the network; see
 * tests/gige. */
std::vector<Subject>
subjects ()
{
  return {{"demux", "codedexposure-demux", "sink", true},
      {"dmdsync", "dmdsync device=sim:stress"}, {"fuse", "codedexposure-fuse"},
      {"recordmux",
          "codedexposure-recordmux log-location=" + folder ().path + "/log"},
      {"moirecalib", "moirecalib"}, {"scene", "codedexposure-scene", nullptr},
      {"sim", "codedexposure-sim"},
      {"subframestats", "subframestats location=" + folder ().path + "/stats"},
      {"view", "codedexposure-view"}};
}

/** One property of the element, and values to switch between. */
struct Setting {
  std::string name;
  std::vector<std::string> values; ///< the element works with the first
};

/* Texts that are more than a name of something else. */
const std::map<std::string, std::vector<std::string>> kTexts = {
    {"schedule", {"", "sequential:2x2", "staircase:3x2",
                     "sequential:lattice:8/3", "staircase:0x0"}},
    {"mapping", {"", "/nonexistent/mapping.json"}},
    {"dmd", {"", "sim:stress", "usb:"}},
    {"line", {"", "row:50%", "row:"}},
    {"pattern", {"grating-both:4/0", ""}},
};

std::vector<Setting>
settings_of (GstElement *element)
{
  std::vector<Setting> settings;
  guint count = 0;
  GParamSpec **specs =
      g_object_class_list_properties (G_OBJECT_GET_CLASS (element), &count);
  for (guint i = 0; i < count; i++) {
    const GParamSpec *spec = specs[i];
    if (!(spec->flags & G_PARAM_WRITABLE) ||
        spec->owner_type == GST_TYPE_OBJECT)
      continue;
    const auto texts = kTexts.find (spec->name);
    if (spec->value_type == G_TYPE_STRING && texts != kTexts.end ())
      settings.push_back ({spec->name, texts->second});
    else if (spec->value_type == G_TYPE_BOOLEAN)
      settings.push_back ({spec->name, {"false", "true"}});
    else if (G_TYPE_IS_ENUM (spec->value_type))
      settings.push_back ({spec->name, {"0", "1"}});
    else if (g_str_equal (spec->name, "bits"))
      settings.push_back ({spec->name, {"0", "7", "12"}});
  }
  g_free (specs);
  return settings;
}

/** The threads, which begin with it and end before the element does. */
class Storm
{
public:
  explicit Storm (const Subject &subject)
      : subject_ (subject), h_ (subject.line, subject.sink)
  {
    gst_harness_set_drop_buffers (h_.get (), TRUE);
    if (subject_.sink) {
      begin (&Storm::stream);
      begin (&Storm::flush);
    }
    begin (&Storm::set);
    begin (&Storm::ask);
    if (subject_.requests)
      begin (&Storm::request);
  }

  /** Changes states until every thread has had its turns. */
  void change_states ()
  {
    for (int i = 0; i < rounds (); i++) {
      for (const GstState state : {GST_STATE_PLAYING, GST_STATE_READY,
               GST_STATE_PAUSED, GST_STATE_NULL}) {
        gst_element_set_state (h_.element (), state);
        wait_for_turns ();
      }
      while (h_.message (GST_MESSAGE_ANY))
        ;
    }
  }

  /** Ends the threads and puts the element back to where it began. */
  ElementHarness &calm ()
  {
    stop_ = true;
    threads_.clear ();
    gst_element_set_state (h_.element (), GST_STATE_NULL);
    for (const Setting &setting : settings_of (h_.element ()))
      put (setting, 0);
    while (h_.message (GST_MESSAGE_ANY))
      ;
    gst_harness_set_drop_buffers (h_.get (), FALSE);
    return h_;
  }

  ~Storm () { stop_ = true; }

private:
  static constexpr int kTurns = 3;

  void begin (void (Storm::*turn) (int))
  {
    std::atomic<int> &turns = turns_[threads_.size ()];
    threads_.emplace_back ([this, turn, &turns] {
      while (!stop_) {
        (this->*turn) (turns.load ());
        turns++;
        turns.notify_one ();
      }
    });
  }
  void wait_for_turns ()
  {
    for (std::size_t i = 0; i < threads_.size (); i++)
      for (int seen = turns_[i], end = seen + kTurns; seen < end;
           seen = turns_[i])
        turns_[i].wait (seen);
  }

  void send (GstEvent *event)
  {
    const std::lock_guard in_turn (data_);
    gst_harness_push_event (h_.get (), event);
  }

  /* A stream from its start to its end; each is another one. */
  void stream (int turn)
  {
    send (gst_event_new_stream_start (turn % 2 ? "odd" : "even"));
    const bool wide = turn % 3 == 0;
    const CapsPtr caps = caps_of (gray_caps (
        48, turn % 5 ? 24 : 20, "100/1", wide ? "GRAY16_LE" : "GRAY8"));
    send (gst_event_new_caps (caps.get ()));
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    segment.rate = turn % 7 == 6 ? -1.0 : 1.0;
    segment.stop = GST_SECOND;
    send (gst_event_new_segment (&segment));
    if (turn % 4)
      send (schedule_to_event (*Schedule::from_preset (
          turn % 4 == 1 ? "sequential:2x2" : "staircase:2x2,pilot=8")));
    const GstVideoInfo info = info_of (caps.get ());
    for (int i = 0; i < 9 && !stop_; i++)
      push (info, turn, i);
    send (gst_event_new_gap (90 * GST_MSECOND, 10 * GST_MSECOND));
    if (turn % 3 == 1)
      send (gst_event_new_eos ());
  }
  void push (const GstVideoInfo &info, int turn, int i)
  {
    const bool cut = turn % 8 == 7 && i == 5;
    BufferPtr frame (gst_buffer_new_allocate (
        nullptr, GST_VIDEO_INFO_SIZE (&info) - gsize (cut), nullptr));
    gst_buffer_memset (
        frame.get (), 0, guint8 (20 * i), GST_VIDEO_INFO_SIZE (&info));
    GST_BUFFER_PTS (frame.get ()) = GstClockTime (i) * 10 * GST_MSECOND;
    if (i == turn % 6)
      GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_DISCONT);
    if (i == turn % 11)
      GST_BUFFER_FLAG_SET (frame.get (), GST_BUFFER_FLAG_CORRUPTED);
    const std::lock_guard in_turn (data_);
    h_.push (std::move (frame));
  }
  /* The start comes beside a frame; after the stop, a segment comes first. */
  void flush (int)
  {
    gst_harness_push_event (h_.get (), gst_event_new_flush_start ());
    const std::lock_guard in_turn (data_);
    gst_harness_push_event (h_.get (), gst_event_new_flush_stop (TRUE));
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    if (GstEvent *caps =
            gst_pad_get_sticky_event (h_.get ()->srcpad, GST_EVENT_CAPS, 0)) {
      gst_event_unref (caps);
      gst_harness_push_event (h_.get (), gst_event_new_segment (&segment));
    }
  }
  void put (const Setting &setting, std::size_t value)
  {
    gst_util_set_object_arg (G_OBJECT (h_.element ()), setting.name.c_str (),
        setting.values[value % setting.values.size ()].c_str ());
  }
  void set (int turn)
  {
    const auto settings = settings_of (h_.element ());
    if (settings.empty ())
      return;
    const auto n = std::size_t (turn);
    put (settings[n % settings.size ()], n / settings.size ());
    for (const Setting &setting : settings) {
      GValue value = G_VALUE_INIT;
      g_object_get_property (
          G_OBJECT (h_.element ()), setting.name.c_str (), &value);
      g_value_unset (&value);
    }
  }
  /* No POSITION: GstBaseTransform answers it from a segment that it resets at
   * the same time. */
  void ask (int turn)
  {
    const CapsPtr caps = caps_of (gray_caps (48, 24, "100/1"));
    GstPad *sink = h_.get ()->sinkpad;
    for (GstQuery *raw : {gst_query_new_latency (),
             gst_query_new_caps (turn % 2 ? caps.get () : nullptr),
             gst_query_new_accept_caps (caps.get ())}) {
      const QueryPtr query (raw);
      gst_pad_peer_query (sink, query.get ());
      if (subject_.sink)
        gst_pad_peer_query (h_.get ()->srcpad, query.get ());
    }
    gst_pad_push_event (
        sink, turn % 2 ? gst_event_new_qos (GST_QOS_TYPE_UNDERFLOW, 1.0, 5, 10)
                       : gst_event_new_reconfigure ());
  }
  void request (int turn)
  {
    const char *names[] = {"subframe_0", "subframe_3", "coded", "region_0"};
    GstPad *pad =
        gst_element_request_pad_simple (h_.element (), names[turn % 4]);
    if (!pad)
      return;
    gst_element_release_request_pad (h_.element (), pad);
    gst_object_unref (pad);
  }

  const Subject subject_;
  ElementHarness h_;
  std::mutex data_; ///< what is serialised comes one by one
  std::atomic<bool> stop_ = false;
  std::atomic<int> turns_[5] = {};
  std::vector<std::jthread> threads_;
};

class Stress : public ::testing::TestWithParam<Subject>
{
};

/** A coded frame or what was made of it comes out. */
void
expect_frames (const Subject &subject, ElementHarness &h)
{
  gst_element_set_state (h.element (), GST_STATE_PLAYING);
  if (!subject.sink)
    return;
  h.push_event (gst_event_new_flush_start ());
  h.push_event (gst_event_new_flush_stop (TRUE));
  h.push_event (gst_event_new_stream_start ("calm"));
  const CapsPtr caps = caps_of (gray_caps (16, 16, "100/1"));
  h.push_event (gst_event_new_caps (caps.get ()));
  GstSegment segment;
  gst_segment_init (&segment, GST_FORMAT_TIME);
  h.push_event (gst_event_new_segment (&segment));
  h.push_event (schedule_to_event (Schedule ()));
  while (h.pull ())
    ;
  for (int i = 0; i < 8; i++)
    ASSERT_EQ (h.push (frame_of (Image<std::uint8_t> (16, 16),
                   GstClockTime (i) * 10 * GST_MSECOND)),
        GST_FLOW_OK)
        << h.error ();
  EXPECT_TRUE (h.pull ()) << h.error ();
}

TEST_P (Stress, LeavesAnElementThatWorks)
{
  Storm storm (GetParam ());
  storm.change_states ();
  expect_frames (GetParam (), storm.calm ());
}

INSTANTIATE_TEST_SUITE_P (Elements, Stress, ::testing::ValuesIn (subjects ()),
    [] (const auto &info) { return std::string (info.param.name); });

} // namespace
