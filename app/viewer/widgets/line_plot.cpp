#include "app/viewer/widgets/line_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace sqslam::viewer {
namespace {

struct ValueRange {
  double low = 0.0;
  double high = 1.0;
};

// Holds all lines, with room above and below; a constant is in the middle.
ValueRange RangeOf(const Plot& plot) {
  if (plot.range) {
    return {plot.range->first, plot.range->second};
  }
  ValueRange range{1e300, -1e300};
  for (const PlotLine& line : plot.lines) {
    for (const double value : line.values) {
      range.low = std::min(range.low, value);
      range.high = std::max(range.high, value);
    }
  }
  if (range.low > range.high) {
    return {};
  }
  const double room = std::max(0.08 * (range.high - range.low), 0.02 * std::abs(range.high) + 1e-9);
  const double low = range.low - room;
  return {range.low >= 0.0 && low < 0.0 ? 0.0 : low, range.high + room};
}

// Title on the left, names of the lines in their colours on the right.
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
  const ValueRange range = RangeOf(plot);
  const std::string top = Number(plot.format, range.high);
  const std::string bottom = Number(plot.format, range.low);
  const float left = corner.x + 3.4F * em;  // the same in all plots of a panel
  const float right = corner.x + width;
  const double span = std::max(plot.x.back() - plot.x.front(), 1e-9);
  const auto x_of = [&](double x) {
    return left + 3.0F + static_cast<float>((x - plot.x.front()) / span) * (right - left - 6.0F);
  };
  const auto y_of = [&](double y) {
    return corner.y + height - static_cast<float>((y - range.low) / (range.high - range.low)) * height;
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
      // Points that fall together would make the line's joints thick.
      if (points.empty() || std::hypot(point.x - points.back().x, point.y - points.back().y) > 1.0F) {
        points.push_back(point);
      }
    }
    if (points.size() == 1) {
      list->AddCircleFilled(points.front(), 2.5F, line.color);
    }
    list->AddPolyline(points.data(), static_cast<int>(points.size()), line.color, 0, 1.6F);
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
    ImGui::TextDisabled("%s  %s", line.name.c_str(), Number(plot.format, line.values[index]).c_str());
  }
  ImGui::EndTooltip();
  return clicked ? std::optional(index) : std::nullopt;
}

}  // namespace sqslam::viewer
