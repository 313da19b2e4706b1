/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "child.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>

#include "row.h"

namespace codedexposure::campaign
{

Child::Child (const std::string &part, const std::vector<std::string> &words)
{
  std::vector<std::string> all{"/proc/self/exe", "--child", part};
  all.insert (all.end (), words.begin (), words.end ());
  std::vector<char *> arguments;
  for (std::string &word : all)
    arguments.push_back (word.data ());
  arguments.push_back (nullptr);
  int in[2];
  int out[2];
  if (pipe2 (in, O_CLOEXEC) != 0 || pipe2 (out, O_CLOEXEC) != 0)
    throw std::runtime_error ("no pipe");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init (&actions);
  posix_spawn_file_actions_adddup2 (&actions, in[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2 (&actions, out[1], STDOUT_FILENO);
  if (posix_spawn (&id_, arguments[0], &actions, nullptr, arguments.data (),
          environ) != 0)
    throw std::runtime_error ("cannot start " + all[0]);
  posix_spawn_file_actions_destroy (&actions);
  close (in[0]);
  close (out[1]);
  in_ = fdopen (in[1], "w");
  out_ = fdopen (out[0], "r");
}

Child::~Child ()
{
  end (SIGKILL);
}

bool
Child::await (const std::string &part)
{
  char line[1024];
  while (std::fgets (line, sizeof line, out_))
    if (std::string (line).find (part) != std::string::npos)
      return true;
  return false;
}

void
Child::type (const std::string &line)
{
  std::fputs ((line + "\n").c_str (), in_);
  std::fflush (in_);
}

void
Child::end (int signal)
{
  if (id_ == 0)
    return;
  kill (id_, signal);
  waitpid (id_, nullptr, 0);
  id_ = 0;
  std::fclose (in_);
  std::fclose (out_);
}

} // namespace codedexposure::campaign
