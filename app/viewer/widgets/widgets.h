#pragma once

#include <imgui.h>
#include <imgui_internal.h>  // arithmetic of ImVec2
#include <imgui_stdlib.h>

#include <Eigen/Core>
#include <algorithm>
#include <initializer_list>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/model/viewer_settings.h"

// Theme and widgets of the panels. Panels draw everything that can be clicked with these widgets, which
// report their labels: scripts click on them by name.
namespace sqslam::viewer {

// A label in the window.
struct ShownLabel {
  std::string text;
  ImVec2 center;  // of the widget that it names, pixels
};

// The labels drawn since the frame began; those scrolled out of sight are left out. The viewer owns the list
// and gives it to ImGui as UserData.
std::vector<ShownLabel>& ShownLabels();

// Add a label around `center`, and one for ImGui's last item.
void ReportLabel(const std::string& text, ImVec2 center);
void ReportItem(const std::string& text);

// Loads DejaVu Sans, regular and bold, or else ImGui's own font. `scale`: window pixels per layout pixel.
void LoadFonts(double scale);

// Sets colours, paddings and roundings.
void ApplyTheme(Theme theme, double scale);

// Colours that ImGui's style has no name for.
struct Palette {
  ImU32 accent;  // selection, position on the timeline
  ImU32 text;
  ImU32 dim_text;
  ImU32 good, bad;  // states, in addition to a word or a shape
  ImU32 plot_a, plot_b, plot_c;
  ImU32 surface;  // of cards over the scene
};
const Palette& PaletteOf(Theme theme);

enum class Icon { kPlay, kPause, kBackward, kStepBack, kStepForward, kFirst, kLast, kStop };

// A square button with an icon and a tooltip `tip`; true when pressed.
bool IconButton(const char* id, Icon icon, const char* tip, bool on = false);

// A heading over a group of fields, and just its bold text.
void Heading(const char* text);
void Bold(const char* text);

// A collapsible section, in the colour of fields: the accent is for the selection. True while open.
bool Section(const char* name);

// Draws "name  value" in two columns of a panel.
void Row(const char* name, const std::string& value);

// A square in the colour of a class, on the line of the text after it; hollow if hidden.
void Swatch(const Eigen::Vector3d& color, bool hollow = false);
ImU32 Packed(const Eigen::Vector3d& color, float alpha = 1.0F);

// A wrapped tooltip; call after the item that it explains.
void Tip(const char* text);

// ImGui's widgets with a tooltip; true when clicked.
bool Button(const char* label, const char* tip = "", ImVec2 size = ImVec2(0.0F, 0.0F));
bool SmallButton(const char* label);
bool Checkbox(const char* label, bool& on, const char* tip = "");
bool Selectable(const std::string& label, bool selected = false, int flags = 0, float width = 0.0F);

// A button that stays pressed while `on`; true when clicked.
bool Toggle(const char* label, bool& on, const char* tip, float width = 0.0F);

// A row of toggles, one for each value of an enum or a bool; the one of `value` is on. True when it changes.
struct Option {
  const char* label;
  const char* tip;
};
template <typename Value>
bool OneOf(std::initializer_list<Option> options, Value& value) {
  bool changed = false;
  int index = 0;
  for (const Option& option : options) {
    if (index > 0) {
      ImGui::SameLine();
    }
    bool on = index == static_cast<int>(value);
    if (Toggle(option.label, on, option.tip)) {
      value = static_cast<Value>(index);
      changed = true;
    }
    ++index;
  }
  return changed;
}

// A drop-down list, true while it is open (then ImGui::EndCombo() must be called), and one of words, true
// when another one is chosen. `width`: ems; below 0: the space left to the name.
bool BeginCombo(const char* name, const std::string& shown, float width);
bool Choice(const char* name, std::string& current, std::span<const std::string> words, float width);

// A menu, filled by content(), and an item in it; true when clicked.
void Menu(const char* label, auto&& content, bool enabled = true) {
  ReportLabel(label, ImGui::GetCursorScreenPos() + ImGui::CalcTextSize(label) * 0.5F);
  if (ImGui::BeginMenu(label, enabled)) {
    content();
    ImGui::EndMenu();
  }
}
bool MenuItem(const std::string& label, const char* keys = nullptr, bool checked = false,
              bool enabled = true);

// A number with a slider, or numbers in a row to drag (`low` = `high`: no limits); true while they change.
bool Slide(const char* name, double& value, double low, double high, const char* format, float width = -8.5F);
bool Drag(const char* name, std::span<double> values, float speed, double low, double high,
          const char* format);

// Dim text: on one line, wrapped at the panel's width, or before the widget that follows on its line.
void Dim(const std::string& text);
void DimWrapped(const std::string& text);
void Label(const std::string& text, float width = 0.0F);  // ems; 0: as wide as the text

// A text field on its own line after its name; true when it was changed and then left.
bool Field(const char* name, std::string& text, int flags = 0);

// Converts numbers to ImVec2.
template <typename X, typename Y>
ImVec2 Vec(X x, Y y) {
  return {static_cast<float>(x), static_cast<float>(y)};
}

// A filled square around `center`, and a line through points, in the present window.
void Square(ImVec2 center, float half_side, ImU32 color, float rounding = 0.0F);
void Line(const std::vector<ImVec2>& points, ImU32 color, float width, bool closed = false);

// A line through points with a dark rim of `rim` pixels, closed or open.
void Stroke(const std::vector<ImVec2>& points, ImU32 color, float width, float rim, bool closed, ImU32 dark);

// A centred window above all others, filled by content(). `width`: ems.
void Dialog(const char* title, float width, auto&& content, int flags = 0) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize();
  ImGui::SetNextWindowPos(window * 0.5F, ImGuiCond_Always, ImVec2(0.5F, 0.5F));
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
  std::vector<double> x;  // ascending
  std::vector<PlotLine> lines;
  std::string x_name;
  const char* format = "{:.3g}";                   // of values, for fmt
  std::optional<double> now;                       // x marked as the present
  std::optional<std::pair<double, double>> range;  // of values; default: fits the lines
};

// Draws a small chart across the panel, with the values under the mouse. Returns the index of the x clicked.
std::optional<std::size_t> DrawPlot(const Palette& palette, const char* id, const Plot& plot, float height);

// Converts the name of an OpenGL texture for ImGui.
ImTextureID TextureId(unsigned name);

// An image in a texture of the current OpenGL context.
class GlTexture {
 public:
  GlTexture() = default;
  ~GlTexture();
  GlTexture(const GlTexture&) = delete;
  GlTexture& operator=(const GlTexture&) = delete;

  void Upload(const cv::Mat& image);  // 8UC3 or 8UC4, BGR; empty: none
  ImTextureID Id() const;             // null: none

 private:
  unsigned name_ = 0;
};

// Returns a part of the current framebuffer, which is `size` pixels large: 8UC3 BGR, top row first.
cv::Mat ReadFramebuffer(cv::Size size, const cv::Rect& part);
inline cv::Mat ReadFramebuffer(cv::Size size) { return ReadFramebuffer(size, {cv::Point(), size}); }

}  // namespace sqslam::viewer
