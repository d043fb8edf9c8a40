#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::testing {

// A small sequence folder: images, camera.yaml, rgb.txt, no boxes.
class WrittenSequence {
 public:
  // Renders the textured world along a path.
  explicit WrittenSequence(const std::vector<Rigid3d>& T_map_camera);
  WrittenSequence(const Camera& camera, const std::vector<cv::Mat>& images);

  const std::filesystem::path& Path() const { return folder_.Path(); }
  std::filesystem::path Image(int index) const;
  void Write(const std::string& name, const std::string& text) const { folder_.Write(name, text); }
  // rgb.txt with the images of these indices, 30 a second.
  void List(const std::vector<int>& images) const;

 private:
  TemporaryFolder folder_;
};

// Only as many images as needed for a sequence that is refused before any is decoded.
WrittenSequence TinySequence();

}  // namespace sqslam::testing
