#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/viewer/frames/timeline.h"
#include "app/viewer/state/document.h"
#include "app/viewer/state/viewer_state.h"
#include "render/video/video_encoder.h"

// Pictures and videos of the screen, and the commands that draw the same without a window.
namespace sqslam::viewer {

// Returns the frame whose image lies beneath the scene while it is seen through the input camera, or null.
ShownFramePtr BackgroundPhoto(const SceneView& view, const Document& document);

// Returns the command that draws the present view without a window: `sqslam render ... --output FILE`, quoted
// for a shell. Selection marks are not part of the picture. `size`: of the picture, pixels.
std::string RenderCommandLine(const ViewerState& state, cv::Size size, bool transparent,
                              const std::string& output);

// Returns the values of `style` that differ from `from`, as KEY=VALUE for --set.
std::vector<std::string> StyleChanges(const SceneStyle& style, SceneStyle from);

// Draws the present view in any size with the renderer of `sqslam render` and writes it as PNG. Needs the
// OpenGL context of the window. Throws UsageError (size, style) and InputError (file).
void WriteScreenshot(const ViewerState& state, cv::Size size, bool transparent,
                     const std::filesystem::path& file);

// Returns the first of STEM-1.png, STEM-2.png, ... in the working folder that does not exist.
std::filesystem::path FreeName(const std::string& stem, const std::string& extension);

// Returns the largest size with even sides, as video encoders need it.
cv::Size EvenSize(cv::Size size);

// Films the screen at a constant frame rate. All throw InputError if the file cannot be written.
class ScreenFilm {
 public:
  static constexpr double kRate = 25.0;  // frames a second

  ScreenFilm(const std::filesystem::path& file, cv::Size size);

  // Adds the picture shown for the last `seconds`, scaled to the size of the video if needed.
  void Add(const cv::Mat& bgr, double seconds);
  void Finish() { encoder_.Finish(); }

  const std::filesystem::path& File() const { return file_; }

 private:
  std::filesystem::path file_;
  cv::Size size_;
  VideoEncoder encoder_;
  double due_ = 0.0;  // seconds shown but not yet written
};

}  // namespace sqslam::viewer
