#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <variant>

#include "app/commands/commands.h"
#include "app/result/input_frames.h"
#include "app/result/map_input.h"
#include "app/terminal/terminal.h"
#include "render/figures/figure_input.h"
#include "render/figures/figures.h"
#include "render/page/write_figure.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace {

constexpr const char* kFigureFooter = R"(
Each figure is written as a PNG that carries its density, or as SVG or PDF with lines and texts as such; the
same input gives the same bytes. Colours suit all kinds of colour vision, dashes and hatches grey prints.
Without a size a figure is as wide as a column (89 mm) or, with much in it, a page of two columns (182 mm).

Examples:
  sqslam figure shapes -o shapes.pdf
  sqslam figure compare out/kitchen --object 4 --object 7 -o compare.pdf
  sqslam figure maps out/kitchen out/desk --name Kitchen --name Desk --boxes -o maps.png --dpi 600
  sqslam figure trajectory out/desk --ground-truth data/desk -o path.svg
  sqslam figure timing out/desk out/kitchen -o timing.pdf --width-mm 88
  sqslam figure iou out/sq out/quadric -o iou.pdf --width-mm 180 --title "3D IoU"
  sqslam figure outliers out/desk --object 2 --object 7 -o outliers.pdf
  sqslam figure yaw out/desk --object 2 -o yaw.pdf
  sqslam figure NAME --help        options of a figure, with examples
)";

// The arguments of a figure on the command line.
struct FigureArguments {
  FigureTask task;
  FigureRequest request;
  std::string output;
  std::string resolution;
  std::string backend = "auto";
  std::string style = "paper";
  std::vector<std::string> settings;
  bool quiet = false;
};

void AddPageOptions(CLI::App& command, const FigureEntry& figure, FigureArguments& a) {
  FigureOptions& page = a.request.page;
  const auto add = [&command](const std::string& name, auto& value, const std::string& help) {
    return command.add_option(name, value, help)->group("Page");
  };
  add("-o,--output", a.output, "FILE.png, FILE.svg or FILE.pdf")->required();
  add("--width-mm", page.width_mm, "Width; else that of a column or of a page");
  add("--height-mm", page.height_mm, "Height; else what the figure needs");
  add("--dpi", page.dpi, "Pixels per inch of a PNG and of pictures in a page; 300 by default");
  add("--resolution", a.resolution,
      "WIDTH,HEIGHT in pixels instead of millimetres; letters grow with the width unless --dpi says how "
      "large a pixel is");
  add("--font-size", page.font_size, "Points")->capture_default_str();
  add("--title", page.title, "A line above the figure");
  command.add_flag("--no-background", page.transparent, "Transparent instead of the style's background")
      ->group("Page");
  add("--style", a.style, "A style's name (paper, dark) or FILE.yaml")->capture_default_str();
  add("--set", a.settings, "KEY=VALUE of the style, repeatable")->expected(1)->take_all();
  if (figure.pictures) {
    add("--rendering-backend", a.backend, "auto, osmesa or egl")
        ->check(CLI::IsMember({"auto", "osmesa", "egl"}))
        ->capture_default_str();
  }
  command.add_flag("--quiet", a.quiet, "No progress")->group("Page");
}

// The things that are drawn: results with their names, objects and frames, and from where maps are seen.
void AddInputs(CLI::App& command, const FigureEntry& figure, FigureRequest& request) {
  const auto many = [](CLI::Option* option) { option->expected(1)->take_all(); };
  if (!figure.results_help.empty()) {
    CLI::Option* results = command.add_option("RESULT", request.results, figure.results_help)->required();
    if (!figure.several) {
      results->expected(1);
    }
  }
  if (!figure.names_help.empty()) {
    many(command.add_option("--name", request.names, figure.names_help));
  }
  if (figure.objects) {
    many(command.add_option("--object", request.objects, "An object (sqslam info RESULT); may be repeated"));
  }
  if (!figure.frames_help.empty()) {
    CLI::Option* frames = command.add_option("--frame", request.frames, figure.frames_help)->expected(1);
    frames->multi_option_policy(figure.several ? CLI::MultiOptionPolicy::TakeAll
                                               : CLI::MultiOptionPolicy::Throw);
  }
  if (figure.view) {
    CameraOverrides& camera = request.page.camera;
    command.add_option("--camera-azimuth-angle", camera.azimuth, "Turn around what is shown, degrees")
        ->group("Camera");
    command.add_option("--camera-elevation-angle", camera.elevation, "Raise, degrees")->group("Camera");
    command.add_option("--camera-zoom-factor", camera.zoom, "Above 1: nearer")
        ->check(CLI::Range(0.01, 100.0))
        ->group("Camera");
  }
}

// A figure's own option: its variable, with the limits that its field states.
struct AddOwnOption {
  CLI::App& command;
  const FigureOption& option;

  std::string Name() const { return option.names.substr(0, option.names.find(' ')); }
  void operator()(bool* value) const { command.add_flag(Name(), *value, option.help); }
  void operator()(std::vector<std::string>* values) const {
    command.add_option(Name(), *values, option.help)->expected(1)->take_all();
  }
  void operator()(std::string* value) const {
    CLI::Option* added = command.add_option(Name(), *value, option.help)->capture_default_str();
    if (!option.field.allowed.empty()) {
      added->check(CLI::IsMember(option.field.allowed));
    }
  }
  void operator()(std::span<double>) const {}  // no figure has lists of numbers
  void operator()(const EnumOption& value) const {
    const std::vector<std::string>& names = option.field.allowed;
    const auto set = [value, names](const std::string& name) {
      value.set(static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin()));
    };
    command.add_option_function<std::string>(Name(), set, option.help)->check(CLI::IsMember(names));
  }
  template <typename Number>
  void operator()(Number* value) const {
    CLI::Option* added = command.add_option(Name(), *value, option.help)
                             ->check(CLI::Range(option.field.min, option.field.max));
    if (*value >= option.field.min) {  // else it stands for the figure's own choice
      added->capture_default_str();
    }
  }
};

// Throws UsageError.
void CompletePage(const FigureEntry& figure, FigureArguments& a) {
  CheckFigurePath(a.output);
  FigureOptions& page = a.request.page;
  if (!a.resolution.empty()) {
    const std::vector<double> size = ParseNumberList("--resolution", a.resolution);
    if (size.size() != 2 || size[0] != static_cast<int>(size[0]) || size[1] != static_cast<int>(size[1])) {
      throw UsageError(
          fmt::format("--resolution {}: expected WIDTH,HEIGHT in pixels, such as 1600,900", a.resolution));
    }
    page.width_px = static_cast<int>(size[0]);
    page.height_px = static_cast<int>(size[1]);
  }
  page.backend = ParseRenderBackend(a.backend);
  page.style = LoadStyle(a.style);
  if (figure.adapt_style != nullptr) {
    figure.adapt_style(page.style);
  }
  for (const std::string& setting : a.settings) {
    SetOption(setting, page.style);
  }
  CheckFigureOptions(page);
}

FrameImages VideoOf(const std::string& result) {
  const std::filesystem::path file = MapFile(result);
  const auto frames = std::make_shared<InputFrames>(RecordingReader(file), file);
  if (!frames->HasVideo()) {
    return nullptr;
  }
  return [frames](std::int64_t frame) { return frames->ImageOf(frame); };
}

// Leaves the terminal's line also where a figure cannot be drawn.
struct PictureCounter {
  std::optional<Progress> progress;
  ~PictureCounter() {
    if (progress) {
      progress->Finish();
    }
  }
};

void DrawFigure(const FigureEntry& figure, FigureArguments& a) {
  CompletePage(figure, a);
  a.request.video_of = VideoOf;
  PictureCounter counter;
  a.request.progress = [&](int done, int total) {
    if (!counter.progress) {
      counter.progress.emplace(total, a.quiet, "picture");
    }
    counter.progress->Update(done, "");
  };
  WriteFigure(a.task.draw(a.request), a.output);
}

void AddFigure(CLI::App& parent, const FigureEntry& figure) {
  CLI::App* command = parent.add_subcommand(figure.name, figure.help);
  command->footer(figure.details);
  const auto a = std::make_shared<FigureArguments>();
  a->task = figure.make();
  AddPageOptions(*command, figure, *a);
  AddInputs(*command, figure, a->request);
  for (const FigureOption& option : a->task.options) {
    std::visit(AddOwnOption{*command, option}, option.field.value);
  }
  command->callback([figure, a] { DrawFigure(figure, *a); });
}

}  // namespace

void AddFigureCommand(CLI::App& app, int& /*exit_code*/) {
  CLI::App* figure = app.add_subcommand("figure", "Draw a figure for a paper: shapes, maps, charts");
  figure->footer(kFigureFooter);
  figure->allow_extras();  // so that an unknown figure is named below, not refused as a stray argument
  for (const FigureEntry& entry : AllFigures()) {
    AddFigure(*figure, entry);
  }
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
