// How long-running stages report to, and are cancelled by, their caller.
#pragma once

#include <string_view>

#include "core/error.h"

namespace lamina {

/// Receives progress of a run. Calls come from one thread at a time. The default does nothing.
class Progress {
 public:
  virtual ~Progress() = default;
  /// A new stage starts, e.g. "level set".
  virtual void begin(std::string_view /*stage*/) {}
  /// Progress within the stage: fraction in [0, 1]; detail such as "step 3 of 9, 120412 cells".
  virtual void update(double /*fraction*/, std::string_view /*detail*/) {}
  /// The stage ends; summary is one line of what it made.
  virtual void end(std::string_view /*summary*/) {}
  /// Something the user should know though the run goes on.
  virtual void warn(std::string_view /*message*/) {}
  /// True once the user asked to stop. Thread safe.
  [[nodiscard]] virtual bool cancelled() const { return false; }

  /// Throws Error{kInterrupted} once cancelled() holds.
  void check_cancelled() const {
    if (cancelled()) throw Error(ErrorCode::kInterrupted, "interrupted");
  }
};

}  // namespace lamina
