#include "libmocap/base/parallel.hpp"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <string>

namespace mocap {

int usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  int cores = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : static_cast<int>(std::thread::hardware_concurrency());
  // cgroup v2 "max 100000" or "150000 100000"; v1 has two files.
  std::string quota;
  double period = 0;
  if (std::ifstream f("/sys/fs/cgroup/cpu.max"); f >> quota >> period && quota != "max" && period > 0)
    cores = std::min(cores, static_cast<int>(std::max(1.0, std::stod(quota) / period + 0.5)));
  else if (std::ifstream q("/sys/fs/cgroup/cpu/cpu.cfs_quota_us"), p("/sys/fs/cgroup/cpu/cpu.cfs_period_us"); q >> quota && p >> period)
    if (const double value = std::stod(quota); value > 0 && period > 0)
      cores = std::min(cores, static_cast<int>(std::max(1.0, value / period + 0.5)));
  return std::max(1, cores);
}

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body) {
  std::vector<std::exception_ptr> failures(count);
  std::atomic<std::size_t> next{0};
  // Indices below the lowest failure so far still run: one of them may fail as well and is then the one to report.
  std::atomic<std::size_t> lowest{count};
  const auto worker = [&] {
    for (std::size_t i = next++; i < lowest; i = next++) {
      try {
        body(i);
      } catch (...) {
        failures[i] = std::current_exception();
        for (std::size_t seen = lowest; i < seen && !lowest.compare_exchange_weak(seen, i);) {
        }
      }
    }
  };
  {
    std::vector<std::jthread> workers;
    for (std::size_t t = 1; t < std::min<std::size_t>(count, static_cast<std::size_t>(std::max(1, threads))); ++t) workers.emplace_back(worker);
    worker();
  }
  for (const auto& f : failures)
    if (f) std::rethrow_exception(f);
}

}  // namespace mocap
