#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <variant>

#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "app/result/map_input.h"
#include "app/terminal/terminal.h"
#include "render/figures/figures.h"

namespace sqslam::app {
namespace {

constexpr const char* kFigureNotes = R"(
Figures are PNG files that store their density, or SVG or PDF files with charts and text as vectors; the same
input gives the same bytes. Colours suit all kinds of colour vision; dashes and hatches work in greyscale. By
default a figure is as wide as a column (89 mm) or, if it needs more space, a page of two columns (182 mm).

Examples:
  sqslam figure shapes -o shapes.pdf
  sqslam figure compare out/kitchen --object 4 --object 7 -o compare.pdf
  sqslam figure maps out/kitchen out/desk --name Kitchen --name Desk --boxes -o maps.png --dpi 600
  sqslam figure plan out/kitchen -o plan.pdf
  sqslam figure trajectory out/desk --ground-truth data/desk -o path.svg
  sqslam figure timing out/desk out/kitchen -o timing.pdf --width-mm 88
  sqslam figure iou out/sq out/quadric -o iou.pdf --width-mm 180 --title "3D IoU"
  sqslam figure outliers out/desk --object 2 --object 7 -o outliers.pdf
  sqslam figure yaw out/desk --object 2 -o yaw.pdf
  sqslam figure NAME --help        options of a figure, with examples
)";

struct FigureArguments {
  FigureRequest request;
  std::string output;
  std::string font;
  StyleArguments style;
  ObjectArguments objects;
  bool quiet = false;
};

void AddPageOptions(Command& command, const FigureEntry& figure, FigureArguments& a) {
  FigureOptions& page = a.request.page;
  command.Group("Page");
  command.Option("--output,-o FILE", a.output, "FILE.png, FILE.svg or FILE.pdf").Required();
  command.Option("--width-mm MM", page.width_mm, "Width; default: that of a column or page");
  command.Option("--height-mm MM", page.height_mm, "Height; default: as much as the figure needs");
  command.Option("--dpi N", page.dpi, "Pixels per inch of a PNG and of embedded pictures; default: 300");
  command.Option("--resolution W,H", page.pixels,
                 "Size in pixels instead of millimetres; text scales with the width unless --dpi is given");
  command.Option("--font-size PT", page.font_size, "Font size");
  command.Option("--font FILE", a.font, "Font of all texts, a .ttf or .otf, which .svg and .pdf embed");
  command.Option("--title TEXT", page.title, "Title above the figure");
  command.Flag("--no-background", page.transparent, "Transparent background");
  a.style.AddTo(command);
  command.Group("General");
  if (figure.pictures) {
    AddBackendOption(command, page.backend);
  }
  command.QuietFlag(a.quiet, "No progress");
}

// Adds the inputs: results and their names, objects, frames, and the view of maps.
void AddInputs(Command& command, const FigureEntry& figure, FigureArguments& a) {
  FigureRequest& request = a.request;
  command.Group("Figure");
  if (!figure.results_help.empty()) {
    command.Positional("RESULT", request.results, figure.results_help).Required().list = figure.several;
  }
  if (figure.several) {
    command.Option("--name TEXT", request.names, figure.names_help);
  }
  if (figure.objects) {
    command.Option("--object ID", request.objects, "Id of an object (see sqslam info); may be repeated");
  }
  if (figure.maps) {
    AddObjectOptions(command, a.objects);
  }
  if (!figure.frames_help.empty()) {
    command.Option("--frame N", request.frames, figure.frames_help).list = figure.several;
  }
  if (figure.view) {
    CameraOverrides& camera = request.page.camera;
    command.Group("Camera");
    command.Option("--camera-azimuth-angle DEG", camera.azimuth, "Rotate around the scene");
    command.Option("--camera-elevation-angle DEG", camera.elevation, "Raise the camera");
    command.Option("--camera-zoom-factor X", camera.zoom, "Above 1: closer").Range(0.01, 100.0);
  }
}

// Fills in the rest of the page options. Throws UsageError.
void CompletePage(const FigureEntry& figure, FigureArguments& a) {
  CheckFigurePath(a.output);
  FigureOptions& page = a.request.page;
  page.style = a.style.Load(figure.adapt_style);
  CheckFigureOptions(page);
}

void DrawFigure(const FigureEntry& figure, FigureArguments& a) {
  if (!a.font.empty()) {
    UseFont(a.font);
  }
  CompletePage(figure, a);
  if (figure.maps) {
    a.request.open_map = [&a](const std::filesystem::path& recording) {
      return OpenMap(recording, a.objects, HiddenObjects::kLeaveOut);
    };
  }
  CreateFolderOf(a.output);
  Progress progress(a.quiet, "picture");
  a.request.page.progress = std::ref(progress);
  WriteFigure(figure.draw(a.request), a.output);
}

void AddFigure(Command& parent, const FigureEntry& figure) {
  Command& command = parent.AddCommand(figure.name, figure.help);
  command.Notes(figure.details);
  const auto a = std::make_shared<FigureArguments>();
  AddPageOptions(command, figure, *a);
  AddInputs(command, figure, *a);
  command.Group("Figure");
  for (const FigureOption& option : figure.options) {
    if (const auto* words = std::get_if<std::vector<std::string>*>(&option.field.value)) {
      command.Option(option.names, **words, option.help);
    } else {
      command.Option(option.names, option.field, option.help);
    }
  }
  command.OnRun([figure, a] { DrawFigure(figure, *a); });
}

}  // namespace

void AddFigureCommand(Command& program) {
  Command& command = program.AddCommand("figure", "Draw a figure for a paper: shapes, maps, charts");
  command.Group("Figures");
  for (const FigureEntry& figure : AllFigures()) {
    AddFigure(command, figure);
  }
  command.Notes(kFigureNotes);
}

}  // namespace sqslam::app
