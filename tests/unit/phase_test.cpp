/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Synchronisation of the masks, measured from frames of a small bench. */
#include <cmath>
#include <deque>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "bench/bench.h"
#include "dmd/simulated_dmd.h"
#include "scenes.h"
#include "sync/phase_lock.h"
#include "sync/phase_watch.h"

using namespace codedexposure;
using namespace codedexposure::test;

namespace
{

using Kind = PhaseReading::Kind;

Schedule
schedule_of (const char *preset)
{
  Result<Schedule> schedule = Schedule::parse (preset);
  EXPECT_TRUE (schedule) << schedule.error ().message;
  return *std::move (schedule);
}

constexpr int kWidth = 96;
constexpr int kHeight = 72;

/** A camera that sees a scene through the masks of simulated mirrors. */
class Camera
{
public:
  explicit Camera (const char *preset, double black = 0)
      : schedule (schedule_of (preset)),
        bench_ (*OpticalBench::make (kWidth, kHeight,
            {.psf_sigma = 0.5,
                .full_well = 10000,
                .read_noise = 5,
                .black_level = black,
                .alignment = {}})),
        scene_ (kWidth, kHeight), frame_ (kWidth, kHeight)
  {
    mirrors.program (schedule);
    mirrors.start ();
  }

  ImageView<const std::uint8_t> expose (const Scene &scene)
  {
    bench_.begin (schedule);
    in_phase = true;
    for (int s = 0; s < schedule.slots (); s++, slot_++) {
      const int mask = mirrors.mask_in_slot (slot_).value_or (-1);
      in_phase &= mask >= 0 && mask % schedule.slots () == s;
      scene (slot_, scene_.view ());
      bench_.expose (std::as_const (scene_).view (), mask, 1.0);
    }
    bench_.read_out (number_++, frame_.view ());
    return std::as_const (frame_).view ();
  }

  const Schedule schedule;
  SimulatedMirrors mirrors;
  bool in_phase = true; ///< the masks in the last exposure

private:
  OpticalBench bench_;
  Image<std::uint8_t> scene_;
  Image<std::uint8_t> frame_;
  std::int64_t slot_ = 0;
  std::uint64_t number_ = 0;
};

/** Sights of @p frames frames with a slip of @p by in slot @p at. */
std::vector<PhaseSight>
sights (
    const char *preset, const Scene &scene, int frames, std::int64_t at, int by)
{
  Camera camera (preset);
  camera.mirrors.slip_at (at, by);
  PhaseWatch watch (camera.schedule, kWidth, kHeight);
  std::vector<PhaseSight> seen;
  for (int f = 0; f < frames; f++)
    seen.push_back (watch.look (camera.expose (scene)));
  return seen;
}

} // namespace

TEST (LevelMeter, MeasuresEveryElementAndThePilotsColumns)
{
  for (const char *preset :
      {"sequential:2x2,pilot=8", "staircase:3x3,phase=1/2,pilot=3",
          "sequential:lattice:8/3,order=bit-reversal,pilot=1"}) {
    SCOPED_TRACE (preset);
    const Schedule schedule = schedule_of (preset);
    Image<std::uint16_t> frame (47, 61);
    for (int y = 0; y < frame.height (); y++)
      for (int x = 0; x < frame.width (); x++)
        frame.at (x, y) =
            std::uint16_t (y >= frame.height () - schedule.pilot_rows ()
                               ? 10000 + x % kPilotColumns
                               : 1000 + schedule.element_at (x, y));
    LevelMeter meter (schedule, frame.width (), frame.height ());
    ASSERT_TRUE (meter.complete ());
    const Levels &levels = meter.measure (std::as_const (frame).view ());
    for (int e = 0; e < schedule.elements (); e++)
      EXPECT_DOUBLE_EQ (levels.elements[std::size_t (e)], 1000 + e);
    for (int c = 0; c < kPilotColumns; c++)
      EXPECT_DOUBLE_EQ (levels.pilot[std::size_t (c)], 10000 + c);
  }
}

TEST (LevelMeter, HonoursTheStrideAndTellsFramesThatAreTooSmall)
{
  const Schedule schedule = schedule_of ("sequential:2x2");
  const std::uint8_t padded[] = {1, 2, 99, 99, 3, 4, 99, 99};
  LevelMeter meter (schedule, 2, 2);
  EXPECT_EQ (
      meter.measure (ImageView<const std::uint8_t>{padded, 2, 2, 4}).elements,
      (std::vector<double>{1, 2, 3, 4}));

  EXPECT_FALSE (LevelMeter (schedule, 1, 8).complete ());
  EXPECT_FALSE (LevelMeter (schedule, 8, 1).complete ());
  EXPECT_FALSE (
      LevelMeter (schedule_of ("sequential:2x2,pilot=2"), 32, 3).complete ());
}

TEST (SlipObservable, IsToldHonestly)
{
  EXPECT_EQ (
      slip_observable (schedule_of ("sequential:2x2")), SlipObservable::never);
  EXPECT_EQ (slip_observable (schedule_of ("sequential:lattice:8/3")),
      SlipObservable::never);
  EXPECT_EQ (slip_observable (schedule_of ("staircase:2x2")),
      SlipObservable::in_the_frame);
  EXPECT_EQ (slip_observable (schedule_of ("staircase:3x3")),
      SlipObservable::in_the_frame);
  EXPECT_EQ (slip_observable (schedule_of ("s-matrix:7x1")),
      SlipObservable::in_the_frame);
  EXPECT_EQ (
      slip_observable (schedule_of ("staircase:16x16")), SlipObservable::never)
      << "one slot in 256 is too small a part of the levels";
  EXPECT_EQ (slip_observable (schedule_of ("sequential:2x2,pilot=4")),
      SlipObservable::always);
}

TEST (SlipSignature, SeesASlipAtEveryBoundaryInTheFrameItself)
{
  for (const char *preset : {"staircase:2x2", "staircase:3x3",
           "staircase:2x2,leak=0.05", "s-matrix:7x1", "staircase:lattice:5/2"})
    for (const Scene &scene : {Scene (still), Scene (moving)})
      for (const int by : {-1, 1}) {
        const int slots = schedule_of (preset).slots ();
        for (int boundary = 1; boundary < slots; boundary++) {
          SCOPED_TRACE (testing::Message ()
                        << preset << " slip " << by << " at slot " << boundary);
          const auto seen = sights (preset, scene, 9, 4 * slots + boundary, by);
          for (int f = 0; f < 9; f++)
            EXPECT_EQ (
                seen[std::size_t (f)].reading.kind == Kind::slipped, f == 4)
                << f;
          EXPECT_FALSE (seen[4].next_frame_tells);
          EXPECT_TRUE (seen[4].reading.slots == by || !seen[4].reading.certain);
        }
      }
}

TEST (SlipSignature, TellsWhenTheNumberOfSlotsIsNotCertain)
{
  /* Masks 0 0 1 2 and masks 0 1 2 0 have the same sum. */
  EXPECT_EQ (sights ("staircase:2x2", still, 5, 4 * 4 + 1, 1)[4].reading,
      (PhaseReading{Kind::slipped, 1, false}));
  EXPECT_EQ (sights ("staircase:2x2", still, 5, 4 * 4 + 3, -1)[4].reading,
      (PhaseReading{Kind::slipped, 1, false}));
  EXPECT_EQ (sights ("staircase:2x2", still, 5, 4 * 4 + 2, 1)[4].reading,
      (PhaseReading{Kind::slipped, 1, true}));
}

TEST (SlipSignature, CannotSeeASlipBetweenTwoExposures)
{
  for (const PhaseSight &sight : sights ("staircase:2x2", still, 10, 16, 1))
    EXPECT_NE (sight.reading.kind, Kind::slipped);
}

TEST (SlipSignature, LightThatChangesIsNotASlip)
{
  const std::vector<std::pair<const char *, Scene>> scenes{
      {"lamps on the mains", kMains},
      {"lamp on and off", lit_by ([] (std::int64_t slot) {
         return slot / 37 % 2 ? 1.0 : 0.3;
       })},
      {"flash of one slot", lit_by ([] (std::int64_t slot) {
         return slot % 9 == 0 ? 1.0 : 0.4;
       })},
      {"black and white slots",
          lit_by ([] (std::int64_t slot) { return slot % 2 ? 1.0 : 0.0; })},
      {"slow fade to black", lit_by ([] (std::int64_t slot) {
         return std::abs (1 - double (slot % 400) / 200.0);
       })},
      {"fast fade to black", lit_by ([] (std::int64_t slot) {
         return std::abs (1 - double (slot % 80) / 40.0);
       })},
      {"checkers in step with the tile",
          each_pixel ([] (int x, int y, std::int64_t slot) {
            return (x + y + slot / 16) % 2 ? 0.8 : 0.1;
          })},
      {"ball on black", each_pixel ([] (int x, int y, std::int64_t slot) {
         const double dx = x - 48 + 30 * std::cos (0.05 * double (slot));
         const double dy = y - 36 + 20 * std::sin (0.07 * double (slot));
         return dx * dx + dy * dy < 100 ? 1.0 : 0.02;
       })}};
  for (const char *preset : {"staircase:2x2", "staircase:3x3", "s-matrix:7x1",
           "sequential:2x2,pilot=8", "sequential:lattice:8/3,pilot=8"})
    for (const auto &[name, scene] : scenes) {
      SCOPED_TRACE (testing::Message () << preset << ", " << name);
      int alarms = 0;
      for (const PhaseSight &sight : sights (preset, scene, 500, 1 << 30, 0))
        alarms += sight.reading.kind == Kind::slipped;
      EXPECT_EQ (alarms, 0);
    }
}

TEST (PilotPhase, ReadsEveryPhaseOfEverySchedule)
{
  for (const char *preset : {"sequential:2x2,pilot=8", "sequential:2x1,pilot=8",
           "sequential:lattice:5/2,pilot=8", "sequential:3x3,pilot=12",
           "staircase:4x4,leak=0.02,pilot=8"}) {
    const int slots = schedule_of (preset).slots ();
    for (int by = -slots; by <= slots; by++) {
      SCOPED_TRACE (testing::Message () << preset << " slip " << by);
      /* Exactly between two exposures, where only the pilot shows it. */
      const auto seen = sights (preset, moving, 8, 4 * slots, by);
      const int late = floor_mod (by, slots);
      for (int f = 0; f < 8; f++) {
        const PhaseReading &reading = seen[std::size_t (f)].reading;
        EXPECT_EQ (
            reading.kind, f < 4 || late == 0 ? Kind::in_phase : Kind::slipped)
            << f;
        const bool few =
            f < 4 || (slots > 2 && std::min (late, slots - late) < 2);
        EXPECT_TRUE (reading.certain || !few) << f;
        EXPECT_TRUE (!reading.certain ||
                     floor_mod (reading.slots, slots) == (f < 4 ? 0 : late))
            << f << ": " << reading.slots;
      }
    }
  }
}

TEST (PilotPhase, AndSignatureFlagTheFrameOfTheSlipAndTheNextTells)
{
  for (const int by : {-1, 1})
    for (int boundary = 1; boundary < 4; boundary++) {
      SCOPED_TRACE (testing::Message () << by << " at " << boundary);
      const auto seen =
          sights ("sequential:2x2,pilot=8", moving, 7, 16 + boundary, by);
      EXPECT_EQ (seen[3].reading.kind, Kind::in_phase);
      EXPECT_TRUE (seen[3].reading.certain);
      EXPECT_EQ (seen[4].reading.kind, Kind::slipped);
      EXPECT_EQ (seen[5].reading, (PhaseReading{Kind::slipped, by, true}));
      EXPECT_FALSE (seen[5].next_frame_tells);
    }
}

TEST (PilotPhase, IsUnclearInTheDark)
{
  const Scene dark = lit_by ([] (std::int64_t) { return 0.01; });
  for (const PhaseSight &sight :
      sights ("sequential:2x2,pilot=8", dark, 20, 21, 1))
    EXPECT_EQ (sight.reading.kind, Kind::unclear);
}

TEST (PhaseWatch, SeesParkedMirrors)
{
  for (const char *preset : {"staircase:2x2", "staircase:2x2,leak=0.1"}) {
    SCOPED_TRACE (preset);
    Camera camera (preset);
    PhaseWatch watch (camera.schedule, kWidth, kHeight);
    for (int f = 0; f < 5; f++)
      EXPECT_EQ (
          watch.look (camera.expose (moving)).reading.kind, Kind::in_phase);
    camera.mirrors.stop ();
    EXPECT_EQ (watch.look (camera.expose (moving)).reading.kind, Kind::parked);
    camera.mirrors.start ();
    EXPECT_EQ (
        watch.look (camera.expose (moving)).reading.kind, Kind::in_phase);
  }
}

/* As of a camera in a dim room. */
TEST (PhaseWatch, TakesTheBlackLevelOfTheCameraForNoLight)
{
  constexpr double kBlack = 64;
  const Scene dim = lit_by ([] (std::int64_t) { return 0.2; });
  Camera camera ("staircase:2x2", kBlack);
  PhaseWatch watch (camera.schedule, kWidth, kHeight, kBlack);
  for (int f = 0; f < 8; f++)
    EXPECT_EQ (watch.look (camera.expose (dim)).reading.kind, Kind::in_phase);
  camera.mirrors.stop ();
  EXPECT_EQ (watch.look (camera.expose (dim)).reading.kind, Kind::parked);
}

namespace
{

/** The result of a run. */
struct Course {
  int slips = 0;
  int locks = 0;
  std::optional<std::uint64_t> noticed; // first frame that is not locked
  std::uint64_t said = 0;               // frame that reported the slip
  std::uint64_t first_frame = 0;        // frame of the slip, as reported
  std::uint64_t over = 0;               // first frame that is not flagged
  int known = 0;                        // frames known to be in phase
  int wrong = 0;                        // of these, frames that are not
  int wrongly_locked = 0; // frames without synchronisation after the detection
};

/**
 * Exposes @p frames frames with a slip of @p by in slot @p at, looks at each
 * after @p in_flight later ones were exposed, and restarts when told to.
 */
Course
run_lock (const char *preset, const Scene &scene, int frames, std::int64_t at,
    int by, std::size_t in_flight)
{
  Camera camera (preset);
  camera.mirrors.slip_at (at, by);
  PhaseWatch watch (camera.schedule, kWidth, kHeight);
  PhaseLock lock ({.observable = slip_observable (camera.schedule),
      .can_restart = true,
      .gap_shows_restart = false});

  Course run;
  std::deque<std::pair<PhaseSight, bool>> queue;
  for (std::uint64_t exposed = 0; exposed < std::uint64_t (frames); exposed++) {
    const PhaseSight sight = watch.look (camera.expose (scene));
    queue.emplace_back (sight, camera.in_phase);
    if (queue.size () <= in_flight)
      continue;
    const std::uint64_t number = exposed - in_flight;
    const LockDecision decision =
        lock.take (queue.front ().first, number, 0, true);
    if (decision.locked == false && !run.noticed)
      run.noticed = number;
    if (decision.slipped) {
      run.slips++;
      run.said = number;
      run.first_frame = decision.slipped->first_frame;
    }
    if (decision.slip_over)
      run.over = number;
    run.known += decision.locked == true;
    run.wrong += decision.locked == true && !queue.front ().second;
    run.locks += decision.locked_now;
    run.wrongly_locked +=
        run.noticed && decision.locked != false && !queue.front ().second;
    EXPECT_EQ (decision.slip == 0, decision.locked != false);
    if (decision.restart) {
      camera.mirrors.stop ();
      camera.mirrors.start ();
    }
    queue.pop_front ();
  }
  return run;
}

} // namespace

TEST (PhaseLock, OnlyAPilotShowsThatFramesAreInPhase)
{
  for (const char *preset :
      {"sequential:2x2", "staircase:2x2", "sequential:2x2,pilot=8"}) {
    SCOPED_TRACE (preset);
    const Course run = run_lock (preset, kMains, 500, 1 << 30, 0, 0);
    EXPECT_EQ (run.locks, schedule_of (preset).pilot_rows () > 0 ? 1 : 0);
    EXPECT_EQ (run.known, run.locks ? 500 : 0);
    EXPECT_EQ (run.slips, 0);
    EXPECT_FALSE (run.noticed);
  }
}

TEST (PhaseLock, NoticesASlipInsideTheExposureInThatFrameAndRecovers)
{
  for (const char *preset : {"staircase:2x2", "staircase:3x3"})
    for (const int by : {-1, 1})
      for (const std::size_t in_flight : {0, 1, 7})
        for (int boundary = 1; boundary < 4; boundary++) {
          SCOPED_TRACE (testing::Message ()
                        << preset << " slip " << by << " at " << boundary
                        << ", " << in_flight << " in flight");
          const int slots = schedule_of (preset).slots ();
          const Course run = run_lock (
              preset, moving, 60, 20 * slots + boundary, by, in_flight);
          EXPECT_EQ (run.slips, 1);
          EXPECT_EQ (run.noticed, 20u);
          EXPECT_EQ (run.said, 20u);
          EXPECT_EQ (run.first_frame, 20u);
          EXPECT_EQ (run.locks, 0);
          EXPECT_EQ (run.over, 22 + in_flight);
          EXPECT_EQ (run.wrongly_locked, 0);
        }
}

TEST (PhaseLock, WithAPilotNoticesASlipAnywhereWithinThreeFrames)
{
  for (const char *preset : {"sequential:2x2,pilot=8",
           "sequential:lattice:8/3,pilot=8", "staircase:2x2,pilot=8"})
    for (const Scene &scene : {Scene (still), kMains})
      for (const int by : {-2, -1, 1})
        for (const std::size_t in_flight : {0, 5}) {
          const int slots = schedule_of (preset).slots ();
          for (int boundary = 0; boundary < slots; boundary++) {
            SCOPED_TRACE (testing::Message ()
                          << preset << " slip " << by << " at " << boundary
                          << ", " << in_flight << " in flight");
            const Course run = run_lock (
                preset, scene, 40, 20 * slots + boundary, by, in_flight);
            EXPECT_EQ (run.slips, 1);
            EXPECT_GE (run.noticed.value_or (0), 20u);
            EXPECT_LE (run.said, 22u);
            EXPECT_EQ (run.first_frame, run.noticed.value_or (0));
            EXPECT_EQ (run.locks, 2);
            EXPECT_EQ (run.wrongly_locked, 0);
            EXPECT_EQ (run.wrong, 0);
          }
        }
}

/* The scene of `codedexposure-scene pour`: dark in parts of the pilot. */
TEST (PhaseLock, WithAPilotNoFrameOutOfPhaseIsKnownToBeInPhase)
{
  const Scene half_dark = each_pixel ([] (int x, int y, std::int64_t slot) {
    return (x + slot / 3) % 48 < 24 ? texture (x, y) : 0.01;
  });
  const Scene still_dark = each_pixel ([] (int x, int y, std::int64_t) {
    return x % 32 < 12 ? texture (x, y) : 0.01;
  });
  for (const char *preset : {"sequential:2x2,pilot=8", "staircase:2x2,pilot=8",
           "sequential:lattice:8/3,pilot=8"})
    for (const Scene &scene : {half_dark, still_dark, Scene (moving)})
      for (const int by : {-1, 1, 2}) {
        const int slots = schedule_of (preset).slots ();
        for (int boundary = 0; boundary < slots; boundary++) {
          SCOPED_TRACE (testing::Message ()
                        << preset << " slip " << by << " at " << boundary);
          const Course run =
              run_lock (preset, scene, 40, 20 * slots + boundary, by, 0);
          EXPECT_EQ (run.wrong, 0);
        }
      }
}

TEST (PhaseLock, AGapShowsTheRestartOfADmdThatTriggersTheCamera)
{
  PhaseLock lock ({.observable = SlipObservable::in_the_frame,
      .can_restart = true,
      .gap_shows_restart = true});
  const PhaseSight good{{Kind::in_phase}};
  const PhaseSight bad{{Kind::slipped, 1, true}};
  EXPECT_EQ (lock.take (good, 0, 0, true).locked, std::nullopt);
  EXPECT_TRUE (lock.take (bad, 1, 0, true).restart);
  EXPECT_EQ (lock.take (good, 2, 0, false).locked, false);
  EXPECT_EQ (lock.take (good, 3, 0, true).locked, false);
  const LockDecision over = lock.take (good, 7, 3, true);
  EXPECT_EQ (over.locked, std::nullopt);
  EXPECT_TRUE (over.slip_over);
  EXPECT_FALSE (over.locked_now);
}

TEST (PhaseLock, AsksAgainForARestartThatIsNotSeen)
{
  PhaseLock lock (
      {.observable = SlipObservable::in_the_frame, .can_restart = true});
  const PhaseSight good{{Kind::in_phase}};
  lock.take (good, 0, 0, true);
  lock.take ({{Kind::slipped, 1, true}}, 1, 0, true);
  int restarts = 0;
  for (int f = 2; f < 300; f++) {
    const LockDecision decision = lock.take (good, std::uint64_t (f), 0, true);
    EXPECT_EQ (decision.locked, false);
    EXPECT_FALSE (decision.slipped);
    restarts += decision.restart;
  }
  EXPECT_EQ (restarts, 4);
}

TEST (PhaseLock, WithoutADmdOnlyAPilotBringsTheLockBack)
{
  const PhaseSight good{{Kind::in_phase}};
  const PhaseSight bad{{Kind::slipped, -1, true}};
  for (const SlipObservable observable :
      {SlipObservable::in_the_frame, SlipObservable::always}) {
    PhaseLock lock ({.observable = observable});
    lock.take (good, 0, 0, true);
    const LockDecision slipped = lock.take (bad, 1, 0, true);
    EXPECT_FALSE (slipped.restart);
    EXPECT_EQ (slipped.slip, -1);
    EXPECT_EQ (lock.take (good, 2, 0, true).locked == true,
        observable == SlipObservable::always);
  }
}

/* A camera that sends its last picture once more, with the time of the next. */
TEST (PhaseLock, AnOldPictureIsNotKnownToBeInPhase)
{
  PhaseLock lock ({.observable = SlipObservable::always});
  const auto shows = [] (int half) {
    return PhaseSight{{Kind::in_phase, 0, true, half}};
  };
  EXPECT_EQ (lock.take (shows (1), 0, 0, true).locked, true);
  EXPECT_EQ (lock.take (shows (0), 1, 0, true).locked, true);
  EXPECT_EQ (lock.take (shows (0), 2, 0, true).locked, std::nullopt);
  EXPECT_EQ (lock.take (shows (0), 3, 0, true).locked, std::nullopt);
  EXPECT_EQ (lock.take (shows (1), 4, 0, true).locked, true);
  EXPECT_EQ (lock.take (shows (1), 6, 1, true).locked, true)
      << "frame 5 is lost";
}

TEST (PhaseLock, WithoutAPilotThePhaseIsUnknownUntilASlip)
{
  const PhaseSight good{{Kind::in_phase}};
  for (const SlipObservable observable :
      {SlipObservable::never, SlipObservable::in_the_frame}) {
    PhaseLock lock ({.observable = observable, .can_restart = true});
    const LockDecision first = lock.take (good, 0, 0, true);
    EXPECT_EQ (first.locked, std::nullopt);
    EXPECT_FALSE (first.locked_now);
    EXPECT_EQ (
        lock.take ({{Kind::slipped, 1, true}}, 1, 0, true).locked, false);
  }
}

TEST (PhaseLock, ASuspicionThatTheNextFrameDeniesIsNoSlip)
{
  PhaseLock lock ({.observable = SlipObservable::always});
  const PhaseSight good{{Kind::in_phase}};
  lock.take (good, 0, 0, true);
  const LockDecision suspected =
      lock.take ({{Kind::slipped, 1, true}, true}, 1, 0, true);
  EXPECT_EQ (suspected.locked, false);
  EXPECT_EQ (suspected.slip, 1);
  EXPECT_FALSE (suspected.slipped);
  EXPECT_EQ (lock.take ({}, 2, 0, true).locked, false);
  const LockDecision denied = lock.take (good, 3, 0, true);
  EXPECT_EQ (denied.locked, true);
  EXPECT_FALSE (denied.locked_now);
}
