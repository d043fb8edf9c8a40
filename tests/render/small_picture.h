#pragma once

#include <cstdlib>
#include <opencv2/core.hpp>

#include "hand_made_map.h"
#include "render/camera/scene_framing.h"
#include "render/picture/picture.h"

namespace sqslam {

// Options of a picture of 320x240 that shows the objects of HandMadeMap() from near.
inline PictureOptions SmallPicture() {
  unsetenv("DISPLAY");
  PictureOptions options;
  options.width = 320;
  options.height = 240;
  options.backend = RenderBackend::kOsmesa;
  // Nearer than the automatic view, which holds the path: the objects are what these tests look at.
  SceneFocus focus = FindFocus(HandMadeMap());
  focus.outline.resize(focus.outline.size() - HandMadeMap().keyframes.size());
  const ViewCamera close = FrameScene(focus, 320.0 / 240.0);
  options.camera.position = close.position;
  options.camera.focal_point = close.focal_point;
  return options;
}

inline bool SameBytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

}  // namespace sqslam
