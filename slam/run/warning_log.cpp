#include "slam/run/warning_log.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>

namespace sqslam {
namespace {

std::shared_ptr<spdlog::sinks::dist_sink_mt> SinkOfSinks() {
  const auto& sinks = spdlog::default_logger()->sinks();
  return sinks.empty() ? nullptr : std::dynamic_pointer_cast<spdlog::sinks::dist_sink_mt>(sinks.front());
}

}  // namespace

class WarningLog::Sink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  std::vector<std::string> Lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    constexpr std::size_t kMaxLines = 100;
    std::string line(message.payload.data(), message.payload.size());
    if (message.level >= spdlog::level::warn && lines_.size() < kMaxLines &&
        std::ranges::find(lines_, line) == lines_.end()) {
      lines_.push_back(std::move(line));
    }
  }
  void flush_() override {}

 private:
  std::vector<std::string> lines_;
};

WarningLog::WarningLog() : sink_(std::make_shared<Sink>()) {
  if (const auto sinks = SinkOfSinks()) {
    sinks->add_sink(sink_);
  }
}

WarningLog::~WarningLog() {
  if (const auto sinks = SinkOfSinks()) {
    sinks->remove_sink(sink_);
  }
}

std::vector<std::string> WarningLog::Lines() const { return sink_->Lines(); }

}  // namespace sqslam
