#include <memory>

#include "app/figures/figure_common.h"
#include "render/figures/panel_figures.h"
#include "render/page/write_figure.h"

namespace sqslam::app {
namespace {

constexpr const char* kShapesFooter = R"(
Rows share e1 (the vertical profile), columns e2 (the horizontal cross-section); all half sizes are equal and
all shapes are drawn at one scale. The maps' objects have exponents from 0.1 to 1.9.

Examples:
  sqslam figure shapes --output shapes.pdf
  sqslam figure shapes --e1 0.1,1,1.9 --e2 0.1,0.4,0.7,1,1.9 --width-mm 120 --dpi 600 --output shapes.png
  sqslam figure shapes --color "#d55e00" --azimuth 20 --elevation 35 --no-background --output shapes.png
)";

struct ShapesArguments : FigureArguments {
  std::string e1 = "0.1,0.5,1,1.5,2";
  std::string e2 = "0.1,0.5,1,1.5,2";
  std::string color = "#56b4e9";
  double eye_azimuth = 35.0;
  double eye_elevation = 25.0;
};

void Draw(const ShapesArguments& a) {
  ShapesFigure figure;
  figure.e1 = ParseNumberList("--e1", a.e1);
  figure.e2 = ParseNumberList("--e2", a.e2);
  figure.color = ParseColor(a.color);
  figure.azimuth = a.eye_azimuth;
  figure.elevation = a.eye_elevation;
  const FigureOptions options = MakeFigureOptions(a, [](SceneStyle& style) {
    style.objects.opacity = 1.0;
    style.objects.segments = 128;
    style.grid.show = false;
  });
  WriteFigure(DrawShapes(figure, options, FigureCounter(a.quiet)), a.output);
}

}  // namespace

void AddShapesFigure(CLI::App& figure) {
  const auto a = std::make_shared<ShapesArguments>();
  CLI::App* command = AddFigure(figure, "shapes", "Superquadrics on a grid of their two exponents",
                                kShapesFooter, FigureKind::kPanels, *a);
  command->add_option("--e1", a->e1, "Exponents of the rows, 0.05 to 2")->capture_default_str();
  command->add_option("--e2", a->e2, "Exponents of the columns, 0.05 to 2")->capture_default_str();
  command->add_option("--color", a->color, "#rrggbb of the shapes")->capture_default_str();
  command->add_option("--azimuth", a->eye_azimuth, "Of the eye, from the shapes' x axis, degrees")
      ->check(CLI::Range(-360.0, 360.0))
      ->capture_default_str();
  command->add_option("--elevation", a->eye_elevation, "Of the eye above the shapes' equator, degrees")
      ->check(CLI::Range(-89.0, 89.0))
      ->capture_default_str();
  command->callback([a] { Draw(*a); });
}

}  // namespace sqslam::app
