#include "app/viewer/state/render_command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <type_traits>

#include "slam/util/options.h"

namespace sqslam::viewer {
namespace {

std::string Quoted(const std::string& word) {
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("_-+./,:=@%").find(static_cast<char>(c)) != std::string::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) {
    return word;
  }
  std::string quoted = "'";
  for (const char c : word) {
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return quoted + "'";
}

std::string ValueText(const OptionField& field) {
  return std::visit(
      [](const auto& value) -> std::string {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, std::string*>) {
          return "\"" + *value + "\"";
        } else if constexpr (std::is_same_v<T, bool*>) {
          return *value ? "true" : "false";
        } else if constexpr (std::is_same_v<T, double*>) {
          return fmt::format("{:.6g}", *value);
        } else if constexpr (std::is_same_v<T, int*> || std::is_same_v<T, std::int64_t*> ||
                             std::is_same_v<T, std::uint64_t*>) {
          return fmt::format("{}", *value);
        } else {  // lists, which no style has
          return "";
        }
      },
      field.value);
}

std::string VectorText(const Eigen::Vector3d& v) {
  // Nothing that a difference of less than a thousandth of a pixel could be seen by.
  return fmt::format("{:.7g},{:.7g},{:.7g}", v.x(), v.y(), v.z());
}

}  // namespace

std::vector<std::string> StyleChanges(const SceneStyle& style, const SceneStyle& from) {
  SceneStyle a = style;
  SceneStyle b = from;
  const std::vector<OptionField> fields = OptionFields(a);
  const std::vector<OptionField> others = OptionFields(b);
  std::vector<std::string> changes;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::string value = ValueText(fields[i]);
    if (value != ValueText(others[i])) {
      changes.push_back(fields[i].key + "=" + value);
    }
  }
  return changes;
}

std::string RenderCommandLine(const ViewerState& state, cv::Size size, bool transparent,
                              const std::string& output) {
  const View& view = state.view;
  std::vector<std::string> words = {"sqslam", "render",
                                    std::filesystem::absolute(state.document.file).string()};
  const auto add = [&](const char* option, const std::string& value) {
    words.push_back(fmt::format("{}={}", option, value));  // in one word: values may begin with a minus
  };
  add("--output", output);
  add("--resolution", fmt::format("{},{}", size.width, size.height));
  if (transparent) {
    words.emplace_back("--no-background");
  }
  if (state.shown && state.document.last && state.shown->frame_index != state.document.last->frame_index) {
    add("--at-frame", std::to_string(state.shown->frame_index));
  }
  if (!state.editing.document.Current().edits.Empty()) {
    add("--edits", std::filesystem::absolute(state.editing.document.EditsFile()).string());
  }
  add("--style", view.style_name);
  for (const std::string& change : StyleChanges(view.style, LoadStyle(view.style_name))) {
    add("--set", change);
  }
  const Layers& layers = state.layers;
  const bool has_cloud = layers.dense_cloud && !layers.cloud_file.empty();
  const bool in_world = has_cloud && layers.cloud_in_world;
  if (layers.true_path || (in_world && !layers.sequence.empty())) {
    add("--ground-truth",
        layers.sequence.empty() ? "auto" : std::filesystem::absolute(layers.sequence).string());
    if (!layers.true_path) {
      add("--set", "ground_truth.show=false");
    }
  }
  if (has_cloud) {
    add("--dense-cloud", std::filesystem::absolute(layers.cloud_file).string());
    add("--dense-cloud-frame", in_world ? "world" : "map");
  }
  add("--camera-position", VectorText(view.camera.position));
  add("--camera-focal-point", VectorText(view.camera.focal_point));
  add("--camera-view-up", VectorText(view.camera.view_up));
  add("--camera-view-angle", fmt::format("{:.7g}", view.camera.view_angle));
  std::string line;
  for (const std::string& word : words) {
    line.append(line.empty() ? "" : " ").append(Quoted(word));
  }
  return line;
}

}  // namespace sqslam::viewer
