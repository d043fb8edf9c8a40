#include "app/terminal/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>

namespace sqslam::app {
namespace {

volatile std::sig_atomic_t interrupted = 0;  // a signal handler can reach nothing but a global

void Handle(int) { interrupted = 1; }

void Install(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART | (handler == SIG_DFL ? 0 : static_cast<int>(SA_RESETHAND));
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupted = 0;
  Install(Handle);
}
InterruptGuard::~InterruptGuard() { Install(SIG_DFL); }
bool InterruptGuard::Interrupted() const { return interrupted != 0; }

Progress::Progress(std::int64_t total, bool quiet, std::string unit)
    : total_(total), quiet_(quiet), unit_(std::move(unit)), terminal_(::isatty(STDERR_FILENO) == 1) {}

void Progress::Update(std::int64_t done, const std::string& state) {
  const auto interval = terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(5000);
  const Clock::time_point now = Clock::now();
  if (quiet_ || now - last_ < interval) {
    return;
  }
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double rate = static_cast<double>(done) / seconds;
  if (total_ <= 0) {
    Print(fmt::format("{} {}  {:.1f}/s  {}", unit_, done, rate, state));
    return;
  }
  const auto left = static_cast<std::int64_t>(static_cast<double>(total_ - done) / std::max(rate, 1e-3));
  Print(fmt::format("{:3}%  {} {}/{}  {:.1f} {}  {}:{:02} left  {}", 100 * done / total_, unit_, done, total_,
                    rate, unit_ == "frame" ? "fps" : unit_ + "s/s", left / 60, left % 60, state));
}

void Progress::Print(const std::string& line) {
  fmt::print(stderr, "{}{}{}", terminal_ ? "\r" : "", line, terminal_ ? "\033[K" : "\n");
  std::fflush(stderr);
  line_open_ = terminal_;
}

void Progress::Finish() {
  if (line_open_) {
    fmt::print(stderr, "\r\033[K");
    line_open_ = false;
  }
}

}  // namespace sqslam::app
