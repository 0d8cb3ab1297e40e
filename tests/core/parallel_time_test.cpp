#include "core/parallel_time.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "core/parallel.h"

namespace lamina {
namespace {

void wait() { std::this_thread::sleep_for(std::chrono::milliseconds(20)); }

// Sleeping takes no less than it says, however busy the machine is.
TEST(ParallelTime, CountsLoopsOfSeveralChunksOnce) {
  const double before = parallel_seconds();
  wait();
  for_each_index(1, [](std::size_t) { wait(); });
  EXPECT_EQ(parallel_seconds(), before);
  const auto start = std::chrono::steady_clock::now();
  for_each_index(
      2,
      [](std::size_t) {
        for_each_index(
            2, [](std::size_t) { wait(); }, 1);
      },
      1);
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_GE(parallel_seconds(), before + 0.02);
  EXPECT_LE(parallel_seconds(), before + wall);
}

}  // namespace
}  // namespace lamina
