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
#include "fuse/fuser.h"
#include "harness.h"
#include "rectify/rectifier.h"

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
  static Mapping mapping (
      Extent mirrors = {kWidth, kHeight}, const Alignment &alignment = kAskew)
  {
    auto made = Mapping::make ({.camera = {kWidth, kHeight},
        .mirrors = mirrors,
        .homography = camera_to_mirrors (alignment, kWidth, kHeight),
        .psf_sigma = kPsfSigma});
    EXPECT_TRUE (made.ok ());
    return *made;
  }
  std::string mapped (
      Extent mirrors = {kWidth, kHeight}, const Alignment &alignment = kAskew)
  {
    return "schedule=" + schedule.text () +
           " mapping=" + save (mapping (mirrors, alignment).to_json ());
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
  /** What the camera sees. */
  std::vector<Image<std::uint8_t>> coded (const Alignment &alignment) const
  {
    BenchOptions options;
    options.alignment = alignment;
    options.psf_sigma = kPsfSigma;
    options.full_well = 10000;
    options.read_noise = 5;
    auto bench = OpticalBench::make (kWidth, kHeight, options);
    std::vector<Image<std::uint8_t>> frames;
    for (int number = 0; number < kFrames; number++) {
      bench->begin (schedule);
      for (int slot = 0; slot < schedule.slots (); slot++) {
        const auto light = scene (number + double (slot) / schedule.slots ());
        bench->expose (light.view (), slot, 1.0);
      }
      bench->read_out (std::uint64_t (number),
          frames.emplace_back (kWidth, kHeight).view ());
    }
    return frames;
  }
  template <typename Pixel>
  void expose (const Alignment &alignment)
  {
    GstClockTime number = 0;
    for (const auto &seen : coded (alignment)) {
      const auto pixels = draw<Pixel> (kWidth, kHeight, [&] (int x, int y) {
        return seen.at (x, y) * (sizeof (Pixel) == 1 ? 1 : 257);
      });
      const auto pts = number++ * GST_SECOND * 1001 / 30000;
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

TEST_F (FuseMapping, TakesBackTheBlurOfAnAlignedBench)
{
  const double blurred = psnr ("schedule=" + schedule.text (), {});
  EXPECT_GT (psnr (mapped ({kWidth, kHeight}, {}), {}), blurred + 2.0);
}

TEST_F (FuseMapping, UncertaintyHasTheErrorsOfRectification)
{
  start ("full-well=10000 read-noise=5 " + mapped ());
  GstHarness *pad = fuse->request ("uncertainty");
  expose<std::uint8_t> (kAskew);

  FuseOptions options;
  options.noise = {10000.0, 5.0};
  auto fuser =
      Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options).value ();
  const double light = 0.4 * options.noise.full_well;
  const Rectifier rectifier = *Rectifier::make (mapping (), schedule,
      {.noise = std::sqrt (options.noise.variance (light, 0.0)) /
                options.noise.full_well});
  std::vector<Image<std::uint8_t>> fused (
      4, Image<std::uint8_t> (kWidth, kHeight));
  std::vector<Image<std::uint16_t>> deviations (
      4, Image<std::uint16_t> (kWidth, kHeight));
  for (const auto &seen : coded (kAskew)) {
    Image<std::uint8_t> mirrors (kWidth, kHeight);
    Image<float> errors (kWidth, kHeight);
    ASSERT_TRUE (
        rectifier.run (seen.view (), mirrors.view (), 0, errors.view ()));
    ASSERT_TRUE (fuser.take (mirrors.view (), {}, {.coded = errors.view ()}));
    ASSERT_TRUE (fuser.fuse (views_of (fused), {}, views_of (deviations)));
    for (const auto &expected : deviations) {
      const BufferPtr buffer (gst_harness_try_pull (pad));
      ASSERT_TRUE (buffer);
      Image<std::uint16_t> image (kWidth, kHeight);
      ASSERT_EQ (gst_buffer_extract (buffer.get (), 0, image.view ().row (0),
                     2 * kWidth * kHeight),
          gsize (2 * kWidth * kHeight));
      EXPECT_EQ (image, expected);
    }
  }
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

/* That of a profile without a mapping is of an aligned camera, and a mapping is
 * better than that, wherever it is from. */
TEST_F (FuseMapping, IsNotReplacedByTheBlurOfAProfile)
{
  BenchProfile profile;
  profile.camera.size = {kWidth, kHeight};
  profile.psf_sigma = Measured{kPsfSigma, 0.01};
  profile.leak = Measured{0.0, 0.0};
  const std::string bench = "bench=" + save (profile.to_json ());
  const auto fused = [&] (const std::string &settings, const StreamSetup &tag) {
    start (settings);
    fuse->push_event (setup_to_event (tag));
    expose<std::uint8_t> (kAskew);
    return pull_images (*fuse);
  };
  const auto by_tag = fused ("", {kSchedule, mapping ()});
  EXPECT_EQ (fused (bench, {kSchedule, mapping ()}), by_tag);
  EXPECT_NE (fused (bench, {kSchedule, {}}), by_tag);
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
                          "24x20. Measure a new mapping with moirecalib or "
                          "\"codedexposure calibrate\".");
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
  EXPECT_EQ (fuse->error ().find (
                 "The mapping property (or --mapping) cannot be read: "),
      0u);
}
