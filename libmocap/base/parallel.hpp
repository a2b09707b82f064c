// Threads: a loop over independent indices, and a bounded pipeline that hands results on in order.
#pragma once
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace mocap {

// The cores this process may use: its affinity mask, cut to the cgroup's CPU quota; at least 1.
int usable_cores();

// Calls body(0) ... body(count-1) on up to `threads` threads (the caller's included). When several throw, the exception
// of the lowest index is rethrown, so that a failure does not depend on timing. Results must not depend on the order.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body);

// Calls produce(i) on `threads` threads and consume(i, result) on the caller's thread in the order of i.
// At most 4 x threads results wait at any time, so memory does not grow with `count`.
// produce must not throw (wrap errors in T); what consume throws ends the pipeline and is rethrown. consume may return
// false to stop early.
template <class T>
void ordered_pipeline(std::size_t count, int threads, const std::function<T(std::size_t)>& produce,
                      const std::function<bool(std::size_t, T&&)>& consume) {
  if (threads <= 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i)
      if (!consume(i, produce(i))) return;
    return;
  }
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::size_t, T> ready;
  std::size_t next_to_produce = 0, next_to_consume = 0;
  bool stop = false;
  const std::size_t window = static_cast<std::size_t>(threads) * 4;
  const auto worker = [&] {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [&] { return stop || next_to_produce >= count || next_to_produce < next_to_consume + window; });
      if (stop || next_to_produce >= count) return;
      const std::size_t mine = next_to_produce++;
      lock.unlock();
      T result = produce(mine);
      lock.lock();
      ready.emplace(mine, std::move(result));
      changed.notify_all();
    }
  };
  std::vector<std::jthread> workers;
  std::exception_ptr failure;
  for (int t = 0; t < threads; ++t) workers.emplace_back(worker);
  {
    std::unique_lock lock(mutex);
    while (next_to_consume < count && !stop) {
      changed.wait(lock, [&] { return ready.contains(next_to_consume); });
      auto node = ready.extract(next_to_consume);
      lock.unlock();
      bool more = false;
      try {
        more = consume(node.key(), std::move(node.mapped()));
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      ++next_to_consume;
      if (!more) stop = true;
      changed.notify_all();
    }
    stop = true;
    changed.notify_all();
  }
  workers.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace mocap
