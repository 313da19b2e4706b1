/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Elements and whole pipelines from NULL to PLAYING and back, many times: no
 * thread, no open file and no object more than after the first times. CYCLES is
 * their number; objects are counted with GST_TRACERS=leaks. */
#include <cstdlib>
#include <filesystem>

#include "pipeline.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

int
cycles ()
{
  const char *text = std::getenv ("CYCLES");
  return text ? std::atoi (text) : 20;
}

std::size_t
entries_of (const char *folder)
{
  const std::filesystem::directory_iterator all (folder);
  return std::size_t (std::distance (begin (all), end (all)));
}

/** Counts the objects of GStreamer that were made and not removed since then;
 * none if nobody traces them. */
class ObjectCount
{
public:
  ObjectCount ()
  {
    each_tracer ([] (gpointer tracer) {
      g_signal_emit_by_name (tracer, "activity-start-tracking");
    });
  }
  long more () const
  {
    long count = 0;
    each_tracer ([&count] (gpointer tracer) {
      GstStructure *raw = nullptr;
      g_signal_emit_by_name (tracer, "activity-get-checkpoint", &raw);
      const StructurePtr seen (raw);
      const auto length = [&seen] (const char *list) {
        const GValue *all = gst_structure_get_value (seen.get (), list);
        return all ? long (gst_value_list_get_size (all)) : 0;
      };
      count += length ("objects-created-list");
      count -= length ("objects-removed-list");
      g_signal_emit_by_name (tracer, "activity-stop-tracking");
    });
    return count;
  }

private:
  template <typename Use>
  static void each_tracer (Use use)
  {
    GList *tracers = gst_tracing_get_active_tracers ();
    for (GList *at = tracers; at; at = at->next)
      if (g_signal_lookup ("activity-get-checkpoint", G_OBJECT_TYPE (at->data)))
        use (at->data);
    g_list_free_full (tracers, gst_object_unref);
  }
};

struct Usage {
  std::size_t threads = entries_of ("/proc/self/task");
  std::size_t files = entries_of ("/proc/self/fd");
};

struct Chain {
  const char *name;
  const char *line;
  long kept = 0; ///< objects that a foreign element keeps from each time
};

constexpr char kScene[] =
    "videotestsrc is-live=false ! "
    "video/x-raw,format=GRAY8,width=32,height=24,framerate=100/1 ! ";

const Chain kChains[] = {
    {"sim", "codedexposure-sim ! fakesink"},
    {"demux",
        "codedexposure-sim ! codedexposure-demux name=d d.src ! queue ! "
        "fakesink d.coded ! queue ! fakesink d.subframe_2 ! queue ! fakesink"},
    {"fuse", "codedexposure-sim ! codedexposure-fuse lookahead=1 ! fakesink"},
    /* matroskademux has the tags of all its streams until it is freed. */
    {"record",
        "codedexposure-sim ! codedexposure-recordmux ! "
        "codedexposure-recorddemux ! fakesink",
        1},
    {"subframestats", "subframestats location=/dev/null ! fakesink"},
    {"view", "codedexposure-view bits=4 ! fakesink"},
    {"moirecalib", "moirecalib pattern=grating-both:4/0 ! fakesink"},
    {"bench",
        "codedexposure-sim dmd=sim:cycles ! dmdsync device=sim:cycles ! "
        "tee name=t ! queue ! codedexposure-demux ! queue ! subframestats ! "
        "fakesink t. ! queue ! codedexposure-fuse ! codedexposure-view ! "
        "fakesink t. ! queue ! codedexposure-recordmux codec=raw ! "
        "fakesink"},
};

class Cycles : public ::testing::TestWithParam<Chain>
{
protected:
  /* Every sink has got a frame in PAUSED. */
  void cycle ()
  {
    gst_element_set_state (pipeline_.get (), GST_STATE_PLAYING);
    ASSERT_EQ (
        gst_element_get_state (pipeline_.get (), nullptr, nullptr, kPatience),
        GST_STATE_CHANGE_SUCCESS);
    ASSERT_EQ (gst_element_set_state (pipeline_.get (), GST_STATE_NULL),
        GST_STATE_CHANGE_SUCCESS);
    const ObjectPtr<GstBus> bus (gst_element_get_bus (pipeline_.get ()));
    const MessagePtr error (
        gst_bus_pop_filtered (bus.get (), GST_MESSAGE_ERROR));
    ASSERT_FALSE (error);
  }

  ObjectPtr<GstElement> pipeline_{
      GST_ELEMENT (gst_object_ref_sink (gst_parse_launch (
          (std::string (kScene) + GetParam ().line).c_str (), nullptr)))};
};

TEST_P (Cycles, LeaveNothingBehind)
{
  constexpr int kFirst = 5;
  for (int i = 0; i < kFirst; i++)
    cycle ();
  const Usage first;
  const ObjectCount objects;
  for (int i = 0; i < cycles (); i++)
    cycle ();
  const Usage last;
  /* GLib keeps some threads for later. */
  EXPECT_LE (last.threads, first.threads + 6);
  EXPECT_LE (last.files, first.files + 2);
  EXPECT_LE (objects.more (), 4 + GetParam ().kept * cycles ());
}

INSTANTIATE_TEST_SUITE_P (Chains, Cycles, ::testing::ValuesIn (kChains),
    [] (const auto &info) { return std::string (info.param.name); });

} // namespace
