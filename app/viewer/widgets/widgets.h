#pragma once

#include <imgui.h>

#include <Eigen/Core>
#include <algorithm>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/widgets/theme.h"

// The widgets that panels are made of.
namespace sqslam::viewer {

enum class Icon { kPlay, kPause, kBackward, kStepBack, kStepForward, kFirst, kLast, kStop };

// A square button with a drawn sign; `tip` is shown under the mouse. True when pressed.
bool IconButton(const char* id, Icon icon, const char* tip, bool on = false);

// A heading over a group of fields, and its letters alone.
void Heading(const char* text);
void Bold(const char* text);

// A section that can be folded, in the colour of fields: the accent is for what is selected. True while open.
bool Section(const char* name);

// "name  value" in two columns of a panel.
void Row(const char* name, const std::string& value);

// A square of a class's colour, on the line of the text that follows; hollow for what is not shown.
void Swatch(const Eigen::Vector3d& color, bool hollow = false);
ImU32 Packed(const Eigen::Vector3d& color, float alpha = 1.0F);

// Text under the mouse, wrapped; after the item that it explains.
void Tip(const char* text);

// A button with a tip; true when it was clicked.
bool Button(const char* label, const char* tip, ImVec2 size = ImVec2(0.0F, 0.0F));

// A button that stays pressed while `*on`; true when it was clicked.
bool Toggle(const char* label, bool* on, const char* tip);

// One of several, as toggles in a row; the index of the one that was clicked.
struct Option {
  const char* label;
  const char* tip;
};
std::optional<int> OneOf(std::initializer_list<Option> options, int current);

// One of several words in a list that opens; the index of the one that was chosen. `width`: ems; below 0:
// what is left beside the name.
std::optional<std::size_t> Choice(const char* name, const std::string& current,
                                  std::span<const std::string> words, float width);

// A number with a slider, or that is dragged (`low` = `high`: without limits); true while it changes.
bool Slide(const char* name, double& value, float low, float high, const char* format, float width = -8.5F);
bool Drag(const char* name, double& value, float speed, float low, float high, const char* format);

// Dim text, on one line or wrapped at the panel's width.
void Dim(const std::string& text);
void DimWrapped(const std::string& text);

// A line through points with a dark rim of `rim` pixels, closed or open.
void Stroke(const std::vector<ImVec2>& points, ImU32 color, float width, float rim, bool closed, ImU32 dark);

// A window in the middle, above all others: content() fills it. `width`: ems.
template <typename Content>
void Dialog(const char* title, float width, Content&& content, int flags = 0) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize();
  ImGui::SetNextWindowPos(ImVec2(0.5F * window.x, 0.5F * window.y), ImGuiCond_Always, ImVec2(0.5F, 0.5F));
  ImGui::SetNextWindowSize(ImVec2(std::min(width * em, 0.96F * window.x), 0.0F));
  ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetStyleColorVec4(ImGuiCol_PopupBg));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(1.6F * em, 1.2F * em));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0F);
  if (ImGui::Begin(title, nullptr,
                   flags | ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                       ImGuiWindowFlags_NoSavedSettings)) {
    content();
  }
  ImGui::End();
  ImGui::PopStyleVar(2);
  ImGui::PopStyleColor();
}

struct PlotLine {
  std::string name;
  ImU32 color = 0;
  std::vector<double> values;  // one for each x
};

struct Plot {
  std::string title;      // with its unit
  std::vector<double> x;  // rising
  std::vector<PlotLine> lines;
  std::string x_name;
  const char* format = "{:.3g}";                   // of values, as fmt
  std::optional<double> now;                       // x of what is shown now, marked
  std::optional<std::pair<double, double>> range;  // of values; otherwise what the lines need
};

// Draws a small chart across the panel; the value under the mouse is told. Returns the index of the x that
// was clicked.
std::optional<std::size_t> DrawPlot(const Palette& palette, const char* id, const Plot& plot, float height);

}  // namespace sqslam::viewer
