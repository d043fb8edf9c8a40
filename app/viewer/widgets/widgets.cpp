#include "app/viewer/widgets/widgets.h"

#include <fmt/format.h>

#include <cmath>

namespace sqslam::viewer {
namespace {

// Draws an icon of about `s` pixels around `c`.
void DrawIcon(Icon icon, ImVec2 c, float s, ImU32 color) {
  ImDrawList* list = ImGui::GetWindowDrawList();
  const auto triangle = [&](float x, float size, float direction) {  // points right (1) or left (-1)
    const ImVec2 at = c + ImVec2(x * s * direction, 0.0F);
    const ImVec2 half(0.5F * size * s * direction, 0.58F * size * s);
    list->AddTriangleFilled(at - half, at + ImVec2(half.x, 0.0F), at + ImVec2(-half.x, half.y), color);
  };
  const auto bar = [&](float x, float width, float height) {
    const ImVec2 at = c + ImVec2(x * s, 0.0F);
    const ImVec2 half(0.5F * width * s, 0.5F * height * s);
    list->AddRectFilled(at - half, at + half, color, 1.0F);
  };
  const bool back = icon == Icon::kBackward || icon == Icon::kStepBack || icon == Icon::kFirst;
  const float d = back ? -1.0F : 1.0F;
  switch (icon) {
    case Icon::kPlay:
    case Icon::kBackward:
      triangle(0.06F, 1.0F, d);
      break;
    case Icon::kPause:
      bar(-0.25F, 0.26F, 1.05F);
      bar(0.25F, 0.26F, 1.05F);
      break;
    case Icon::kStop:
      bar(0.0F, 0.95F, 0.95F);
      break;
    case Icon::kStepForward:
    case Icon::kStepBack:
      triangle(-0.12F, 0.8F, d);
      bar(0.4F * d, 0.18F, 0.95F);
      break;
    case Icon::kFirst:
    case Icon::kLast:
      triangle(-0.3F, 0.62F, d);
      triangle(0.16F, 0.62F, d);
      bar(0.58F * d, 0.16F, 0.8F);
      break;
  }
}

// Returns a range that holds all lines, with a margin; centres a constant.
std::pair<double, double> RangeOf(const Plot& plot) {
  if (plot.range) {
    return *plot.range;
  }
  double least = 1e300;
  double most = -1e300;
  for (const PlotLine& line : plot.lines) {
    for (const double value : line.values) {
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  if (least > most) {
    return {0.0, 1.0};
  }
  const double room = std::max(0.08 * (most - least), 0.02 * std::abs(most) + 1e-9);
  return {least >= 0.0 && least < room ? 0.0 : least - room, most + room};
}

// Draws the title on the left, the names of the lines in their colours on the right.
void DrawNames(const Plot& plot, const Palette& palette) {
  ImGui::TextDisabled("%s", plot.title.c_str());
  if (plot.lines.size() < 2) {
    return;
  }
  const float em = ImGui::GetFontSize();
  float width = 0.0F;
  for (const PlotLine& line : plot.lines) {
    width += ImGui::CalcTextSize(line.name.c_str()).x + 1.6F * em;
  }
  ImGui::SameLine();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  float x = at.x + ImGui::GetContentRegionAvail().x - width + 0.6F * em;
  ImDrawList* list = ImGui::GetWindowDrawList();
  for (const PlotLine& line : plot.lines) {
    const float y = at.y + 0.55F * em;
    list->AddLine(ImVec2(x, y), ImVec2(x + 0.7F * em, y), line.color, 2.5F);
    list->AddText(ImVec2(x + 0.95F * em, at.y), palette.text, line.name.c_str());
    x += ImGui::CalcTextSize(line.name.c_str()).x + 1.6F * em;
  }
  ImGui::NewLine();
}

std::string Number(const char* format, double value) { return fmt::format(fmt::runtime(format), value); }

// The rectangle of the lines of a plot on the screen.
struct PlotArea {
  ImVec2 corner, end;
  double first_x = 0.0, span = 1.0;  // of the values
  double low = 0.0, high = 1.0;

  static constexpr float kInset = 3.0F;  // pixels beside the first and the last x
  float Width() const { return end.x - corner.x - 2.0F * kInset; }

  ImVec2 At(double x, double y) const {
    return {corner.x + kInset + static_cast<float>((x - first_x) / span) * Width(),
            end.y - static_cast<float>((y - low) / (high - low)) * (end.y - corner.y)};
  }
  double XAt(float pixel) const { return first_x + (pixel - corner.x - kInset) / Width() * span; }
  void DrawVertical(double x, ImU32 color, float width) const {
    const float at = std::floor(At(x, low).x) + 0.5F;
    ImGui::GetWindowDrawList()->AddLine(ImVec2(at, corner.y), ImVec2(at, end.y), color, width);
  }
};

void DrawPlotLine(const Plot& plot, const PlotLine& line, const PlotArea& area) {
  std::vector<ImVec2> points;
  for (std::size_t i = 0; i < plot.x.size(); ++i) {
    const ImVec2 point = area.At(plot.x[i], line.values[i]);
    // Coinciding points would thicken the joints of the line.
    if (points.empty() || std::hypot(point.x - points.back().x, point.y - points.back().y) > 1.0F) {
      points.push_back(point);
    }
  }
  if (points.size() == 1) {
    ImGui::GetWindowDrawList()->AddCircleFilled(points.front(), 2.5F, line.color);
  }
  Line(points, line.color, 1.6F);
}

// Marks the values at an x and shows them as a tooltip.
void DrawPlotValues(const Plot& plot, std::size_t index, const char* format, const PlotArea& area) {
  ImGui::BeginTooltip();
  ImGui::Text("%s %.0f", plot.x_name.c_str(), plot.x[index]);
  for (const PlotLine& line : plot.lines) {
    ImGui::TextDisabled("%s  %s", line.name.c_str(), Number(format, line.values[index]).c_str());
  }
  ImGui::EndTooltip();
  for (const PlotLine& line : plot.lines) {
    ImVec2 dot = area.At(plot.x[index], line.values[index]);
    dot.x = std::floor(dot.x) + 0.5F;
    ImGui::GetWindowDrawList()->AddCircleFilled(dot, 3.0F, line.color);
  }
}

}  // namespace

std::vector<ShownLabel>& ShownLabels() {
  return *static_cast<std::vector<ShownLabel>*>(ImGui::GetIO().UserData);
}

void ReportLabel(const std::string& text, ImVec2 center) {
  if (ImGui::IsRectVisible(center, center + ImVec2(1.0F, 1.0F))) {
    ShownLabels().push_back({text, center});
  }
}

void ReportItem(const std::string& text) {
  const ImVec2 size = ImGui::GetItemRectSize();
  const float width =
      std::min(size.x, ImGui::CalcTextSize(text.c_str()).x);  // rows are wider than their column
  ReportLabel(text, ImGui::GetItemRectMin() + ImVec2(width, size.y) * 0.5F);
}

bool IconButton(const char* id, Icon icon, const char* tip, bool on) {
  const float side = ImGui::GetFrameHeight();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::PushID(id);
  const bool pressed = ImGui::Button("##icon", ImVec2(1.15F * side, side));
  ImGui::PopID();
  DrawIcon(icon, ImFloor(at + ImVec2(0.575F, 0.5F) * side), 0.42F * side,
           ImGui::GetColorU32(on ? ImGuiCol_CheckMark : ImGuiCol_Text));
  Tip(tip);
  return pressed;
}

void Heading(const char* text) {
  ImGui::Dummy(ImVec2(0.0F, 0.25F * ImGui::GetFontSize()));
  Bold(text);
}

bool Section(const char* name) {
  ImGui::PushStyleColor(ImGuiCol_Header, ImGui::GetStyleColorVec4(ImGuiCol_FrameBg));
  const bool open = ImGui::CollapsingHeader(name, ImGuiTreeNodeFlags_DefaultOpen);
  ImGui::PopStyleColor();
  ReportItem(name);
  return open;
}

void Bold(const char* text) {
  ImGui::PushFont(ImGui::GetIO().Fonts->Fonts[std::min(1, ImGui::GetIO().Fonts->Fonts.Size - 1)]);
  ImGui::TextUnformatted(text);
  ImGui::PopFont();
}

void Row(const char* name, const std::string& value) {
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(9.5F * ImGui::GetFontSize());
  ImGui::TextUnformatted(value.c_str());
}

ImU32 Packed(const Eigen::Vector3d& color, float alpha) {
  const Eigen::Vector3f c = color.cast<float>();
  return ImGui::ColorConvertFloat4ToU32(ImVec4(c.x(), c.y(), c.z(), alpha));
}

void Swatch(const Eigen::Vector3d& color, bool hollow) {
  const float size = 0.75F * ImGui::GetFontSize();
  const float line = ImGui::GetTextLineHeight();
  const ImVec2 at = ImGui::GetCursorScreenPos() + ImVec2(0.0F, 0.5F * (line - size));
  const ImVec2 end = at + ImVec2(size, size);
  ImDrawList* list = ImGui::GetWindowDrawList();
  if (hollow) {
    list->AddRect(at + ImVec2(1.0F, 1.0F), end - ImVec2(1.0F, 1.0F), Packed(color), 3.0F, 0, 1.5F);
  } else {
    list->AddRectFilled(at, end, Packed(color), 3.0F);
  }
  ImGui::Dummy(ImVec2(size, line));
  ImGui::SameLine();
}

void Tip(const char* text) {
  if (*text != '\0' && ImGui::IsItemHovered()) {
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(24.0F * ImGui::GetFontSize());
    ImGui::TextUnformatted(text);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
  }
}

bool Button(const char* label, const char* tip, ImVec2 size) {
  const bool clicked = ImGui::Button(label, size);
  ReportItem(label);
  Tip(tip);
  return clicked;
}

bool SmallButton(const char* label) {
  const bool clicked = ImGui::SmallButton(label);
  ReportItem(label);
  return clicked;
}

bool Checkbox(const char* label, bool& on, const char* tip) {
  const bool clicked = ImGui::Checkbox(label, &on);
  ReportItem(label);
  Tip(tip);
  return clicked;
}

bool Selectable(const std::string& label, bool selected, int flags, float width) {
  const bool clicked = ImGui::Selectable(label.c_str(), selected, flags, ImVec2(width, 0.0F));
  ReportItem(label);
  return clicked;
}

bool Toggle(const char* label, bool& on, const char* tip, float width) {
  const bool was = on;
  if (was) {
    ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_Header));
    ImGui::PushStyleColor(ImGuiCol_ButtonHovered, ImGui::GetStyleColorVec4(ImGuiCol_HeaderActive));
  }
  const bool clicked = Button(label, tip, ImVec2(width, 0.0F));
  if (was) {
    ImGui::PopStyleColor(2);
  }
  on = was != clicked;
  return clicked;
}

bool BeginCombo(const char* name, const std::string& shown, float width) {
  ReportLabel(shown, ImGui::GetCursorScreenPos() + ImVec2(0.5F, 0.5F) * ImGui::GetFrameHeight());
  ImGui::SetNextItemWidth(width * ImGui::GetFontSize());
  return ImGui::BeginCombo(name, shown.c_str(), ImGuiComboFlags_HeightLarge);
}

bool Choice(const char* name, std::string& current, std::span<const std::string> words, float width) {
  const std::string before = current;
  if (BeginCombo(name, before, width)) {
    for (const std::string& word : words) {
      if (Selectable(word, word == before)) {
        current = word;
      }
    }
    ImGui::EndCombo();
  }
  return current != before;
}

bool MenuItem(const std::string& label, const char* keys, bool checked, bool enabled) {
  const bool clicked = ImGui::MenuItem(label.c_str(), keys, checked, enabled);
  ReportItem(label);
  return clicked;
}

bool Slide(const char* name, double& value, double low, double high, const char* format, float width) {
  ImGui::SetNextItemWidth(width * ImGui::GetFontSize());
  return ImGui::SliderScalar(name, ImGuiDataType_Double, &value, &low, &high, format);
}

bool Drag(const char* name, std::span<double> values, float speed, double low, double high,
          const char* format) {
  ImGui::SetNextItemWidth(-7.0F * ImGui::GetFontSize());
  return ImGui::DragScalarN(name, ImGuiDataType_Double, values.data(), static_cast<int>(values.size()), speed,
                            &low, &high, format, low < high ? ImGuiSliderFlags_AlwaysClamp : 0);
}

void Dim(const std::string& text) { ImGui::TextDisabled("%s", text.c_str()); }

void DimWrapped(const std::string& text) {
  ImGui::PushTextWrapPos(0.0F);
  Dim(text);
  ImGui::PopTextWrapPos();
}

void Label(const std::string& text, float width) {
  ImGui::AlignTextToFramePadding();
  Dim(text);
  ImGui::SameLine(width * ImGui::GetFontSize());
}

bool Field(const char* name, std::string& text, int flags) {
  Label(name, 4.0F);
  ImGui::SetNextItemWidth(-1.0F);
  ImGui::InputText((std::string("##") + name).c_str(), &text, flags);
  return ImGui::IsItemDeactivatedAfterEdit();
}

void Square(ImVec2 center, float half_side, ImU32 color, float rounding) {
  const ImVec2 half(half_side, half_side);
  ImGui::GetWindowDrawList()->AddRectFilled(center - half, center + half, color, rounding);
}

void Line(const std::vector<ImVec2>& points, ImU32 color, float width, bool closed) {
  ImGui::GetWindowDrawList()->AddPolyline(points.data(), static_cast<int>(points.size()), color,
                                          closed ? ImDrawFlags_Closed : 0, width);
}

void Stroke(const std::vector<ImVec2>& points, ImU32 color, float width, float rim, bool closed, ImU32 dark) {
  Line(points, dark, width + rim, closed);
  Line(points, color, width, closed);
}

std::optional<std::size_t> DrawPlot(const Palette& palette, const char* id, const Plot& plot, float height) {
  DrawNames(plot, palette);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x;
  if (width < 10.0F || plot.x.empty()) {
    return std::nullopt;
  }
  ImGui::InvisibleButton(id, ImVec2(width, height));
  const bool clicked = ImGui::IsItemActivated();
  const float em = ImGui::GetFontSize();
  const auto [low, high] = RangeOf(plot);
  const ImVec2 start = corner + ImVec2(3.4F * em, 0.0F);  // the same x in all plots of a panel
  const PlotArea area{start,
                      corner + ImVec2(width, height),
                      plot.x.front(),
                      std::max(plot.x.back() - plot.x.front(), 1e-9),
                      low,
                      high};
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(area.corner, area.end, ImGui::GetColorU32(ImGuiCol_FrameBg, 0.55F), 3.0F);
  // A narrow range needs more digits, or both ends would read the same.
  const bool narrow = Number(plot.format, high) == Number(plot.format, low);
  const char* const format = narrow ? "{:.3g}" : plot.format;
  const auto label = [&](const std::string& text, float y) {
    list->AddText(ImVec2(start.x - 0.5F * em - ImGui::CalcTextSize(text.c_str()).x, y), palette.dim_text,
                  text.c_str());
  };
  label(Number(format, high), corner.y - 0.15F * em);
  label(Number(format, low), area.end.y - 1.0F * em);
  if (plot.now) {
    area.DrawVertical(std::clamp(*plot.now, plot.x.front(), plot.x.back()), palette.accent, 1.5F);
  }
  for (const PlotLine& line : plot.lines) {
    DrawPlotLine(plot, line, area);
  }
  if (!ImGui::IsItemHovered()) {
    return std::nullopt;
  }
  const double mouse_x = area.XAt(ImGui::GetIO().MousePos.x);
  const auto nearest = std::ranges::min_element(plot.x, {}, [&](double x) { return std::abs(x - mouse_x); });
  const auto index = static_cast<std::size_t>(nearest - plot.x.begin());
  area.DrawVertical(*nearest, palette.dim_text, 1.0F);
  DrawPlotValues(plot, index, format, area);
  return clicked ? std::optional(index) : std::nullopt;
}

}  // namespace sqslam::viewer
