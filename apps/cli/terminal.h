// Progress on stderr, and Ctrl-C.
#pragma once

#include <chrono>
#include <string>

#include "core/progress.h"

namespace lamina::cli {

enum class Verbosity { kQuiet, kNormal, kVerbose };

/// On a terminal one line with a bar, counts and the time left, redrawn; elsewhere a plain line for each
/// stage. While it lives, SIGINT and SIGTERM ask the run to stop; a second one ends the program at once.
class Terminal : public Progress {
 public:
  explicit Terminal(Verbosity verbosity);
  ~Terminal() override;
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void begin(std::string_view stage) override;
  void update(double fraction, std::string_view detail) override;
  void end(std::string_view summary) override;
  void warn(std::string_view message) override;
  [[nodiscard]] bool cancelled() const override;

 private:
  using Clock = std::chrono::steady_clock;
  void draw(double fraction, std::string_view detail);
  void erase();
  [[nodiscard]] double elapsed() const;

  Verbosity verbosity_;
  bool terminal_;
  bool drawn_ = false;
  std::string stage_;
  Clock::time_point started_, shown_;
};

/// "lamina: error: ..." in one line.
void print_error(std::string_view message);

}  // namespace lamina::cli
