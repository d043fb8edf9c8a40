#include "app/terminal/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace sqslam::app {

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
