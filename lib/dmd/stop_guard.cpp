/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "dmd/stop_guard.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "base/try.h"
#include "dmd/tool_path.h"

namespace codedexposure
{

namespace
{

using namespace std::chrono_literals;

constexpr char kRuns = '1', kStands = '0';

const char *
tool_path ()
{
  const char *named = std::getenv ("CODEDEXPOSURE_TOOL");
  return named != nullptr ? named : CODEDEXPOSURE_TOOL_PATH;
}

/** Runs the tool with @p words as its standard input and nothing else of this
 * process but standard error; 0 or an errno. */
int
spawn_tool (const std::string &device, int words, pid_t &process)
{
  std::string tool = tool_path (), dmd = "dmd", guard = "guard", board = device;
  char *const arguments[] = {
      tool.data (), dmd.data (), guard.data (), board.data (), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init (&files);
  posix_spawn_file_actions_adddup2 (&files, words, STDIN_FILENO);
  posix_spawn_file_actions_addopen (
      &files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addclosefrom_np (&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init (&attributes);
  posix_spawnattr_setflags (&attributes, POSIX_SPAWN_SETSID);
  const int code = posix_spawn (
      &process, tool.c_str (), &files, &attributes, arguments, environ);
  posix_spawn_file_actions_destroy (&files);
  posix_spawnattr_destroy (&attributes);
  return code;
}

Result<void>
stop_board (const std::string &device)
{
  ASSIGN_OR_RETURN (const auto dmd, open_dmd (device));
  dmd->stop ();
  ASSIGN_OR_RETURN (const DmdStatus now, dmd->status ());
  if (now.running)
    return Error{dmd->info ().name + " does not stop", ErrorCode::device};
  return {};
}

} // namespace

Result<std::unique_ptr<StopGuard>>
StopGuard::post (const std::string &device)
{
  int ends[2];
  int code = 0;
  if (socketpair (AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    code = errno;
  } else {
    pid_t process = 0;
    code = spawn_tool (device, ends[0], process);
    close (ends[0]);
    if (code == 0)
      return std::unique_ptr<StopGuard> (new StopGuard (ends[1], process));
    close (ends[1]);
  }
  return Error{
      std::string ("cannot run '") + tool_path () +
          "', which would stop the mirrors if this process were killed: " +
          std::strerror (code) +
          "; install it, set CODEDEXPOSURE_TOOL to its path, or use "
          "guard=off",
      ErrorCode::not_found};
}

StopGuard::~StopGuard ()
{
  shutdown (words_, SHUT_WR);
  // Wait for a guard that has nothing to do but to end.
  constexpr int kPatience = 1000; // ms
  pollfd end{words_, 0, 0};
  const bool ending = !running_ && poll (&end, 1, kPatience) == 1;
  waitpid (process_, nullptr, ending ? 0 : WNOHANG);
  close (words_);
}

bool
StopGuard::tell (bool running)
{
  running_ = running;
  const char word = running ? kRuns : kStands;
  return send (words_, &word, 1, MSG_NOSIGNAL) == 1;
}

Result<void>
stand_guard (int words, const std::string &device)
{
  char word = kStands;
  ssize_t got = 0;
  do
    got = read (words, &word, 1);
  while (got > 0 || (got < 0 && errno == EINTR));
  if (word != kRuns)
    return {};

  // The kernel may still be closing what the process held.
  constexpr int kAttempts = 20;
  Result<void> stopped;
  for (int attempt = 0; attempt < kAttempts; attempt++) {
    std::this_thread::sleep_for (100ms);
    stopped = stop_board (device);
    if (stopped)
      break;
  }
  return stopped;
}

BoardDmd::BoardDmd (const DmdOptions &options, std::string device)
    : options_ (options), device_ (std::move (device))
{
}

Result<void>
BoardDmd::watch ()
{
  if (!options_.guard || (guard_ && guard_->tell (true)))
    return {};
  auto guard = StopGuard::post (device_);
  if (!guard)
    return guard.error ().with_prefix (info_.name + ": ");
  guard_ = *std::move (guard);
  guard_->tell (true);
  return {};
}

void
BoardDmd::stop ()
{
  running_ = !park () && running_;
  if (guard_)
    guard_->tell (running_);
}

} // namespace codedexposure
