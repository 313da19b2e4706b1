/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Threads that share the parts of a task. */
#include "base/workers.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace
{

using namespace codedexposure;

TEST (Workers, EveryPartIsDoneOnce)
{
  for (const int count : {1, 2, 5}) {
    Workers workers (count);
    ASSERT_EQ (workers.count (), count);
    for (const int parts : {0, 1, 3, 100}) {
      std::vector<std::atomic<int>> done (std::size_t (parts) + 1);
      EXPECT_TRUE (workers.run (parts, [&] (int part, int worker) {
        done[std::size_t (part)] += worker >= 0 && worker < count ? 1 : 1000;
      }));
      for (int part = 0; part < parts; part++)
        EXPECT_EQ (done[std::size_t (part)], 1) << part << " of " << parts;
      EXPECT_EQ (done.back (), 0);
    }
  }
}

/* Each task waits until the other has started. */
TEST (Workers, ThreadsWorkSideBySide)
{
  Workers workers (2);
  std::mutex mutex;
  std::condition_variable changed;
  int begun = 0;
  workers.run (2, [&] (int, int) {
    std::unique_lock lock (mutex);
    begun++;
    changed.notify_all ();
    changed.wait (lock, [&] { return begun == 2; });
  });
  EXPECT_EQ (begun, 2);
}

TEST (Workers, NoPartBeginsAfterAStop)
{
  for (const int count : {1, 3}) {
    Workers workers (count);
    std::stop_source stop;
    std::atomic<int> done = 0;
    EXPECT_FALSE (workers.run (
        1000,
        [&] (int, int) {
          done++;
          stop.request_stop ();
        },
        stop.get_token ()));
    EXPECT_GE (done, 1);
    EXPECT_LE (done, count);
    EXPECT_TRUE (workers.run (2, [] (int, int) {}));
  }
}

TEST (Workers, ZeroStandsForTheProcessors)
{
  const int processors = int (std::thread::hardware_concurrency ());
  EXPECT_EQ (Workers (0).count (), std::clamp (processors, 1, Workers::kMost));
  EXPECT_EQ (Workers (1000).count (), Workers::kMost);
}

} // namespace
