#include "apps/cli/terminal.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>

namespace lamina::cli {
namespace {

volatile std::sig_atomic_t g_stop = 0;

void ask_to_stop(int) { g_stop = 1; }

/// SA_RESETHAND: the second signal finds the default action, which ends the program.
void catch_signals() {
  struct sigaction action {};
  action.sa_handler = ask_to_stop;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

std::size_t columns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20) return size.ws_col;
  return 80;
}

std::string duration(double seconds) {
  if (seconds < 90.0) return fmt::format("{:.0f} s", seconds);
  if (seconds < 5400.0) return fmt::format("{:.0f} min", seconds / 60.0);
  return fmt::format("{:.1f} h", seconds / 3600.0);
}

void put(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

}  // namespace

Terminal::Terminal(Verbosity verbosity) : verbosity_(verbosity), terminal_(isatty(STDERR_FILENO) == 1) {
  catch_signals();
}

Terminal::~Terminal() {
  erase();
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool Terminal::cancelled() const { return g_stop != 0; }

double Terminal::elapsed() const { return std::chrono::duration<double>(Clock::now() - started_).count(); }

void Terminal::begin(std::string_view stage) {
  stage_ = stage;
  started_ = shown_ = Clock::now();
  if (terminal_ && verbosity_ != Verbosity::kQuiet) draw(0.0, "");
}

void Terminal::update(double fraction, std::string_view detail) {
  if (verbosity_ == Verbosity::kQuiet) return;
  const double since = std::chrono::duration<double>(Clock::now() - shown_).count();
  if (terminal_ && since > 0.1) {
    draw(std::clamp(fraction, 0.0, 1.0), detail);
  } else if (!terminal_ && verbosity_ == Verbosity::kVerbose && since > 1.0) {
    put(fmt::format("{:<12}{:>8.1f} s  {:3.0f} %  {}\n", stage_, elapsed(), 100.0 * fraction, detail));
    shown_ = Clock::now();
  }
}

void Terminal::end(std::string_view summary) {
  if (verbosity_ == Verbosity::kQuiet) return;
  erase();
  put(fmt::format("{:<12}{:>8.1f} s  {}\n", stage_, elapsed(), summary));
}

void Terminal::warn(std::string_view message) {
  if (verbosity_ == Verbosity::kQuiet) return;
  erase();
  put(fmt::format("lamina: warning: {}\n", message));
}

void Terminal::draw(double fraction, std::string_view detail) {
  constexpr int kBar = 24;
  const int full = static_cast<int>(fraction * kBar);
  std::string line =
      fmt::format("{:<10} [{:#>{}}{:.>{}}] {:3.0f} %", stage_, "", full, "", kBar - full, 100.0 * fraction);
  // An estimate from the first moments of a stage would be wild.
  if (fraction > 0.02 && elapsed() > 1.0)
    line += fmt::format(", {} left", duration(elapsed() * (1.0 - fraction) / fraction));
  if (!detail.empty()) line += fmt::format("  {}", detail);
  line.resize(std::min(line.size(), columns() - 1));
  put("\r\x1b[K" + line);
  drawn_ = true;
  shown_ = Clock::now();
}

void Terminal::erase() {
  if (drawn_) put("\r\x1b[K");
  drawn_ = false;
}

void print_error(std::string_view message) {
  std::string line(message);
  std::replace(line.begin(), line.end(), '\n', ' ');
  put(fmt::format("lamina: error: {}\n", line));
}

}  // namespace lamina::cli
