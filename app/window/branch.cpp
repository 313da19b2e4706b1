/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "branch.h"

#include <cmath>
#include <cstdlib>

#include <gst/video/gstvideoaggregator.h>

#include "failure.h"
#include "pipeline/pads.h"
#include "pipeline/video_output.h"
#include "stats/event_watch.h"
#include "window/screen.h"

namespace codedexposure::app
{

using namespace gst;

namespace
{

/* The names of panes, in the counters of their queues. */
constexpr struct {
  const char *name, *caption;
} kPanes[] = {{"beside", "camera"}, {"fast", "subframes"}, {"full", "fused"},
    {"added", "sum"}};

/* The window sets how many frames it holds when their rate is known; until
 * then, two coded frames of any schedule fit. */
GstElement *
add_latest (Chain &chain, const std::string &name, bool waits)
{
  constexpr int kMost = 2 * 256;
  chain.to ("queue", {{"name", name}, {"leaky", waits ? "no" : "downstream"},
                         {"max-size-buffers", kMost}, {"max-size-bytes", 0},
                         {"max-size-time", 0}});
  return chain.last ();
}

/* Unless the stream @waits, the first queue never blocks it, and the second one
 * skips frames for which the screen is too slow, when the window has remembered
 * them. */
WindowPane
add_pane (Chain chain, std::size_t index, std::optional<int> bits,
    GstElement *compositor, bool waits)
{
  const std::string name = kPanes[index].name;
  WindowPane pane;
  pane.caption = kPanes[index].caption;
  pane.entry = add_latest (chain, name, waits);
  pane.late = add_latest (chain, name + "-late", waits);
  pane.view =
      chain.to ("codedexposure-view", {{"qos", false}, {"bits", bits}}).last ();
  pane.scale =
      chain.to ("videoscale", {{"add-borders", false}, {"qos", false}}).last ();
  pane.shown = chain.to ("capsfilter").last ();
  chain.to ("videoconvert").caps ("video/x-raw,format=BGRx");
  pane.mixed.reset (gst_element_request_pad_simple (compositor, "sink_%u"));
  chain.to (compositor, GST_PAD_NAME (pane.mixed.get ()));
  return pane;
}

/* Called by the compositor's own thread, which alone changes what it asks. */
bool
has_all_inputs (GstElement *compositor)
{
  return gst_element_foreach_sink_pad (
      compositor,
      [] (GstElement *, GstPad *pad, gpointer) -> gboolean {
        return GST_VIDEO_INFO_WIDTH (&GST_VIDEO_AGGREGATOR_PAD (pad)->info) >
                   0 ||
               gst_aggregator_pad_is_eos (GST_AGGREGATOR_PAD (pad));
      },
      nullptr);
}

/* @compositor shows nothing until all of its inputs have a size or have ended.
 * It does not wait for live ones that are late: its first pictures would be
 * smaller, and some windows keep the size of the first picture. */
void
wait_for_inputs (GstElement *compositor)
{
  /* Sticky events that are dropped come again before the next frame. */
  add_probe (pad_of (compositor, "src").get (),
      GST_PAD_PROBE_TYPE_DATA_DOWNSTREAM,
      [compositor] (GstPad *, GstPadProbeInfo *info) {
        const bool ends = (info->type & GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM) &&
                          GST_EVENT_TYPE (gst_pad_probe_info_get_event (
                              info)) == GST_EVENT_EOS;
        return ends || has_all_inputs (compositor) ? GST_PAD_PROBE_REMOVE
                                                   : GST_PAD_PROBE_DROP;
      });
}

constexpr double kRemembered = 10; // s

Rule<Text>
event_rule ()
{
  return text_that (
      [] (const std::string &text) { return bool (parse_event_rule (text)); },
      "an event such as mean:10 or motion:2@64x48+100+80");
}

bool
is_set (const char *variable)
{
  const char *value = std::getenv (variable);
  return value && *value;
}

/* A sink for Wayland needs no X display. */
bool
opens_window (GstElement *sink)
{
  const auto is_window = [] (GstElement *element) {
    const std::string kind = factory_of (element);
    return kind == "autovideosink" || kind == "glimagesink" ||
           kind == "ximagesink" || kind == "xvimagesink";
  };
  bool found = is_window (sink);
  if (GST_IS_BIN (sink))
    each_element (
        sink, [&] (GstElement *element) { found |= is_window (element); });
  return found;
}

} // namespace

void
WindowOptions::declare (Options &options, bool comes)
{
  options.value ("--sink", sink, "\"GST\"",
      "another video sink, such as ximagesink [autovideosink]");
  if (!comes)
    return;
  options.value ("--keep-on", keep_on, "EVENT",
      "keep as K does when the coded frames change suddenly:\n\"mean:10\", "
      "by 10 % of the largest value on average;\n\"motion:2\", by 2 % from "
      "one frame to the next more\nthan before; \"motion:2@64x48+100+80\", "
      "in that\nregion of the frame",
      event_rule ());
  options.value ("--keep-after", keep_after, "SECONDS",
      "time of the 10 s that comes after the event [5]",
      real (0, kRemembered, "a number of seconds from 0 to 10"));
  options.need ({"--keep-after"}, "--keep-on");
}

GstElement *
WindowOptions::add_keeper (
    Chain &chain, const std::string &command, std::optional<int> bits) const
{
  const auto in_ns = [] (double seconds) {
    return std::uint64_t (std::llround (1e9 * seconds));
  };
  std::optional<std::uint64_t> after;
  if (keep_after)
    after = in_ns (*keep_after);
  return chain
      .to ("codedexposure-keep",
          {{"location", command}, {"length", in_ns (kRemembered)},
              {"event", keep_on}, {"after", after}, {"bits", bits}})
      .last ();
}

std::string
WindowOptions::keys_of (const std::string &command)
{
  return R"(Keys in the window:
  Space           pause at the subframe that is shown; again: live
  Left, Right     pause, and go one subframe back or forward
  L               loop the last second at 1/4 speed; again: live
  K               keep what has just happened: the coded frames of the last 10 s
                  become a recording, )" +
         command + R"(-frameN.mkv;
                  the signal USR1 does so, too
  Up, Down        change the gain of a GenICam camera by 1/20 of its range
  PageUp, PageDown
                  change its exposure time, as far as all slots are whole
)" + common_keys (command) +
         "The stream does not wait for the window: recording and counting go "
         "on in a pause\nor loop, and subframes are skipped if the screen is "
         "too slow. The window keeps\nthe pictures of the last second, up to "
         "256 MB a pane: 25 MB for 768x576 pixels\nof 8 bits at 25 frames/s, "
         "and N times 11 MB more if fused; and the coded frames\nof the last "
         "10 s, 110 MB, up to a quarter of the free memory.\n";
}

std::string
WindowOptions::common_keys (const std::string &command)
{
  return R"(  S               write what is shown to the current folder, but replace no
                  file: the window to )" +
         command + R"(-frameN-slotK-TIMEs.png, and each
                  picture with all of its pixels and bits beside it,
                  ...-camera.png and so on
  Wheel, Z, X     look closer at the pointer, and back; 0: see the whole.
                  The captions say the pixel at the pointer and its value
  Drag            move the part that is seen; with the right button: contrast
                  (right, left) and brightness (up, down)
  +, -            show pictures twice as bright, and back
  C               stretch what is seen of the coded frame from black to white;
                  again: show all values
  R               mark saturated pixels in red; again: do not
  F               fill the screen; again, or Esc: do not
  H               show these keys; again: hide them
  Q               end, as Ctrl-C does
)";
}

WindowBranch
add_window_branch (const std::vector<Chain> &sources,
    const WindowOptions &options, std::optional<int> bits,
    const std::string &paced)
{
  Graph &graph = sources.front ().graph ();
  WindowBranch branch;
  branch.compositor = graph.add ("compositor", {{"background", "black"}});
  wait_for_inputs (branch.compositor);
  for (const Chain &source : sources)
    branch.panes.push_back (add_pane (source, branch.panes.size (), bits,
        branch.compositor, !paced.empty ()));
  /* No screen shows more; fewer frames would make keys slow. */
  Chain chain = graph.from (branch.compositor);
  branch.size = chain
                    .caps ("video/x-raw,format=BGRx,framerate=" +
                           (paced.empty () ? "[25/1,100/1]" : paced))
                    .last ();
  branch.overlay = chain.to ("cairooverlay").last ();
  chain.to ("queue", {{"max-size-buffers", 4}})
      .to ("videoscale", {{"add-borders", true}})
      .to ("videoconvert");
  branch.sink = options.sink ? graph.add_text (*options.sink)
                             : graph.add ("autovideosink");
  chain.to (branch.sink);
  return branch;
}

void
need_screen (const WindowBranch &branch)
{
  constexpr const char *kRemedy =
      " Run this in a desktop session or through ssh -X, or record and decode "
      "instead.";
  if (is_set ("WAYLAND_DISPLAY") || !opens_window (branch.sink))
    return;
  if (!is_set ("DISPLAY"))
    fail (std::string ("no screen: DISPLAY is not set.") + kRemedy);
  if (!find_screen ().opens)
    fail (std::string ("the screen DISPLAY=") + std::getenv ("DISPLAY") +
          " cannot be opened." + kRemedy);
}

} // namespace codedexposure::app
