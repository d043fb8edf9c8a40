#include "app/viewer/automation.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "app/viewer/state/pictures.h"
#include "slam/util/atomic_file.h"
#include "slam/util/throw_if.h"

namespace sqslam::viewer {
namespace {

// A piece of text in the window, in one font and on one line.
struct WindowText {
  std::string text;            // UTF-8
  double x = 0.0, y = 0.0;     // its middle, pixels
  double left = 0.0, pen = 0;  // its first edge, and where its next letter would begin
};

struct Letter {
  const ImFont* font = nullptr;
  const ImFontGlyph* glyph = nullptr;
};

// The letters of all fonts by their place in the fonts' texture, which vertices keep exactly.
using Letters = std::map<std::array<float, 4>, Letter>;

Letters KnownLetters() {
  Letters letters;
  for (const ImFont* font : ImGui::GetIO().Fonts->Fonts) {
    for (const ImFontGlyph& glyph : font->Glyphs) {
      if (glyph.Visible != 0) {
        letters[{glyph.U0, glyph.V0, glyph.U1, glyph.V1}] = {font, &glyph};
      }
    }
  }
  return letters;
}

// Joins letters, in the order of drawing, to texts.
class TextJoiner {
 public:
  void Add(const Letter& letter, const ImDrawVert& corner, const ImDrawVert& opposite,
           const ImVec4& visible) {
    const ImFontGlyph& glyph = *letter.glyph;
    const double scale = (opposite.pos.x - corner.pos.x) / (glyph.X1 - glyph.X0);
    const double pen = corner.pos.x - scale * glyph.X0;
    const double line = corner.pos.y - scale * glyph.Y0;
    const double blank = scale * letter.font->GetCharAdvance(' ');
    const double gap = texts_.empty() ? 0.0 : pen - texts_.back().pen;
    const bool spaced = std::abs(gap - blank) < 0.5;
    const bool same_line = font_ == letter.font && std::abs(line - line_) < 0.5;
    if (texts_.empty() || !same_line || (std::abs(gap) > 0.5 && !spaced)) {
      texts_.emplace_back().left = pen;
      visible_.push_back(visible);
      font_ = letter.font;
      line_ = line;
    } else if (spaced) {
      texts_.back().text += ' ';
    }
    std::array<char, 5> utf8{};
    WindowText& text = texts_.back();
    text.text += ImTextCharToUtf8(utf8.data(), glyph.Codepoint);
    text.pen = pen + scale * glyph.AdvanceX;
    text.x = 0.5 * (text.left + text.pen);
    text.y = line + 0.5 * scale * letter.font->FontSize;
  }

  std::vector<WindowText> Visible() const {
    std::vector<WindowText> texts;
    for (std::size_t i = 0; i < texts_.size(); ++i) {
      const WindowText& text = texts_[i];
      const ImVec4& part = visible_[i];
      if (text.x > part.x && text.y > part.y && text.x < part.z && text.y < part.w) {
        texts.push_back(text);
      }
    }
    return texts;
  }

 private:
  std::vector<WindowText> texts_;
  std::vector<ImVec4> visible_;  // part of the window to which each is clipped
  const ImFont* font_ = nullptr;
  double line_ = 0.0;
};

// Reads back the texts that the panels have drawn; those out of sight in a scrolled panel are left out.
std::vector<WindowText> TextsOf(const ImDrawData& drawn) {
  const Letters letters = KnownLetters();
  TextJoiner joiner;
  for (int i = 0; i < drawn.CmdListsCount; ++i) {
    const ImDrawList& list = *drawn.CmdLists[i];
    for (const ImDrawCmd& command : list.CmdBuffer) {
      // A letter is a rectangle of two triangles: its first and third vertices are opposite corners.
      for (unsigned at = command.IdxOffset; at + 6 <= command.IdxOffset + command.ElemCount;) {
        const auto vertex = [&](unsigned index) -> const ImDrawVert& {
          return list
              .VtxBuffer[static_cast<int>(command.VtxOffset + list.IdxBuffer[static_cast<int>(at + index)])];
        };
        const ImDrawVert& corner = vertex(0);
        const ImDrawVert& opposite = vertex(2);
        const auto found = letters.find({corner.uv.x, corner.uv.y, opposite.uv.x, opposite.uv.y});
        if (found != letters.end()) {
          joiner.Add(found->second, corner, opposite, command.ClipRect);
        }
        at += found != letters.end() ? 6 : 3;
      }
    }
  }
  return joiner.Visible();
}

// Finds a text in the frame drawn last, as scripts name what they click on: "cup 3", or "cup*" for one that
// begins so. Of several it is the uppermost, then the leftmost.
std::optional<WindowText> FindText(std::string_view text) {
  const ImDrawData* drawn = ImGui::GetDrawData();  // null while a frame is held back
  if (drawn == nullptr) {
    return std::nullopt;
  }
  const bool begins = text.ends_with('*');
  const std::string_view wanted = text.substr(0, text.size() - (begins ? 1 : 0));
  std::optional<WindowText> best;
  for (WindowText& found : TextsOf(*drawn)) {
    const bool same = begins ? found.text.starts_with(wanted) : found.text == wanted;
    if (same && (!best || std::tie(found.y, found.x) < std::tie(best->y, best->x))) {
      best = std::move(found);
    }
  }
  return best;
}

// Returns the move of the mouse to a text that the window shows.
InputEvent MoveTo(const ScriptLine& line) {
  const WindowText text = FindText(line.text).value();
  return {.x = std::floor(text.x + line.event.x), .y = std::floor(text.y + line.event.y)};
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
  const CloudLayerPtr& cloud = state.layers.drawn.dense_cloud;
  const SurfaceMeshPtr& mesh = state.layers.drawn.dense_mesh;
  const std::vector<std::pair<std::string, std::string>> values = {
      {"title", document.title},
      {"selected", id(state.selection.selected)},
      {"hovered", id(state.selection.hovered)},
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
  std::vector<InputEvent> events;
  if (frames_left_ > 0) {
    --frames_left_;
    return events;
  }
  for (; at_ < script_.size(); ++at_) {
    const ScriptLine& line = script_[at_];
    switch (line.kind) {
      case ScriptLine::Kind::kEvent:
        // A press and its release must fall into different frames.
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
      case ScriptLine::Kind::kPoint:
        if (!events.empty() || Waits(line, viewer)) {
          BePatient(line, seconds);
          return events;
        }
        waited_ = 0.0;
        if (line.kind == ScriptLine::Kind::kPoint) {
          ++at_;
          return {MoveTo(line)};
        }
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
          return events;  // these must take effect first
        }
        Act(line, viewer);
        break;
    }
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
    } else {
      Expect(line, viewer);
    }
  } catch (const InputError& error) {
    throw InputError("{}:{}: {}", source_, line.line, error.what());
  }
}

void ScriptPlayer::BePatient(const ScriptLine& line, double seconds) {
  constexpr double kPatience = 60.0;  // seconds
  waited_ += seconds;
  ThrowIf<InputError>(waited_ > kPatience, "{}:{}: timed out: {}", source_, line.line, line.text);
}

bool ScriptPlayer::Waits(const ScriptLine& line, const Viewer& viewer) const {
  if (line.kind == ScriptLine::Kind::kPoint) {
    return !FindText(line.text);
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
  const Document& document = state.document;
  const Clock::time_point now = Clock::now();
  const auto since = [&](Clock::time_point from) {
    return std::chrono::duration<double>(now - from).count();
  };
  if (seconds) {
    times_.Add("window drawn", 1e3 * *seconds);
  }
  if (!opened_ && document.Map() != nullptr) {
    opened_ = since(start_);
  }
  if (document.run.active) {
    run_start_ = run_start_.value_or(now);
    run_seconds_ = since(*run_start_);
    run_frames_ += seconds ? 1 : 0;
    return;
  }
  const Timeline& timeline = document.timeline;
  if (timeline.Empty() || !document.shown) {
    return;
  }
  if (timeline.MomentAt(state.playback.time).frame_index != document.shown->frame_index) {
    wanted_ = wanted_.value_or(now);
  } else if (wanted_) {
    times_.Add("another frame on the screen", 1e3 * since(*wanted_));
    wanted_.reset();
  }
}

std::string FrameTiming::Text() const {
  std::string text;
  if (opened_) {
    text += fmt::format("first map on the screen after {:.0f} ms\n", 1e3 * *opened_);
  }
  for (const auto& [name, times] : times_.Summaries()) {
    text += fmt::format("{}: {} times, mean {:.1f} ms, 95 % within {:.1f} ms, longest {:.1f} ms\n", name,
                        times.count, times.mean, times.p95, times.max);
  }
  if (run_seconds_ > 0.0) {
    text += fmt::format("during the run: {:.1f} window frames per second\n", run_frames_ / run_seconds_);
  }
  return text;
}

}  // namespace sqslam::viewer
