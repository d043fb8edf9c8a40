#include "app/viewer/state/screenshot.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "render/picture/picture.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;

void WriteScreenshot(const ViewerState& state, cv::Size size, bool transparent, const fs::path& file) {
  if (state.Map() == nullptr || !state.document.frame) {
    throw UsageError("there is no map to draw yet");
  }
  if (file.extension() != ".png") {
    throw UsageError(fmt::format("{}: expected FILE.png", file.string()));
  }
  PictureOptions options;
  options.width = size.width;
  options.height = size.height;
  options.transparent = transparent;
  options.backend = RenderBackend::kCurrent;
  options.style = state.view.style;
  options.layers = state.layers.drawn;
  PictureRenderer renderer(options);
  renderer.SetMap(*state.document.frame);
  renderer.SetMapKeepingFrame(*state.Map());
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", renderer.Render(state.view.camera), bytes);
  WriteFileAtomically(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});  // NOLINT: bytes
}

fs::path FreeName(const fs::path& folder, const std::string& stem, const std::string& extension) {
  for (int number = 1;; ++number) {
    const fs::path path = folder / fmt::format("{}-{}{}", stem, number, extension);
    if (!fs::exists(path)) {
      return path;
    }
  }
}

}  // namespace sqslam::viewer
