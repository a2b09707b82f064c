// Data-parallel gradients with the same bits for any number of threads.
//
// A batch is cut into a fixed number of shards, which belongs to the configuration of a training run. Each shard's loss
// and gradients are computed on one thread with single-threaded BLAS, and are added in the order of the shards; threads
// only decide who computes which shard.
#pragma once
#include <torch/torch.h>

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace mocap::nn {

// Rows [first, last) of a batch that shard `shard` of `shards` takes; sizes differ by at most one.
std::pair<std::int64_t, std::int64_t> shard_range(std::int64_t batch, int shards, int shard);

class ShardedGradient {
 public:
  // What a shard returns: its share of the loss (a scalar with a graph; the shares add up to the batch's loss, so
  // divide by the whole batch's size, not the shard's), and any figures to be added up for the log.
  struct Share {
    torch::Tensor loss;
    std::vector<double> figures;
  };
  struct Result {
    double loss = 0;
    std::vector<double> figures;
    std::vector<torch::Tensor> gradients;  // one per parameter; zeros where the loss does not depend on it
  };

  // Starts threads - 1 workers (the caller is the last one); more threads than shards are not started.
  // Call nn::use_one_blas_thread() first.
  ShardedGradient(int shards, int threads);
  ~ShardedGradient();
  ShardedGradient(const ShardedGradient&) = delete;
  ShardedGradient& operator=(const ShardedGradient&) = delete;

  int shards() const { return shards_; }

  // share(i) runs once for each shard i, on any thread; it may read the parameters but must not touch shared state.
  // If shares throw, the exception of the lowest shard that threw is rethrown here once all threads are idle again, and
  // the object stays usable. Not reentrant.
  Result compute(const std::vector<torch::Tensor>& parameters, const std::function<Share(int shard)>& share);

  // body(0) ... body(count-1) on the same threads, for work between steps (validation shards, optimiser slices). Same
  // rules as `share`.
  void for_each(int count, const std::function<void(int)>& body);

 private:
  void work();
  void drain();

  const int shards_;
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  const std::function<void(int)>* body_ = nullptr;
  std::vector<std::exception_ptr> failures_;
  int count_ = 0, next_ = 0, running_ = 0;
  bool stop_ = false;
  std::vector<std::jthread> workers_;
};

}  // namespace mocap::nn
