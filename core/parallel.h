// Parallel loops with the same result for every thread count. TBB executes them and stays in parallel.cpp.
//
// Rules that make it so: work is cut into chunks of a fixed size, never by the number of threads; a loop body
// writes only to slots of its own chunk; reductions combine chunk results in index order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace lamina {

/// A non-owning reference to a callable, so that loop bodies are erased once per chunk.
template <class Signature>
class FunctionRef;
template <class R, class... Args>
class FunctionRef<R(Args...)> {
 public:
  template <class F, class = std::enable_if_t<!std::is_same_v<std::decay_t<F>, FunctionRef>>>
  FunctionRef(F&& f)  // NOLINT(google-explicit-constructor): mirrors std::function
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(f)))),
        call_([](void* object, Args... args) -> R {
          return (*static_cast<std::remove_reference_t<F>*>(object))(std::forward<Args>(args)...);
        }) {}
  R operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }

 private:
  void* object_;
  R (*call_)(void*, Args...);
};

/// Limits the number of worker threads while it lives. n = 0: all hardware threads.
class ThreadLimit {
 public:
  explicit ThreadLimit(int n);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Number of hardware threads, at least 1.
int hardware_threads();

/// Calls body(begin, end) for consecutive chunks of `grain` indices that cover [0, n), in any order and on
/// any thread. An exception of the body is rethrown here.
void for_each_chunk(std::size_t n, std::size_t grain, FunctionRef<void(std::size_t, std::size_t)> body);

/// Runs both callables, possibly at the same time.
void invoke_both(FunctionRef<void()> a, FunctionRef<void()> b);

/// Calls body(i) for every i in [0, n); grain as in for_each_chunk.
template <class Body>
void for_each_index(std::size_t n, Body&& body, std::size_t grain = 1024) {
  for_each_chunk(n, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

/// Folds chunk results in index order: result = combine(...combine(init, chunk(0, g))..., chunk(kg, n)).
template <class T, class Chunk, class Combine>
T reduce(std::size_t n, T init, Chunk&& chunk, Combine&& combine, std::size_t grain = 4096) {
  const std::size_t count = (n + grain - 1) / grain;
  std::vector<T> part(count, init);
  for_each_chunk(n, grain,
                 [&](std::size_t begin, std::size_t end) { part[begin / grain] = chunk(begin, end); });
  for (const T& p : part) init = combine(init, p);
  return init;
}

/// Replaces counts by their exclusive prefix sums; returns the total.
std::int64_t exclusive_scan(std::vector<std::int64_t>& counts);

/// Indices 0..keys.size()-1 ordered by key, ties by index.
std::vector<std::int32_t> sorted_order(const std::vector<std::uint64_t>& keys);

}  // namespace lamina
