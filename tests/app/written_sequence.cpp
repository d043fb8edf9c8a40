#include "tests/app/written_sequence.h"

#include <fmt/format.h>

#include <numeric>
#include <opencv2/imgcodecs.hpp>

#include "slam/io/cameras.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

std::vector<cv::Mat> Render(const TexturedWorld& world, const std::vector<Rigid3d>& T_map_camera) {
  std::vector<cv::Mat> images;
  for (std::size_t i = 0; i < T_map_camera.size(); ++i) {
    images.push_back(world.Render(static_cast<std::int64_t>(i), T_map_camera[i]).bgr);
  }
  return images;
}

}  // namespace

WrittenSequence::WrittenSequence(const std::vector<Rigid3d>& T_map_camera)
    : WrittenSequence(TexturedWorld().GetCamera(), Render(TexturedWorld(), T_map_camera)) {}

WrittenSequence::WrittenSequence(const Camera& camera, const std::vector<cv::Mat>& images) {
  WriteCamera(Path() / "camera.yaml", camera);
  std::filesystem::create_directory(Path() / "rgb");
  for (std::size_t i = 0; i < images.size(); ++i) {
    cv::imwrite(Image(static_cast<int>(i)).string(), images[i]);
  }
  std::vector<int> all(images.size());
  std::iota(all.begin(), all.end(), 0);
  List(all);
}

std::filesystem::path WrittenSequence::Image(int index) const {
  return Path() / "rgb" / fmt::format("{:04}.jpg", index);
}

void WrittenSequence::List(const std::vector<int>& images) const {
  std::string text;
  for (std::size_t i = 0; i < images.size(); ++i) {
    text += fmt::format("{:.6f} rgb/{:04}.jpg\n", static_cast<double>(i) / 30.0, images[i]);
  }
  Write("rgb.txt", text);
}

WrittenSequence TinySequence() { return WrittenSequence({Rigid3d{}, Rigid3d{}}); }

}  // namespace sqslam::testing
