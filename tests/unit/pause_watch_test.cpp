/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A process that is stopped notices it. */
#include <csignal>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "sync/pause_watch.h"

using namespace codedexposure;
using namespace std::chrono_literals;

TEST (PauseWatch, SaysNothingWhileTheProcessRuns)
{
  const PauseWatch watch;
  EXPECT_EQ (watch.recent (1h).count (), 0);
}

/* The child stops itself; it goes on when the parent has let time pass. */
TEST (PauseWatch, TellsForHowLongTheProcessWasStopped)
{
  constexpr auto kStopped = 1500ms;
  const pid_t child = fork ();
  ASSERT_GE (child, 0);
  if (child == 0) {
    const PauseWatch watch;
    raise (SIGSTOP);
    _exit (watch.recent (1h) >= PauseWatch::kMinPause ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ (waitpid (child, &status, WUNTRACED), child);
  ASSERT_TRUE (WIFSTOPPED (status));
  std::this_thread::sleep_for (kStopped);
  kill (child, SIGCONT);
  ASSERT_EQ (waitpid (child, &status, 0), child);
  ASSERT_TRUE (WIFEXITED (status));
  EXPECT_EQ (WEXITSTATUS (status), 0);
}
