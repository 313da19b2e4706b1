/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Another process of this program. */
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include <sys/types.h>

namespace codedexposure::campaign
{

class Child
{
public:
  Child (const std::string &part, const std::vector<std::string> &words);
  ~Child ();
  Child (const Child &) = delete;
  Child &operator= (const Child &) = delete;

  /** Waits for a line with @p part on its standard output. */
  bool await (const std::string &part);
  /** Types a line. */
  void type (const std::string &line);
  void end (int signal);

private:
  pid_t id_ = 0;
  FILE *in_ = nullptr;
  FILE *out_ = nullptr;
};

} // namespace codedexposure::campaign
