// Runs independent tasks on several threads, with one workspace for each thread.
//
// The assignment of tasks to threads is not deterministic. The result is the same for any number of
// threads if each task depends on its index only and writes to its own place.
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace shaker::estimator {

// make() returns a workspace; work(workspace, i) is called once for each i in [0, count). The
// caller is one of the threads, and blocks until all have ended; then the first exception is
// thrown again. `threads` 0: one for each core, at most 256. `chunk`: tasks that a thread takes
// at a time; 1 suits few and long tasks.
template <class Make, class Work>
void in_parallel(long count, unsigned threads, Make make, Work work, long chunk = 16) {
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  threads = static_cast<unsigned>(
      std::clamp<long>(std::min<long>(threads, (count + chunk - 1) / chunk), 1, 256));
  std::atomic<long> next{0};
  std::mutex mutex;
  std::exception_ptr trouble;
  const auto run = [&] {
    try {
      auto workspace = make();
      for (long first = next.fetch_add(chunk); first < count; first = next.fetch_add(chunk)) {
        for (long i = first; i < std::min(first + chunk, count); ++i)
          work(workspace, i);
      }
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!trouble) trouble = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  for (unsigned t = 1; t < threads; ++t)
    others.emplace_back(run);
  run();
  for (std::thread& thread : others)
    thread.join();
  if (trouble) std::rethrow_exception(trouble);
}

}  // namespace shaker::estimator
