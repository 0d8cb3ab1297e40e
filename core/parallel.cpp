#include "core/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>
#include <thread>

#include "core/parallel_time.h"

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace lamina {
namespace {

// The thread sanitizer does not see into TBB, which Debian builds without it: it is told that what comes
// before a loop happens before its bodies, and these before what comes after. Between bodies nothing is
// promised, so races between them are found.
class ForkJoin {
 public:
#ifdef __SANITIZE_THREAD__
  ForkJoin() { __tsan_release(&fork_); }
  ~ForkJoin() { __tsan_acquire(&join_); }
  class Body {
   public:
    explicit Body(ForkJoin& loop) : loop_(loop) { __tsan_acquire(&loop_.fork_); }
    ~Body() { __tsan_release(&loop_.join_); }

   private:
    ForkJoin& loop_;
  };

 private:
  char fork_ = 0, join_ = 0;
#else
  struct Body {
    explicit Body(ForkJoin& /*loop*/) {}
  };
#endif
};

using Clock = std::chrono::steady_clock;

std::atomic<int> g_running{0};  // loops that run now, nested ones included
std::atomic<Clock::rep> g_begun{0}, g_total{0};

/// Counts the time from the first of the loops that run at the same time to the last.
class Timed {
 public:
  Timed() {
    if (g_running.fetch_add(1) == 0) g_begun = Clock::now().time_since_epoch().count();
  }
  ~Timed() {
    if (g_running.fetch_sub(1) == 1) g_total += Clock::now().time_since_epoch().count() - g_begun;
  }
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;
};

}  // namespace

double parallel_seconds() { return std::chrono::duration<double>(Clock::duration(g_total)).count(); }

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
  const Timed timed;
  ForkJoin loop;
  tbb::parallel_for(
      std::size_t{0}, count,
      [&](std::size_t c) {
        const ForkJoin::Body inside(loop);
        body(c * grain, std::min(n, (c + 1) * grain));
      },
      tbb::simple_partitioner());
}

void invoke_both(FunctionRef<void()> a, FunctionRef<void()> b) {
  const Timed timed;
  ForkJoin loop;
  const auto inside = [&](const FunctionRef<void()>& part) {
    const ForkJoin::Body here(loop);
    part();
  };
  tbb::parallel_invoke([&] { inside(a); }, [&] { inside(b); });
}

std::int64_t exclusive_scan(std::vector<std::int64_t>& counts) {
  std::int64_t total = 0;
  for (std::int64_t& c : counts) total += std::exchange(c, total);
  return total;
}

std::vector<std::int32_t> sorted_order(const std::vector<std::uint64_t>& keys) {
  std::vector<std::int32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0);
  const auto before = [&](std::int32_t a, std::int32_t b) {
    return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
  };
#ifdef __SANITIZE_THREAD__
  std::sort(order.begin(), order.end(), before);
#else
  const Timed timed;
  // Ties by index make the order unique, so an unstable parallel sort gives the same result on any threads.
  tbb::parallel_sort(order.begin(), order.end(), before);
#endif
  return order;
}

}  // namespace lamina
