/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Threads that share the parts of a task. */
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

namespace cexp
{

/** A fixed number of threads, the caller's among them. One caller at a time. */
class Workers
{
public:
  static constexpr int kMost = 64;

  /** @p count  of threads, at most kMost; 0: one for each processor. Fewer
   * where the system gives no more. */
  explicit Workers (int count);
  ~Workers ();

  int count () const { return int (threads_.size ()) + 1; }

  /** Part 0 .. parts - 1 of a task, on thread @p worker of 0 .. count () - 1.
   * Must not throw. */
  using Task = std::function<void (int part, int worker)>;
  /** Runs every part once, in any order, and returns when all are done. No part
   * is begun after @p stop was requested; false then. */
  bool run (int parts, const Task &task, std::stop_token stop = {});

private:
  void serve (std::stop_token quit, int worker);
  void work (int worker);

  std::mutex mutex_;
  std::condition_variable_any begun_;
  std::condition_variable done_;
  std::uint64_t round_ = 0; ///< number of the task
  int busy_ = 0;            ///< threads that are not done with it
  const Task *task_ = nullptr;
  int parts_ = 0;
  std::stop_token stop_;
  std::atomic<int> next_ = 0;
  std::vector<std::jthread> threads_; ///< last: they use all of the above
};

} // namespace cexp
