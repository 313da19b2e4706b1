/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-demux in a pipeline, from pad to pad, with the frames of a
 * camera's pool: on a real bench, and on an ideal one, where it is compared
 * with its kernel, a plain push and common elements. Prints tables of
 * docs/performance.md. */
#include <cstdio>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "../quality/must.h"
#include "common/elements.h"
#include "common/meta.h"
#include "common/raii.h"
#include "extract/extractor.h"
#include "medians.h"
#include "setup/bench_profile.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;

constexpr guint kRing = 4; ///< frames in a camera's pool
constexpr int kCameraRate = 25;
constexpr int kBits = 12; ///< of a camera with 16 bits in memory

/** An element between a source pad and a sink pad of the benchmark. */
class Line
{
public:
  /** @p bench  text of the profile of the first element, or nothing. */
  Line (const std::string &launch, int width, int height, const char *format,
      const std::string &bench)
      : caps_ (
            gst_caps_from_string (caps_text (width, height, format).c_str ())),
        source_ (gst_pad_new ("source", GST_PAD_SRC)),
        sink_ (gst_pad_new ("sink", GST_PAD_SINK))
  {
    gst_object_ref_sink (source_.get ());
    gst_object_ref_sink (sink_.get ());
    gst_pad_set_element_private (sink_.get (), this);
    gst_pad_set_chain_function (sink_.get (), &Line::take);
    gst_pad_set_active (sink_.get (), TRUE);
    gst_pad_set_active (source_.get (), TRUE);
    link (launch, bench);
    make_pool ();
    begin ();
  }
  ~Line ()
  {
    gst_pad_push_event (source_.get (), gst_event_new_eos ());
    gst_pad_set_active (source_.get (), FALSE);
    if (element_)
      gst_element_set_state (element_.get (), GST_STATE_NULL);
    gst_pad_set_active (sink_.get (), FALSE);
    gst_buffer_pool_set_active (pool_.get (), FALSE);
  }
  Line (const Line &) = delete;
  Line &operator= (const Line &) = delete;

  /** Sends one frame through; false when the element refuses it. */
  bool push ()
  {
    GstBuffer *frame = nullptr;
    if (gst_buffer_pool_acquire_buffer (pool_.get (), &frame, nullptr) !=
        GST_FLOW_OK)
      return false;
    GST_BUFFER_PTS (frame) = pushed_++ * (GST_SECOND / kCameraRate);
    GST_BUFFER_DURATION (frame) = GST_SECOND / kCameraRate;
    return gst_pad_push (source_.get (), frame) == GST_FLOW_OK;
  }
  double taken_of_each () const
  {
    return pushed_ == 0 ? 0.0 : double (taken_) / double (pushed_);
  }

private:
  static std::string caps_text (int width, int height, const char *format)
  {
    return std::string ("video/x-raw,format=") + format +
           ",width=" + std::to_string (width) +
           ",height=" + std::to_string (height) +
           ",framerate=" + std::to_string (kCameraRate) + "/1,interlace-mode=" +
           (std::strcmp (format, "I420") == 0 ? "interleaved" : "progressive");
  }

  static GstFlowReturn take (GstPad *pad, GstObject *, GstBuffer *buffer)
  {
    static_cast<Line *> (gst_pad_get_element_private (pad))->taken_++;
    gst_buffer_unref (buffer);
    return GST_FLOW_OK;
  }

  void link (const std::string &launch, const std::string &bench)
  {
    if (launch.empty ()) {
      gst_pad_link (source_.get (), sink_.get ());
      return;
    }
    GError *error = nullptr;
    element_.reset (
        gst_parse_bin_from_description (launch.c_str (), TRUE, &error));
    if (!element_) {
      std::fprintf (stderr, "%s: %s\n", launch.c_str (), error->message);
      std::exit (1);
    }
    gst_object_ref_sink (element_.get ());
    if (!bench.empty ())
      g_object_set (GST_BIN (element_.get ())->children->data, "bench",
          bench.c_str (), nullptr);
    const ObjectPtr<GstPad> in (
        gst_element_get_static_pad (element_.get (), "sink"));
    const ObjectPtr<GstPad> out (
        gst_element_get_static_pad (element_.get (), "src"));
    gst_pad_link (source_.get (), in.get ());
    gst_pad_link (out.get (), sink_.get ());
    gst_element_set_state (element_.get (), GST_STATE_PLAYING);
  }

  void make_pool ()
  {
    GstVideoInfo info;
    gst_video_info_from_caps (&info, caps_.get ());
    const guint size = guint (GST_VIDEO_INFO_SIZE (&info));
    pool_.reset (gst_video_buffer_pool_new ());
    GstStructure *config = gst_buffer_pool_get_config (pool_.get ());
    gst_buffer_pool_config_set_params (
        config, caps_.get (), size, kRing, kRing);
    gst_buffer_pool_set_config (pool_.get (), config);
    gst_buffer_pool_set_active (pool_.get (), TRUE);

    std::mt19937 random (1);
    std::vector<std::uint8_t> pixels (size);
    for (auto &pixel : pixels)
      pixel = std::uint8_t (random () % 255);
    if (GST_VIDEO_INFO_COMP_DEPTH (&info, 0) == 16)
      for (std::size_t high = 1; high < pixels.size (); high += 2)
        pixels[high] %= 1 << (kBits - 8);
    std::vector<BufferPtr> frames;
    for (guint i = 0; i < kRing; i++) {
      GstBuffer *frame = nullptr;
      gst_buffer_pool_acquire_buffer (pool_.get (), &frame, nullptr);
      gst_buffer_fill (frame, 0, pixels.data (), size);
      frames.emplace_back (frame);
    }
  }

  void begin ()
  {
    GstSegment segment;
    gst_segment_init (&segment, GST_FORMAT_TIME);
    for (GstEvent *event : {gst_event_new_stream_start ("bench"),
             gst_event_new_caps (caps_.get ()),
             gst_event_new_segment (&segment)})
      gst_pad_push_event (source_.get (), event);
  }

  CapsPtr caps_;
  ObjectPtr<GstPad> source_;
  ObjectPtr<GstPad> sink_;
  ObjectPtr<GstElement> element_;
  ObjectPtr<GstBufferPool> pool_;
  guint64 pushed_ = 0;
  guint64 taken_ = 0;
};

/** The kernel alone, in a ring of subframes as downstream's pool has them. */
class Kernel
{
public:
  Kernel (const std::string &schedule, Method method, int width, int height)
      : extractor_ (*Extractor<std::uint8_t>::make (
            *Schedule::parse (schedule), width, height, {.method = method}))
  {
    std::mt19937 random (1);
    const auto size = extractor_.subframe_size ();
    for (guint i = 0; i < kRing; i++) {
      auto &coded = coded_.emplace_back (width, height);
      for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
          coded.view ().at (x, y) = std::uint8_t (random () % 255);
      auto &views = views_.emplace_back ();
      for (int k = 0; k < extractor_.subframes (); k++)
        views.push_back (
            subframes_
                .emplace_back (std::make_unique<Image<std::uint8_t>> (
                    size.width, size.height))
                ->view ());
    }
  }
  void run ()
  {
    at_ = (at_ + 1) % kRing;
    quality::must (extractor_.run (coded_[at_].view (), views_[at_]));
  }

private:
  Extractor<std::uint8_t> extractor_;
  std::size_t at_ = 0;
  std::vector<Image<std::uint8_t>> coded_;
  std::vector<std::unique_ptr<Image<std::uint8_t>>> subframes_;
  std::vector<std::vector<ImageView<std::uint8_t>>> views_;
};

struct Contender {
  std::string name;
  std::string launch; ///< empty: pad to pad
  const char *format;
  std::string schedule; ///< of the kernel to compare with, if any
  Method method;
  std::string bench = {};
};

/** What is measured of a real bench: one more in each step. */
std::vector<Contender>
real_benches (int width, int height)
{
  std::vector<Contender> all;
  for (const char *preset : {"sequential:2x2", "sequential:4x4"}) {
    BenchProfile bench;
    bench.camera.size = {width, height};
    const auto add = [&] (const std::string &name, const char *format) {
      all.push_back ({name + ", " + preset,
          std::string ("codedexposure-demux schedule=") + preset, format, "",
          Method::kAuto, bench.to_json ()});
    };
    add ("ideal", "GRAY8");
    bench.leak = Measured{0.001, 0.0001};
    add ("leakage", "GRAY8");
    bench.black_level = Measured{6.0, 0.1};
    add ("and a black level", "GRAY8");
    bench.bits = kBits;
    add ("and 12 bits", "GRAY16_LE");
    Mapping::Parts parts{bench.camera.size, bench.camera.size};
    parts.homography = {1.0, 0.008, 0.3, -0.008, 1.0, 0.4, 0.0, 0.0, 1.0};
    parts.psf_sigma = 0.3;
    bench.mapping = Mapping::make (parts).value ();
    add ("and a mapping", "GRAY16_LE");
  }
  return all;
}

std::vector<Contender>
contenders ()
{
  std::vector<Contender> all;
  const auto demux = [&] (const char *name, const std::string &schedule,
                         Method method) {
    all.push_back ({name,
        "codedexposure-demux schedule=" + schedule +
            " method=" + std::string (method_name (method)),
        "GRAY8", schedule, method});
  };
  demux ("select, n = 4", "sequential:2x2", Method::kSelect);
  demux ("select, n = 16", "sequential:4x4", Method::kSelect);
  demux ("decode, n = 4", "staircase:2x2", Method::kDecode);
  demux ("rank, n = 4", "staircase:2x2", Method::kRank);
  demux ("rank, n = 16", "staircase:4x4", Method::kRank);
  demux ("rank, n = 81", "staircase:9x9", Method::kRank);
  all.push_back ({"a plain push", "", "GRAY8", "", Method::kAuto});
  all.push_back ({"videoscale to half",
      "videoscale ! capsfilter "
      "caps=video/x-raw,width=384,height=288",
      "GRAY8", "", Method::kAuto});
  all.push_back ({"deinterlace, linear, I420",
      "deinterlace mode=interlaced method=linear fields=all", "I420", "",
      Method::kAuto});
  return all;
}

void
print_row (
    const std::string &name, double seconds, double kernel, double outputs)
{
  std::printf ("| %s | %.1f | %.0f | %.2f | %.2f |", name.c_str (),
      seconds * 1e6, 1.0 / seconds, seconds * kCameraRate * 100,
      seconds / outputs * 1e6);
  if (kernel > 0.0)
    std::printf (
        " %.1f | %.2f |\n", kernel * 1e6, (seconds - kernel) / outputs * 1e6);
  else
    std::printf (" | |\n");
}

void
measure (
    const char *title, const std::vector<Contender> &all, int width, int height)
{
  benchmark::ClearRegisteredBenchmarks ();
  std::vector<std::unique_ptr<Line>> lines;
  std::vector<std::unique_ptr<Kernel>> kernels;
  for (const Contender &c : all) {
    Line *line = lines
                     .emplace_back (std::make_unique<Line> (
                         c.launch, width, height, c.format, c.bench))
                     .get ();
    benchmark::RegisterBenchmark (c.name.c_str (),
        [line] (benchmark::State &state) {
          for (auto _ : state)
            if (!line->push ())
              state.SkipWithError ("the element refuses the frame");
        })
        ->MeasureProcessCPUTime ();
    if (c.schedule.empty ())
      continue;
    Kernel *kernel = kernels
                         .emplace_back (std::make_unique<Kernel> (
                             c.schedule, c.method, width, height))
                         .get ();
    benchmark::RegisterBenchmark (
        (c.name + ", kernel").c_str (), [kernel] (benchmark::State &state) {
          for (auto _ : state)
            kernel->run ();
        });
  }
  bench::Medians medians;
  benchmark::RunSpecifiedBenchmarks (&medians);

  std::printf (
      "\n%s, %dx%d\n\n"
      "| | us a frame | frames/s | %% of a core at 25 frames/s | us an "
      "output buffer | kernel alone, us | above it, us an output "
      "buffer |\n|---|---|---|---|---|---|---|\n",
      title, width, height);
  for (std::size_t i = 0; i < all.size (); i++) {
    const double seconds = medians.seconds (all[i].name);
    if (seconds > 0.0)
      print_row (all[i].name, seconds,
          medians.seconds (all[i].name + ", kernel"),
          lines[i]->taken_of_each ());
  }
}

} // namespace

int
main (int argc, char **argv)
{
  gst_init (&argc, &argv);
  register_meta (kFrameMetaName);
  GST_ELEMENT_REGISTER (codedexposure_demux, nullptr);
  auto arguments = bench::taking_turns (argv[0]);
  arguments.insert (arguments.end (), argv + 1, argv + argc);
  int count = int (arguments.size ());
  benchmark::Initialize (&count, const_cast<char **> (arguments.data ()));
  constexpr Extent kSizes[] = {{768, 576}, {4096, 3072}};
  for (const auto &[width, height] : kSizes)
    measure ("real benches", real_benches (width, height), width, height);
  for (const auto &[width, height] : kSizes)
    measure ("GRAY8 unless said otherwise", contenders (), width, height);
}
