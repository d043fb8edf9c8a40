#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/picture/picture_text.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

struct AxisLook {
  const char* letter;
  Eigen::Vector3d color;
};
// From the palette of Okabe and Ito; the lightness differs, for greyscale prints.
const std::array<AxisLook, 3> kYawAxes = {
    AxisLook{"x", ParseColor("#d55e00")}, {"y", ParseColor("#00a878")}, {"z", ParseColor("#4aa8ff")}};
const Eigen::Vector3d kAxisHalo = Eigen::Vector3d::Ones();
const Eigen::Vector3d kLineRim = Eigen::Vector3d::Zero();
const Eigen::Vector3d kUnmatched = Eigen::Vector3d::Constant(0.72);

std::vector<LegendEntry> YawLegend() {
  std::vector<LegendEntry> entries = {LegendEntry::Line("unmatched line", {kUnmatched, 0.7, {}})};
  for (const auto& [letter, color] : kYawAxes) {
    entries.push_back(LegendEntry::Line(fmt::format("along {}", letter), {color, 1.6, {}}));
  }
  return entries;
}

PanelGrid LayOutYaw(const YawFigure& figure, const FigureTheme& theme, double width) {
  PanelGrid grid = PanelGrid::Of(2, static_cast<int>(figure.objects.size()), width, 1.8 * theme.font);
  grid.top = 1.8 * theme.font;
  // The mean aspect ratio of the regions, so that little else is shown.
  double aspect = 0.0;
  for (const YawFigure::Object& object : figure.objects) {
    const double own = object.region.width / std::max(object.region.height, 1.0);
    aspect += (object.quarter_turns % 2 == 0 ? own : 1.0 / own) / static_cast<double>(figure.objects.size());
  }
  grid.height = grid.width / std::clamp(aspect, 0.75, 2.0);
  grid.texts = 1.7 * theme.small;
  grid.below = 0.4 * grid.gap + LegendHeight(YawLegend(), width, theme);
  return grid;
}

void DrawMatchedLines(FigurePage& page, const ImageCrop& crop, const YawFigure::View& view) {
  for (const bool matched : {false, true}) {
    for (const YawFigure::Line& line : view.lines) {
      if ((line.axis >= 0) == matched) {
        const Eigen::Vector3d color =
            matched ? kYawAxes[static_cast<std::size_t>(line.axis)].color : kUnmatched;
        crop.DrawLine(page, line.from, line.to, {kLineRim, matched ? 1.5 : 0.9, {}});
        crop.DrawLine(page, line.from, line.to, {color, matched ? 1.0 : 0.45, {}});
      }
    }
  }
}

// Draws the axes as edges that meet in the corner, with letters beyond their ends. Without arrowheads: lines
// are undirected, and the corner is chosen for its visibility, not by the axes' signs.
void DrawObjectAxes(FigurePage& page, const ImageCrop& crop, const YawFigure::View& view, double font) {
  const Eigen::Vector2d from = crop.ToPage(view.corner);
  const FigureRect& area = crop.Area();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [letter, color] = kYawAxes[i];
    const Eigen::Vector2d& end = view.ends[i];
    const Eigen::Vector2d along = crop.ToPage(end) - from;
    crop.DrawLine(page, view.corner, end, {kAxisHalo, 3.4, {}});
    crop.DrawLine(page, view.corner, end, {color, 2.0, {3.0, 1.4}});
    if (crop.Contains(end) && along.norm() >= 1.0) {
      const Eigen::Vector2d at = from + along + 0.7 * font * along.normalized();
      page.Text({letter,
                 {std::clamp(at.x(), area.x + 0.5 * font, area.Right() - 0.5 * font),
                  std::clamp(at.y(), area.y + 0.6 * font, area.Bottom() - 0.6 * font)},
                 font,
                 color,
                 TextAlign::kCenter,
                 true,
                 0.0,
                 kAxisHalo});
    }
  }
}

// Draws the axes and lines of one view; `note` follows the mean angle.
void DrawYawPanel(PanelSheet& sheet, int row, int column, const YawFigure::Object& object,
                  const YawFigure::View& view, const std::string& note) {
  auto& [page, area, theme] = static_cast<FigureSheet&>(sheet);
  const FigureRect panel = sheet.PanelAt(row, column);
  const ImageCrop crop(object.image, object.region, object.quarter_turns, panel);
  crop.Draw(page);
  DrawMatchedLines(page, crop, view);
  DrawObjectAxes(page, crop, view, theme.font);
  page.Label(object.yaw_lines == 0 ? "no line tells the yaw"
                                   : fmt::format("mean angle {:.1f}°, {}", view.mean_angle, note),
             {panel.Center().x(), panel.Bottom() + 0.95 * theme.small}, theme.small, theme.ink, panel.width);
}

}  // namespace

FigurePage DrawYaw(const YawFigure& figure, const FigureOptions& options) {
  ThrowIf<UsageError>(figure.objects.empty(), "no objects, expected at least one");
  for (const YawFigure::Object& object : figure.objects) {
    ThrowIf<UsageError>(object.image.empty(), "{}: no image, expected that of a frame", object.name);
  }
  PanelSheet sheet =
      MakePanelSheet(options, kColumnWidth, "Yaw from line segments",
                     [&](double width, const FigureTheme& theme) { return LayOutYaw(figure, theme, width); });
  for (int row = 0; row < sheet.grid.rows; ++row) {
    const YawFigure::Object& object = figure.objects[static_cast<std::size_t>(row)];
    sheet.NameRow(row, object.name);
    DrawYawPanel(sheet, row, 0, object, object.before,
                 fmt::format("{} line{}", object.yaw_lines, object.yaw_lines == 1 ? "" : "s"));
    DrawYawPanel(sheet, row, 1, object, object.after,
                 fmt::format("yaw {}{:.1f}°", object.yaw < -0.05 ? "\u2212" : "", std::abs(object.yaw)));
  }
  sheet.NameColumn(0, "(a) map's axes");
  sheet.NameColumn(1, "(b) optimised");
  const double legend = LegendHeight(YawLegend(), sheet.area.width, sheet.theme);
  DrawLegend(sheet, YawLegend(), {sheet.area.x, sheet.area.Bottom() - legend, sheet.area.width, legend});
  return std::move(sheet.page);
}

}  // namespace sqslam
