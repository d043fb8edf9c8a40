#include "render/page/color_ramp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/page/panels.h"
#include "render/scene/style.h"

namespace sqslam {

Eigen::Vector3d Viridis(double value) {
  static constexpr std::array<const char*, 9> kColors = {
      "#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"};
  const double at = std::clamp(value, 0.0, 1.0) * (kColors.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(at), kColors.size() - 2);
  const double share = at - static_cast<double>(low);
  return (1.0 - share) * ParseColor(kColors[low]) + share * ParseColor(kColors[low + 1]);
}

double ColorBarHeight(const FigureTheme& theme) { return 2.7 * theme.small; }

void DrawColorBar(FigurePage& page, const ColorBar& bar, const FigureRect& area,
                  const FigureTheme& page_theme) {
  constexpr int kSteps = 96;
  constexpr double kLeastLength = 0.35;  // of the area's width
  FigureTheme theme = page_theme;
  const double texts =
      TextWidth(bar.meaning, theme.small) + TextWidth(bar.limit_meaning, theme.small) + 1.3 * theme.small;
  theme.small *=
      std::min(1.0, (1.0 - kLeastLength) * area.width / texts);  // narrow pages get smaller letters
  const double gap = 0.6 * theme.small;
  const double left_room = TextWidth(bar.meaning, theme.small);
  const double right_room = TextWidth(bar.limit_meaning, theme.small);
  const double length = std::min(22.0 * theme.small, area.width - left_room - right_room - 2.0 * gap);
  const double left = area.x + 0.5 * (area.width - left_room - length - right_room - 2.0 * gap);
  const FigureRect strip{left + left_room + gap, area.y + 0.4 * theme.small, length, 0.9 * theme.small};
  // Each step reaches under the next one: no seams.
  for (int i = 0; i < kSteps; ++i) {
    const double x = strip.x + strip.width * i / kSteps;
    page.Rect({x, strip.y, std::min(2.0 * strip.width / kSteps, strip.Right() - x), strip.height},
              Viridis((i + 0.5) / kSteps));
  }
  const PlotArea plot{strip, bar.axis, {}};
  DrawXAxis(page, plot, "", theme, false);
  page.Text(
      PlainText(bar.meaning, {strip.x - gap, strip.Center().y()}, theme.small, theme.ink, TextAlign::kRight));
  if (bar.limit > bar.axis.low && bar.limit < bar.axis.high) {
    const double x = plot.X(bar.limit);
    page.Line({x, strip.y - 0.25 * theme.small}, {x, strip.Bottom()}, {theme.ink, 1.0, {}});
    page.Text(
        PlainText(bar.limit_meaning, {strip.Right() + gap, strip.Center().y()}, theme.small, theme.ink));
  }
}

}  // namespace sqslam
