#pragma once

#include <filesystem>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Draws what is on the screen anew, by the renderer of `sqslam render`, in any size, and writes it as PNG.
// Needs the OpenGL context of the window. Throws UsageError (size, style) and InputError (file).
void WriteScreenshot(const ViewerState& state, cv::Size size, bool transparent,
                     const std::filesystem::path& file);

// STEM-1.png, STEM-2.png, ... in the folder: the first that is not there yet.
std::filesystem::path FreeName(const std::filesystem::path& folder, const std::string& stem,
                               const std::string& extension);

}  // namespace sqslam::viewer
