/* SPDX-License-Identifier: LGPL-2.1-or-later */
#include "python.h"

#include <csignal>
#include <cstdlib>
#include <filesystem>

#include <unistd.h>

#include "failure.h"

namespace codedexposure::app
{

namespace fs = std::filesystem;

/* In a build tree, the package is in the source tree. */
void
become_archive (const std::vector<std::string> &words)
{
  std::error_code ignored;
  const fs::path program = fs::read_symlink ("/proc/self/exe", ignored);
  const fs::path tree = program.parent_path ().parent_path ();
  setenv ("CODEDEXPOSURE_PROGRAM", program.c_str (), 1);
  if (fs::exists (tree / "gst/libgstcodedexposure.so", ignored))
    setenv ("PYTHONPATH", SOURCE_PYTHON, 1);
  std::vector<std::string> all{PYTHON, "-m", "codedexposure.archive"};
  all.insert (all.end (), words.begin (), words.end ());
  std::vector<char *> arguments;
  for (std::string &word : all)
    arguments.push_back (word.data ());
  arguments.push_back (nullptr);
  /* An interruption while Python starts would be a fatal error of Python's. It
   * stays pending until main () of the package unblocks it. */
  sigset_t interruption;
  sigemptyset (&interruption);
  sigaddset (&interruption, SIGINT);
  pthread_sigmask (SIG_BLOCK, &interruption, nullptr);
  execvp (arguments[0], arguments.data ());
  fail (std::string (PYTHON) + " cannot be run; install python3");
}

} // namespace codedexposure::app
