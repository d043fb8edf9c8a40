#include "app/viewer/frame_timing.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "slam/util/statistics.h"

namespace sqslam::viewer {
namespace {

std::string Summary(const char* name, std::vector<double> seconds) {
  if (seconds.empty()) {
    return "";
  }
  const double mean =
      std::accumulate(seconds.begin(), seconds.end(), 0.0) / static_cast<double>(seconds.size());
  const double longest = *std::max_element(seconds.begin(), seconds.end());
  return fmt::format("{}: {} times, mean {:.1f} ms, 95 % within {:.1f} ms, longest {:.1f} ms\n", name,
                     seconds.size(), 1e3 * mean, 1e3 * LowerQuantile(seconds, 0.95), 1e3 * longest);
}

}  // namespace

void FrameTiming::Add(const ViewerState& state, std::optional<double> seconds) {
  const Document& document = state.document;
  const Clock::time_point now = Clock::now();
  const auto since = [&](Clock::time_point from) {
    return std::chrono::duration<double>(now - from).count();
  };
  if (seconds) {
    drawing_.push_back(*seconds);
  }
  if (!opened_ && document.Map() != nullptr) {
    opened_ = since(start_);
  }
  if (document.run.active) {
    run_start_ = run_start_.value_or(now);
    run_seconds_ = since(*run_start_);
    run_frames_ += seconds ? 1 : 0;
    return;
  }
  const Timeline& timeline = document.timeline;
  if (timeline.Empty() || !document.shown) {
    return;
  }
  if (timeline.MomentAt(state.playback.time).frame_index != document.shown->frame_index) {
    wanted_ = wanted_.value_or(now);
  } else if (wanted_) {
    latencies_.push_back(since(*wanted_));
    wanted_.reset();
  }
}

std::string FrameTiming::Text() const {
  std::string text;
  if (opened_) {
    text += fmt::format("first map on the screen after {:.0f} ms\n", 1e3 * *opened_);
  }
  text += Summary("window drawn", drawing_);
  text += Summary("another frame on the screen", latencies_);
  if (run_seconds_ > 0.0) {
    text += fmt::format("during the run: {:.1f} frames of the window a second\n", run_frames_ / run_seconds_);
  }
  return text;
}

}  // namespace sqslam::viewer
