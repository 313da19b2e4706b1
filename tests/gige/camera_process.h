/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* codedexposure-camera as a process of its own, which can be killed. */
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace codedexposure::test
{

/** Serves coded frames from its construction on, and ends with it. */
class CameraProcess
{
public:
  /** @p options  beyond the address, 127.0.0.1, and the frames: 256x192 pixels
   * of @p schedule, 100 a second. */
  explicit CameraProcess (
      const std::string &schedule, const std::vector<std::string> &options = {})
  {
    std::vector<std::string> words{"env", "GST_PLUGIN_PATH_1_0=" PLUGIN_DIR,
        "GST_REGISTRY_1_0=" PLUGIN_REGISTRY, CAMERA,
        "videotestsrc pattern=ball ! video/x-raw,format=GRAY8,width=256,"
        "height=192,framerate=400/1 ! codedexposure-sim schedule=" +
            schedule + " ! video/x-raw,framerate=100/1"};
    words.insert (words.end (), options.begin (), options.end ());
    start (words);
    await ("serving");
  }
  ~CameraProcess () { end (SIGKILL); }
  CameraProcess (const CameraProcess &) = delete;
  CameraProcess &operator= (const CameraProcess &) = delete;

  /** Types a line, such as "stop@now". */
  void type (const std::string &line)
  {
    std::fputs ((line + "\n").c_str (), in_);
    std::fflush (in_);
  }
  /** Waits for a line with @p part, and returns it; "" when it ended. */
  std::string await (const std::string &part)
  {
    char line[1024];
    while (std::fgets (line, sizeof line, said_))
      if (std::string (line).find (part) != std::string::npos)
        return line;
    ADD_FAILURE () << "the camera never said: " << part;
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
    std::fclose (said_);
  }

private:
  void start (std::vector<std::string> &words)
  {
    std::vector<char *> arguments;
    for (std::string &word : words)
      arguments.push_back (word.data ());
    arguments.push_back (nullptr);
    int in[2];
    int said[2];
    ASSERT_EQ (pipe2 (in, O_CLOEXEC) + pipe2 (said, O_CLOEXEC), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init (&actions);
    posix_spawn_file_actions_adddup2 (&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2 (&actions, said[1], STDERR_FILENO);
    ASSERT_EQ (posix_spawnp (&id_, arguments[0], &actions, nullptr,
                   arguments.data (), environ),
        0);
    posix_spawn_file_actions_destroy (&actions);
    close (in[0]);
    close (said[1]);
    in_ = fdopen (in[1], "w");
    said_ = fdopen (said[0], "r");
  }

  pid_t id_ = 0;
  FILE *in_ = nullptr;
  FILE *said_ = nullptr;
};

} // namespace codedexposure::test
