#include "app/commands.h"
#include "app/figure_common.h"

namespace sqslam::app {
namespace {

constexpr const char* kFooter = R"(
Each figure is written as a PNG that carries its density, or as SVG or PDF with lines and texts as such; the
same input gives the same bytes. Colours suit all kinds of colour vision, dashes and hatches grey prints.

Examples:
  sqslam figure shapes --output shapes.pdf
  sqslam figure compare out/kitchen --object 4 --object 7 --output compare.pdf
  sqslam figure maps out/kitchen out/desk --name Kitchen --name Desk --boxes --output maps.png --dpi 600
  sqslam figure trajectory out/desk --ground-truth data/desk --output path.svg
  sqslam figure timing out/desk out/kitchen --output timing.pdf --width-mm 88
  sqslam figure iou out/sq out/quadric --output iou.pdf --width-mm 180 --title "3D IoU"
  sqslam figure NAME --help        options of a figure, with examples
)";

}  // namespace

void AddFigureCommand(CLI::App& app, int& /*exit_code*/) {
  CLI::App* figure = app.add_subcommand("figure", "Draw a figure for a paper: shapes, maps, charts");
  figure->footer(kFooter);
  figure->require_subcommand(1);
  AddShapesFigure(*figure);
  AddCompareFigure(*figure);
  AddMapsFigure(*figure);
  AddTrajectoryFigure(*figure);
  AddTimingFigure(*figure);
  AddIouFigure(*figure);
}

}  // namespace sqslam::app
