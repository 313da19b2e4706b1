/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Contenders that take turns, and the median time of each. */
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

namespace cexp::bench
{

/** Arguments by which contenders take turns, so that what disturbs one disturbs
 * all; those of the command line, which win, come after them. */
inline std::vector<const char *>
taking_turns (const char *program)
{
  return {program, "--benchmark_repetitions=9", "--benchmark_min_time=0.02",
      "--benchmark_enable_random_interleaving=true"};
}

/** Keeps the median processor time of one round of each contender. */
class Medians : public benchmark::BenchmarkReporter
{
public:
  bool ReportContext (const Context &) override { return true; }
  void ReportRuns (const std::vector<Run> &runs) override
  {
    for (const Run &run : runs)
      if (run.run_type == Run::RT_Iteration && !run.error_occurred)
        times_[run.run_name.function_name].push_back (
            run.cpu_accumulated_time / double (run.iterations));
  }
  /** 0 when the contender was not run. */
  double seconds (const std::string &contender)
  {
    auto &times = times_[contender];
    if (times.empty ())
      return 0.0;
    const auto middle = times.begin () + std::ptrdiff_t (times.size () / 2);
    std::nth_element (times.begin (), middle, times.end ());
    return *middle;
  }

private:
  std::map<std::string, std::vector<double>> times_;
};

} // namespace cexp::bench
