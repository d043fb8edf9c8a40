#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets.h"

namespace sqslam::viewer {
namespace {

std::string Clock(double seconds) {
  const int whole = static_cast<int>(std::max(0.0, seconds));
  return fmt::format("{}:{:04.1f}", whole / 60, std::max(0.0, seconds) - 60.0 * (whole / 60));
}

// One curve over the time axis.
struct Curve {
  std::string name;
  ImU32 color = 0;
  std::vector<double> times;  // seconds
  std::vector<double> values;

  double Max() const { return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end()); }
  // The newest value at a time; below 0: none.
  double At(double time) const {
    const auto after = std::upper_bound(times.begin(), times.end(), time + 1e-9);
    return after == times.begin() ? -1.0 : values[static_cast<std::size_t>(after - times.begin()) - 1];
  }
};

class TimelinePanel : public Panel {
 public:
  Place Where() const override { return Place::kBottom; }
  std::string Title() const override { return "Time"; }
  bool Wanted(const ViewerState& state) const override {
    return state.document.kind != Document::Kind::kNone && !state.document.timeline.Empty();
  }

  void Draw(ViewerState& state) override {
    if (state.run.active) {
      DrawRunControls(state);
    } else {
      DrawTransport(state);
    }
    DrawPlots(state);
  }

 private:
  static void DrawTransport(ViewerState& state) {
    Playback& playback = state.playback;
    const Timeline& timeline = state.document.timeline;
    if (IconButton("first", Icon::kFirst, "To the start (Home)")) {
      playback.playing = false;
      playback.time = timeline.Begin();
    }
    ImGui::SameLine();
    if (IconButton("back", Icon::kStepBack,
                   "Previous frame (Left); previous state of the map (Shift Left)")) {
      playback.Step(-1, timeline);
    }
    ImGui::SameLine();
    const bool backward = playback.playing && playback.speed < 0.0;
    if (IconButton("backward", backward ? Icon::kPause : Icon::kBackward, "Play backward (B)", backward)) {
      PlayBy(state, -1.0);
    }
    ImGui::SameLine();
    const bool forward = playback.playing && playback.speed > 0.0;
    if (IconButton("play", forward ? Icon::kPause : Icon::kPlay, "Play (Space)", forward)) {
      PlayBy(state, 1.0);
    }
    ImGui::SameLine();
    if (IconButton("forward", Icon::kStepForward,
                   "Next frame (Right); next state of the map (Shift Right)")) {
      playback.Step(1, timeline);
    }
    ImGui::SameLine();
    if (IconButton("last", Icon::kLast, "To the finished map (End)")) {
      playback.playing = false;
      playback.time = timeline.End();
    }
    ImGui::SameLine();
    DrawSpeed(playback);
    ImGui::SameLine();
    DrawTime(state);
  }

  // Plays in a direction, or stops what plays that way.
  static void PlayBy(ViewerState& state, double direction) {
    Playback& playback = state.playback;
    if (playback.playing && playback.speed * direction > 0.0) {
      playback.playing = false;
      return;
    }
    playback.playing = false;
    playback.speed = std::copysign(playback.speed, direction);
    playback.Toggle(state.document.timeline);
  }

  static void DrawSpeed(Playback& playback) {
    constexpr std::array<double, 8> kSpeeds = {0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0};
    ImGui::SetNextItemWidth(5.4F * ImGui::GetFontSize());
    if (ImGui::BeginCombo("##speed", fmt::format("{:g}\u00d7", std::abs(playback.speed)).c_str())) {
      for (const double speed : kSpeeds) {
        if (ImGui::Selectable(fmt::format("{:g}\u00d7", speed).c_str(), speed == std::abs(playback.speed))) {
          playback.speed = std::copysign(speed, playback.speed);
        }
      }
      ImGui::EndCombo();
    }
    Tip("Speed of playing, against that of the camera");
  }

  static void DrawTime(const ViewerState& state) {
    const Timeline& timeline = state.document.timeline;
    const double time = state.playback.time;
    const Moment& moment = timeline.moments[static_cast<std::size_t>(std::max(0, timeline.At(time)))];
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(
        fmt::format("{} / {}", Clock(time - timeline.Begin()), Clock(timeline.End() - timeline.Begin()))
            .c_str());
    ImGui::SameLine(0.0F, 1.6F * ImGui::GetFontSize());
    ImGui::TextDisabled("frame %lld of %lld    state %d of %d of the map",
                        static_cast<long long>(moment.frame_index),
                        static_cast<long long>(timeline.moments.back().frame_index), moment.snapshot + 1,
                        timeline.moments.back().snapshot + 1);
  }

  static void DrawRunControls(ViewerState& state) {
    using What = RunRequestChange::What;
    RunStatus& run = state.run;
    if (IconButton("pause", run.paused ? Icon::kPlay : Icon::kPause,
                   run.paused ? "Go on (Space)" : "Pause the run (Space)", run.paused)) {
      state.Ask(RunRequestChange{run.paused ? What::kContinue : What::kPause});
    }
    ImGui::SameLine();
    if (IconButton("step", Icon::kStepForward, "One frame, then pause (Right)")) {
      state.Ask(RunRequestChange{What::kStep});
    }
    ImGui::SameLine();
    if (IconButton("end", Icon::kStop, "End the run here and save it")) {
      state.Ask(RunRequestChange{What::kEnd});
    }
    ImGui::SameLine();
    constexpr std::array<double, 6> kRates = {0.0, 60.0, 30.0, 15.0, 5.0, 1.0};
    const auto name = [](double rate) {
      return rate > 0.0 ? fmt::format("{:g} frames/s", rate) : std::string("full speed");
    };
    ImGui::SetNextItemWidth(9.0F * ImGui::GetFontSize());
    if (ImGui::BeginCombo("##rate", name(run.max_rate).c_str())) {
      for (const double rate : kRates) {
        if (ImGui::Selectable(name(rate).c_str(), rate == run.max_rate)) {
          run.max_rate = rate;
        }
      }
      ImGui::EndCombo();
    }
    Tip("How fast the images are taken at most");
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    const std::string of = run.total > 0 ? fmt::format(" of {}", run.total) : "";
    ImGui::TextUnformatted(fmt::format("frame {}{}", run.frames, of).c_str());
    ImGui::SameLine(0.0F, 1.6F * ImGui::GetFontSize());
    ImGui::TextDisabled("%s", run.ending ? "saving the map ..." : run.paused ? "paused" : run.state.c_str());
  }

  static std::vector<Curve> CurvesOf(const ViewerState& state) {
    const Palette& palette = PaletteOf(state.theme);
    const auto of_summaries = [&](const char* name, ImU32 color, int SnapshotSummary::*field) {
      Curve curve{name, color, {}, {}};
      for (const SnapshotSummary& summary : state.document.timeline.summaries) {
        curve.times.push_back(summary.timestamp);
        curve.values.push_back(summary.*field);
      }
      return curve;
    };
    std::vector<Curve> curves = {
        of_summaries("points in view", palette.plot_a, &SnapshotSummary::seen_points),
        of_summaries("objects", palette.plot_b, &SnapshotSummary::objects)};
    if (!state.run.tracking_ms.empty()) {
      Curve timing{"tracking, ms", palette.plot_c, state.run.frame_times, {}};
      timing.values.assign(state.run.tracking_ms.begin(), state.run.tracking_ms.end());
      curves.push_back(std::move(timing));
    } else {
      curves.push_back(of_summaries("points", palette.plot_c, &SnapshotSummary::points));
    }
    return curves;
  }

  void DrawPlots(ViewerState& state) {
    const ImVec2 place = ImGui::GetContentRegionAvail();
    const Timeline& timeline = state.document.timeline;
    const float em = ImGui::GetFontSize();
    if (place.y < 1.5F * em || place.x < 10.0F * em) {
      return;
    }
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const float left = corner.x + 9.5F * em;  // the names of the curves stand there
    const float right = corner.x + place.x - 0.5F * em;
    const double begin = timeline.Begin();
    const double length = std::max(timeline.End() - begin, 1e-6);
    const auto x_of = [&](double time) {
      return left + static_cast<float>((time - begin) / length) * (right - left);
    };
    ImGui::SetCursorScreenPos(ImVec2(left - 4.0F, corner.y));
    ImGui::InvisibleButton("axis", ImVec2(right - left + 8.0F, place.y));
    const bool hovered = ImGui::IsItemHovered();
    if (ImGui::IsItemActive() && !state.run.active) {
      const double share = (ImGui::GetIO().MousePos.x - left) / std::max(right - left, 1.0F);
      state.playback.playing = false;
      state.playback.time = begin + std::clamp(share, 0.0, 1.0) * length;
    }
    const float axis = 0.9F * em;  // height of the marks below the curves
    const std::vector<Curve> curves = CurvesOf(state);
    const float height = (place.y - axis) / static_cast<float>(curves.size());
    ImDrawList* list = ImGui::GetWindowDrawList();
    const double now = state.run.active ? timeline.End() : state.playback.time;
    for (std::size_t i = 0; i < curves.size(); ++i) {
      const float top = corner.y + static_cast<float>(i) * height;
      DrawCurve(state, curves[i], ImVec2(left, top + 2.0F), ImVec2(right, top + height - 2.0F), x_of, now,
                corner.x);
    }
    const Palette& palette = PaletteOf(state.theme);
    for (const double time : timeline.keyframes) {
      const float x = x_of(time);
      list->AddLine(ImVec2(x, corner.y + place.y - axis + 2.0F), ImVec2(x, corner.y + place.y - 2.0F),
                    palette.dim_text, 1.0F);
    }
    list->AddText(ImVec2(corner.x, corner.y + place.y - axis - 0.12F * em), palette.dim_text, "keyframes");
    const float x = std::floor(x_of(now)) + 0.5F;
    list->AddLine(ImVec2(x, corner.y), ImVec2(x, corner.y + place.y), palette.accent, 2.0F);
    list->AddTriangleFilled(ImVec2(x - 5.0F, corner.y), ImVec2(x + 5.0F, corner.y),
                            ImVec2(x, corner.y + 7.0F), palette.accent);
    if (hovered && !state.run.active) {
      DrawPointer(state, curves, begin + (ImGui::GetIO().MousePos.x - left) / (right - left) * length);
    }
  }

  static void DrawCurve(const ViewerState& state, const Curve& curve, ImVec2 low, ImVec2 high,
                        const std::function<float(double)>& x_of, double now, float names) {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const Palette& palette = PaletteOf(state.theme);
    const float em = ImGui::GetFontSize();
    list->AddRectFilled(low, high, ImGui::GetColorU32(ImGuiCol_FrameBg, 0.55F), 3.0F);
    const double value = curve.At(now);
    const float y = 0.5F * (low.y + high.y) - 0.5F * em;
    list->AddRectFilled(ImVec2(names, y + 0.2F * em), ImVec2(names + 3.0F, y + 0.9F * em), curve.color);
    list->AddText(ImVec2(names + 8.0F, y), palette.dim_text, curve.name.c_str());
    if (value >= 0.0) {
      const std::string text = fmt::format("{:.0f}", value);
      list->AddText(ImVec2(low.x - 0.6F * em - ImGui::CalcTextSize(text.c_str()).x, y), palette.text,
                    text.c_str());
    }
    const double top = std::max(curve.Max() * 1.08, 1.0);
    std::vector<ImVec2> points;
    for (std::size_t i = 0; i < curve.times.size() && i < curve.values.size(); ++i) {
      const float x = x_of(curve.times[i]);
      const float at = high.y - 1.0F - static_cast<float>(curve.values[i] / top) * (high.y - low.y - 2.0F);
      if (!points.empty()) {
        points.emplace_back(x, points.back().y);  // a value holds until the next
      }
      points.emplace_back(x, at);
    }
    list->AddPolyline(points.data(), static_cast<int>(points.size()), curve.color, 0, 1.5F);
  }

  static void DrawPointer(const ViewerState& state, const std::vector<Curve>& curves, double time) {
    const Timeline& timeline = state.document.timeline;
    const int at = timeline.At(time);
    ImGui::BeginTooltip();
    ImGui::Text("%s   frame %lld", Clock(time - timeline.Begin()).c_str(),
                static_cast<long long>(timeline.moments[static_cast<std::size_t>(at)].frame_index));
    for (const Curve& curve : curves) {
      if (const double value = curve.At(time); value >= 0.0) {
        ImGui::TextDisabled("%s  %.0f", curve.name.c_str(), value);
      }
    }
    ImGui::EndTooltip();
  }
};

}  // namespace

PanelPtr MakeTimelinePanel() { return std::make_unique<TimelinePanel>(); }

}  // namespace sqslam::viewer
