/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* What happens when memory runs out, at any allocation. */
#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

#include <dlfcn.h>
#include <malloc.h>

#include <gtest/gtest.h>
#include <xxhash.h>

#include "base/workers.h"
#include "calibrate/calibration.h"
#include "dmd/runner.h"
#include "extract/extractor.h"
#include "fuse/fuser.h"
#include "mapping/mapping.h"
#include "record/pixel_hash.h"
#include "rectify/rectifier.h"

namespace
{

/** Allocations that still succeed, in all threads together. */
std::atomic<long> left = std::numeric_limits<long>::max ();
/** Bytes that are allocated. */
std::atomic<std::size_t> held = 0;

void *
allocate (std::size_t size)
{
  void *memory = left-- > 0 ? std::malloc (size > 0 ? size : 1) : nullptr;
  if (!memory)
    throw std::bad_alloc ();
  held += malloc_usable_size (memory);
  return memory;
}

void
release (void *memory)
{
  held -= malloc_usable_size (memory);
  std::free (memory);
}

} // namespace

void *
operator new (std::size_t size)
{
  return allocate (size);
}
void *
operator new[] (std::size_t size)
{
  return allocate (size);
}
void *
operator new (std::size_t size, const std::nothrow_t &) noexcept
{
  try {
    return allocate (size);
  } catch (const std::bad_alloc &) {
    return nullptr;
  }
}
void
operator delete (void *memory) noexcept
{
  release (memory);
}
void
operator delete[] (void *memory) noexcept
{
  release (memory);
}
void
operator delete (void *memory, std::size_t) noexcept
{
  release (memory);
}
void
operator delete[] (void *memory, std::size_t) noexcept
{
  release (memory);
}

/** In place of the library's, which calls malloc (). */
XXH3_state_t *
XXH3_createState ()
{
  static const auto create = reinterpret_cast<decltype (&XXH3_createState)> (
      dlsym (RTLD_NEXT, "XXH3_createState"));
  return left-- > 0 ? create () : nullptr;
}

namespace
{

using namespace codedexposure;

/** While it lives, memory ends after so many allocations. */
class Limit
{
public:
  explicit Limit (long allocations) { left = allocations; }
  ~Limit () { left = std::numeric_limits<long>::max (); }
};

/** Runs @p function with memory for no allocation, for a few, and for more and
 * more until it succeeds; before that, it must say what it lacks. */
template <typename Function>
void
expect_errors_until_enough (const Function &function)
{
  for (long allocations = 0;; allocations += 1 + allocations / 16) {
    const auto result = [&] {
      const Limit limit (allocations);
      return function ();
    }();
    if (result) {
      EXPECT_GT (allocations, 0);
      return;
    }
    ASSERT_EQ (result.error ().code, ErrorCode::out_of_memory)
        << result.error ().message << " after " << allocations;
    ASSERT_LT (allocations, 100'000'000);
  }
}

constexpr int kWidth = 24, kHeight = 16;

Mapping
turned_mapping ()
{
  auto made = Mapping::make ({.camera = {kWidth, kHeight},
      .mirrors = {kWidth, kHeight},
      .homography = {1.0, 0.01, 0.2, -0.01, 1.0, 0.1, 0.0, 0.0, 1.0}});
  return made.value ();
}

TEST (Memory, ACalibrationGoesOnAfterAFrameThatDidNotFit)
{
  constexpr Extent kSize{64, 48};
  const auto patterns = calibration_patterns (kSize);
  auto run = Calibration::make (kSize, kSize, patterns);
  ASSERT_TRUE (run);
  const Image<std::uint8_t> frame (kSize.width, kSize.height);
  for (const Pattern &pattern : patterns)
    expect_errors_until_enough (
        [&] { return run->add (pattern, frame.view ()); });
  EXPECT_TRUE (run->missing ().empty ());
}

TEST (Memory, GrayCodesOfACalibrationTakeABitOfAPixel)
{
  constexpr Extent kCamera{256, 192}, kMirrors{8192, 8192};
  const auto patterns = calibration_patterns (kMirrors);
  auto run = Calibration::make (kCamera, kMirrors, patterns);
  ASSERT_TRUE (run);
  const Image<std::uint8_t> frame (kCamera.width, kCamera.height);
  const std::size_t before = held;
  int codes = 0;
  for (const Pattern &pattern : patterns)
    if (pattern.kind == Pattern::Kind::gray) {
      ASSERT_TRUE (run->add (pattern, frame.view ()));
      codes++;
    }
  ASSERT_GE (codes, 40);
  const std::size_t floats = sizeof (float) * 256 * 192;
  EXPECT_LT (held - before, 4 * floats);
}

/* JSON takes no part, and neither do regions, whose JSON is measured:
 * nlohmann::json allocates memory to free a value. */
TEST (Memory, ValuesAreMadeOrNot)
{
  const Schedule::Parts parts{.tile = Tile::parse ("2x2").value (),
      .code = Code::named ("staircase", 4).value ()};
  expect_errors_until_enough ([] { return Tile::parse ("lattice:8/3"); });
  expect_errors_until_enough ([] { return Code::named ("s-matrix", 7); });
  expect_errors_until_enough ([] {
    return Schedule::parse ("sequential:lattice:8/3,order=0/2/1/3/4/5/7/"
                            "6,active=9.8ms,leak=0.01");
  });
  /* The caller copies the parts. */
  std::vector schedules (500, parts);
  expect_errors_until_enough ([&] {
    auto made = Schedule::make (std::move (schedules.back ()));
    schedules.pop_back ();
    return made;
  });
}

TEST (Memory, WrongTextsAreRefusedOrNot)
{
  for (long allocations = 0; allocations < 200; allocations++) {
    const auto refused = [&] {
      const Limit limit (allocations);
      return Schedule::parse ("sequential:2x2,order=0/0/0/0,phase=1/1");
    }();
    ASSERT_FALSE (refused);
  }
}

TEST (Memory, PlansAreMadeOrNot)
{
  const Schedule schedule = Schedule::parse ("staircase:2x2").value ();
  expect_errors_until_enough ([&] {
    return Extractor<std::uint8_t>::make (schedule, kWidth, kHeight);
  });
  const Mapping mapping = turned_mapping ();
  expect_errors_until_enough (
      [&] { return Rectifier::make (mapping, schedule); });
  expect_errors_until_enough (
      [&] { return Fuser<std::uint8_t>::make (schedule, kWidth, kHeight); });
}

/* A stream's tag may say anything of its tile and its mapping. */
TEST (Memory, WindowsOfAHugeTileAreRefusedBeforeTheyAreMade)
{
  constexpr int kPeriod = Tile::kMaxPeriod;
  std::vector<std::uint8_t> labels (kPeriod * kPeriod);
  for (int y = 0; y < kPeriod; y++)
    for (int x = 0; x < kPeriod; x++)
      labels[std::size_t (y * kPeriod + x)] = std::uint8_t (
          (x % 2 + 2 * (y % 2)) ^ ((x / 2) * (y / 2) * 7 / 5 % 4));
  const Schedule schedule = Schedule::make (
      {.tile = Tile::from_labels (kPeriod, kPeriod, labels).value (),
          .code = Code::named ("sequential", 4).value ()})
                                .value ();
  constexpr int kSide = 64;
  const double slope = 14.0 * (kSide - 1);
  const Mapping mapping = Mapping::make (
      {.camera = {kSide, kSide},
          .mirrors = {kSide, kSide},
          .displacement = Displacement{2, 2, {0, slope, 0, slope},
              {0, 0, 0, 0}}}).value ();
  const auto made = [&] {
    const Limit limit (5'000);
    return Rectifier::make (mapping, schedule);
  }();
  ASSERT_FALSE (made);
  EXPECT_EQ (made.error ().code, ErrorCode::invalid_argument);
}

/** What @p fuser makes of two frames. */
std::vector<Image<std::uint8_t>>
fused (Fuser<std::uint8_t> &fuser)
{
  std::vector<Image<std::uint8_t>> frames;
  for (int k = 0; k < fuser.slots (); k++)
    frames.emplace_back (kWidth, kHeight);
  std::vector<ImageView<std::uint8_t>> views;
  for (auto &frame : frames)
    views.push_back (frame.view ());
  for (int number = 0; number < 2; number++) {
    Image<std::uint8_t> coded (kWidth, kHeight);
    for (int y = 0; y < kHeight; y++)
      for (int x = 0; x < kWidth; x++)
        coded.at (x, y) = std::uint8_t (9 * x + 5 * y * number + 40);
    EXPECT_TRUE (fuser.take (coded.view ()));
    EXPECT_TRUE (fuser.fuse (views));
  }
  return frames;
}

/* A frame that fails in the caller or in a worker is lost, and nothing else. */
TEST (Memory, FusersGoOnAfterAFrameThatFailed)
{
  const Schedule schedule = Schedule::parse ("sequential:2x2").value ();
  for (const FuseQuality quality : {FuseQuality::kFast, FuseQuality::kBalanced,
           FuseQuality::kBest, FuseQuality::kLearned}) {
    FuseOptions options;
    options.quality = quality;
    options.threads = 3;
    auto fuser = Fuser<std::uint8_t>::make (schedule, kWidth, kHeight, options);
    ASSERT_TRUE (fuser);
    const auto truth = fused (*fuser);
    fuser->forget ();
    Image<std::uint8_t> coded (kWidth, kHeight);
    std::vector<Image<std::uint8_t>> frames (4, coded);
    std::vector<ImageView<std::uint8_t>> views;
    for (auto &frame : frames)
      views.push_back (frame.view ());
    expect_errors_until_enough ([&] {
      auto done = fuser->take (coded.view ());
      if (done)
        done = fuser->fuse (views);
      if (!done) {
        EXPECT_EQ (fuser->pending (), 0);
      }
      return done;
    });
    fuser->forget ();
    EXPECT_EQ (fused (*fuser), truth);
  }
}

TEST (Memory, AHashOfRowsIsMadeOrNot)
{
  const Image<std::uint8_t> pixels (8, 4);
  const auto rows = pixels.view ().block (0, 0, 7, 4);
  EXPECT_NO_THROW (pixel_hash (rows));
  const Limit limit (0);
  EXPECT_THROW (pixel_hash (rows), std::bad_alloc);
}

TEST (Memory, WorkersHandAnExceptionToTheirCaller)
{
  Workers workers (3);
  for (const int bad : {0, 1, 50, 99}) {
    EXPECT_THROW (workers.run (100,
                      [bad] (int part, int) {
                        if (part == bad)
                          throw std::bad_alloc ();
                      }),
        std::bad_alloc);
    std::atomic<int> done = 0;
    EXPECT_TRUE (workers.run (100, [&] (int, int) { done++; }));
    EXPECT_EQ (done, 100);
  }
}

/** Runs out of memory whatever it is told to do. */
class HungryDmd : public Dmd
{
public:
  const DmdInfo &info () const override { return info_; }
  Nanoseconds upload_time (const Schedule &, std::stop_token) override
  {
    return 0;
  }
  Result<void> upload (
      const Schedule &, std::stop_token, const UploadProgress &) override
  {
    throw std::bad_alloc ();
  }
  Result<void> start (const SlotPlan &, std::stop_token) override { return {}; }
  Result<void> show (
      const StillMask &, const SlotPlan &, std::stop_token) override
  {
    return {};
  }
  void stop () override { throw std::bad_alloc (); }
  bool running () const override { throw std::bad_alloc (); }

private:
  DmdInfo info_{.name = "hungry"};
};

TEST (Memory, ARunnerReportsAJobThatFailed)
{
  std::vector<ErrorCode> failures;
  {
    DmdRunner runner (std::make_unique<HungryDmd> (),
        {.failed =
                [&] (const Error &error) {
                  failures.push_back (error.code);
                  throw std::bad_alloc ();
                },
            .not_parked = [] { throw std::bad_alloc (); }});
    runner.upload (Schedule ());
    EXPECT_FALSE (runner.settle ());
    EXPECT_TRUE (runner.failed ());
    runner.halt ();
    EXPECT_TRUE (runner.halted ());
    runner.upload (Schedule ());
    EXPECT_FALSE (runner.settle ());
  }
  EXPECT_EQ (failures,
      (std::vector{ErrorCode::out_of_memory, ErrorCode::out_of_memory}));
}

} // namespace
