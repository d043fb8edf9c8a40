#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/camera/camera_path.h"

namespace sqslam::viewer {

// Key frames of a camera path that were set by hand.
struct CameraKeys {
  struct Key {
    double time = 0.0;  // seconds of the video
    ViewCamera camera;
  };
  std::vector<Key> keys;
  double interval = 2.0;  // seconds from one key to the next
  bool loop = false;

  void Add(const ViewCamera& camera);
  void Remove(std::size_t index);  // those after it move up

  // As `sqslam render --camera-path` reads it.
  std::string Yaml() const;
};

}  // namespace sqslam::viewer
