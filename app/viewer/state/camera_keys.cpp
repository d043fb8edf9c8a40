#include "app/viewer/state/camera_keys.h"

#include <fmt/format.h>

namespace sqslam::viewer {
namespace {

std::string Triple(const Eigen::Vector3d& v) {
  return fmt::format("[{:.7g}, {:.7g}, {:.7g}]", v.x(), v.y(), v.z());
}

}  // namespace

void CameraKeys::Add(const ViewCamera& camera) {
  keys.push_back({keys.empty() ? 0.0 : keys.back().time + interval, camera});
}

void CameraKeys::Remove(std::size_t index) {
  if (index >= keys.size()) {
    return;
  }
  const double gap = index + 1 < keys.size() ? keys[index + 1].time - keys[index].time : 0.0;
  keys.erase(keys.begin() + static_cast<std::ptrdiff_t>(index));
  for (std::size_t i = index; i < keys.size(); ++i) {
    keys[i].time -= gap;
  }
}

std::string CameraKeys::Yaml() const {
  std::string text = "# Set by hand in sqslam-viewer; sqslam render --camera-path plays it.\n";
  text += "easing: smooth\n";
  if (loop && !keys.empty()) {
    text += fmt::format("loop: true\nduration: {:.7g}\n", keys.back().time + interval);
  }
  text += "keys:\n";
  for (const Key& key : keys) {
    text +=
        fmt::format("  - {{time: {:.7g}, position: {}, focal_point: {}, view_up: {}, view_angle: {:.7g}}}\n",
                    key.time, Triple(key.camera.position), Triple(key.camera.focal_point),
                    Triple(key.camera.view_up), key.camera.view_angle);
  }
  return text;
}

}  // namespace sqslam::viewer
