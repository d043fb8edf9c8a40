#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/terminal/terminal.h"
#include "render/page/figure_options.h"
#include "render/page/page.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// What every figure's command takes.
struct FigureArguments {
  std::string output;
  std::string resolution;
  std::optional<double> width_mm, height_mm, dpi;
  std::string title;
  double font_size = 8.0;
  bool no_background = false;
  std::string backend = "auto";
  std::string style = "paper";
  std::vector<std::string> settings;
  double azimuth = 0.0;
  double elevation = 0.0;
  double zoom = 1.0;
  bool quiet = false;
};

enum class FigureKind { kChart, kPanels };

// Registers `sqslam figure NAME` with these options and returns it; kPanels adds those of pictures of maps.
CLI::App* AddFigure(CLI::App& figure, const std::string& name, const std::string& description,
                    const std::string& footer, FigureKind kind, FigureArguments& arguments);

// --camera-azimuth-angle, --camera-elevation-angle, --camera-zoom-factor, as in sqslam render.
void AddViewOptions(CLI::App& command, FigureArguments& arguments);

// Options from the arguments; `adapt` changes the style before --set does, to what this figure looks best in.
// Throws UsageError.
FigureOptions MakeFigureOptions(const FigureArguments& arguments,
                                const std::function<void(SceneStyle&)>& adapt = {});

// Counts pictures on stderr.
class FigureCounter {
 public:
  explicit FigureCounter(bool quiet) : quiet_(quiet) {}
  ~FigureCounter();
  void operator()(int done, int total);

 private:
  bool quiet_;
  std::optional<Progress> progress_;
};

// The last map of a result folder or map.sqmap, and the folder of what was mapped. Throws InputError.
struct FigureMap {
  MapSnapshotPtr map;
  std::string sequence;
};
FigureMap LastMap(const std::filesystem::path& result);

// A name for each result: those given, or the last folder names. Throws UsageError where there are not as
// many names as results.
std::vector<std::string> NamesOf(const std::vector<std::string>& results,
                                 const std::vector<std::string>& names);

// "0.1,0.5,1" to numbers; throws UsageError that names the option.
std::vector<double> ParseNumberList(const std::string& option, const std::string& text);

// One function a figure, in a file of its own: figure_NAME.cpp. A further figure gets its file, its line
// here, in figure_command.cpp and in CMakeLists.txt.
void AddShapesFigure(CLI::App& figure);
void AddCompareFigure(CLI::App& figure);
void AddMapsFigure(CLI::App& figure);
void AddTrajectoryFigure(CLI::App& figure);
void AddTimingFigure(CLI::App& figure);
void AddIouFigure(CLI::App& figure);
void AddOutliersFigure(CLI::App& figure);
void AddYawFigure(CLI::App& figure);

}  // namespace sqslam::app
