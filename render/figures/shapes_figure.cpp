#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
ViewCamera EyeOnShapes(const ShapesFigure& figure, double aspect) {
  const double azimuth = figure.azimuth * kRadiansPerDegree;
  const double elevation = figure.elevation * kRadiansPerDegree;
  ViewCamera camera;
  camera.view_angle = 20.0;
  camera.focal_point = Eigen::Vector3d::Zero();
  camera.position = 10.0 * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                           std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  const std::array<Eigen::Vector3d, 8> corners = BoxCorners({{Eigen::Vector3d::Ones(), 1.0, 1.0}, {}});
  return FitOutline(camera, {corners.begin(), corners.end()}, aspect, WithinMargin(0.04));
}

struct ShapesGrid {
  FigureRect area;  // of all cells
  double cell = 0.0;
};

std::string ExponentText(double e) { return fmt::format("{:.3g}", e); }

// Room above for the exponent's symbol and values; SideRoom is the same at the left.
double HeadRoom(const FigureTheme& theme) { return 2.6 * theme.font; }

double SideRoom(const ShapesFigure& figure, const FigureTheme& theme) {
  return Largest(figure.e1, 0.0, [&](double e) { return TextWidth(ExponentText(e), theme.font); }) +
         2.3 * theme.font;
}

ShapesGrid PlaceGrid(const FigureSheet& sheet, const ShapesFigure& figure) {
  const double head = HeadRoom(sheet.theme);
  const double side = SideRoom(figure, sheet.theme);
  const auto columns = static_cast<double>(figure.e2.size());
  const auto rows = static_cast<double>(figure.e1.size());
  ShapesGrid grid;
  grid.cell = std::min((sheet.area.width - side) / columns, (sheet.area.height - head) / rows);
  const double width = side + columns * grid.cell;
  const double height = head + rows * grid.cell;
  grid.area = {sheet.area.x + 0.5 * (sheet.area.width - width) + side,
               sheet.area.y + 0.5 * (sheet.area.height - height) + head, columns * grid.cell,
               rows * grid.cell};
  return grid;
}

void DrawExponents(FigureSheet& sheet, const ShapesGrid& grid, const ShapesFigure& figure) {
  const FigureTheme& theme = sheet.theme;
  const double names = HeadRoom(theme) - 0.6 * theme.font;
  const double values = 0.65 * theme.font;
  FigurePage& page = sheet.page;
  page.Text("ε₂", {grid.area.Center().x(), grid.area.y - names}, 1.1 * theme.font, theme.ink,
            TextAlign::kCenter);
  page.Text("ε₁", {grid.area.x - SideRoom(figure, theme), grid.area.Center().y()}, 1.1 * theme.font,
            theme.ink);
  for (std::size_t i = 0; i < figure.e2.size(); ++i) {
    page.Text(ExponentText(figure.e2[i]),
              {grid.area.x + (static_cast<double>(i) + 0.5) * grid.cell, grid.area.y - values}, theme.font,
              theme.ink, TextAlign::kCenter);
  }
  for (std::size_t i = 0; i < figure.e1.size(); ++i) {
    page.Text(ExponentText(figure.e1[i]),
              {grid.area.x - 0.3 * theme.font, grid.area.y + (static_cast<double>(i) + 0.5) * grid.cell},
              theme.font, theme.ink, TextAlign::kRight);
  }
}

}  // namespace

FigurePage DrawShapes(const ShapesFigure& figure, const FigureOptions& options,
                      const FigureProgress& progress) {
  for (const std::vector<double>* values : {&figure.e1, &figure.e2}) {
    ThrowIf<UsageError>(values->empty() || values->size() > 20, "{} exponents: expected 1 to 20",
                        values->size());
    for (const double e : *values) {
      ThrowIf<UsageError>(!(e >= 0.05 && e <= 2.0), "exponent {}: expected 0.05 to 2", e);
    }
  }
  FigureSheet sheet = MakeSheet(options, kColumnWidth, "Superquadrics of different exponents",
                                [&](double width, const FigureTheme& theme) {
                                  return HeadRoom(theme) + (width - SideRoom(figure, theme)) /
                                                               static_cast<double>(figure.e2.size()) *
                                                               static_cast<double>(figure.e1.size());
                                });
  const ShapesGrid grid = PlaceGrid(sheet, figure);
  PictureOptions panel =
      PanelOptions(options, sheet.page.dpi, grid.cell, grid.cell, {{kShapeLabel, figure.color}});
  panel.style.light.shadow = 0.0;  // it would be cut off at the panel's edge
  PictureRenderer renderer(panel);
  const ViewCamera eye = EyeOnShapes(figure, 1.0);
  int done = 0;
  Tell(progress, 0, static_cast<int>(figure.e1.size() * figure.e2.size()));
  for (std::size_t row = 0; row < figure.e1.size(); ++row) {
    for (std::size_t column = 0; column < figure.e2.size(); ++column) {
      renderer.SetMap(OneShape(figure.e1[row], figure.e2[column]));
      const double x = grid.area.x + static_cast<double>(column) * grid.cell;
      const double y = grid.area.y + static_cast<double>(row) * grid.cell;
      PlacePanel(sheet.page, renderer.Render(eye), {x, y, grid.cell, grid.cell});
      Tell(progress, ++done, static_cast<int>(figure.e1.size() * figure.e2.size()));
    }
  }
  DrawExponents(sheet, grid, figure);
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
  return DrawShapes(figure, request.page, request.progress);
}

}  // namespace

FigureEntry ShapesEntry() {
  return {.name = "shapes",
          .help = "Superquadrics on a grid of their two exponents",
          .details = R"(
Rows share e1 (the vertical profile), columns e2 (the horizontal cross-section); all half sizes are equal and
all shapes are drawn at one scale. The maps' objects have exponents from 0.1 to 1.9.

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
              },
          .make = FigureEntry::Maker(DrawShapesOf)};
}

}  // namespace sqslam
