#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {
namespace {

std::string Clock(double seconds) {
  const int whole = static_cast<int>(std::max(0.0, seconds));
  return fmt::format("{}:{:04.1f}", whole / 60, std::max(0.0, seconds) - 60.0 * (whole / 60));
}

// A curve over the time axis.
struct Curve {
  const Series* series = nullptr;
  ImU32 color = 0;

  std::string Name() const {
    return series->unit.empty() ? series->name : fmt::format("{}, {}", series->name, series->unit);
  }
};

std::string ValueText(const Series& series, double value) {
  return fmt::format("{:.{}f}", value, series.unit.empty() || value >= 100.0 ? 0 : 1);
}

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

  // What older recordings do not hold has no curve.
  static std::vector<Curve> CurvesOf(const ViewerState& state) {
    const Palette& palette = PaletteOf(state.theme);
    const RunSeries& series = state.document.timeline.series;
    std::vector<Curve> curves;
    const Series& tracked = series.Named("tracked points");
    curves.push_back({tracked.HasValues() ? &tracked : &series.Named("map points"), palette.plot_a});
    curves.push_back({&series.Named("objects"), palette.plot_b});
    const Series& timing = series.Named("tracking");
    curves.push_back({timing.HasValues() ? &timing : &series.Named("keyframes"), palette.plot_c});
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
    const float left = corner.x + 11.0F * em;  // the names of the curves stand there
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
    DrawMarks(state, corner.x, ImVec2(left, corner.y), ImVec2(right, corner.y + place.y), axis, x_of);
    const Palette& palette = PaletteOf(state.theme);
    const float x = std::floor(x_of(now)) + 0.5F;
    list->AddLine(ImVec2(x, corner.y), ImVec2(x, corner.y + place.y), palette.accent, 2.0F);
    list->AddTriangleFilled(ImVec2(x - 5.0F, corner.y), ImVec2(x + 5.0F, corner.y),
                            ImVec2(x, corner.y + 7.0F), palette.accent);
    if (hovered && !state.run.active) {
      const double per_pixel = length / std::max(right - left, 1.0F);
      DrawPointer(state, curves, begin + (ImGui::GetIO().MousePos.x - left) * per_pixel, 5.0 * per_pixel);
    }
  }

  // Keyframes as ticks; what else happened as a line through all curves, with its name under the mouse.
  static void DrawMarks(const ViewerState& state, float names, ImVec2 low, ImVec2 high, float axis,
                        const std::function<float(double)>& x_of) {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const Palette& palette = PaletteOf(state.theme);
    const float em = ImGui::GetFontSize();
    list->AddText(ImVec2(names, high.y - axis - 0.12F * em), palette.dim_text, "keyframes");
    for (const RunMark& mark : state.document.timeline.series.Marks()) {
      const float x = x_of(mark.timestamp);
      if (x < low.x || x > high.x) {
        continue;
      }
      if (mark.kind == RunMark::Kind::kKeyframe) {
        list->AddLine(ImVec2(x, high.y - axis + 2.0F), ImVec2(x, high.y - 2.0F), palette.dim_text, 1.0F);
        continue;
      }
      const bool bad = mark.kind == RunMark::Kind::kLost;
      const ImU32 color = bad ? palette.bad : palette.good;
      list->AddLine(ImVec2(x, low.y), ImVec2(x, high.y), color, 1.5F);
      list->AddRectFilled(ImVec2(x - 3.5F, high.y - axis), ImVec2(x + 3.5F, high.y - axis + 7.0F), color,
                          1.5F);
    }
  }

  static void DrawCurve(const ViewerState& state, const Curve& curve, ImVec2 low, ImVec2 high,
                        const std::function<float(double)>& x_of, double now, float names) {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const Palette& palette = PaletteOf(state.theme);
    const float em = ImGui::GetFontSize();
    list->AddRectFilled(low, high, ImGui::GetColorU32(ImGuiCol_FrameBg, 0.55F), 3.0F);
    const float y = 0.5F * (low.y + high.y) - 0.5F * em;
    list->AddRectFilled(ImVec2(names, y + 0.2F * em), ImVec2(names + 3.0F, y + 0.9F * em), curve.color);
    list->AddText(ImVec2(names + 8.0F, y), palette.dim_text, curve.Name().c_str());
    if (const auto value = ValueAt(state, *curve.series, now)) {
      const std::string text = ValueText(*curve.series, *value);
      list->AddText(ImVec2(low.x - 0.6F * em - ImGui::CalcTextSize(text.c_str()).x, y), palette.text,
                    text.c_str());
    }
    const double top = std::max(curve.series->Range().second * 1.08, 1.0);
    std::vector<ImVec2> points;
    const auto stroke = [&] {
      list->AddPolyline(points.data(), static_cast<int>(points.size()), curve.color, 0, 1.5F);
      points.clear();
    };
    for (std::size_t i = 0; i < curve.series->time.size(); ++i) {
      if (!curve.series->value[i]) {
        stroke();
        continue;
      }
      const float x = x_of(curve.series->time[i]);
      const float at =
          high.y - 1.5F - static_cast<float>(*curve.series->value[i] / top) * (high.y - low.y - 3.0F);
      if (points.size() >= 2 && points.back().y == at && points[points.size() - 2].y == at) {
        points.back().x = x;  // a longer level piece, not one more: their ends would thicken it
      } else {
        points.emplace_back(x, at);
      }
    }
    stroke();
  }

  static std::optional<double> ValueAt(const ViewerState& state, const Series& series, double time) {
    const Timeline& timeline = state.document.timeline;
    const int at = timeline.At(time);
    return at < 0
               ? std::nullopt
               : series.At(static_cast<double>(timeline.moments[static_cast<std::size_t>(at)].frame_index));
  }

  static void DrawPointer(const ViewerState& state, const std::vector<Curve>& curves, double time,
                          double reach) {
    const Timeline& timeline = state.document.timeline;
    const int at = timeline.At(time);
    ImGui::BeginTooltip();
    ImGui::Text("%s   frame %lld", Clock(time - timeline.Begin()).c_str(),
                static_cast<long long>(timeline.moments[static_cast<std::size_t>(at)].frame_index));
    for (const Curve& curve : curves) {
      if (const auto value = ValueAt(state, *curve.series, time)) {
        ImGui::TextDisabled("%s  %s", curve.Name().c_str(), ValueText(*curve.series, *value).c_str());
      }
    }
    for (const RunMark& mark : timeline.series.Marks()) {
      if (mark.kind != RunMark::Kind::kKeyframe && std::abs(mark.timestamp - time) <= reach) {
        ImGui::TextUnformatted(std::string(MarkName(mark.kind)).c_str());
      }
    }
    ImGui::EndTooltip();
  }
};

}  // namespace

PanelPtr MakeTimelinePanel() { return std::make_unique<TimelinePanel>(); }

}  // namespace sqslam::viewer
