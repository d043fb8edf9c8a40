#include "app/viewer/automation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "app/viewer/state/pictures.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/util/atomic_file.h"
#include "slam/util/throw_if.h"

namespace sqslam::viewer {
namespace {

// Finds a label in the frame drawn last, as scripts name it: "cup 3", or "cup*" for one that begins so.
// Returns the uppermost of several, then the leftmost; null if there is none.
const ShownLabel* FindLabel(std::string_view text) {
  const bool begins = text.ends_with('*');
  const std::string_view wanted = text.substr(0, text.size() - (begins ? 1 : 0));
  const ShownLabel* best = nullptr;
  for (const ShownLabel& label : ShownLabels()) {
    const bool same = begins ? label.text.starts_with(wanted) : label.text == wanted;
    if (same && (best == nullptr ||
                 std::tie(label.center.y, label.center.x) < std::tie(best->center.y, best->center.x))) {
      best = &label;
    }
  }
  return best;
}

}  // namespace

std::string StateValue(const ViewerState& state, const std::string& key) {
  const Document& document = state.document;
  const MapSnapshot* map = document.Map();
  const auto flag = [](bool on) { return std::string(on ? "yes" : "no"); };
  const auto id = [](const std::optional<int>& object) { return object ? std::to_string(*object) : "none"; };
  const auto word = [](const std::string& text) { return text.empty() ? "none" : text; };
  std::string error;
  for (const Notice& notice : state.messages.notices) {
    error = notice.error ? notice.text : error;
  }
  const std::optional<std::set<int>>& answers = state.selection.answers;
  const CloudLayerPtr& cloud = state.layers.drawn.dense_cloud;
  const SurfaceMeshPtr& mesh = state.layers.drawn.dense_mesh;
  const std::vector<std::pair<std::string, std::string>> values = {
      {"title", document.title},
      {"selected", id(state.selection.selected)},
      {"hovered", id(state.selection.hovered)},
      {"answers", answers ? fmt::format("{}", fmt::join(*answers, " ")) : "none"},
      {"hint", word(state.selection.Hint())},
      {"frame", document.shown ? std::to_string(document.shown->frame_index) : "none"},
      {"objects", std::to_string(map != nullptr ? map->objects.size() : 0)},
      {"image", flag(document.shown && !document.shown->image.empty())},
      {"playing", flag(state.playback.playing)},
      {"running", flag(document.run.active)},
      {"style", state.view.style_name},
      {"preset", word(state.view.preset)},
      {"help", flag(state.window.show_help)},
      {"unsaved", flag(state.editing.document.Modified())},
      {"undo", word(state.editing.document.History().UndoName())},
      {"solids", std::to_string(state.editing.Solids().solids.size())},
      {"chosen", std::to_string(state.editing.annotation.chosen.size())},
      {"cut", NameOf(state.view.clip.axis)},
      {"covisibility", flag(state.view.style.covisibility.show)},
      {"true_path", flag(!state.layers.drawn.true_path.empty())},
      {"cloud", std::to_string(cloud ? cloud->points.size() : 0)},
      {"mesh", std::to_string(mesh ? mesh->triangles.size() : 0)},
      {"error", word(error)},
      {"failure", word(document.failure)},
  };
  std::string known;
  for (const auto& [name, value] : values) {
    if (name == key) {
      return value;
    }
    known += (known.empty() ? "" : ", ") + name;
  }
  throw InputError("unknown key '{}', expected one of {}", key, known);
}

ScriptPlayer::ScriptPlayer(std::vector<ScriptLine> script, std::string source,
                           std::function<void(const std::string&)> picture)
    : script_(std::move(script)), source_(std::move(source)), picture_(std::move(picture)) {}

std::vector<InputEvent> ScriptPlayer::Next(const Viewer& viewer, double seconds) {
  using Kind = InputEvent::Kind;
  constexpr double kMaxWait = 60.0;  // seconds
  std::vector<InputEvent> events;
  if (frames_left_ > 0) {
    --frames_left_;
    return events;
  }
  for (; at_ < script_.size(); ++at_) {
    const ScriptLine& line = script_[at_];
    if (line.kind == ScriptLine::Kind::kEvent) {
      events.push_back(line.event);
      const Kind kind = line.event.kind;
      if (kind == Kind::kPress || kind == Kind::kRelease || kind == Kind::kMove) {
        ++at_;
        return events;  // a press and its release must fall into different frames
      }
    } else if (line.kind == ScriptLine::Kind::kFrames) {
      frames_left_ = line.count;
      ++at_;
      return events;
    } else if (!events.empty()) {
      return events;  // they must take effect first
    } else if (Waits(line, viewer)) {
      waited_ += seconds;
      ThrowIf<InputError>(waited_ > kMaxWait, "{}:{}: timed out (60 s): {}", source_, line.line, line.text);
      return events;
    } else if (line.kind == ScriptLine::Kind::kPoint) {
      ++at_;
      const ImVec2 label = FindLabel(line.text)->center;
      return {{.x = std::floor(label.x + line.event.x), .y = std::floor(label.y + line.event.y)}};
    } else if (line.kind == ScriptLine::Kind::kRepeat) {
      if (std::chrono::steady_clock::now() - start_ < std::chrono::seconds(line.count)) {
        at_ = 0;
        return events;
      }
    } else {
      Act(line, viewer);
    }
    waited_ = 0.0;
  }
  return events;
}

void ScriptPlayer::Act(const ScriptLine& line, const Viewer& viewer) const {
  try {
    if (line.kind == ScriptLine::Kind::kPicture) {
      picture_(line.text);
    } else if (line.kind == ScriptLine::Kind::kCommand) {
      const ViewerState& state = viewer.State();
      WriteFileAtomically(line.text, RenderCommandLine(state, state.view.size, false, "map.png") + "\n");
    } else if (line.kind == ScriptLine::Kind::kExpect) {
      Expect(line, viewer);
    }
  } catch (const InputError& error) {
    throw InputError("{}:{}: {}", source_, line.line, error.what());
  }
}

bool ScriptPlayer::Waits(const ScriptLine& line, const Viewer& viewer) {
  if (line.kind != ScriptLine::Kind::kWait) {
    return line.kind == ScriptLine::Kind::kPoint && FindLabel(line.text) == nullptr;
  }
  const Document& document = viewer.State().document;
  if (line.text == "map") {
    return document.Map() == nullptr;
  }
  if (line.text == "end") {
    return document.run.active;
  }
  if (line.text == "frame") {
    return !document.shown || document.shown->frame_index < line.count;
  }
  return !viewer.Idle();
}

void ScriptPlayer::Expect(const ScriptLine& line, const Viewer& viewer) {
  const std::size_t blank = line.text.find(' ');
  const std::string key = line.text.substr(0, blank);
  const std::string wanted = blank == std::string::npos ? "" : line.text.substr(blank + 1);
  const std::string value = StateValue(viewer.State(), key);
  const bool differs = wanted.starts_with("not ") && value != wanted.substr(4);
  ThrowIf<InputError>(value != wanted && !differs, "{} is {}, expected {}", key, value, wanted);
}

void FrameTiming::Add(const ViewerState& state, std::optional<double> seconds) {
  const Clock::time_point now = Clock::now();
  if (seconds) {
    times_.Add("window drawn", 1e3 * *seconds);
  }
  const Document& document = state.document;
  const Timeline& timeline = document.timeline;
  if (document.run.active || timeline.Empty() || !document.shown) {
    return;
  }
  if (timeline.MomentAt(state.playback.time).frame_index != document.shown->frame_index) {
    outdated_ = outdated_.value_or(now);
  } else if (outdated_) {
    times_.Add("another frame on the screen",
               std::chrono::duration<double, std::milli>(now - *outdated_).count());
    outdated_.reset();
  }
}

std::string FrameTiming::Text() const {
  std::string text;
  for (const auto& [name, times] : times_.Summaries()) {
    text += fmt::format("{}: {} times, mean {:.1f} ms, 95 % within {:.1f} ms, longest {:.1f} ms\n", name,
                        times.count, times.mean, times.p95, times.max);
  }
  return text;
}

}  // namespace sqslam::viewer
