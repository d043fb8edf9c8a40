#pragma once

#include <imgui.h>

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// What stands over the picture of the map, drawn into the current ImGui window. A value for one frame of the
// window; `state` must outlive it.
class SceneOverlay {
 public:
  // `origin`: top-left corner of the picture on the screen; `size`: of the picture. Both px.
  SceneOverlay(const ViewerState& state, ImVec2 origin, cv::Size size)
      : state_(state), origin_(origin), size_(size) {}

  void Outline(const SnapshotObject* object, ImU32 color, float width) const;  // null: nothing
  void Name(const SnapshotObject* object) const;  // a tag above it; null: nothing
  void InputCamera() const;                       // the frustum of the input camera where it is now
  void Measurement() const;

 private:
  std::vector<ImVec2> OutlineOf(const SnapshotObject& object) const;
  // Text on a card whose bottom is above `at`.
  void Tag(const std::string& text, ImVec2 at, const Eigen::Vector3d& color) const;

  const ViewerState& state_;
  ImVec2 origin_;
  cv::Size size_;
};

}  // namespace sqslam::viewer
