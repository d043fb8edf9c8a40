#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <ranges>
#include <set>

#include "render/figures/figure_input.h"
#include "render/figures/figure_names.h"
#include "render/page/chart.h"
#include "render/picture/label_layout.h"
#include "render/picture/picture.h"
#include "render/picture/picture_overlay.h"
#include "render/scene/object_look.h"
#include "slam/io/result_files.h"
#include "slam/util/thinned.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// The classes of a figure's maps and boxes.
struct MapClasses {
  LabelColors colors;
  std::set<std::string> all;
  std::set<std::string> certain;  // of reliable objects and boxes
  bool uncertain_lines = false;   // some objects are drawn as faint lines

  MapClasses(const MapsFigure& figure, const SceneStyle::Objects& style) : colors(style.colors) {
    for (const MapsFigure::Panel& panel : figure.panels) {
      for (const SnapshotObject& object : panel.map.objects) {
        all.insert(object.label);
        if (style.uncertain == UncertainObjects::kSolid || IsReliable(object)) {
          certain.insert(object.label);
        } else if (style.uncertain == UncertainObjects::kOutline) {
          uncertain_lines = true;
        }
      }
      for (const Detection& box : panel.boxes) {
        all.insert(box.label);
        certain.insert(box.label);
      }
    }
  }

  std::vector<LegendEntry> Legend(const FigureTheme& theme) const {
    std::vector<LegendEntry> entries = ToVector(certain, [this](const std::string& label) {
      return LegendEntry::Bar(ReadableLabel(label), {colors(label), {}, 0});
    });
    if (uncertain_lines) {
      entries.push_back(LegendEntry::Line("uncertain", theme.Axis()));
    }
    return entries;
  }
};

PanelGrid LayOutMaps(const MapsFigure& figure, const MapClasses& classes, const FigureTheme& theme,
                     double width) {
  const int count = static_cast<int>(figure.panels.size());
  const int columns = std::clamp(figure.columns > 0 ? figure.columns : std::min(count, 5), 1, count);
  PanelGrid grid = PanelGrid::Of(columns, (count + columns - 1) / columns, width);
  const auto with_image = std::ranges::find_if(
      figure.panels, [](const MapsFigure::Panel& panel) { return !panel.image.empty(); });
  grid.height = grid.width / (4.0 / 3.0);
  if (with_image != figure.panels.end()) {
    grid.height = grid.image =
        grid.width / (static_cast<double>(with_image->image.cols) / with_image->image.rows);
  }
  grid.images_grow = false;
  grid.texts = 1.9 * theme.font;
  grid.below = LegendHeight(classes.Legend(theme), width, theme);
  return grid;
}

// Draws the names of boxes into them, or beside them with a leader if they are too small.
void DrawBoxNames(FigureSheet& sheet, const MapsFigure::Panel& panel, const FigureRect& area) {
  const cv::Size pixels(cvRound(FigureNames::kPixelsPerPoint * area.width),
                        cvRound(FigureNames::kPixelsPerPoint * area.height));
  const double scale = static_cast<double>(pixels.width) / panel.image.cols;
  const double letters = 0.75 * sheet.theme.small;
  FigureNames writer(sheet, area, pixels, letters);
  std::vector<cv::Rect> boxes;
  for (const auto& [label, score, box] : panel.boxes) {
    boxes.push_back(cv::Rect(cvRound(scale * box.x), cvRound(scale * box.y), cvRound(scale * box.width),
                             cvRound(scale * box.height)) &
                    cv::Rect({0, 0}, pixels));
  }
  std::vector<std::size_t> order(boxes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater(), [&](std::size_t i) { return boxes[i].area(); });
  cv::Mat1i number(pixels, -1);
  for (const std::size_t i : order) {  // small ones on top
    number(boxes[i]) = static_cast<int>(i);
  }
  std::vector<std::string> names;
  std::vector<LabelRequest> requests;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    names.push_back(ReadableLabel(panel.boxes[i].label));
    const cv::Size size = writer.SizeOf(names.back());
    const int margin = cvRound(FigureNames::kPixelsPerPoint);
    requests.push_back({VisiblePartOf(number == static_cast<int>(i)), size,
                        static_cast<double>(boxes[i].area()), static_cast<int>(i),
                        cv::Rect(boxes[i].tl() + cv::Point(margin, margin), size)});
  }
  writer.Draw(names, std::vector<Eigen::Vector3d>(names.size(), sheet.theme.ink), requests, number);
}

// Draws the image as large as it fits, with boxes in the colours of their classes and, optionally, names.
void DrawImageWithBoxes(FigureSheet& sheet, const MapsFigure::Panel& panel, const FigureRect& area,
                        bool names, const MapClasses& classes) {
  if (panel.image.empty()) {
    DrawNoImage(sheet, area);
    return;
  }
  FigurePage& page = sheet.page;
  const FigureRect fitted = area.Fitted(panel.image.cols, panel.image.rows);
  const double scale = fitted.width / panel.image.cols;
  page.Image(panel.image, fitted);
  const double stroke = std::min(1.1, 0.0065 * area.width);
  for (const Detection& detection : panel.boxes) {
    const Box2d& box = detection.box;
    const Eigen::Array2d size(panel.image.cols, panel.image.rows);
    const Eigen::Array2d from = Eigen::Array2d(box.x, box.y).max(0.0).min(size);
    const Eigen::Array2d to = Eigen::Array2d(box.x + box.width, box.y + box.height).max(0.0).min(size);
    const FigureRect outline{fitted.x + scale * from.x(), fitted.y + scale * from.y(),
                             scale * (to.x() - from.x()), scale * (to.y() - from.y())};
    page.Rect(outline, {}, FigureStroke{{0.0, 0.0, 0.0}, 1.6 * stroke, {}});  // visible on any image
    page.Rect(outline, {}, FigureStroke{classes.colors(detection.label), stroke, {}});
  }
  if (names) {
    DrawBoxNames(sheet, panel, fitted);
  }
}

}  // namespace

FigurePage DrawMaps(const MapsFigure& figure, const FigureOptions& options) {
  ThrowIf<UsageError>(figure.panels.empty(), "no maps, expected at least one");
  const MapClasses classes(figure, options.style.objects);
  PanelSheet sheet = MakePanelSheet(
      options, figure.panels.size() == 1 ? kColumnWidth : kTextWidth, "Object maps",
      [&](double width, const FigureTheme& theme) { return LayOutMaps(figure, classes, theme, width); });
  const FigureTheme& theme = sheet.theme;
  const PanelGrid& grid = sheet.grid;
  constexpr std::size_t kMaxColors = 12;  // more cannot be told apart
  const bool names = figure.labels || classes.all.size() > kMaxColors;
  PictureRenderer renderer(PanelOptions(options, sheet));
  const int count = static_cast<int>(figure.panels.size());
  options.Tell(0, count);
  for (int i = 0; i < count; ++i) {
    const MapsFigure::Panel& panel = figure.panels[static_cast<std::size_t>(i)];
    const auto [row, column] = std::div(i, grid.columns);
    const FigureRect area = sheet.PanelAt(row, column);
    if (grid.image > 0.0) {
      DrawImageWithBoxes(sheet, panel, sheet.ImageAt(row, column), names, classes);
    }
    renderer.SetLayers({{}, panel.dense_cloud, nullptr});
    renderer.SetMap(panel.map);
    const cv::Mat picture = renderer.Render();
    PlacePanel(sheet.page, picture, area);
    if (names) {
      const SceneLayers layers{{}, panel.dense_cloud, nullptr};
      DrawObjectNames(sheet, panel.map.objects, options.style, SolidsAreSeeThrough(options.style, layers),
                      renderer.DefaultCamera(), picture.size(), area);
    }
    const std::string letter = count < 2 || i > 25 ? "" : fmt::format("({}) ", static_cast<char>('a' + i));
    sheet.page.Label(letter + panel.name, {area.Center().x(), area.Bottom() + 0.9 * theme.font}, theme.font,
                     theme.ink, grid.width);
    options.Tell(i + 1, count);
  }
  DrawLegend(sheet, classes.Legend(theme), sheet.Below());
  return std::move(sheet.page);
}

namespace {

struct MapsOptions {
  int columns = 0;
  bool boxes = false;
  bool labels = false;
  bool no_images = false;
  void VisitFields(auto&& visit) {
    visit("--columns N", "Maps in a row; default: all, up to five", columns, 1, 20);
    visit("--boxes", "Draw the boxes of objects on the images", boxes);
    visit("--labels", "Names at the objects and in their boxes; always with more than twelve classes",
          labels);
    visit("--no-images", "Maps only", no_images);
  }
};

// Returns the snapshot whose image is shown: that nearest to `frame`, or with the most boxes of objects; null
// if no image is available.
MapSnapshotPtr Representative(const RecordedMap& recorded, std::optional<std::int64_t> frame) {
  constexpr std::size_t kMaxRead = 120;  // snapshots, evenly over the run
  const RecordingReader& reader = *recorded.reader;
  if (frame) {
    const auto distance = [&](int i) { return std::abs(reader.FrameIndex(i) - *frame); };
    const MapSnapshotPtr map =
        reader.Read(*std::ranges::min_element(std::views::iota(0, reader.Size()), {}, distance));
    return recorded.images->Has(*map) ? map : nullptr;
  }
  const int step = static_cast<int>(StepThrough(static_cast<std::size_t>(reader.Size()), kMaxRead));
  MapSnapshotPtr best;
  std::ptrdiff_t most_boxes = -1;
  for (int i = reader.Size() - 1; i >= 0; i -= step) {
    const MapSnapshotPtr map = reader.Read(i);
    const auto boxes = std::ranges::count_if(map->detections,
                                             [](const SnapshotDetection& box) { return box.object_id >= 0; });
    if (boxes > most_boxes && recorded.images->Has(*map)) {
      best = map;
      most_boxes = boxes;
    }
  }
  return best;
}

// Returns the boxes of the objects of the finished map, with their final labels.
std::vector<Detection> BoxesOf(const MapSnapshot& moment, const MapSnapshot& last) {
  std::vector<Detection> boxes;
  for (const SnapshotDetection& seen : moment.detections) {
    const auto object = std::ranges::find(last.objects, seen.object_id, &SnapshotObject::id);
    if (object != last.objects.end()) {
      boxes.emplace_back(seen.detection).label = object->label;
    }
  }
  return boxes;
}

MapsFigure::Panel ReadPanel(const FigureRequest& request, std::size_t index, const std::string& name,
                            const MapsOptions& options) {
  const std::string& result = request.results[index];
  const RecordedMap map = OpenMap(request, result);
  const auto frame = request.frames.empty() ? std::nullopt : std::optional(request.frames[index]);
  const MapSnapshotPtr moment = options.no_images ? nullptr : Representative(map, frame);
  MapsFigure::Panel panel;
  panel.name = name;
  panel.map = *map.last;
  if (request.page.style.dense_cloud.show) {
    panel.dense_cloud = ReadCloudLayer(ResultFile(result, "map.sqmap"));
  }
  if (moment) {
    panel.image = map.images->Read(*moment);
    if (options.boxes && !panel.image.empty()) {
      panel.boxes = BoxesOf(*moment, panel.map);
    }
  }
  return panel;
}

FigurePage DrawMapsOf(const FigureRequest& request, const MapsOptions& options) {
  const std::vector<std::string> names = ResultNames(request);
  ThrowIf<UsageError>(!request.frames.empty() && request.frames.size() != request.results.size(),
                      "--frame: {} for {}, expected one for each result in their order",
                      request.frames.size(), request.results.size());
  MapsFigure figure;
  figure.columns = options.columns;
  figure.labels = options.labels;
  for (std::size_t i = 0; i < request.results.size(); ++i) {
    figure.panels.push_back(ReadPanel(request, i, names[i], options));
  }
  return DrawMaps(figure, request.page);
}

}  // namespace

FigureEntry MapsEntry() {
  return FigureEntry{
      .name = "maps",
      .help = "Maps in a row, each below an image of its run",
      .details = R"(
Above each map stands an input image of its run: the frame with the most boxes of objects, or the one nearest to
--frame. --boxes draws these boxes. A class has one colour in all maps and boxes, and one legend below serves
all. With more than twelve classes, names stand beside the objects and in the boxes as well (--labels: always), with a
line to what they name where something else is between. Objects that others hide have no name.
Results without images (live cameras, deleted images and videos) get an empty place, or only their map if no
result has an image.

Examples:
  sqslam figure maps out/kitchen out/desk -o maps.pdf
  sqslam figure maps out/a out/b out/c --name "Desk A" --name "Desk B" --name Kitchen --boxes -o maps.png
  sqslam figure maps out/kitchen --labels --frame 300 --width-mm 120 --dpi 600 -o kitchen.png
  sqslam figure maps out/* --columns 3 --no-images --set cameras.keyframes=false -o all.pdf
)",
      .results_help = "Result folders of sqslam run, or their map.sqmap",
      .several = true,
      .names_help = "Name below a map; repeated for each, in their order",
      .maps = true,
      .frames_help = "Frame whose image is shown; repeated for each map, in their order",
      .pictures = true,
      .view = true,
  }
      .DrawnBy(DrawMapsOf);
}

}  // namespace sqslam
