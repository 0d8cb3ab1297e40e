#include "core/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <numeric>
#include <thread>

namespace lamina {

struct ThreadLimit::Impl {
  explicit Impl(std::size_t n) : control(tbb::global_control::max_allowed_parallelism, n) {}
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int n)
    : impl_(std::make_unique<Impl>(static_cast<std::size_t>(n > 0 ? n : hardware_threads()))) {}
ThreadLimit::~ThreadLimit() = default;

int hardware_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

void for_each_chunk(std::size_t n, std::size_t grain, FunctionRef<void(std::size_t, std::size_t)> body) {
  if (n == 0) return;
  const std::size_t count = (n + grain - 1) / grain;
  if (count == 1) {
    body(0, n);
    return;
  }
  tbb::parallel_for(
      std::size_t{0}, count, [&](std::size_t c) { body(c * grain, std::min(n, (c + 1) * grain)); },
      tbb::simple_partitioner());
}

void invoke_both(FunctionRef<void()> a, FunctionRef<void()> b) {
  tbb::parallel_invoke([&] { a(); }, [&] { b(); });
}

std::int64_t exclusive_scan(std::vector<std::int64_t>& counts) {
  std::int64_t total = 0;
  for (std::int64_t& c : counts) total += std::exchange(c, total);
  return total;
}

std::vector<std::int32_t> sorted_order(const std::vector<std::uint64_t>& keys) {
  std::vector<std::int32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0);
  // Ties by index make the order unique, so an unstable parallel sort gives the same result on any threads.
  tbb::parallel_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
  });
  return order;
}

}  // namespace lamina
