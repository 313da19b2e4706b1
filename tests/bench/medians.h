/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Runs methods in turn and takes the median time of each. */
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

namespace codedexposure::bench
{

/** Options that run methods in turn, so that a disturbance affects all of them.
 * Options of the command line follow and override them. */
inline std::vector<const char *>
taking_turns (const char *program)
{
  return {program, "--benchmark_repetitions=9", "--benchmark_min_time=0.02",
      "--benchmark_enable_random_interleaving=true"};
}

/** Records the median processor time of one round of each method. */
class Medians : public benchmark::BenchmarkReporter
{
public:
  bool ReportContext (const Context &) override { return true; }
  void ReportRuns (const std::vector<Run> &runs) override
  {
    for (const Run &run : runs)
      if (run.run_type == Run::RT_Iteration && !was_skipped (run))
        times_[run.run_name.function_name].push_back (
            run.cpu_accumulated_time / double (run.iterations));
  }
  /** 0 if the method was not run. */
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
  /* The field got another name with version 1.8. */
  template <typename AnyRun>
  static bool was_skipped (const AnyRun &run)
  {
    if constexpr (requires { run.error_occurred; })
      return run.error_occurred;
    else
      return bool (run.skipped);
  }

  std::map<std::string, std::vector<double>> times_;
};

} // namespace codedexposure::bench
