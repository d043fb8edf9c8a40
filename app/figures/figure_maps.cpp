#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "app/figures/figure_common.h"
#include "app/result/input_frames.h"
#include "app/result/map_input.h"
#include "render/figures/panel_figures.h"
#include "render/page/write_figure.h"
#include "slam/io/image_resize.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMapsFooter = R"(
Above each map stands an input image of its run: the frame in which most boxes belonged to objects, or that
nearest to --frame. --boxes draws these boxes. A class has one colour in all maps and boxes; one legend below
serves all. Results without images (live cameras, images and videos that have gone) get an empty place, or only
their map where none has any.

Examples:
  sqslam figure maps out/kitchen out/desk --output maps.pdf
  sqslam figure maps out/a out/b out/c --name "Desk A" --name "Desk B" --name Kitchen --boxes --output maps.png
  sqslam figure maps out/kitchen --labels --frame 300 --width-mm 120 --dpi 600 --output kitchen.png
  sqslam figure maps out/* --columns 3 --no-images --set cameras.keyframes=false --output all.pdf
)";

struct MapsArguments : FigureArguments {
  std::vector<std::string> results;
  std::vector<std::string> names;
  std::vector<std::int64_t> frames;
  int columns = 0;
  bool boxes = false;
  bool labels = false;
  bool no_images = false;
};

bool HasImage(const MapSnapshot& map) {
  std::error_code error;
  return !map.image_path.empty() && fs::is_regular_file(map.image_path, error);
}

// The snapshot whose image is shown; null where no image is left.
MapSnapshotPtr Representative(const RecordingReader& reader, std::optional<std::int64_t> frame,
                              bool in_video) {
  constexpr int kMostRead = 120;  // snapshots looked at, evenly over the run
  const int step = frame ? 1 : std::max(1, reader.Size() / kMostRead);
  MapSnapshotPtr best;
  std::int64_t best_value = -1;
  if (frame) {
    int nearest = 0;
    for (int i = 0; i < reader.Size(); ++i) {
      if (std::abs(reader.FrameIndex(i) - *frame) < std::abs(reader.FrameIndex(nearest) - *frame)) {
        nearest = i;
      }
    }
    const MapSnapshotPtr map = reader.Read(nearest);
    return in_video || HasImage(*map) ? map : nullptr;
  }
  for (int i = reader.Size() - 1; i >= 0; i -= step) {
    const MapSnapshotPtr map = reader.Read(i);
    const auto value = std::count_if(map->detections.begin(), map->detections.end(),
                                     [](const SnapshotDetection& box) { return box.object_id >= 0; });
    if (value > best_value && (in_video || HasImage(*map))) {
      best = map;
      best_value = value;
    }
  }
  return best;
}

// Boxes that belong to objects, under the labels that these have in the end.
std::vector<MapsFigure::Box> BoxesOf(const MapSnapshot& moment, const MapSnapshot& last) {
  std::vector<MapsFigure::Box> boxes;
  for (const SnapshotDetection& box : moment.detections) {
    if (box.object_id < 0) {
      continue;
    }
    std::string label = box.detection.label;
    for (const SnapshotObject& object : last.objects) {
      label = object.id == box.object_id ? object.label : label;
    }
    boxes.push_back({label, box.detection.box});
  }
  return boxes;
}

MapsFigure::Panel ReadPanel(const MapsArguments& a, const std::string& result, const std::string& name,
                            std::optional<std::int64_t> frame) {
  const RecordingReader reader(MapFile(result));
  if (reader.Size() == 0) {
    throw InputError(fmt::format("{}: holds no snapshot, expected a map", result));
  }
  MapsFigure::Panel panel;
  panel.name = name;
  panel.map = *reader.Last();
  const InputFrames frames(reader, MapFile(result));
  const MapSnapshotPtr moment = a.no_images ? nullptr : Representative(reader, frame, frames.HasVideo());
  if (moment) {
    panel.image = HasImage(*moment)
                      ? ReadImageInSize(moment->image_path, {moment->camera.width, moment->camera.height})
                      : frames.ImageOf(moment->frame_index);
    if (a.boxes && !panel.image.empty()) {
      panel.boxes = BoxesOf(*moment, panel.map);
    }
  }
  return panel;
}

void Draw(const MapsArguments& a) {
  const FigureOptions options = MakeFigureOptions(a);
  const std::vector<std::string> names = NamesOf(a.results, a.names);
  if (!a.frames.empty() && a.frames.size() != a.results.size()) {
    throw UsageError(fmt::format("--frame: {} for {}, expected one for each result in their order",
                                 a.frames.size(), a.results.size()));
  }
  MapsFigure figure;
  figure.columns = a.columns;
  figure.labels = a.labels;
  for (std::size_t i = 0; i < a.results.size(); ++i) {
    figure.panels.push_back(
        ReadPanel(a, a.results[i], names[i], a.frames.empty() ? std::nullopt : std::optional(a.frames[i])));
  }
  FigureCounter counter(a.quiet);
  WriteFigure(DrawMaps(figure, options, std::ref(counter)), a.output);
}

}  // namespace

void AddMapsFigure(CLI::App& figure) {
  const auto a = std::make_shared<MapsArguments>();
  CLI::App* command = AddFigure(figure, "maps", "Maps in a row, each below an image of its run", kMapsFooter,
                                FigureKind::kPanels, *a);
  command->add_option("RESULT", a->results, "Result folders of sqslam run, or their map.sqmap")->required();
  command->add_option("--name", a->names, "Name below a map, repeatable, in their order")
      ->expected(1)
      ->take_all();
  command->add_option("--frame", a->frames, "Frame whose image is shown, repeatable, in the maps' order")
      ->expected(1)
      ->take_all();
  command->add_option("--columns", a->columns, "Maps in a row; by default all, up to five")
      ->check(CLI::Range(1, 20));
  command->add_flag("--boxes", a->boxes, "Draw the boxes of objects on the images");
  command->add_flag("--labels", a->labels, "Names over the objects");
  command->add_flag("--no-images", a->no_images, "Maps only");
  AddViewOptions(*command, *a);
  command->callback([a] { Draw(*a); });
}

}  // namespace sqslam::app
