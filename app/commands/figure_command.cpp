#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/figures/figure_common.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace {

constexpr const char* kFigureFooter = R"(
Each figure is written as a PNG that carries its density, or as SVG or PDF with lines and texts as such; the
same input gives the same bytes. Colours suit all kinds of colour vision, dashes and hatches grey prints.
Without a size a figure is as wide as a column (89 mm) or, with much in it, a page of two columns (182 mm).

Examples:
  sqslam figure shapes --output shapes.pdf
  sqslam figure compare out/kitchen --object 4 --object 7 --output compare.pdf
  sqslam figure maps out/kitchen out/desk --name Kitchen --name Desk --boxes --output maps.png --dpi 600
  sqslam figure trajectory out/desk --ground-truth data/desk --output path.svg
  sqslam figure timing out/desk out/kitchen --output timing.pdf --width-mm 88
  sqslam figure iou out/sq out/quadric --output iou.pdf --width-mm 180 --title "3D IoU"
  sqslam figure outliers out/desk --object 2 --object 7 --output outliers.pdf
  sqslam figure yaw out/desk --object 2 --output yaw.pdf
  sqslam figure NAME --help        options of a figure, with examples
)";

}  // namespace

void AddFigureCommand(CLI::App& app, int& /*exit_code*/) {
  CLI::App* figure = app.add_subcommand("figure", "Draw a figure for a paper: shapes, maps, charts");
  figure->footer(kFigureFooter);
  figure->allow_extras();  // so that an unknown figure is named below, not refused as a stray argument
  AddShapesFigure(*figure);
  AddCompareFigure(*figure);
  AddMapsFigure(*figure);
  AddTrajectoryFigure(*figure);
  AddTimingFigure(*figure);
  AddIouFigure(*figure);
  AddOutliersFigure(*figure);
  AddYawFigure(*figure);
  figure->callback([figure] {
    std::vector<std::string> names;
    for (const CLI::App* known : figure->get_subcommands({})) {
      names.push_back(known->get_name());
    }
    const std::vector<std::string> unknown = figure->remaining();
    if (!unknown.empty() || figure->get_subcommands().empty()) {
      throw UsageError(fmt::format("figure{}{}: expected one of {} (see sqslam figure --help)",
                                   unknown.empty() ? "" : " ", unknown.empty() ? "" : unknown.front(),
                                   fmt::join(names, ", ")));
    }
  });
}

}  // namespace sqslam::app
