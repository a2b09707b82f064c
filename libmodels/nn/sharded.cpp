#include "libmodels/nn/sharded.hpp"

#include <algorithm>

#include "libmodels/nn/blas.hpp"

namespace mocap::nn {

std::pair<std::int64_t, std::int64_t> shard_range(std::int64_t batch, int shards, int shard) {
  return {batch * shard / shards, batch * (shard + 1) / shards};
}

ShardedGradient::ShardedGradient(int shards, int threads) : shards_(std::max(1, shards)) {
  for (int t = 1; t < std::min(shards_, threads); ++t) workers_.emplace_back([this] { work(); });
}

ShardedGradient::~ShardedGradient() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
}

void ShardedGradient::work() {
  initialize_worker_thread();
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stop_ || next_ < count_; });
    if (stop_) return;
    lock.unlock();
    drain();
    lock.lock();
  }
}

void ShardedGradient::drain() {
  std::unique_lock lock(mutex_);
  while (next_ < count_) {
    const int mine = next_++;
    ++running_;
    lock.unlock();
    try {
      (*body_)(mine);
    } catch (...) {
      failures_[mine] = std::current_exception();
    }
    lock.lock();
    if (--running_ == 0 && next_ >= count_) done_.notify_all();
  }
}

void ShardedGradient::for_each(int count, const std::function<void(int)>& body) {
  {
    const std::lock_guard lock(mutex_);
    body_ = &body;
    failures_.assign(count, nullptr);
    next_ = 0;
    count_ = count;
  }
  wake_.notify_all();
  drain();
  std::unique_lock lock(mutex_);
  done_.wait(lock, [&] { return running_ == 0; });
  count_ = 0;
  const auto first = std::find_if(failures_.begin(), failures_.end(), [](const auto& f) { return f != nullptr; });
  if (first != failures_.end()) std::rethrow_exception(*first);
}

ShardedGradient::Result ShardedGradient::compute(const std::vector<torch::Tensor>& parameters,
                                                 const std::function<Share(int)>& share) {
  std::vector<Result> parts(shards_);
  for_each(shards_, [&](int i) {
    const torch::AutoGradMode with_gradients(true);
    Share s = share(i);
    // grad() instead of backward(): shards must not meet in the parameters' shared .grad.
    parts[i].gradients = torch::autograd::grad({s.loss}, parameters, {}, false, false, true);
    parts[i].loss = s.loss.item<double>();
    parts[i].figures = std::move(s.figures);
  });

  Result sum = std::move(parts[0]);
  for (int i = 1; i < shards_; ++i) {
    sum.loss += parts[i].loss;
    for (std::size_t f = 0; f < sum.figures.size(); ++f) sum.figures[f] += parts[i].figures.at(f);
  }
  // Slices of the parameter list in parallel: within a parameter the order of additions is that of the shards.
  const int slices = static_cast<int>(workers_.size()) + 1;
  for_each(slices, [&](int slice) {
    const torch::NoGradGuard guard;
    for (std::size_t p = slice; p < parameters.size(); p += slices) {
      torch::Tensor& total = sum.gradients[p];
      for (int i = 1; i < shards_; ++i) {
        const torch::Tensor& part = parts[i].gradients[p];
        if (part.defined()) total = total.defined() ? total + part : part;  // not in place: gradients may share memory
      }
      if (!total.defined()) total = torch::zeros_like(parameters[p]);
    }
  });
  return sum;
}

}  // namespace mocap::nn
