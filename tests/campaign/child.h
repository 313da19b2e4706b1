/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Another process of this program. */
#pragma once

#include <string>
#include <vector>

#include "child_process.h"

namespace codedexposure::campaign
{

/** Runs a part of run_child (), and is heard on its standard output. */
class Child : public test::ChildProcess
{
public:
  Child (const std::string &part, const std::vector<std::string> &words)
      : ChildProcess (command (part, words), STDOUT_FILENO)
  {
  }

private:
  static std::vector<std::string> command (
      const std::string &part, const std::vector<std::string> &words)
  {
    std::vector<std::string> all{"/proc/self/exe", "--child", part};
    all.insert (all.end (), words.begin (), words.end ());
    return all;
  }
};

} // namespace codedexposure::campaign
