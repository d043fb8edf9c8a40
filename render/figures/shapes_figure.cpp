#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "render/camera/scene_framing.h"
#include "render/figures/figure_input.h"
#include "render/picture/picture.h"
#include "slam/geometry/angles.h"
#include "slam/util/largest.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

constexpr const char* kShapeLabel = "shape";

MapSnapshot OneShape(double e1, double e2) {
  MapSnapshot map;
  map.gravity_known = true;
  SnapshotObject object;
  object.label = kShapeLabel;
  object.superquadric.shape = {Eigen::Vector3d::Ones(), e1, e2};
  map.objects.push_back(object);
  return map;
}

// Frames the bounding cube, so that all shapes are drawn at the same scale.
ViewCamera EyeOnShapes(const ShapesFigure& figure) {
  const double azimuth = figure.azimuth * kRadiansPerDegree;
  const double elevation = figure.elevation * kRadiansPerDegree;
  ViewCamera camera;
  camera.view_angle = 20.0;
  camera.focal_point = Eigen::Vector3d::Zero();
  camera.position = 10.0 * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                           std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  const std::array<Eigen::Vector3d, 8> corners = BoxCorners({{Eigen::Vector3d::Ones(), 1.0, 1.0}, {}});
  return FitOutline(camera, {corners.begin(), corners.end()}, 1.0, WithinMargin(0.04));
}

std::string ExponentText(double e) { return fmt::format("{:.3g}", e); }

PanelGrid LayOutShapes(const ShapesFigure& figure, const FigureTheme& theme, double width) {
  const double numbers =
      Largest(figure.e1, 0.0, [&](double e) { return TextWidth(ExponentText(e), theme.font); });
  PanelGrid grid{static_cast<int>(figure.e2.size()), static_cast<int>(figure.e1.size()), 0.0};
  grid.left = numbers + 2.3 * theme.font;
  grid.top = 2.6 * theme.font;
  grid.width = grid.height = (width - grid.left) / grid.columns;
  return grid;
}

// Makes the cells square and centres them.
void MakeSquare(PanelSheet& sheet) {
  PanelGrid& grid = sheet.grid;
  grid.width = grid.height = std::min(grid.width, grid.height);
  sheet.area.x += 0.5 * (sheet.area.width - grid.left - grid.columns * grid.width);
  sheet.area.y += 0.5 * (sheet.area.height - grid.Height());
}

void DrawExponents(PanelSheet& sheet, const ShapesFigure& figure) {
  const FigureTheme& theme = sheet.theme;
  const PanelGrid& grid = sheet.grid;
  FigurePage& page = sheet.page;
  const FigureRect first = sheet.PanelAt(0, 0);
  page.Text("ε₂", {first.x + 0.5 * grid.columns * grid.width, first.y - grid.top + 0.6 * theme.font},
            1.1 * theme.font, theme.ink, TextAlign::kCenter);
  page.Text("ε₁", {first.x - grid.left, first.y + 0.5 * grid.rows * grid.height}, 1.1 * theme.font,
            theme.ink);
  for (int i = 0; i < grid.columns; ++i) {
    page.Text(ExponentText(figure.e2[static_cast<std::size_t>(i)]),
              {sheet.PanelAt(0, i).Center().x(), first.y - 0.65 * theme.font}, theme.font, theme.ink,
              TextAlign::kCenter);
  }
  for (int i = 0; i < grid.rows; ++i) {
    page.Text(ExponentText(figure.e1[static_cast<std::size_t>(i)]),
              {first.x - 0.3 * theme.font, sheet.PanelAt(i, 0).Center().y()}, theme.font, theme.ink,
              TextAlign::kRight);
  }
}

}  // namespace

FigurePage DrawShapes(const ShapesFigure& figure, const FigureOptions& options) {
  for (const std::vector<double>* values : {&figure.e1, &figure.e2}) {
    ThrowIf<UsageError>(values->empty() || values->size() > 20, "{} exponents: expected 1 to 20",
                        values->size());
    for (const double e : *values) {
      ThrowIf<UsageError>(!(e >= 0.05 && e <= 2.0), "exponent {}: expected 0.05 to 2", e);
    }
  }
  PanelSheet sheet = MakePanelSheet(
      options, kColumnWidth, "Superquadrics of different exponents",
      [&](double width, const FigureTheme& theme) { return LayOutShapes(figure, theme, width); });
  MakeSquare(sheet);
  const PanelGrid& grid = sheet.grid;
  PictureOptions panel = PanelOptions(options, sheet);
  panel.style.objects.colors[kShapeLabel] = FormatColor(figure.color);
  panel.style.light.shadow = 0.0;  // it would be cut off at the panel's edge
  PictureRenderer renderer(panel);
  const ViewCamera eye = EyeOnShapes(figure);
  const int total = grid.rows * grid.columns;
  options.Tell(0, total);
  for (int i = 0; i < total; ++i) {
    const auto [row, column] = std::div(i, grid.columns);
    renderer.SetMap(
        OneShape(figure.e1[static_cast<std::size_t>(row)], figure.e2[static_cast<std::size_t>(column)]));
    PlacePanel(sheet.page, renderer.Render(eye), sheet.PanelAt(row, column));
    options.Tell(i + 1, total);
  }
  DrawExponents(sheet, figure);
  return std::move(sheet.page);
}

namespace {

struct ShapesOptions {
  std::string e1 = "0.1,0.5,1,1.5,2";
  std::string e2 = "0.1,0.5,1,1.5,2";
  std::string color = "#56b4e9";
  double azimuth = 35.0;
  double elevation = 25.0;
  void VisitFields(auto&& visit) {
    visit("--e1 X,...", "Exponents of the rows, 0.05 to 2", e1);
    visit("--e2 X,...", "Exponents of the columns, 0.05 to 2", e2);
    visit("--color #RRGGBB", "Colour of the shapes", color);
    visit("--azimuth DEG", "Direction of the eye, from the shapes' x axis", azimuth, -360.0, 360.0);
    visit("--elevation DEG", "Height of the eye above the shapes' equator", elevation, -89.0, 89.0);
  }
};

FigurePage DrawShapesOf(const FigureRequest& request, const ShapesOptions& options) {
  const ShapesFigure figure{ParseNumberList("--e1", options.e1), ParseNumberList("--e2", options.e2),
                            ParseColor(options.color), options.azimuth, options.elevation};
  return DrawShapes(figure, request.page);
}

}  // namespace

FigureEntry ShapesEntry() {
  return FigureEntry{.name = "shapes",
                     .help = "Superquadrics on a grid of their two exponents",
                     .details = R"(
Rows share e1 (the vertical profile), columns e2 (the horizontal cross-section). All half sizes are equal and
all shapes are drawn at one scale. Objects of maps have exponents from 0.1 to 1.9.

Examples:
  sqslam figure shapes -o shapes.pdf
  sqslam figure shapes --e1 0.1,1,1.9 --e2 0.1,0.4,0.7,1,1.9 --width-mm 120 --dpi 600 -o shapes.png
  sqslam figure shapes --color "#d55e00" --azimuth 20 --elevation 35 --no-background -o shapes.png
)",
                     .pictures = true,
                     .adapt_style =
                         [](SceneStyle& style) {
                           style.objects.opacity = 1.0;
                           style.objects.segments = 128;
                           style.grid.show = false;
                         }}
      .DrawnBy(DrawShapesOf);
}

}  // namespace sqslam
