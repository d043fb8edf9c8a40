#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "slam/util/text_lines.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace {

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
  explicit TimelinePanel(ViewerState& s) : Panel(Place::kBottom, "Time", s) {}
  bool Wanted() const override { return !document_.timeline.Empty(); }

  void Draw() override {
    if (document_.run.active) {
      DrawRunControls();
    } else {
      DrawTransport();
    }
    DrawPlots();
  }

 private:
  void DrawTransport() {
    OnPress("first", Icon::kFirst, "To the start (Home)", [&] { playback_.JumpTo(timeline_.Begin()); });
    OnPress("back", Icon::kStepBack, "Previous frame (Left); previous state of the map (Shift Left)",
            [&] { playback_.Step(-1, timeline_); });
    const bool backward = playback_.Plays(-1.0);
    OnPress(
        "backward", backward ? Icon::kPause : Icon::kBackward, "Play backward (B)",
        [&] { playback_.Toggle(-1.0, timeline_); }, backward);
    const bool forward = playback_.Plays(1.0);
    OnPress(
        "play", forward ? Icon::kPause : Icon::kPlay, "Play (Space)",
        [&] { playback_.Toggle(1.0, timeline_); }, forward);
    OnPress("forward", Icon::kStepForward, "Next frame (Right); next state of the map (Shift Right)",
            [&] { playback_.Step(1, timeline_); });
    OnPress("last", Icon::kLast, "To the finished map (End)", [&] { playback_.JumpTo(timeline_.End()); });
    const auto name = [](double speed) { return fmt::format("{:g}\u00d7", std::abs(speed)); };
    if (const auto speed =
            NumberChoice("##speed", playback_.speed, {0.1, 0.25, 0.5, 1, 2, 4, 8, 16}, name, 5.4F)) {
      playback_.speed = std::copysign(*speed, playback_.speed);
    }
    Tip("Speed of playing, against that of the camera");
    ImGui::SameLine();
    DrawTime();
  }

  // A button in the row, with an icon and an action.
  static void OnPress(const char* id, Icon icon, const char* tip, auto action, bool on = false) {
    if (IconButton(id, icon, tip, on)) {
      action();
    }
    ImGui::SameLine();
  }

  // A drop-down list of numbers, shown by name(); returns the one chosen.
  static std::optional<double> NumberChoice(const char* id, double current,
                                            const std::vector<double>& numbers, auto name, float width) {
    std::string text = name(current);
    const bool chosen = Choice(id, text, ToVector(numbers, name), width);
    return chosen ? std::optional(*std::ranges::find(numbers, text, name)) : std::nullopt;
  }

  void DrawTime() const {
    const double begin = timeline_.Begin();
    const Moment& moment = timeline_.MomentAt(playback_.time);
    const Moment& last = timeline_.moments.back();
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(
        fmt::format("{} / {}", ClockText(playback_.time - begin), ClockText(timeline_.End() - begin))
            .c_str());
    ImGui::SameLine(0.0F, 1.6F * ImGui::GetFontSize());
    Dim(fmt::format("frame {} of {}    state {} of {} of the map", moment.frame_index, last.frame_index,
                    moment.snapshot + 1, last.snapshot + 1));
  }

  void DrawRunControls() {
    using Command = RunControl::Command;
    const RunStatus& run = document_.run;
    const auto ask = [this](Command command) {
      return [this, command] { requests_.push_back(RunControl{command}); };
    };
    OnPress("pause", run.paused ? Icon::kPlay : Icon::kPause,
            run.paused ? "Go on (Space)" : "Pause the run (Space)",
            ask(run.paused ? Command::kContinue : Command::kPause), run.paused);
    OnPress("step", Icon::kStepForward, "One frame, then pause (Right)", ask(Command::kStep));
    OnPress("end", Icon::kStop, "End the run here and save it", ask(Command::kEnd));
    const auto name = [](double rate) {
      return rate > 0.0 ? fmt::format("{:g} frames/s", rate) : std::string("full speed");
    };
    if (const auto rate = NumberChoice("##rate", run.max_rate, {0, 60, 30, 15, 5, 1}, name, 9.0F)) {
      requests_.push_back(RunControl{Command::kRate, *rate});
    }
    Tip("How fast the images are taken at most");
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    const std::string of = run.total > 0 ? fmt::format(" of {}", run.total) : "";
    ImGui::TextUnformatted(fmt::format("frame {}{}", run.frames, of).c_str());
    ImGui::SameLine(0.0F, 1.6F * ImGui::GetFontSize());
    Dim(run.ending ? "saving the map ..." : run.paused ? "paused" : run.state);
  }

  // Returns the curves; values that older recordings lack are replaced by others.
  std::vector<Curve> Curves() const {
    const Palette& palette = PaletteOf(window_.settings.theme);
    const RunSeries& series = timeline_.series;
    const Series& tracked = series.Named("tracked points");
    const Series& timing = series.Named("tracking");
    return {{tracked.HasValues() ? &tracked : &series.Named("map points"), palette.plot_a},
            {&series.Named("objects"), palette.plot_b},
            {timing.HasValues() ? &timing : &series.Named("keyframes"), palette.plot_c}};
  }

  // Position of the curves on the screen.
  struct Axes {
    ImVec2 low, high;                  // corners of all curves and marks
    float names = 0.0F;                // left edge of the names
    float marks = 0.0F;                // height of the marks below the curves
    double begin = 0.0, length = 1.0;  // seconds

    float X(double time) const {
      return low.x + static_cast<float>((time - begin) / length) * (high.x - low.x);
    }
    double TimeAt(float x) const { return begin + (x - low.x) / std::max(high.x - low.x, 1.0F) * length; }
  };

  void DrawPlots() {
    const ImVec2 room = ImGui::GetContentRegionAvail();
    const float em = ImGui::GetFontSize();
    if (room.y < 1.5F * em || room.x < 10.0F * em) {
      return;
    }
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const Axes axes{.low = ImVec2(corner.x + 11.0F * em, corner.y),
                    .high = ImVec2(corner.x + room.x - 0.5F * em, corner.y + room.y),
                    .names = corner.x,
                    .marks = 0.9F * em,
                    .begin = timeline_.Begin(),
                    .length = std::max(timeline_.End() - timeline_.Begin(), 1e-6)};
    ImGui::SetCursorScreenPos(ImVec2(axes.low.x - 4.0F, corner.y));
    ImGui::InvisibleButton("axis", ImVec2(axes.high.x - axes.low.x + 8.0F, room.y));
    const bool hovered = ImGui::IsItemHovered();
    const float mouse = ImGui::GetIO().MousePos.x;
    if (ImGui::IsItemActive() && !document_.run.active) {
      playback_.JumpTo(std::clamp(axes.TimeAt(mouse), axes.begin, axes.begin + axes.length));
    }
    const double now = document_.run.active ? timeline_.End() : playback_.time;
    const std::vector<Curve> curves = Curves();
    const float height = (room.y - axes.marks) / static_cast<float>(curves.size());
    for (std::size_t i = 0; i < curves.size(); ++i) {
      const float top = corner.y + static_cast<float>(i) * height;
      DrawCurve(curves[i], axes, top + 2.0F, top + height - 2.0F, now);
    }
    DrawGaps(axes);
    DrawMarks(axes);
    const ImU32 accent = PaletteOf(window_.settings.theme).accent;
    const float x = std::floor(axes.X(now)) + 0.5F;
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->AddLine(ImVec2(x, axes.low.y), ImVec2(x, axes.high.y), accent, 2.0F);
    const ImVec2 tip(x, axes.low.y + 7.0F);
    list->AddTriangleFilled(tip + ImVec2(-5.0F, -7.0F), tip + ImVec2(5.0F, -7.0F), tip, accent);
    if (hovered && !document_.run.active) {
      DrawPointer(curves, axes.TimeAt(mouse), axes.TimeAt(mouse + 5.0F) - axes.TimeAt(mouse));
    }
  }

  // Draws a name beside the axis.
  void DrawLabel(const std::string& text, ImVec2 at) const {
    ImGui::GetWindowDrawList()->AddText(at, PaletteOf(window_.settings.theme).dim_text, text.c_str());
    ReportLabel(text, at + ImGui::CalcTextSize(text.c_str()) * 0.5F);
  }

  // Interrupts the axis where the camera has no pose in the map.
  void DrawGaps(const Axes& axes) const {
    ImDrawList* list = ImGui::GetWindowDrawList();
    for (const auto& [begin, end] : timeline_.Gaps()) {
      const float left = axes.X(begin), right = std::max(axes.X(end), left + 2.0F);
      list->AddRectFilled(ImVec2(left, axes.low.y), ImVec2(right, axes.high.y),
                          ImGui::GetColorU32(ImGuiCol_WindowBg));
      list->AddRectFilled(ImVec2(left, axes.high.y - axes.marks), ImVec2(right, axes.high.y - 2.0F),
                          PaletteOf(window_.settings.theme).bad);
    }
  }

  // Draws keyframes as ticks, other events as lines through all curves.
  void DrawMarks(const Axes& axes) const {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const Palette& palette = PaletteOf(window_.settings.theme);
    const float top = axes.high.y - axes.marks;
    DrawLabel("keyframes", ImVec2(axes.names, top - 0.12F * ImGui::GetFontSize()));
    for (const RunMark& mark : timeline_.series.Marks()) {
      const float x = axes.X(mark.timestamp);
      if (x < axes.low.x || x > axes.high.x) {
        continue;
      }
      if (mark.kind == RunMark::Kind::kKeyframe) {
        list->AddLine(ImVec2(x, top + 2.0F), ImVec2(x, axes.high.y - 2.0F), palette.dim_text, 1.0F);
        continue;
      }
      const ImU32 color = mark.kind == RunMark::Kind::kLost ? palette.bad : palette.good;
      list->AddLine(ImVec2(x, axes.low.y), ImVec2(x, axes.high.y), color, 1.5F);
      list->AddRectFilled(ImVec2(x - 3.5F, top), ImVec2(x + 3.5F, top + 7.0F), color, 1.5F);
    }
  }

  void DrawCurve(const Curve& curve, const Axes& axes, float top, float bottom, double now) const {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const Palette& palette = PaletteOf(window_.settings.theme);
    const float em = ImGui::GetFontSize();
    list->AddRectFilled(ImVec2(axes.low.x, top), ImVec2(axes.high.x, bottom),
                        ImGui::GetColorU32(ImGuiCol_FrameBg, 0.55F), 3.0F);
    const float y = 0.5F * (top + bottom) - 0.5F * em;
    list->AddRectFilled(ImVec2(axes.names, y + 0.2F * em), ImVec2(axes.names + 3.0F, y + 0.9F * em),
                        curve.color);
    DrawLabel(curve.Name(), ImVec2(axes.names + 8.0F, y));
    if (const auto value = ValueAt(*curve.series, now)) {
      const std::string text = ValueText(*curve.series, *value);
      list->AddText(ImVec2(axes.low.x - 0.6F * em - ImGui::CalcTextSize(text.c_str()).x, y), palette.text,
                    text.c_str());
    }
    const double most = std::max(curve.series->Range().second * 1.08, 1.0);
    std::vector<ImVec2> points;
    const auto stroke = [&] {
      Line(points, curve.color, 1.5F);
      points.clear();
    };
    for (std::size_t i = 0; i < curve.series->time.size(); ++i) {
      if (!curve.series->value[i]) {
        stroke();
        continue;
      }
      const float x = axes.X(curve.series->time[i]);
      const float at =
          bottom - 1.5F - static_cast<float>(*curve.series->value[i] / most) * (bottom - top - 3.0F);
      if (points.size() >= 2 && points.back().y == at && points[points.size() - 2].y == at) {
        points.back().x = x;  // extends a level segment: joints would thicken the line
      } else {
        points.emplace_back(x, at);
      }
    }
    stroke();
  }

  std::optional<double> ValueAt(const Series& series, double time) const {
    return series.At(static_cast<double>(timeline_.MomentAt(time).frame_index));
  }

  void DrawPointer(const std::vector<Curve>& curves, double time, double reach) const {
    ImGui::BeginTooltip();
    ImGui::TextUnformatted(fmt::format("{}   frame {}", ClockText(time - timeline_.Begin()),
                                       timeline_.MomentAt(time).frame_index)
                               .c_str());
    for (const Curve& curve : curves) {
      if (const auto value = ValueAt(*curve.series, time)) {
        Dim(curve.Name() + "  " + ValueText(*curve.series, *value));
      }
    }
    if (!timeline_.MomentAt(time).tracked) {
      ImGui::TextUnformatted("no place in the map: tracking was lost, or a submap was never joined");
    }
    for (const RunMark& mark : timeline_.series.Marks()) {
      if (mark.kind != RunMark::Kind::kKeyframe && std::abs(mark.timestamp - time) <= reach) {
        ImGui::TextUnformatted(NameOf(mark.kind));
      }
    }
    ImGui::EndTooltip();
  }

  const Timeline& timeline_ = document_.timeline;
};

}  // namespace

PanelPtr MakeTimelinePanel(ViewerState& s) { return std::make_unique<TimelinePanel>(s); }

}  // namespace sqslam::viewer
