#include "apps/pipeline/stages.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>

#include "core/parallel_time.h"

namespace lamina {
namespace {

/// Lets VmHWM start anew at the present resident set (Linux); without effect where that is not allowed.
void reset_peak() {
  if (std::FILE* file = std::fopen("/proc/self/clear_refs", "w")) {
    std::fputs("5", file);
    std::fclose(file);
  }
}

rusage own_usage() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

double seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

}  // namespace

double cpu_seconds() {
  const rusage usage = own_usage();
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double user_seconds() { return seconds(own_usage().ru_utime); }

double peak_resident_bytes() {
  double bytes = 0.0;
  if (std::FILE* file = std::fopen("/proc/self/status", "r")) {
    char line[256];
    long long kib = 0;
    while (std::fgets(line, sizeof line, file) != nullptr)
      if (std::sscanf(line, "VmHWM: %lld kB", &kib) == 1) bytes = 1024.0 * static_cast<double>(kib);
    std::fclose(file);
  }
  return bytes;
}

double StageCost::serial_fraction(int threads) const {
  const double alone = serial_seconds + threads * (wall_seconds - serial_seconds);
  return alone > 0.0 ? serial_seconds / alone : 0.0;
}

StageCost total_cost(const std::vector<StageCost>& stages) {
  StageCost total;
  for (const StageCost& s : stages) {
    total.wall_seconds += s.wall_seconds;
    total.cpu_seconds += s.cpu_seconds;
    total.user_seconds += s.user_seconds;
    total.serial_seconds += s.serial_seconds;
    total.peak_bytes = std::max(total.peak_bytes, s.peak_bytes);
  }
  return total;
}

std::string cost_text(const std::vector<StageCost>& stages, int threads) {
  const StageCost total = total_cost(stages);
  return fmt::format("{:.1f} s wall, {:.1f} s cpu, {} threads, {:.1f} % serial, peak {:.0f} MiB",
                     total.wall_seconds, total.cpu_seconds, threads, 100.0 * total.serial_fraction(threads),
                     total.peak_bytes / 1048576.0);
}

void StageRecorder::stage(const std::string& name) {
  check_cancelled();
  reset_peak();
  costs_.push_back({.name = name});
  part_.clear();
  started_ = std::chrono::steady_clock::now();
  cpu_started_ = cpu_seconds();
  user_started_ = user_seconds();
  parallel_started_ = parallel_seconds();
  if (outer_ != nullptr) outer_->begin(name);
}

void StageRecorder::done(const std::string& summary) {
  if (!costs_.empty()) {
    StageCost& cost = costs_.back();
    cost.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
    cost.cpu_seconds = cpu_seconds() - cpu_started_;
    cost.user_seconds = user_seconds() - user_started_;
    cost.serial_seconds = std::max(0.0, cost.wall_seconds - (parallel_seconds() - parallel_started_));
    cost.peak_bytes = peak_resident_bytes();
  }
  if (outer_ != nullptr) outer_->end(summary);
}

void StageRecorder::begin(std::string_view part) { part_ = part; }

void StageRecorder::update(double fraction, std::string_view detail) {
  if (outer_ == nullptr) return;
  const bool named = !part_.empty() && (costs_.empty() || part_ != costs_.back().name);
  outer_->update(fraction, named ? fmt::format("{}: {}", part_, detail) : std::string(detail));
}

void StageRecorder::end(std::string_view) { part_.clear(); }

void StageRecorder::warn(std::string_view message) {
  if (std::find(warnings_.begin(), warnings_.end(), message) != warnings_.end()) return;
  warnings_.emplace_back(message);
  if (outer_ != nullptr) outer_->warn(message);
}

}  // namespace lamina
