#include "app/figures/figure_common.h"

#include <fmt/format.h>

#include <charconv>

#include "app/result/map_input.h"
#include "render/page/write_figure.h"
#include "slam/evaluation/comparison.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;

CLI::App* AddFigure(CLI::App& figure, const std::string& name, const std::string& description,
                    const std::string& footer, FigureKind kind, FigureArguments& a) {
  CLI::App* command = figure.add_subcommand(name, description);
  command->footer(footer);
  const char* page = "Page";
  command->add_option("--output", a.output, "FILE.png, FILE.svg or FILE.pdf")->required()->group(page);
  command->add_option("--width-mm", a.width_mm, "Width; else that of a column or of a page")->group(page);
  command->add_option("--height-mm", a.height_mm, "Height; else what the figure needs")->group(page);
  command->add_option("--dpi", a.dpi, "Pixels per inch of a PNG and of pictures in a page; 300 by default")
      ->group(page);
  command
      ->add_option("--resolution", a.resolution,
                   "WIDTH,HEIGHT in pixels instead of millimetres; letters grow with the width unless --dpi "
                   "says how large a pixel is")
      ->group(page);
  command->add_option("--font-size", a.font_size, "Points")->capture_default_str()->group(page);
  command->add_option("--title", a.title, "A line above the figure")->group(page);
  command->add_flag("--no-background", a.no_background, "Transparent instead of the style's background")
      ->group(page);
  command->add_option("--style", a.style, "A style's name (paper, dark) or FILE.yaml")
      ->capture_default_str()
      ->group(page);
  command->add_option("--set", a.settings, "KEY=VALUE of the style, repeatable")
      ->expected(1)
      ->take_all()
      ->group(page);
  if (kind == FigureKind::kPanels) {
    command->add_option("--rendering-backend", a.backend, "auto, osmesa or egl")
        ->check(CLI::IsMember({"auto", "osmesa", "egl"}))
        ->capture_default_str()
        ->group(page);
  }
  command->add_flag("--quiet", a.quiet, "No progress")->group(page);
  return command;
}

void AddViewOptions(CLI::App& command, FigureArguments& a) {
  const char* group = "Camera";
  command.add_option("--camera-azimuth-angle", a.azimuth, "Turn around what is shown, degrees")->group(group);
  command.add_option("--camera-elevation-angle", a.elevation, "Raise, degrees")->group(group);
  command.add_option("--camera-zoom-factor", a.zoom, "Above 1: nearer")
      ->check(CLI::Range(0.01, 100.0))
      ->group(group);
}

FigureOptions MakeFigureOptions(const FigureArguments& a, const std::function<void(SceneStyle&)>& adapt) {
  CheckFigurePath(a.output);
  FigureOptions options;
  options.width_mm = a.width_mm;
  options.height_mm = a.height_mm;
  options.dpi = a.dpi;
  if (!a.resolution.empty()) {
    const std::vector<double> size = ParseNumberList("--resolution", a.resolution);
    if (size.size() != 2 || size[0] != static_cast<int>(size[0]) || size[1] != static_cast<int>(size[1])) {
      throw UsageError(
          fmt::format("--resolution {}: expected WIDTH,HEIGHT in pixels, such as 1600,900", a.resolution));
    }
    options.width_px = static_cast<int>(size[0]);
    options.height_px = static_cast<int>(size[1]);
  }
  options.title = a.title;
  options.font_size = a.font_size;
  options.transparent = a.no_background;
  options.backend = ParseRenderBackend(a.backend);
  options.style = LoadStyle(a.style);
  if (adapt) {
    adapt(options.style);
  }
  for (const std::string& setting : a.settings) {
    SetOption(setting, options.style);
  }
  options.camera.azimuth = a.azimuth;
  options.camera.elevation = a.elevation;
  options.camera.zoom = a.zoom;
  CheckFigureOptions(options);
  return options;
}

FigureCounter::~FigureCounter() {
  if (progress_) {
    progress_->Finish();
  }
}

void FigureCounter::operator()(int done, int total) {
  if (!progress_) {
    progress_.emplace(total, quiet_, "picture");
  }
  progress_->Update(done, "");
}

FigureMap LastMap(const fs::path& result) {
  const RecordingReader reader(MapFile(result));
  if (reader.Size() == 0) {
    throw InputError(fmt::format("{}: holds no snapshot, expected a map", result.string()));
  }
  return {reader.Last(), reader.Info().sequence_path};
}

std::vector<std::string> NamesOf(const std::vector<std::string>& results,
                                 const std::vector<std::string>& names) {
  if (names.empty()) {
    return ShortNames({results.begin(), results.end()});
  }
  if (names.size() != results.size()) {
    throw UsageError(fmt::format("--name: {} for {}, expected one for each result in their order",
                                 names.size(), results.size()));
  }
  return names;
}

std::vector<double> ParseNumberList(const std::string& option, const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    double number = 0.0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc() || (next != end && *next != ',')) {
      throw UsageError(
          fmt::format("{} {}: expected numbers with commas between them, such as 0.1,1", option, text));
    }
    numbers.push_back(number);
    if (next == end) {
      return numbers;
    }
    at = next + 1;
  }
}

}  // namespace sqslam::app
