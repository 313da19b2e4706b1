/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* A process with which the test speaks in lines, and which can be killed. */
#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

namespace codedexposure::test
{

/** Runs from its construction on, and ends with it. */
class ChildProcess
{
public:
  /** @p words   the command, and its arguments.
   * @p output  STDOUT_FILENO or STDERR_FILENO: where await () reads. */
  ChildProcess (std::vector<std::string> words, int output)
  {
    std::vector<char *> arguments;
    for (std::string &word : words)
      arguments.push_back (word.data ());
    arguments.push_back (nullptr);
    int in[2];
    int out[2];
    if (pipe2 (in, O_CLOEXEC) != 0 || pipe2 (out, O_CLOEXEC) != 0)
      throw std::runtime_error ("no pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init (&actions);
    posix_spawn_file_actions_adddup2 (&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2 (&actions, out[1], output);
    if (posix_spawnp (&id_, arguments[0], &actions, nullptr, arguments.data (),
            environ) != 0)
      throw std::runtime_error ("cannot start " + words[0]);
    posix_spawn_file_actions_destroy (&actions);
    close (in[0]);
    close (out[1]);
    in_ = fdopen (in[1], "w");
    out_ = fdopen (out[0], "r");
  }
  ~ChildProcess () { end (SIGKILL); }
  ChildProcess (const ChildProcess &) = delete;
  ChildProcess &operator= (const ChildProcess &) = delete;

  /** Types a line. */
  void type (const std::string &line)
  {
    std::fputs ((line + "\n").c_str (), in_);
    std::fflush (in_);
  }
  /** Waits for a line with @p part, and returns it; "" when it ended. */
  std::string await (const std::string &part)
  {
    char line[1024];
    while (std::fgets (line, sizeof line, out_))
      if (std::string (line).find (part) != std::string::npos)
        return line;
    return "";
  }
  void end (int signal)
  {
    if (id_ == 0)
      return;
    kill (id_, signal);
    waitpid (id_, nullptr, 0);
    id_ = 0;
    std::fclose (in_);
    std::fclose (out_);
  }

private:
  pid_t id_ = 0;
  FILE *in_ = nullptr;
  FILE *out_ = nullptr;
};

} // namespace codedexposure::test
