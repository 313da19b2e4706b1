/* SPDX-License-Identifier: LGPL-2.1-or-later */
/* Threads that share the parts of a task. */
#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

namespace codedexposure
{

/** A fixed number of threads, including the caller's. Not for two callers at a
 * time. */
class Workers
{
public:
  static constexpr int kMost = 64;

  /** @p count: threads, up to kMost; 0: one for each processor. There are fewer
   * when the system cannot start them. */
  explicit Workers (int count);
  ~Workers ();

  int count () const { return int (threads_.size ()) + 1; }

  /** Part 0 .. parts - 1 of a task, on thread @p worker of 0 .. count () - 1.
   */
  using Task = std::function<void (int part, int worker)>;
  /** Runs every part once, in any order, and returns when all are done. After
   * @p stop is requested, no further part starts and the result is false. After
   * a part throws, no further part starts, and the caller gets the exception.
   */
  bool run (int parts, const Task &task, std::stop_token stop = {});

private:
  void serve (std::stop_token quit, int worker);
  void work (int worker);

  std::mutex mutex_;
  std::condition_variable_any begun_;
  std::condition_variable done_;
  std::uint64_t round_ = 0; ///< number of the task
  int busy_ = 0;            ///< threads that still work on it
  const Task *task_ = nullptr;
  int parts_ = 0;
  std::stop_token stop_;
  std::exception_ptr failure_;
  std::atomic<int> next_ = 0;
  std::vector<std::jthread> threads_; ///< last: they use all of the above
};

} // namespace codedexposure
