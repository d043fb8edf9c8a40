#include "app/viewer/state/scene_view.h"

#include <fmt/format.h>

#include <utility>

#include "render/camera/scene_framing.h"

namespace sqslam::viewer {

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
  const auto triple = [](const Eigen::Vector3d& v) {
    return fmt::format("[{:.7g}, {:.7g}, {:.7g}]", v.x(), v.y(), v.z());
  };
  std::string text =
      "# Set by hand in sqslam-viewer; sqslam render --camera-path plays it.\neasing: smooth\n";
  if (loop && !keys.empty()) {
    text += fmt::format("loop: true\nduration: {:.7g}\n", keys.back().time + interval);
  }
  text += "keys:\n";
  for (const Key& key : keys) {
    text +=
        fmt::format("  - {{time: {:.7g}, position: {}, focal_point: {}, view_up: {}, view_angle: {:.7g}}}\n",
                    key.time, triple(key.camera.position), triple(key.camera.focal_point),
                    triple(key.camera.view_up), key.camera.view_angle);
  }
  return text;
}

void SceneView::MoveTo(const ViewCamera& place) {
  camera = place;
  preset = "";
  automatic = false;
  mode = CameraMode::kFree;
}

ViewCamera SceneView::Named(const std::string& name) const {
  const double aspect = size.height > 0 ? static_cast<double>(size.width) / size.height : 16.0 / 9.0;
  return name.empty() ? FrameScene(focus, aspect) : PresetView(name, focus, aspect);
}

void SceneView::LookFrom(const std::string& name) {
  camera = Named(name);
  mode = CameraMode::kFree;
  preset = name;
  automatic = true;
}

void SceneView::UseStyle(const std::string& name) {
  SceneStyle next = LoadStyle(name);
  next.covisibility.show = style->covisibility.show;
  next.covisibility.min_points = style->covisibility.min_points;
  style.Set(std::move(next));
  style_name = name;
}

SceneStyle SceneView::StyleWithClip() const {
  SceneStyle all = *style;
  all.clip = clip;
  return all;
}

}  // namespace sqslam::viewer
