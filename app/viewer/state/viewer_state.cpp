#include "app/viewer/state/viewer_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/viewer/state/render_command_line.h"
#include "render/camera/view_presets.h"
#include "slam/util/error.h"

namespace sqslam::viewer {

const SnapshotObject* ViewerState::Object(std::optional<int> id) const {
  const MapSnapshot* map = Map();
  if (map == nullptr || !id) {
    return nullptr;
  }
  const auto found = std::find_if(map->objects.begin(), map->objects.end(),
                                  [&](const SnapshotObject& object) { return object.id == *id; });
  return found == map->objects.end() ? nullptr : &*found;
}

std::string ObjectName(const SnapshotObject& object) {
  if (!object.name.empty()) {
    return object.name;
  }
  std::string label = object.label;
  std::replace(label.begin(), label.end(), '_', ' ');
  return fmt::format("{} {}", label, object.id);
}

ViewCamera NamedView(const ViewerState& state, const std::string& name) {
  const cv::Size size = state.scene_size;
  const double aspect = size.height > 0 ? static_cast<double>(size.width) / size.height : 16.0 / 9.0;
  return name.empty() ? FrameScene(state.focus, aspect) : PresetView(name, state.focus, aspect);
}

std::optional<ClipPlane> CutOf(const ViewerState& state) {
  return MakeClipPlane(state.view.style.clip, state.focus, state.view.camera);
}

void SwitchCut(ViewerState& state) {
  SceneStyle::Clip& clip = state.view.style.clip;
  clip.axis = clip.axis == "none" ? "view" : "none";
}

void ShowCloud(ViewerState& state, const std::filesystem::path& file) {
  state.layers.cloud_file = std::filesystem::absolute(file);
  state.layers.dense_cloud = true;
}

void LookFrom(ViewerState& state, const std::string& preset) {
  state.view.mode = CameraMode::kFree;
  state.view.camera = NamedView(state, preset);
  state.view.preset = preset;
  state.view.automatic = true;
}

void CopyCommand(ViewerState& state) {
  const ScreenshotRequest& wanted = state.screenshot;
  const cv::Size size = wanted.width > 0 ? cv::Size(wanted.width, wanted.height) : state.scene_size;
  std::string notice = "The command that draws this picture is on the clipboard.";
  if (state.editing.document.EditsModified()) {
    notice += " It shows the edits once they are saved (Ctrl S).";
  }
  if (state.editing.representation != Representation::kSuperquadric) {
    notice += " It draws superquadrics.";
  }
  state.Ask(CopyTextRequest{RenderCommandLine(state, size, wanted.transparent, "map.png"), notice});
}

void UseStyle(ViewerState& state, const std::string& name) {
  try {
    const SceneStyle before = std::exchange(state.view.style, LoadStyle(name));
    state.view.style.clip = before.clip;  // what one looks at stays, however it is drawn
    state.view.style.covisibility.show = before.covisibility.show;
    state.view.style.covisibility.min_points = before.covisibility.min_points;
    state.view.style_name = name;
    ++state.view.style_version;
  } catch (const UsageError& error) {
    state.Complain(error.what());
  }
}

}  // namespace sqslam::viewer
