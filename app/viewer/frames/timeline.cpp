#include "app/viewer/frames/timeline.h"

#include <algorithm>

namespace sqslam::viewer {

int Timeline::At(double time) const {
  if (moments.empty()) {
    return -1;
  }
  const auto after = std::ranges::upper_bound(moments, time + 1e-9, {}, &Moment::timestamp);
  return std::max(0, static_cast<int>(after - moments.begin()) - 1);
}

std::vector<std::pair<double, double>> Timeline::Gaps() const {
  std::vector<std::pair<double, double>> gaps;
  bool open = false;
  for (const Moment& moment : moments) {
    if (open) {
      gaps.back().second = moment.timestamp;
    } else if (!moment.tracked) {
      gaps.emplace_back(moment.timestamp, moment.timestamp);
    }
    open = !moment.tracked;
  }
  return gaps;
}

int Timeline::OfSnapshot(int snapshot) const {
  const auto found = std::ranges::lower_bound(moments, snapshot, {}, &Moment::snapshot);
  return found == moments.end() ? Last() : static_cast<int>(found - moments.begin());
}

void Playback::Advance(double seconds, const Timeline& timeline) {
  if (!playing || timeline.Empty()) {
    return;
  }
  time = std::clamp(time + seconds * speed, timeline.Begin(), timeline.End());
  playing = speed > 0.0 ? time < timeline.End() : time > timeline.Begin();
}

void Playback::Toggle(double direction, const Timeline& timeline) {
  playing = !Plays(direction) && !timeline.Empty();
  if (!playing) {
    return;
  }
  speed = std::copysign(speed, direction);
  if (speed > 0.0 && time >= timeline.End() - 1e-9) {
    time = timeline.Begin();
  } else if (speed < 0.0 && time <= timeline.Begin() + 1e-9) {
    time = timeline.End();
  }
}

void Playback::Step(int count, const Timeline& timeline) {
  playing = false;
  if (!timeline.Empty()) {
    const int to = std::clamp(timeline.At(time) + count, 0, timeline.Last());
    time = timeline.moments[static_cast<std::size_t>(to)].timestamp;
  }
}

void Playback::StepSnapshot(int count, const Timeline& timeline) {
  playing = false;
  if (timeline.Empty()) {
    return;
  }
  const int now = timeline.MomentAt(time).snapshot;
  const int to = timeline.OfSnapshot(std::max(now + count, 0));
  time = timeline.moments[static_cast<std::size_t>(to)].timestamp;
}

}  // namespace sqslam::viewer
