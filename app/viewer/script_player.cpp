#include "app/viewer/script_player.h"

#include <fmt/format.h>

#include <utility>

#include "app/viewer/state/render_command_line.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

std::string IdText(const std::optional<int>& id) { return id ? std::to_string(*id) : "none"; }

}  // namespace

std::string StateValue(const ViewerState& state, const std::string& key) {
  const MapSnapshot* map = state.Map();
  const auto errors = [&] {
    std::string text = "none";
    for (const Notice& notice : state.notices) {
      text = notice.error ? notice.text : text;
    }
    return text;
  };
  const std::vector<std::pair<std::string, std::function<std::string()>>> values = {
      {"title", [&] { return state.document.title; }},
      {"selected", [&] { return IdText(state.selected); }},
      {"hovered", [&] { return IdText(state.hovered); }},
      {"frame", [&] { return state.shown ? std::to_string(state.shown->frame_index) : "none"; }},
      {"objects", [&] { return std::to_string(map != nullptr ? map->objects.size() : 0); }},
      {"image", [&] { return std::string(state.shown && !state.shown->image.empty() ? "yes" : "no"); }},
      {"playing", [&] { return std::string(state.playback.playing ? "yes" : "no"); }},
      {"running", [&] { return std::string(state.run.active ? "yes" : "no"); }},
      {"style", [&] { return state.view.style_name; }},
      {"preset", [&] { return state.view.preset.empty() ? std::string("none") : state.view.preset; }},
      {"help", [&] { return std::string(state.show_help ? "yes" : "no"); }},
      {"unsaved", [&] { return std::string(state.editing.document.Modified() ? "yes" : "no"); }},
      {"undo",
       [&] {
         const std::string name = state.editing.document.History().UndoName();
         return name.empty() ? std::string("none") : name;
       }},
      {"solids", [&] { return std::to_string(state.editing.document.Current().annotation.solids.size()); }},
      {"chosen", [&] { return std::to_string(state.editing.annotation.chosen.size()); }},
      {"cut", [&] { return state.view.style.clip.axis; }},
      {"covisibility", [&] { return std::string(state.view.style.covisibility.show ? "yes" : "no"); }},
      {"true_path", [&] { return std::string(state.layers.drawn.true_path.empty() ? "no" : "yes"); }},
      {"cloud",
       [&] {
         const auto& cloud = state.layers.drawn.dense_cloud;
         return std::to_string(cloud ? cloud->p_map.size() : 0);
       }},
      {"error", errors},
  };
  std::string known;
  for (const auto& [name, value] : values) {
    if (name == key) {
      return value();
    }
    known += (known.empty() ? "" : ", ") + name;
  }
  throw InputError(fmt::format("'{}' is nothing that can be expected; there are {}", key, known));
}

ScriptPlayer::ScriptPlayer(std::vector<ScriptLine> script, std::string source,
                           std::function<void(const std::string&)> picture)
    : script_(std::move(script)), source_(std::move(source)), picture_(std::move(picture)) {}

std::vector<InputEvent> ScriptPlayer::Next(const Viewer& viewer, double seconds) {
  constexpr double kPatience = 60.0;  // seconds
  std::vector<InputEvent> events;
  if (frames_left_ > 0) {
    --frames_left_;
    return events;
  }
  for (; at_ < script_.size(); ++at_) {
    const ScriptLine& line = script_[at_];
    switch (line.kind) {
      case ScriptLine::Kind::kEvent:
        // A press and its release must be seen by different frames.
        events.push_back(line.event);
        if (line.event.kind == InputEvent::Kind::kPress || line.event.kind == InputEvent::Kind::kRelease ||
            line.event.kind == InputEvent::Kind::kMove) {
          ++at_;
          return events;
        }
        break;
      case ScriptLine::Kind::kFrames:
        frames_left_ = line.count;
        ++at_;
        return events;
      case ScriptLine::Kind::kWait:
        if (!events.empty() || Waits(line, viewer)) {
          waited_ += seconds;
          if (waited_ > kPatience) {
            throw InputError(fmt::format("{}:{}: waited for {} in vain", source_, line.line, line.text));
          }
          return events;
        }
        waited_ = 0.0;
        break;
      case ScriptLine::Kind::kRepeat:
        if (std::chrono::steady_clock::now() - start_ < std::chrono::seconds(line.count)) {
          at_ = 0;
          return events;
        }
        break;
      case ScriptLine::Kind::kPicture:
      case ScriptLine::Kind::kCommand:
      case ScriptLine::Kind::kExpect:
        if (!events.empty()) {
          return events;  // they come to pass first
        }
        if (line.kind == ScriptLine::Kind::kPicture) {
          picture_(line.text);
        } else if (line.kind == ScriptLine::Kind::kCommand) {
          const ViewerState& state = viewer.State();
          WriteFileAtomically(line.text, RenderCommandLine(state, state.scene_size, false, "map.png") + "\n");
        } else {
          Expect(line, viewer);
        }
        break;
    }
  }
  return events;
}

bool ScriptPlayer::Waits(const ScriptLine& line, const Viewer& viewer) const {
  if (line.text == "map") {
    return viewer.State().Map() == nullptr;
  }
  if (line.text == "end") {
    return viewer.State().run.active;
  }
  if (line.text == "frame") {
    const ViewerState& state = viewer.State();
    return !state.shown || state.shown->frame_index < line.count;
  }
  return !viewer.Idle();
}

void ScriptPlayer::Expect(const ScriptLine& line, const Viewer& viewer) const {
  const std::size_t blank = line.text.find(' ');
  const std::string key = line.text.substr(0, blank);
  const std::string wanted = blank == std::string::npos ? "" : line.text.substr(blank + 1);
  const std::string value = StateValue(viewer.State(), key);
  const bool differs = wanted.starts_with("not ") && value != wanted.substr(4);
  if (value != wanted && !differs) {
    throw InputError(fmt::format("{}:{}: {} is {}, expected {}", source_, line.line, key, value, wanted));
  }
}

}  // namespace sqslam::viewer
