#include "consac/run/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <numeric>

namespace consac::run {
namespace {

TEST(ThreadPool, OneThreadNeedsNoPool) {
  ThreadPool pool(1);
  EXPECT_EQ(pool.executor().run, nullptr);
}

#if defined(CONSAC_SANITIZED_THREADS)
constexpr std::int64_t kJobs = 500;  // 2,000 of them take ThreadSanitizer a minute of a core
#else
constexpr std::int64_t kJobs = 2000;
#endif

TEST(ThreadPool, EveryBlockOfEveryJobRunsOnce) {
  for (const int threads : {2, 3, 8}) {
    ThreadPool pool(threads);
    const Executor executor = pool.executor();
    for (std::int64_t job = 0; job < kJobs; ++job) {
      std::vector<int> ran(static_cast<std::size_t>(job % 37), 0);
      executor.ForEach(static_cast<std::int64_t>(ran.size()),
                       [&](std::int64_t block) { ++ran[static_cast<std::size_t>(block)]; });
      for (const int times : ran) ASSERT_EQ(times, 1) << threads << " threads, job " << job;
    }
  }
}

TEST(ThreadPool, WhatABlockThrowsIsThrownWhereTheJobWasBegun) {
  ThreadPool pool(3);
  const Executor executor = pool.executor();
  for (std::int64_t culprit = 0; culprit < 64; ++culprit) {
    EXPECT_THROW(executor.ForEach(64,
                                  [&](std::int64_t block) {
                                    if (block == culprit) throw std::bad_alloc();
                                  }),
                 std::bad_alloc);
  }
  std::atomic<int> ran = 0;
  executor.ForEach(2, [&](std::int64_t) { ++ran; });
  EXPECT_EQ(ran.load(), 2) << "and the pool goes on";
}

TEST(ThreadPool, WhatABlockWroteIsSeenAfterTheJob) {
  ThreadPool pool(3);
  const Executor executor = pool.executor();
  std::vector<std::int64_t> sums(64);
  std::vector<std::int64_t> numbers(1000);
  for (std::int64_t round = 1; round <= 200; ++round) {
    std::iota(numbers.begin(), numbers.end(), round);
    executor.ForEach(64, [&](std::int64_t block) {
      sums[static_cast<std::size_t>(block)] = std::accumulate(numbers.begin(), numbers.end(), std::int64_t{0}) + block;
    });
    std::int64_t total = 0;
    for (const std::int64_t sum : sums) total += sum;
    ASSERT_EQ(total, 64 * (1000 * round + 999 * 500) + 64 * 63 / 2);
  }
}

}  // namespace
}  // namespace consac::run
