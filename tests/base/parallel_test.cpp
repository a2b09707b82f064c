#include "libmocap/base/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>

namespace mocap {
namespace {

using std::chrono::milliseconds;

TEST(UsableCores, IsAtLeastOneAndWithinTheMachine) {
  EXPECT_GE(usable_cores(), 1);
  EXPECT_LE(usable_cores(), static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
}

TEST(ParallelFor, CallsEachIndexOnce) {
  for (const int threads : {-1, 0, 1, 2, 8})
    for (const std::size_t count : {0u, 1u, 5u, 1000u}) {
      std::vector<std::atomic<int>> calls(count);
      parallel_for(count, threads, [&](std::size_t i) { ++calls[i]; });
      for (const auto& c : calls) ASSERT_EQ(c, 1);
    }
}

TEST(ParallelFor, UsesNoMoreThreadsThanAskedAndTheCallersOwn) {
  std::mutex mutex;
  std::map<std::thread::id, int> ids;
  parallel_for(200, 3, [&](std::size_t) {
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    const std::lock_guard lock(mutex);
    ++ids[std::this_thread::get_id()];
  });
  EXPECT_LE(ids.size(), 3u);
  EXPECT_TRUE(ids.contains(std::this_thread::get_id()));
}

// Index 3 fails late, when index 5 has long failed: index 3 must still be the one reported, every time.
TEST(ParallelFor, TheLowestFailureIsRethrownWhateverTheTiming) {
  for (int round = 0; round < 300; ++round) {
    try {
      parallel_for(64, 4, [&](std::size_t i) {
        if (i == 3) std::this_thread::sleep_for(std::chrono::microseconds(round % 7 * 30));
        if (i == 3 || i == 4 || i == 5 || i == 60) throw std::runtime_error(std::to_string(i));
      });
      FAIL();
    } catch (const std::runtime_error& e) {
      ASSERT_STREQ(e.what(), "3");
    }
  }
}

TEST(ParallelFor, StopsSoonAfterAFailure) {
  std::atomic<int> calls{0};
  EXPECT_THROW(parallel_for(1000000, 2, [&](std::size_t i) {
    ++calls;
    if (i == 10) throw 1;
  }), int);
  EXPECT_LT(calls, 1000000);
}

TEST(OrderedPipeline, HandsOverInOrderOnTheCallersThread) {
  for (const int threads : {0, 1, 2, 7}) {
    std::vector<std::size_t> order;
    const auto caller = std::this_thread::get_id();
    ordered_pipeline<std::unique_ptr<std::size_t>>(
        300, threads,
        [](std::size_t i) {
          if (i % 10 == 0) std::this_thread::sleep_for(milliseconds(1));
          return std::make_unique<std::size_t>(i * i);
        },
        [&](std::size_t i, std::unique_ptr<std::size_t>&& value) {
          EXPECT_EQ(std::this_thread::get_id(), caller);
          EXPECT_EQ(*value, i * i);
          order.push_back(i);
          return true;
        });
    ASSERT_EQ(order.size(), 300u);
    for (std::size_t i = 0; i < 300; ++i) ASSERT_EQ(order[i], i);
  }
}

TEST(OrderedPipeline, NothingToDo) {
  ordered_pipeline<int>(0, 4, [](std::size_t) { return 1; }, [](std::size_t, int&&) -> bool { ADD_FAILURE(); return true; });
}

TEST(OrderedPipeline, ConsumerStopsEarly) {
  for (const int threads : {1, 4}) {
    std::atomic<std::size_t> produced{0};
    std::size_t consumed = 0;
    ordered_pipeline<int>(
        100000, threads, [&](std::size_t) { ++produced; return 0; },
        [&](std::size_t i, int&&) { ++consumed; return i < 9; });
    EXPECT_EQ(consumed, 10u);
    EXPECT_LE(produced, 10u + 4u * static_cast<unsigned>(threads));
  }
}

TEST(OrderedPipeline, ConsumersExceptionEndsIt) {
  for (const int threads : {1, 4}) {
    std::size_t consumed = 0;
    try {
      ordered_pipeline<int>(1000, threads, [](std::size_t) { return 0; }, [&](std::size_t i, int&&) -> bool {
        ++consumed;
        if (i == 5) throw std::runtime_error("enough");
        return true;
      });
      FAIL();
    } catch (const std::runtime_error& e) {
      EXPECT_STREQ(e.what(), "enough");
    }
    EXPECT_EQ(consumed, 6u);
  }
}

TEST(OrderedPipeline, WaitingResultsAreBounded) {
  const int threads = 3;
  std::atomic<long> alive{0}, most{0};
  struct Counted {
    explicit Counted(std::atomic<long>& a, std::atomic<long>& m) : alive(&a) {
      const long now = ++a;
      long seen = m;
      while (now > seen && !m.compare_exchange_weak(seen, now)) {}
    }
    Counted(Counted&& other) noexcept : alive(std::exchange(other.alive, nullptr)) {}
    ~Counted() { if (alive) --*alive; }
    std::atomic<long>* alive;
  };
  ordered_pipeline<Counted>(
      400, threads, [&](std::size_t) { return Counted(alive, most); },
      [&](std::size_t, Counted&&) {
        std::this_thread::sleep_for(std::chrono::microseconds(100));
        return true;
      });
  EXPECT_EQ(alive, 0);
  EXPECT_LE(most, 4 * threads + 1);
  EXPECT_GT(most, 1);
}

// The first result is the slowest: the others may run ahead of it by the window, no further.
TEST(OrderedPipeline, ASlowFirstResultHoldsTheOthersBack) {
  std::atomic<bool> first_done{false}, ran_ahead{false};
  ordered_pipeline<int>(
      200, 2,
      [&](std::size_t i) {
        if (i == 0) {
          std::this_thread::sleep_for(milliseconds(30));
          first_done = true;
        } else if (!first_done && i >= 8) {
          ran_ahead = true;
        }
        return 0;
      },
      [](std::size_t, int&&) { return true; });
  EXPECT_FALSE(ran_ahead);
}

}  // namespace
}  // namespace mocap
