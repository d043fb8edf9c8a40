#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/viewer/state/viewer_state.h"
#include "render/video/video_encoder.h"

// Pictures and videos of what is on the screen, and the commands that draw the same without a window.
namespace sqslam::viewer {

// The command that draws what is on the screen without a window: `sqslam render ... --output FILE`, its words
// quoted for a shell. Marks of the selection are not part of the picture. `size`: of the picture, pixels.
std::string RenderCommandLine(const ViewerState& state, cv::Size size, bool transparent,
                              const std::string& output);

// The values of a style that differ from those of another, as KEY=VALUE of --set.
std::vector<std::string> StyleChanges(const SceneStyle& style, const SceneStyle& from);

// Draws what is on the screen anew, by the renderer of `sqslam render`, in any size, and writes it as PNG.
// Needs the OpenGL context of the window. Throws UsageError (size, style) and InputError (file).
void WriteScreenshot(const ViewerState& state, cv::Size size, bool transparent,
                     const std::filesystem::path& file);

// STEM-1.png, STEM-2.png, ... in the working folder: the first that is not there yet.
std::filesystem::path FreeName(const std::string& stem, const std::string& extension);

// Films what is on the screen at a steady rate, however unevenly its frames come. All throw InputError where
// the file cannot be written.
class ScreenFilm {
 public:
  static constexpr double kRate = 25.0;  // frames a second

  ScreenFilm(const std::filesystem::path& file, cv::Size size);

  // The picture that was on the screen for the last `seconds`; another size than at first is scaled to it.
  void Add(const cv::Mat& bgr, double seconds);
  void Finish() { encoder_.Finish(); }

  const std::filesystem::path& File() const { return file_; }

 private:
  std::filesystem::path file_;
  cv::Size size_;
  VideoEncoder encoder_;
  double due_ = 0.0;  // seconds that were shown but not written yet
};

}  // namespace sqslam::viewer
