/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-fuse with a mapping: accuracy of its frames, messages and
 * errors. */
#include <cmath>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "bench/bench.h"
#include "common/messages.h"
#include "common/meta.h"
#include "common/tag.h"
#include "harness.h"

namespace
{

using namespace codedexposure;
using namespace codedexposure::gst;
using namespace codedexposure::test;

constexpr int kWidth = 96, kHeight = 72, kFrames = 4;
const Schedule kSchedule = *Schedule::from_preset ("sequential:lattice:4/2");
constexpr Alignment kAskew{0.4, 0.4, 0.5, 1.01};
constexpr double kPsfSigma = 0.4;

/** A simulated bench and the fused frames of its coded frames. */
class FuseMapping : public ::testing::Test
{
protected:
  ~FuseMapping () override { std::filesystem::remove (path); }

  /** Texture that is static in the lower half and moves in the upper; @p time
   * in frames. */
  static Image<std::uint8_t> scene (double time)
  {
    return draw<std::uint8_t> (kWidth, kHeight, [=] (int x, int y) {
      const double at = x - (y < kHeight / 2 ? 2.8 * time : 0.0);
      return int (
          120 + 50 * std::sin (0.5 * at + 0.3 * y) + 30 * std::sin (0.8 * y));
    });
  }
  static Mapping mapping (Extent mirrors = {kWidth, kHeight})
  {
    auto made = Mapping::make ({.camera = {kWidth, kHeight},
        .mirrors = mirrors,
        .homography = camera_to_mirrors (kAskew, kWidth, kHeight),
        .psf_sigma = kPsfSigma});
    EXPECT_TRUE (made.ok ());
    return *made;
  }
  std::string mapped (Extent mirrors = {kWidth, kHeight})
  {
    return "schedule=" + schedule.text () +
           " mapping=" + save (mapping (mirrors).to_json ());
  }
  std::string save (const std::string &text)
  {
    std::ofstream (path) << text;
    return path.string ();
  }
  void start (const std::string &settings, Extent size = {kWidth, kHeight},
      const std::string &format = "GRAY8")
  {
    fuse = std::make_unique<ElementHarness> ("codedexposure-fuse " + settings);
    fuse->set_caps (gray_caps (size.width, size.height, "30000/1001", format));
  }
  GstFlowReturn push_grey (Extent size, GstClockTime pts)
  {
    return fuse->push (frame_of (draw<std::uint8_t> (size.width, size.height,
                                     [] (int, int) { return 99; }),
        pts));
  }
  template <typename Pixel>
  void expose (const Alignment &alignment)
  {
    BenchOptions options;
    options.alignment = alignment;
    options.psf_sigma = kPsfSigma;
    options.full_well = 10000;
    options.read_noise = 5;
    auto bench = OpticalBench::make (kWidth, kHeight, options);
    for (int number = 0; number < kFrames; number++) {
      bench->begin (schedule);
      for (int slot = 0; slot < schedule.slots (); slot++) {
        const auto light = scene (number + double (slot) / schedule.slots ());
        bench->expose (light.view (), slot, 1.0);
      }
      Image<std::uint8_t> coded (kWidth, kHeight);
      bench->read_out (std::uint64_t (number), coded.view ());
      const auto pixels = draw<Pixel> (kWidth, kHeight, [&] (int x, int y) {
        return coded.at (x, y) * (sizeof (Pixel) == 1 ? 1 : 257);
      });
      const auto pts = GstClockTime (number) * GST_SECOND * 1001 / 30000;
      ASSERT_EQ (fuse->push (frame_of (pixels, pts)), GST_FLOW_OK);
    }
  }
  /** PSNR of the fused frames against the light on the mirrors, dB. */
  template <typename Pixel = std::uint8_t>
  double psnr (const std::string &settings, const Alignment &alignment)
  {
    start ("full-well=10000 read-noise=5 " + settings, {kWidth, kHeight},
        sizeof (Pixel) == 1 ? "GRAY8" : "GRAY16_LE");
    expose<Pixel> (alignment);
    const auto images = pull_images<Pixel> (*fuse);
    EXPECT_EQ (images.size (), std::size_t (schedule.slots () * kFrames));
    double squares = 0.0, count = 0.0;
    for (std::size_t k = 0; k < images.size (); k++) {
      const auto truth = scene (double (k) / schedule.slots ());
      for (int y = 8; y < kHeight - 8; y++)
        for (int x = 8; x < kWidth - 8; x++) {
          const double seen =
              images[k].at (x, y) / (sizeof (Pixel) == 1 ? 1.0 : 257.0);
          squares += std::pow (seen - truth.at (x, y), 2);
          count += 1.0;
        }
    }
    return 10.0 * std::log10 (255.0 * 255.0 * count / squares);
  }

  Schedule schedule = kSchedule;
  std::unique_ptr<ElementHarness> fuse;
  std::filesystem::path path =
      std::filesystem::temp_directory_path () /
      ("cexp-fuse-mapping-" + std::to_string (getpid ()) + ".json");
};

} // namespace

TEST_F (FuseMapping, PutsAMisalignedBenchRight)
{
  const std::string unmapped = "schedule=" + schedule.text ();
  const double aligned = psnr (unmapped, {});
  EXPECT_GT (psnr (mapped (), kAskew), aligned - 0.3);
  EXPECT_LT (psnr (unmapped, kAskew), aligned - 3.0);
  EXPECT_GT (psnr<std::uint16_t> (mapped (), kAskew), aligned - 0.3);
}

TEST_F (FuseMapping, PutsRegionsRight)
{
  schedule =
      *Schedule::from_preset ("sequential:2x2,"
                              "region=36x27+13+9:staircase:3x3,"
                              "region=32x32+53+26:sequential:lattice:4/2");
  const std::string unmapped = "schedule=" + schedule.text ();
  const double aligned = psnr (unmapped, {});
  EXPECT_GT (psnr (mapped (), kAskew), aligned - 0.3);
  EXPECT_LT (psnr (unmapped, kAskew), aligned - 3.0);
}

TEST_F (FuseMapping, ComesWithTheTag)
{
  start ("");
  fuse->push_event (setup_to_event ({kSchedule, mapping ()}));
  expose<std::uint8_t> (kAskew);
  const auto by_tag = pull_images (*fuse);
  const auto said = fuse->posted<MirrorsSeen> ();
  ASSERT_TRUE (said);
  EXPECT_GT (said->unseen, 0u);
  EXPECT_EQ (counter_of (fuse->element (), "mirrors-unseen"), said->unseen);
  EXPECT_EQ (counter_of (fuse->element (), "mirrors-mixed"), said->mixed);

  start (mapped ());
  expose<std::uint8_t> (kAskew);
  EXPECT_EQ (pull_images (*fuse), by_tag);
}

TEST_F (FuseMapping, FusedFramesHaveTheSizeOfTheMirrors)
{
  start (mapped ({80, 64}));
  expose<std::uint8_t> (kAskew);
  for (const auto &image : pull_images (*fuse)) {
    EXPECT_EQ (image.width (), 80);
    EXPECT_EQ (image.height (), 64);
  }
}

TEST_F (FuseMapping, OfOtherFramesIsRefused)
{
  start ("mapping=" + save (mapping ().to_json ()), {24, 20});
  EXPECT_EQ (push_grey ({24, 20}, 0), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_EQ (
      fuse->error (), "The mapping " + path.string () +
                          " is for frames of 96x72 pixels, but these have "
                          "24x20. Measure a new mapping with moirecalib.");
}

TEST_F (FuseMapping, OfOtherFramesInTheTagIsLeftOut)
{
  start ("", {24, 20});
  fuse->push_event (setup_to_event ({kSchedule, mapping ()}));
  EXPECT_EQ (push_grey ({24, 20}, 0), GST_FLOW_OK);
  EXPECT_EQ (push_grey ({24, 20}, GST_SECOND * 1001 / 30000), GST_FLOW_OK);
  EXPECT_NE (fuse->warning ().find ("Do not scale or crop coded frames"),
      std::string::npos);
  EXPECT_EQ (fuse->warning (), "") << "it is said once";
}

TEST_F (FuseMapping, ThatCannotBeReadIsAnError)
{
  start ("");
  g_object_set (
      fuse->element (), "mapping", save ("nonsense").c_str (), nullptr);
  EXPECT_EQ (push_grey ({kWidth, kHeight}, 0), GST_FLOW_NOT_NEGOTIATED);
  EXPECT_EQ (fuse->error ().find ("The mapping property cannot be read: "), 0u);
}
