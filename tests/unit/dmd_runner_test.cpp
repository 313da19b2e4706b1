/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* The thread that talks to a DMD: order, cancellation, failure, parking. */
#include <condition_variable>
#include <future>
#include <mutex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dmd/runner.h"

using namespace codedexposure;

namespace
{

/** Calls to a RecordingDmd, and its configured results. */
struct Record {
  std::vector<std::string> calls;
  bool running = false;
  bool upload_waits = false; // until a stop is requested
  bool start_fails = false;
  bool deaf = false; // to being told to stop
  std::promise<void> uploading;
};

class RecordingDmd : public Dmd
{
public:
  explicit RecordingDmd (std::shared_ptr<Record> record)
      : record_ (std::move (record))
  {
  }
  ~RecordingDmd () override { record_->calls.push_back ("closed"); }

  const DmdInfo &info () const override { return info_; }
  Nanoseconds upload_time (const Schedule &schedule, std::stop_token) override
  {
    return schedule.masks () * 1'000'000;
  }
  Result<void> upload (const Schedule &schedule, std::stop_token stop,
      const UploadProgress &progress) override
  {
    record_->calls.push_back ("upload " + schedule.text ());
    progress (0, schedule.masks ());
    if (record_->upload_waits) {
      record_->uploading.set_value ();
      std::mutex lock;
      std::unique_lock guard (lock);
      std::condition_variable_any ().wait (guard, stop, [] { return false; });
      return Error{"cancelled"};
    }
    return {};
  }
  Result<void> start (const SlotPlan &plan, std::stop_token) override
  {
    record_->calls.push_back ("start " + time_text (plan.active ()));
    if (record_->start_fails)
      return Error{"no light"};
    record_->running = true;
    return {};
  }
  Result<void> show (
      const StillMask &mask, const SlotPlan &, std::stop_token) override
  {
    record_->calls.push_back ("show " + mask.name);
    record_->running = true;
    return {};
  }
  void stop () override
  {
    record_->calls.push_back ("stop");
    record_->running = record_->running && record_->deaf;
  }
  bool running () const override { return record_->running; }

private:
  std::shared_ptr<Record> record_;
  DmdInfo info_{.name = "recording"};
};

class DmdRunnerTest : public ::testing::Test
{
protected:
  std::unique_ptr<DmdRunner> make_runner ()
  {
    return std::make_unique<DmdRunner> (std::make_unique<RecordingDmd> (record),
        DmdRunner::Reports{
            .predicted = [this] (Nanoseconds time) { predicted = time; },
            .progress = [this] (int sent, int) { progress.push_back (sent); },
            .failed =
                [this] (
                    const Error &error) { failures.push_back (error.message); },
            .not_parked = [this] { not_parked++; }});
  }

  std::shared_ptr<Record> record = std::make_shared<Record> ();
  Nanoseconds predicted = 0;
  std::vector<int> progress;
  std::vector<std::string> failures;
  int not_parked = 0;
  const SlotPlan plan = *SlotPlan::fit ({}, 4, {25, 1});
};

} // namespace

TEST_F (DmdRunnerTest, UploadsStartsAndParks)
{
  const auto runner = make_runner ();
  runner->upload (Schedule ());
  EXPECT_TRUE (runner->settle ());
  runner->start (plan);
  EXPECT_TRUE (runner->settle ());
  EXPECT_TRUE (runner->settled ());
  EXPECT_TRUE (record->running);

  runner->halt ();
  EXPECT_FALSE (record->running);
  EXPECT_EQ (record->calls, (std::vector<std::string>{"upload sequential:2x2",
                                "stop", "start 10ms", "stop"}));
  EXPECT_EQ (predicted, 4'000'000);
  EXPECT_EQ (progress, std::vector{0});
  EXPECT_TRUE (failures.empty ());
}

TEST_F (DmdRunnerTest, DoesNothingOutsideARun)
{
  const auto runner = make_runner ();
  runner->start (plan);
  EXPECT_FALSE (runner->settle ());

  runner->upload (Schedule ());
  runner->halt ();
  record->calls.clear ();
  runner->start (plan);
  EXPECT_FALSE (runner->settle ());
  EXPECT_TRUE (record->calls.empty ());
}

TEST_F (DmdRunnerTest, RunsAgainAfterHalt)
{
  const auto runner = make_runner ();
  for (int run = 0; run < 2; run++) {
    runner->upload (Schedule ());
    runner->start (plan);
    EXPECT_TRUE (runner->settle ());
    EXPECT_TRUE (record->running);
    runner->halt ();
    EXPECT_FALSE (record->running);
  }
}

TEST_F (DmdRunnerTest, DestructionParksAndCloses)
{
  {
    const auto runner = make_runner ();
    runner->upload (Schedule ());
    runner->start (plan);
    EXPECT_TRUE (runner->settle ());
  }
  ASSERT_GE (record->calls.size (), 2u);
  EXPECT_EQ (record->calls.end ()[-2], "stop");
  EXPECT_EQ (record->calls.back (), "closed");
}

TEST_F (DmdRunnerTest, HaltCancelsAnUploadWithoutAFailure)
{
  record->upload_waits = true;
  const auto runner = make_runner ();
  runner->upload (Schedule ());
  runner->start (plan);
  record->uploading.get_future ().wait ();
  auto waiter =
      std::async (std::launch::async, [&] { return runner->settle (); });
  runner->halt ();
  EXPECT_FALSE (waiter.get ());
  EXPECT_TRUE (failures.empty ());
  EXPECT_FALSE (runner->failed ());
  EXPECT_EQ (record->calls,
      (std::vector<std::string>{"upload sequential:2x2", "stop", "stop"}));
}

TEST_F (DmdRunnerTest, InterruptCutsAWaitShortAndLeavesTheJob)
{
  record->upload_waits = true;
  const auto runner = make_runner ();
  runner->upload (Schedule ());
  record->uploading.get_future ().wait ();
  EXPECT_FALSE (runner->settle (std::chrono::milliseconds (1)));
  runner->interrupt (true);
  EXPECT_FALSE (runner->settle ());
  EXPECT_FALSE (runner->settled ());
  EXPECT_FALSE (runner->failed ());
}

TEST_F (DmdRunnerTest, AnInterruptEndsWithTheRun)
{
  const auto runner = make_runner ();
  runner->upload (Schedule ());
  runner->interrupt (true);
  runner->halt ();
  runner->upload (Schedule ());
  EXPECT_TRUE (runner->settle ());
}

TEST_F (DmdRunnerTest, SaysThatADeviceDoesNotPark)
{
  const auto runner = make_runner ();
  runner->upload (Schedule ());
  runner->start (plan);
  ASSERT_TRUE (runner->settle ());
  runner->halt ();
  EXPECT_EQ (not_parked, 0);

  runner->upload (Schedule ());
  runner->start (plan);
  ASSERT_TRUE (runner->settle ());
  record->deaf = true;
  runner->halt ();
  EXPECT_EQ (not_parked, 1);
  record->deaf = false;
}

TEST_F (DmdRunnerTest, AFailureParksEndsTheRunAndIsReportedOnce)
{
  record->start_fails = true;
  const auto runner = make_runner ();
  runner->upload (Schedule ());
  runner->start (plan);
  runner->start (plan);
  EXPECT_FALSE (runner->settle ());
  EXPECT_TRUE (runner->failed ());
  EXPECT_EQ (failures, std::vector<std::string>{"no light"});
  EXPECT_EQ (record->calls.back (), "stop");

  record->start_fails = false;
  runner->halt ();
  EXPECT_FALSE (runner->failed ());
  runner->upload (Schedule ());
  runner->start (plan);
  EXPECT_TRUE (runner->settle ());
}

TEST_F (DmdRunnerTest, ShowsAMaskAndRestoresTheSchedule)
{
  const auto runner = make_runner ();
  runner->upload (Schedule ());
  runner->start (plan);
  ASSERT_TRUE (runner->settle ());
  record->calls.clear ();
  runner->show ({.name = "stripes", .on = {}}, plan);
  EXPECT_TRUE (runner->settle ());
  runner->restore (Schedule (), plan);
  EXPECT_TRUE (runner->settle ());
  EXPECT_EQ (
      record->calls, (std::vector<std::string>{"stop", "show stripes",
                         "upload sequential:2x2", "stop", "start 10ms"}));
  runner->halt ();
  record->calls.clear ();
  runner->show ({.name = "stripes", .on = {}}, plan);
  EXPECT_FALSE (runner->settle ());
  EXPECT_TRUE (record->calls.empty ());
}
