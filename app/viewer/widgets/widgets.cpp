#include "app/viewer/widgets/widgets.h"

#include <fmt/format.h>
#include <imgui_stdlib.h>

#include <cmath>

namespace sqslam::viewer {
namespace {

// Draws a triangle that points right (1) or left (-1), centred at `c`.
void Triangle(ImDrawList* list, ImVec2 c, float size, float direction, ImU32 color) {
  const float x = 0.5F * size * direction;
  list->AddTriangleFilled(ImVec2(c.x - x, c.y - 0.58F * size), ImVec2(c.x + x, c.y),
                          ImVec2(c.x - x, c.y + 0.58F * size), color);
}

void Bar(ImDrawList* list, ImVec2 c, float width, float height, ImU32 color) {
  list->AddRectFilled(ImVec2(c.x - 0.5F * width, c.y - 0.5F * height),
                      ImVec2(c.x + 0.5F * width, c.y + 0.5F * height), color, 1.0F);
}

void DrawIcon(ImDrawList* list, Icon icon, ImVec2 c, float s, ImU32 color) {
  switch (icon) {
    case Icon::kPlay:
      Triangle(list, ImVec2(c.x + 0.06F * s, c.y), s, 1.0F, color);
      break;
    case Icon::kBackward:
      Triangle(list, ImVec2(c.x - 0.06F * s, c.y), s, -1.0F, color);
      break;
    case Icon::kPause:
      Bar(list, ImVec2(c.x - 0.25F * s, c.y), 0.26F * s, 1.05F * s, color);
      Bar(list, ImVec2(c.x + 0.25F * s, c.y), 0.26F * s, 1.05F * s, color);
      break;
    case Icon::kStop:
      Bar(list, c, 0.95F * s, 0.95F * s, color);
      break;
    case Icon::kStepForward:
    case Icon::kStepBack: {
      const float d = icon == Icon::kStepForward ? 1.0F : -1.0F;
      Triangle(list, ImVec2(c.x - 0.12F * s * d, c.y), 0.8F * s, d, color);
      Bar(list, ImVec2(c.x + 0.4F * s * d, c.y), 0.18F * s, 0.95F * s, color);
      break;
    }
    case Icon::kFirst:
    case Icon::kLast: {
      const float d = icon == Icon::kLast ? 1.0F : -1.0F;
      Triangle(list, ImVec2(c.x - 0.3F * s * d, c.y), 0.62F * s, d, color);
      Triangle(list, ImVec2(c.x + 0.16F * s * d, c.y), 0.62F * s, d, color);
      Bar(list, ImVec2(c.x + 0.58F * s * d, c.y), 0.16F * s, 0.8F * s, color);
      break;
    }
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

std::size_t NearestIndex(const std::vector<double>& x, double at) {
  const auto after = std::lower_bound(x.begin(), x.end(), at);
  if (after == x.begin()) {
    return 0;
  }
  if (after == x.end()) {
    return x.size() - 1;
  }
  return static_cast<std::size_t>(after - x.begin()) - (at - *(after - 1) < *after - at ? 1 : 0);
}

std::string Number(const char* format, double value) { return fmt::format(fmt::runtime(format), value); }

}  // namespace

bool IconButton(const char* id, Icon icon, const char* tip, bool on) {
  const float side = ImGui::GetFrameHeight();
  ImGui::PushID(id);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const bool pressed = ImGui::InvisibleButton("##icon", ImVec2(1.15F * side, side));
  const bool held = ImGui::IsItemActive();
  const bool hovered = ImGui::IsItemHovered();
  const ImGuiCol back = held ? ImGuiCol_ButtonActive : hovered ? ImGuiCol_ButtonHovered : ImGuiCol_Button;
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, ImVec2(at.x + 1.15F * side, at.y + side), ImGui::GetColorU32(back),
                      ImGui::GetStyle().FrameRounding);
  DrawIcon(list, icon, ImVec2(std::floor(at.x + 0.575F * side), std::floor(at.y + 0.5F * side)), 0.42F * side,
           ImGui::GetColorU32(on ? ImGuiCol_CheckMark : ImGuiCol_Text));
  ImGui::PopID();
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
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float y = at.y + 0.5F * (ImGui::GetTextLineHeight() - size);
  ImDrawList* list = ImGui::GetWindowDrawList();
  if (hollow) {
    list->AddRect(ImVec2(at.x + 1.0F, y + 1.0F), ImVec2(at.x + size - 1.0F, y + size - 1.0F), Packed(color),
                  3.0F, 0, 1.5F);
  } else {
    list->AddRectFilled(ImVec2(at.x, y), ImVec2(at.x + size, y + size), Packed(color), 3.0F);
  }
  ImGui::Dummy(ImVec2(size, ImGui::GetTextLineHeight()));
  ImGui::SameLine();
}

void Tip(const char* text) {
  if (text != nullptr && *text != '\0' && ImGui::IsItemHovered()) {
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(24.0F * ImGui::GetFontSize());
    ImGui::TextUnformatted(text);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
  }
}

bool Toggle(const char* label, bool* on, const char* tip) {
  const bool was = *on;
  if (was) {
    ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_Header));
    ImGui::PushStyleColor(ImGuiCol_ButtonHovered, ImGui::GetStyleColorVec4(ImGuiCol_HeaderActive));
  }
  const bool clicked = ImGui::Button(label);
  if (was) {
    ImGui::PopStyleColor(2);
  }
  if (clicked) {
    *on = !*on;
  }
  Tip(tip);
  return clicked;
}

bool Button(const char* label, const char* tip, ImVec2 size) {
  const bool clicked = ImGui::Button(label, size);
  Tip(tip);
  return clicked;
}

std::optional<int> OneOf(std::initializer_list<Option> options, int current) {
  std::optional<int> clicked;
  int index = 0;
  for (const Option& option : options) {
    if (index > 0) {
      ImGui::SameLine();
    }
    bool on = index == current;
    if (Toggle(option.label, &on, option.tip)) {
      clicked = index;
    }
    ++index;
  }
  return clicked;
}

std::optional<std::size_t> Choice(const char* name, const std::string& current,
                                  std::span<const std::string> words, float width) {
  std::optional<std::size_t> chosen;
  ImGui::SetNextItemWidth(width * ImGui::GetFontSize());
  if (ImGui::BeginCombo(name, current.c_str())) {
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (ImGui::Selectable(words[i].c_str(), words[i] == current)) {
        chosen = i;
      }
    }
    ImGui::EndCombo();
  }
  return chosen;
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
  ImGui::GetWindowDrawList()->AddRectFilled(ImVec2(center.x - half_side, center.y - half_side),
                                            ImVec2(center.x + half_side, center.y + half_side), color,
                                            rounding);
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
  const bool hovered = ImGui::IsItemHovered();
  const float em = ImGui::GetFontSize();
  const auto [low, high] = RangeOf(plot);
  // A narrow range needs more digits, or both ends would read the same.
  const bool narrow = Number(plot.format, high) == Number(plot.format, low);
  const char* const format = narrow ? "{:.3g}" : plot.format;
  const std::string top = Number(format, high);
  const std::string bottom = Number(format, low);
  const float left = corner.x + 3.4F * em;  // the same in all plots of a panel
  const float right = corner.x + width;
  const double span = std::max(plot.x.back() - plot.x.front(), 1e-9);
  const auto x_of = [&](double x) {
    return left + 3.0F + static_cast<float>((x - plot.x.front()) / span) * (right - left - 6.0F);
  };
  const auto y_of = [&, least = low, most = high](double y) {
    return corner.y + height - static_cast<float>((y - least) / (most - least)) * height;
  };
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(ImVec2(left, corner.y), ImVec2(right, corner.y + height),
                      ImGui::GetColorU32(ImGuiCol_FrameBg, 0.55F), 3.0F);
  const auto label = [&](const std::string& text, float y) {
    list->AddText(ImVec2(left - 0.5F * em - ImGui::CalcTextSize(text.c_str()).x, y), palette.dim_text,
                  text.c_str());
  };
  label(top, corner.y - 0.15F * em);
  label(bottom, corner.y + height - 1.0F * em);
  if (plot.now) {
    const float x = std::floor(x_of(std::clamp(*plot.now, plot.x.front(), plot.x.back()))) + 0.5F;
    list->AddLine(ImVec2(x, corner.y), ImVec2(x, corner.y + height), palette.accent, 1.5F);
  }
  for (const PlotLine& line : plot.lines) {
    std::vector<ImVec2> points;
    for (std::size_t i = 0; i < plot.x.size(); ++i) {
      const ImVec2 point(x_of(plot.x[i]), y_of(line.values[i]));
      // Coinciding points would thicken the joints of the line.
      if (points.empty() || std::hypot(point.x - points.back().x, point.y - points.back().y) > 1.0F) {
        points.push_back(point);
      }
    }
    if (points.size() == 1) {
      list->AddCircleFilled(points.front(), 2.5F, line.color);
    }
    Line(points, line.color, 1.6F);
  }
  if (!hovered) {
    return std::nullopt;
  }
  const double at = plot.x.front() + (ImGui::GetIO().MousePos.x - left - 3.0F) / (right - left - 6.0F) * span;
  const std::size_t index = NearestIndex(plot.x, at);
  const float x = std::floor(x_of(plot.x[index])) + 0.5F;
  list->AddLine(ImVec2(x, corner.y), ImVec2(x, corner.y + height), palette.dim_text, 1.0F);
  ImGui::BeginTooltip();
  ImGui::Text("%s %.0f", plot.x_name.c_str(), plot.x[index]);
  for (const PlotLine& line : plot.lines) {
    list->AddCircleFilled(ImVec2(x, y_of(line.values[index])), 3.0F, line.color);
    ImGui::TextDisabled("%s  %s", line.name.c_str(), Number(format, line.values[index]).c_str());
  }
  ImGui::EndTooltip();
  return clicked ? std::optional(index) : std::nullopt;
}

}  // namespace sqslam::viewer
