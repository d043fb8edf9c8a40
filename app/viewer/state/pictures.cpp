#include "app/viewer/state/pictures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "render/picture/photo.h"
#include "render/picture/picture.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// Returns the value as --set takes it.
std::string OptionValueText(const OptionField& field) {
  if (const auto* const* number = std::get_if<double*>(&field.value)) {
    return fmt::format("{:.6g}", **number);
  }
  const bool word =
      std::holds_alternative<std::string*>(field.value) || std::holds_alternative<EnumOption>(field.value);
  return word ? fmt::format("\"{}\"", OptionText(field)) : OptionText(field);
}

std::string VectorText(const Eigen::Vector3d& v) {
  // Seven digits: differences beyond them move no pixel by a thousandth.
  return fmt::format("{:.7g}", fmt::join(v, ","));
}

bool IsThroughCamera(const SceneView& view, const Document& document) {
  return view.mode == CameraMode::kFirstPerson && document.Map() != nullptr && document.Map()->T_map_camera;
}

}  // namespace

std::vector<std::string> StyleChanges(const SceneStyle& style, SceneStyle from) {
  from.objects.colors = style.objects.colors;  // the window cannot change them, but the file may have changed
  return ToVector(ChangedOptions(style, from, OptionValueText),
                  [](const auto& change) { return change[0] + "=" + change[1]; });
}

ShownFramePtr BackgroundPhoto(const SceneView& view, const Document& document) {
  const ShownFramePtr& shown = document.shown;
  const bool has = IsThroughCamera(view, document) &&
                   shown->image.size() == cv::Size(shown->map->camera.width, shown->map->camera.height);
  return has ? shown : nullptr;
}

std::string RenderCommandLine(const ViewerState& state, cv::Size size, bool transparent,
                              const std::string& output) {
  const SceneView& view = state.view;
  const Document& document = state.document;
  std::vector<std::string> words = {"sqslam", "render", fs::absolute(document.file).string()};
  const auto add = [&](const char* option, const std::string& value) {
    words.push_back(fmt::format("{}={}", option, value));  // as one word: values may begin with a minus
  };
  add("--output", output);
  add("--resolution", fmt::format("{},{}", size.width, size.height));
  if (transparent) {
    words.emplace_back("--no-background");
  }
  const ShownFramePtr photo = transparent ? nullptr : BackgroundPhoto(view, document);
  const bool through = IsThroughCamera(view, document);
  if (photo) {
    words.emplace_back("--photo");
  }
  if (through) {
    add("--camera-frame", std::to_string(document.shown->frame_index));
    add("--at-frame", std::to_string(document.shown->frame_index));
  } else if (document.shown && document.last && document.shown->frame_index != document.last->frame_index) {
    add("--at-frame", std::to_string(document.shown->frame_index));
  }
  if (!state.editing.Edits().Empty()) {
    add("--edits", fs::absolute(state.editing.document.EditsFile()).string());
  }
  add("--style", view.style_name);
  SceneStyle loaded = LoadStyle(view.style_name);
  SetStyle(view.settings, loaded);
  for (const std::string& setting : view.settings) {
    add("--set", setting);
  }
  for (const std::string& change : StyleChanges(view.StyleWithClip(), loaded)) {
    add("--set", change);
  }
  const Layers& layers = state.layers;
  const bool has_cloud = layers.dense_cloud && !layers.cloud_file.empty();
  const bool in_world = has_cloud && layers.cloud_in_world;
  if (layers.true_path || (in_world && !layers.sequence.empty())) {
    add("--ground-truth", layers.sequence.empty() ? "auto" : fs::absolute(layers.sequence).string());
    if (!layers.true_path) {
      add("--set", "ground_truth.show=false");
    }
  }
  if (has_cloud) {
    add("--dense-cloud", fs::absolute(layers.cloud_file).string());
    add("--dense-cloud-frame", in_world ? "world" : "map");
  }
  if (!layers.dense_cloud) {
    add("--set", "dense_cloud.show=false");
  }
  if (through) {
    if (!photo) {  // --camera-frame leaves cameras out unless one of their options is given
      add("--set", fmt::format("cameras.current={}", view.style.cameras.current));
    }
    return ShellLine(words);
  }
  add("--camera-position", VectorText(view.camera.position));
  add("--camera-focal-point", VectorText(view.camera.focal_point));
  add("--camera-view-up", VectorText(view.camera.view_up));
  add("--camera-view-angle", fmt::format("{:.7g}", view.camera.view_angle));
  return ShellLine(words);
}

void WriteScreenshot(const ViewerState& state, cv::Size size, bool transparent, const fs::path& file) {
  ThrowIf<UsageError>(state.document.Map() == nullptr || !state.document.frame,
                      "there is no map to draw yet");
  PictureOptions options;
  options.width = size.width;
  options.height = size.height;
  options.transparent = transparent;
  options.backend = RenderBackend::kCurrent;
  options.style = state.view.StyleWithClip();
  options.layers = state.layers.drawn;
  if (const ShownFramePtr photo = transparent ? nullptr : BackgroundPhoto(state.view, state.document)) {
    const MapSnapshot& map = *photo->map;
    WritePicture(file, RenderOnPhoto(*state.document.frame, map, photo->image, *map.T_map_camera, options));
    return;
  }
  PictureRenderer renderer(options);
  renderer.SetMap(*state.document.frame);
  const MapSnapshot& map = *state.document.Map();
  renderer.SetMapKeepingFrame(map);
  WritePicture(file,
               renderer.Render(IsThroughCamera(state.view, state.document)
                                   ? LookThrough(*map.T_map_camera, map.camera, size, state.view.focus.radius)
                                   : state.view.camera));
}

cv::Size EvenSize(cv::Size size) {
  return {std::max(2, size.width / 2 * 2), std::max(2, size.height / 2 * 2)};
}

fs::path FreeName(const std::string& stem, const std::string& extension) {
  for (int number = 1;; ++number) {
    const fs::path path = fs::current_path() / fmt::format("{}-{}{}", stem, number, extension);
    if (!fs::exists(path)) {
      return path;
    }
  }
}

ScreenFilm::ScreenFilm(const fs::path& file, cv::Size size)
    : file_(file), size_(EvenSize(size)), encoder_(file, size_, kRate) {}

void ScreenFilm::Add(const cv::Mat& bgr, double seconds) {
  constexpr double kMaxSeconds = 1.0;  // seconds: an idle window is not filmed for longer
  due_ += std::min(seconds, kMaxSeconds);
  if (due_ < 1.0 / kRate || bgr.empty()) {
    return;
  }
  cv::Mat frame = bgr;
  if (frame.size() != size_) {
    cv::resize(bgr, frame, size_, 0.0, 0.0, cv::INTER_AREA);
  }
  for (; due_ >= 1.0 / kRate; due_ -= 1.0 / kRate) {
    encoder_.Add(frame);
  }
}

}  // namespace sqslam::viewer
