#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/picture/picture.h"
#include "render/picture/picture_overlay.h"
#include "slam/geometry/superquadric.h"
#include "slam/io/result_files.h"
#include "slam/util/thinned.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Returns the colours that all panels share, for the classes of all maps and boxes.
std::map<std::string, Eigen::Vector3d> CommonColors(const MapsFigure& figure) {
  std::set<std::string> labels;
  for (const MapsFigure::Panel& panel : figure.panels) {
    for (const SnapshotObject& object : panel.map.objects) {
      labels.insert(object.label);
    }
    for (const Detection& box : panel.boxes) {
      labels.insert(box.label);
    }
  }
  const std::vector<std::string> all(labels.begin(), labels.end());
  const LabelColors colors(all);
  std::map<std::string, Eigen::Vector3d> result;
  for (const std::string& label : all) {
    result[label] = colors(label);
  }
  return result;
}

// Lists the classes of reliable objects and of boxes, and explains the faint lines of uncertain objects.
std::vector<LegendEntry> ClassLegend(const MapsFigure& figure, UncertainObjects uncertain,
                                     const std::map<std::string, Eigen::Vector3d>& colors,
                                     const FigureTheme& theme) {
  std::set<std::string> labels;
  bool faint = false;
  for (const MapsFigure::Panel& panel : figure.panels) {
    for (const SnapshotObject& object : panel.map.objects) {
      const bool certain = uncertain == UncertainObjects::kSolid || IsReliable(object);
      faint = faint || (!certain && uncertain == UncertainObjects::kOutline);
      if (certain) {
        labels.insert(object.label);
      }
    }
    for (const Detection& box : panel.boxes) {
      labels.insert(box.label);
    }
  }
  std::vector<LegendEntry> entries = ToVector(labels, [&](const std::string& label) {
    return LegendEntry::Bar(ReadableLabel(label), {colors.at(label), {}, 0});
  });
  if (faint) {
    entries.push_back(LegendEntry::Line("uncertain", theme.Axis()));
  }
  return entries;
}

PanelGrid LayOutMaps(const MapsFigure& figure, UncertainObjects uncertain, const FigureTheme& theme,
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
  grid.texts = 1.9 * theme.font;
  grid.below = LegendHeight(ClassLegend(figure, uncertain, CommonColors(figure), theme), width, theme);
  return grid;
}

// Draws the image as large as it fits, with boxes in the colours of their classes and, optionally, names.
void DrawImageWithBoxes(FigurePage& page, const MapsFigure::Panel& panel, const FigureRect& area, bool names,
                        const std::map<std::string, Eigen::Vector3d>& colors, const FigureTheme& theme) {
  if (panel.image.empty()) {
    DrawNoImage(page, area, theme);
    return;
  }
  const FigureRect fitted = area.Fitted(panel.image.cols, panel.image.rows);
  const double scale = fitted.width / panel.image.cols;
  page.Image(panel.image, fitted);
  const double stroke = std::min(1.1, 0.0065 * area.width);
  for (const Detection& box : panel.boxes) {
    const double left = std::clamp(box.box.x, 0.0, double(panel.image.cols));
    const double top = std::clamp(box.box.y, 0.0, double(panel.image.rows));
    const double right = std::clamp(box.box.x + box.box.width, 0.0, double(panel.image.cols));
    const double bottom = std::clamp(box.box.y + box.box.height, 0.0, double(panel.image.rows));
    const FigureRect outline{fitted.x + scale * left, fitted.y + scale * top, scale * (right - left),
                             scale * (bottom - top)};
    page.Rect(outline, {}, FigureStroke{{0.0, 0.0, 0.0}, 1.6 * stroke, {}});  // visible on any image
    page.Rect(outline, {}, FigureStroke{colors.at(box.label), stroke, {}});
    if (const double size = 0.75 * theme.small; names && outline.height > 1.2 * size) {
      FigureText name = NarrowText({ReadableLabel(box.label), {}, size, theme.ink}, outline.width - 2.0);
      name.anchor = {outline.x + 1.5, outline.y + 0.75 * size};
      name.halo = theme.background;
      page.Text(name);
    }
  }
}

// Draws names above the objects, nearest first. A name that would cover another moves up one line; if there
// is no room either, it is left out, as farther up it would seem to belong to something else.
void DrawObjectNames(FigurePage& page, const MapSnapshot& map, UncertainObjects uncertain,
                     const ViewCamera& camera, cv::Size pixels, const FigureRect& area,
                     const FigureTheme& theme) {
  struct Name {
    std::string text;
    Eigen::Vector2d anchor;
    double depth;
    bool certain;
  };
  const double size = 0.85 * theme.small;
  std::vector<Name> names;
  for (const SnapshotObject& object : map.objects) {
    const bool certain = uncertain == UncertainObjects::kSolid || IsReliable(object);
    if (!certain && uncertain == UncertainObjects::kHide) {
      continue;
    }
    const Eigen::Vector3d up = camera.view_up.normalized();
    const Eigen::Vector3d top =
        object.superquadric.T_map_object.translation + SupportExtent(object.superquadric, up) * up;
    const SeenPoint seen = Project(camera, pixels, top);
    const bool inside = seen.pixel.x >= 0.0 && seen.pixel.y >= 0.0 && seen.pixel.x < pixels.width &&
                        seen.pixel.y < pixels.height;
    if (seen.depth > 0.0 && inside) {
      names.push_back({ReadableLabel(object.label),
                       {area.x + seen.pixel.x / pixels.width * area.width,
                        area.y + seen.pixel.y / pixels.height * area.height - 0.8 * size},
                       seen.depth,
                       certain});
    }
  }
  std::ranges::sort(names, [](const Name& a, const Name& b) { return a.depth < b.depth; });
  std::vector<FigureRect> taken;
  for (const Name& name : names) {
    const double width = TextWidth(name.text, size);
    FigureRect box{name.anchor.x() - 0.5 * width, name.anchor.y() - 0.55 * size, width, 1.1 * size};
    box.x = std::clamp(box.x, area.x, std::max(area.x, area.Right() - width));  // inside the panel
    box.y = std::max(box.y, area.y);
    const auto covers = [&box](const FigureRect& other) {
      return box.x < other.Right() + 2.0 && other.x < box.Right() + 2.0 && box.y < other.Bottom() &&
             other.y < box.Bottom();
    };
    if (std::ranges::any_of(taken, covers)) {
      box.y -= 1.1 * size;
    }
    if (area.Contains(box) && std::ranges::none_of(taken, covers)) {
      taken.push_back(box);
      page.Text({name.text, box.Center(), size, name.certain ? theme.ink : theme.muted, TextAlign::kCenter,
                 false, 0.0, theme.background});
    }
  }
}

}  // namespace

FigurePage DrawMaps(const MapsFigure& figure, const FigureOptions& options, const FigureProgress& progress) {
  ThrowIf<UsageError>(figure.panels.empty(), "no maps, expected at least one");
  const double own_width = figure.panels.size() == 1 ? kColumnWidth : kTextWidth;
  const UncertainObjects uncertain = options.style.objects.uncertain;
  FigureSheet sheet =
      MakeSheet(options, own_width, "Object maps", [&](double width, const FigureTheme& theme) {
        return LayOutMaps(figure, uncertain, theme, width).Height();
      });
  const auto colors = CommonColors(figure);
  // More colours cannot be told apart.
  constexpr std::size_t kMostColors = 12;
  const bool names = figure.labels || colors.size() > kMostColors;
  PanelGrid grid = LayOutMaps(figure, uncertain, sheet.theme, sheet.area.width);
  // If the height was given, spare room goes to the maps; missing room is taken from maps and images.
  const double spare = grid.Spare(sheet.area);
  const double shared = spare > 0.0 ? 0.0 : grid.image / (grid.image + grid.height);
  grid.image += shared * spare;
  grid.height += (1.0 - shared) * spare;
  ThrowIf<UsageError>(grid.height < 10.0,
                      "the figure is too low for its maps, expected a larger height or more columns");
  PictureRenderer renderer(PanelOptions(options, sheet.page.dpi, grid.width, grid.height, colors));
  const int count = static_cast<int>(figure.panels.size());
  Tell(progress, 0, count);
  for (int i = 0; i < count; ++i) {
    const MapsFigure::Panel& panel = figure.panels[static_cast<std::size_t>(i)];
    const FigureRect area = grid.PanelAt(sheet.area, i / grid.columns, i % grid.columns);
    if (grid.image > 0.0) {
      const FigureRect above = grid.ImageAt(sheet.area, i / grid.columns, i % grid.columns);
      DrawImageWithBoxes(sheet.page, panel, above, names, colors, sheet.theme);
    }
    renderer.SetLayers({{}, panel.dense_cloud, nullptr});
    renderer.SetMap(panel.map);
    const cv::Mat picture = renderer.Render();
    PlacePanel(sheet.page, picture, area);
    if (names) {
      DrawObjectNames(sheet.page, panel.map, uncertain, renderer.DefaultCamera(), picture.size(), area,
                      sheet.theme);
    }
    const std::string letter = count < 2 || i > 25 ? "" : fmt::format("({}) ", static_cast<char>('a' + i));
    sheet.page.Label(letter + panel.name, {area.Center().x(), area.Bottom() + 0.9 * sheet.theme.font},
                     sheet.theme.font, sheet.theme.ink, grid.width);
    Tell(progress, i + 1, count);
  }
  DrawLegend(sheet.page, ClassLegend(figure, uncertain, colors, sheet.theme),
             {sheet.area.x, sheet.area.Bottom() - grid.below, sheet.area.width, grid.below}, sheet.theme);
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
    visit("--labels", "Names over the objects and in their boxes; always with more than twelve classes",
          labels);
    visit("--no-images", "Maps only", no_images);
  }
};

// Returns the snapshot whose image is shown; null if no image is available.
MapSnapshotPtr Representative(const RecordedMap& recorded, std::optional<std::int64_t> frame) {
  const RecordingReader& reader = *recorded.reader;
  if (frame) {
    int nearest = 0;
    for (int i = 0; i < reader.Size(); ++i) {
      if (std::abs(reader.FrameIndex(i) - *frame) < std::abs(reader.FrameIndex(nearest) - *frame)) {
        nearest = i;
      }
    }
    const MapSnapshotPtr map = reader.Read(nearest);
    return recorded.images->Has(*map) ? map : nullptr;
  }
  constexpr std::size_t kMostRead = 120;  // snapshots, evenly over the run
  const int step = static_cast<int>(StepThrough(static_cast<std::size_t>(reader.Size()), kMostRead));
  MapSnapshotPtr best;
  std::int64_t best_value = -1;
  for (int i = reader.Size() - 1; i >= 0; i -= step) {
    const MapSnapshotPtr map = reader.Read(i);
    const auto value = std::ranges::count_if(map->detections,
                                             [](const SnapshotDetection& box) { return box.object_id >= 0; });
    if (value > best_value && recorded.images->Has(*map)) {
      best = map;
      best_value = value;
    }
  }
  return best;
}

// Returns the boxes associated with objects, with the objects' final labels.
std::vector<Detection> BoxesOf(const MapSnapshot& moment, const MapSnapshot& last) {
  std::vector<Detection> boxes;
  for (const SnapshotDetection& seen : moment.detections) {
    if (seen.object_id >= 0) {
      Detection& box = boxes.emplace_back(seen.detection);
      const auto object = std::ranges::find(last.objects, seen.object_id, &SnapshotObject::id);
      box.label = object != last.objects.end() ? object->label : box.label;
    }
  }
  return boxes;
}

MapsFigure::Panel ReadPanel(const FigureRequest& request, std::size_t index, const std::string& name,
                            const MapsOptions& options) {
  const std::string& result = request.results[index];
  const RecordedMap map = OpenMap(result);
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
  return DrawMaps(figure, request.page, request.progress);
}

}  // namespace

FigureEntry MapsEntry() {
  return {.name = "maps",
          .help = "Maps in a row, each below an image of its run",
          .details = R"(
Above each map stands an input image of its run: the frame in which most boxes belonged to objects, or that
nearest to --frame. --boxes draws these boxes. A class has one colour in all maps and boxes; one legend below
serves all; with more than twelve classes, whose colours nobody tells apart, names stand over the objects and in
the boxes as well (--labels: always). Results without images (live cameras, images and videos that have gone) get an empty place, or only
their map where none has any.

Examples:
  sqslam figure maps out/kitchen out/desk -o maps.pdf
  sqslam figure maps out/a out/b out/c --name "Desk A" --name "Desk B" --name Kitchen --boxes -o maps.png
  sqslam figure maps out/kitchen --labels --frame 300 --width-mm 120 --dpi 600 -o kitchen.png
  sqslam figure maps out/* --columns 3 --no-images --set cameras.keyframes=false -o all.pdf
)",
          .results_help = "Result folders of sqslam run, or their map.sqmap",
          .several = true,
          .names_help = "Name below a map; repeated for each, in their order",
          .frames_help = "Frame whose image is shown; repeated for each map, in their order",
          .pictures = true,
          .view = true,
          .make = FigureEntry::Maker(DrawMapsOf)};
}

}  // namespace sqslam
