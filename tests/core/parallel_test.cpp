#include "core/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>
#include <stdexcept>

namespace lamina {
namespace {

TEST(Parallel, EveryIndexOnce) {
  for (const std::size_t n : {0U, 1U, 7U, 1000U, 100001U}) {
    std::vector<std::atomic<int>> hits(n);
    for_each_index(
        n, [&](std::size_t i) { ++hits[i]; }, 64);
    EXPECT_TRUE(std::all_of(hits.begin(), hits.end(), [](const auto& h) { return h == 1; }));
  }
}

TEST(Parallel, SumsHaveTheSameBitsForEveryThreadCount) {
  std::mt19937_64 rng(1);
  std::vector<double> x(300000);
  for (double& v : x) v = std::uniform_real_distribution<double>(-1, 1)(rng) * std::pow(10.0, rng() % 12);
  const auto sum = [&] {
    return reduce(
        x.size(), 0.0,
        [&](std::size_t b, std::size_t e) { return std::accumulate(x.begin() + b, x.begin() + e, 0.0); },
        [](double a, double b) { return a + b; });
  };
  double expected = 0.0;
  {
    const ThreadLimit one(1);
    expected = sum();
  }
  for (const int threads : {2, 3, 8}) {
    const ThreadLimit limit(threads);
    for (int repeat = 0; repeat < 20; ++repeat) EXPECT_EQ(sum(), expected);
  }
}

TEST(Parallel, ExceptionsOfABodyArriveHere) {
  EXPECT_THROW(for_each_index(
                   10000,
                   [](std::size_t i) {
                     if (i == 7777) throw std::runtime_error("x");
                   },
                   16),
               std::runtime_error);
}

TEST(Parallel, ExclusiveScan) {
  std::vector<std::int64_t> c = {3, 0, 5, 2};
  EXPECT_EQ(exclusive_scan(c), 10);
  EXPECT_EQ(c, (std::vector<std::int64_t>{0, 3, 3, 8}));
}

TEST(Parallel, SortedOrderIsStable) {
  std::mt19937_64 rng(5);
  std::vector<std::uint64_t> keys(50000);
  for (auto& k : keys) k = rng() % 100;
  std::vector<std::int32_t> expected(keys.size());
  std::iota(expected.begin(), expected.end(), 0);
  std::stable_sort(expected.begin(), expected.end(), [&](auto a, auto b) { return keys[a] < keys[b]; });
  EXPECT_EQ(sorted_order(keys), expected);
}

}  // namespace
}  // namespace lamina
