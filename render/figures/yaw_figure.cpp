#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/figures/figures.h"
#include "render/figures/image_crop.h"
#include "render/page/chart.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

constexpr double kYawGap = 5.0;  // points between panels

// Okabe and Ito; their order in lightness also tells them apart in grey.
Eigen::Vector3d YawAxisColor(int axis) {
  static constexpr std::array<const char*, 3> kColors = {"#d55e00", "#00a878", "#4aa8ff"};
  return ParseColor(kColors[static_cast<std::size_t>(axis)]);
}
constexpr std::array<const char*, 3> kAxisLetters = {"x", "y", "z"};
const Eigen::Vector3d kAxisHalo = Eigen::Vector3d::Ones();
const Eigen::Vector3d kLineRim = Eigen::Vector3d::Zero();
const Eigen::Vector3d kUnmatched = Eigen::Vector3d::Constant(0.72);

std::vector<LegendEntry> YawLegend() {
  std::vector<LegendEntry> entries;
  entries.push_back(LegendEntry::Line("unmatched line", {kUnmatched, 0.7, {}}));
  for (int axis = 0; axis < 3; ++axis) {
    entries.push_back(LegendEntry::Line(fmt::format("along {}", kAxisLetters[static_cast<std::size_t>(axis)]),
                                        {YawAxisColor(axis), 1.6, {}}));
  }
  return entries;
}

struct YawLayout {
  double left = 0.0;   // the objects' names
  double top = 0.0;    // the columns' names
  double width = 0.0;  // of a panel
  double height = 0.0;
  double texts = 0.0;  // below a panel
  double legend = 0.0;
};

YawLayout LayOutYaw(const YawFigure& figure, const FigureTheme& theme, double width) {
  YawLayout layout;
  layout.left = 1.8 * theme.font;
  layout.top = 1.8 * theme.font;
  layout.width = 0.5 * (width - layout.left - kYawGap);
  // As the regions are on average, so that little beside them is shown.
  double aspect = 0.0;
  for (const YawFigure::Object& object : figure.objects) {
    const double own = object.region.width / std::max(object.region.height, 1.0);
    aspect += (object.quarter_turns % 2 == 0 ? own : 1.0 / own) / static_cast<double>(figure.objects.size());
  }
  layout.height = layout.width / std::clamp(aspect, 0.75, 2.0);
  layout.texts = 1.7 * theme.small;
  layout.legend = LegendHeight(YawLegend(), width, theme);
  return layout;
}

double YawHeight(const YawLayout& layout, std::size_t rows) {
  return layout.top + static_cast<double>(rows) * (layout.height + layout.texts + kYawGap) - kYawGap +
         0.4 * kYawGap + layout.legend;
}

void DrawClipped(FigurePage& page, const ImageCrop& crop, Eigen::Vector2d from, Eigen::Vector2d to,
                 const FigureStroke& stroke) {
  if (crop.Clip(from, to)) {
    page.Line(crop.ToPage(from), crop.ToPage(to), stroke);
  }
}

void DrawMatchedLines(FigurePage& page, const ImageCrop& crop, const YawFigure::View& view) {
  for (const bool matched : {false, true}) {
    for (const YawFigure::Line& line : view.lines) {
      if ((line.axis >= 0) == matched) {
        DrawClipped(page, crop, line.from, line.to, {kLineRim, matched ? 1.5 : 0.9, {}});
        DrawClipped(page, crop, line.from, line.to,
                    {matched ? YawAxisColor(line.axis) : kUnmatched, matched ? 1.0 : 0.45, {}});
      }
    }
  }
}

// Axes as edges that meet in the corner, their letters beyond the ends. No arrows: a line has no sense of
// direction, and the corner is that before the camera, wherever the axes point.
void DrawObjectAxes(FigurePage& page, const ImageCrop& crop, const YawFigure::View& view,
                    const FigureTheme& theme) {
  const Eigen::Vector2d from = crop.ToPage(view.corner);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector2d to = crop.ToPage(view.ends[static_cast<std::size_t>(axis)]);
    const Eigen::Vector2d along = (to - from).normalized();
    DrawClipped(page, crop, view.corner, view.ends[static_cast<std::size_t>(axis)], {kAxisHalo, 3.4, {}});
    DrawClipped(page, crop, view.corner, view.ends[static_cast<std::size_t>(axis)],
                {YawAxisColor(axis), 2.0, {3.0, 1.4}});
    if (!crop.Contains(view.ends[static_cast<std::size_t>(axis)]) || (to - from).norm() < 1.0) {
      continue;
    }
    Eigen::Vector2d at = to + 0.7 * theme.font * along;
    const FigureRect& area = crop.Area();
    at.x() = std::clamp(at.x(), area.x + 0.5 * theme.font, area.Right() - 0.5 * theme.font);
    at.y() = std::clamp(at.y(), area.y + 0.6 * theme.font, area.Bottom() - 0.6 * theme.font);
    FigureText letter = PlainText(kAxisLetters[static_cast<std::size_t>(axis)], at, theme.font,
                                  YawAxisColor(axis), TextAlign::kCenter, true);
    letter.halo = kAxisHalo;
    page.Text(letter);
  }
}

void DrawYawPanel(FigurePage& page, const YawFigure::Object& object, const YawFigure::View& view,
                  const std::string& note, const FigureRect& panel, const FigureTheme& theme) {
  const ImageCrop crop(object.image, object.region, object.quarter_turns, panel);
  crop.Draw(page);
  DrawMatchedLines(page, crop, view);
  DrawObjectAxes(page, crop, view, theme);
  page.Text(NarrowText(PlainText(note, {panel.Center().x(), panel.Bottom() + 0.95 * theme.small}, theme.small,
                                 theme.ink, TextAlign::kCenter),
                       panel.width));
}

std::string AngleNote(const YawFigure::Object& object, const YawFigure::View& view, const std::string& more) {
  return object.yaw_lines == 0 ? "no line tells the yaw"
                               : fmt::format("mean angle {:.1f}°, {}", view.mean_angle, more);
}

std::string LineCount(int lines) { return fmt::format("{} line{}", lines, lines == 1 ? "" : "s"); }

std::string YawText(double degrees) {
  return fmt::format("yaw {}{:.1f}°", degrees < -0.05 ? "\u2212" : "", std::abs(degrees));
}

}  // namespace

FigurePage DrawYaw(const YawFigure& figure, const FigureOptions& options) {
  if (figure.objects.empty()) {
    throw UsageError("no objects, expected at least one");
  }
  for (const YawFigure::Object& object : figure.objects) {
    if (object.image.empty()) {
      throw UsageError(fmt::format("{}: no image, expected that of a frame", object.name));
    }
  }
  FigureSheet sheet = MakeSheet(options, kColumnWidth, "Yaw from line segments", [&](double width) {
    return YawHeight(LayOutYaw(figure, FigureTheme(options), width), figure.objects.size());
  });
  const FigureTheme& theme = sheet.theme;
  YawLayout layout = LayOutYaw(figure, theme, sheet.area.width);
  const std::size_t rows = figure.objects.size();
  layout.height += (sheet.area.height - YawHeight(layout, rows)) / static_cast<double>(rows);
  if (layout.height < 8.0) {
    throw UsageError("the figure is too low for its images, expected a larger height");
  }
  for (std::size_t i = 0; i < rows; ++i) {
    const YawFigure::Object& object = figure.objects[i];
    FigureRect panel{
        sheet.area.x + layout.left,
        sheet.area.y + layout.top + static_cast<double>(i) * (layout.height + layout.texts + kYawGap),
        layout.width, layout.height};
    FigureText name = NarrowText(PlainText(object.name, {sheet.area.x + 0.6 * theme.font, panel.Center().y()},
                                           theme.font, theme.ink, TextAlign::kCenter),
                                 panel.height);
    name.angle = 90.0;
    sheet.page.Text(name);
    DrawYawPanel(sheet.page, object, object.before,
                 AngleNote(object, object.before, LineCount(object.yaw_lines)), panel, theme);
    panel.x += layout.width + kYawGap;
    DrawYawPanel(sheet.page, object, object.after, AngleNote(object, object.after, YawText(object.yaw)),
                 panel, theme);
  }
  const double heading = sheet.area.y + 0.6 * theme.font;
  const double first = sheet.area.x + layout.left + 0.5 * layout.width;
  sheet.page.Text("(a) map's axes", {first, heading}, theme.font, theme.ink, TextAlign::kCenter);
  sheet.page.Text("(b) optimised", {first + layout.width + kYawGap, heading}, theme.font, theme.ink,
                  TextAlign::kCenter);
  DrawLegend(sheet.page, YawLegend(),
             {sheet.area.x, sheet.area.Bottom() - layout.legend, sheet.area.width, layout.legend}, theme);
  return std::move(sheet.page);
}

}  // namespace sqslam
