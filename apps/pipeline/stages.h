// Times and peak memory of the stages of a run, and its warnings, on their way to the caller's Progress.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "core/progress.h"

namespace lamina {

/// What one stage took.
struct StageCost {
  std::string name;
  double wall_seconds = 0.0;
  double cpu_seconds = 0.0;  ///< user + system, all threads
  double peak_bytes =
      0.0;  ///< largest resident set while it ran (of the run so far where the kernel cannot reset it)
  double user_seconds = 0.0;    ///< all threads
  double serial_seconds = 0.0;  ///< wall seconds outside of parallel loops

  /// Share of the work that one thread has to do alone: serial seconds over the wall seconds of one thread,
  /// when parallel loops keep all threads busy.
  [[nodiscard]] double serial_fraction(int threads) const;
};

/// Sums of the seconds and the largest peak of all stages.
StageCost total_cost(const std::vector<StageCost>& stages);
/// The same in words: "1.5 s wall, 2.5 s cpu, 2 threads, 3.0 % serial, peak 100 MiB".
std::string cost_text(const std::vector<StageCost>& stages, int threads);

/// A Progress that measures. The pipeline calls stage() and done(); what libraries call begin/end inside a
/// stage is shown as its detail.
class StageRecorder : public Progress {
 public:
  /// `outer` may be null.
  explicit StageRecorder(Progress* outer) : outer_(outer) {}

  void stage(const std::string& name);
  void done(const std::string& summary);

  void begin(std::string_view part) override;
  void update(double fraction, std::string_view detail) override;
  void end(std::string_view summary) override;
  void warn(std::string_view message) override;
  [[nodiscard]] bool cancelled() const override { return outer_ != nullptr && outer_->cancelled(); }

  [[nodiscard]] const std::vector<StageCost>& costs() const { return costs_; }
  /// Each message once.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  Progress* outer_;
  std::vector<StageCost> costs_;
  std::vector<std::string> warnings_;
  std::string part_;
  std::chrono::steady_clock::time_point started_;
  double cpu_started_ = 0.0, user_started_ = 0.0, parallel_started_ = 0.0;
};

/// User + system seconds of the process so far.
double cpu_seconds();
/// The user part alone.
double user_seconds();
/// Largest resident set of the process since it was last reset, bytes; 0 where the system does not say.
double peak_resident_bytes();

}  // namespace lamina
