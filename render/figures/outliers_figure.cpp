#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "render/picture/picture.h"
#include "render/picture/picture_overlay.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using PointFate = OutliersFigure::Fate;
using FatedPoint = OutliersFigure::Point;

constexpr double kPointReach = 2.2;  // half diagonals of the object; farther points are not framed

int CountOf(const OutliersFigure::Object& object, PointFate fate) {
  return static_cast<int>(
      std::ranges::count_if(object.points, [fate](const FatedPoint& p) { return p.fate == fate; }));
}

// All grey: colours encode the scores.
std::map<std::string, Eigen::Vector3d> SolidColors(const OutliersFigure& figure) {
  std::map<std::string, Eigen::Vector3d> colors;
  for (const OutliersFigure::Object& object : figure.objects) {
    colors[object.map.objects.front().label] = {0.62, 0.66, 0.72};
  }
  return colors;
}

// Returns one axis for the scores of all objects.
ChartAxis ScoreAxis(const OutliersFigure& figure) {
  double low = figure.threshold > 0.0 ? figure.threshold : 1.0;
  double high = figure.threshold;
  for (const OutliersFigure::Object& object : figure.objects) {
    for (const FatedPoint& point : object.points) {
      if (point.anomaly > 0.0) {
        low = std::min(low, point.anomaly);
        high = std::max(high, point.anomaly);
      }
    }
  }
  return RoundAxis(std::min(low, high), std::max(low, high), 4, true);
}

// Draws points as discs, crosses or rings according to their fate, in the colour of their score.
class PointMarks {
 public:
  PointMarks(const FigureTheme& theme, const ChartAxis& axis) : theme_(theme), axis_(axis) {}

  void Draw(FigurePage& page, const Eigen::Vector2d& center, const FatedPoint& point, double size) const {
    const Eigen::Vector3d color = ColorOf(point);
    if (point.fate == PointFate::kIsolated) {
      page.Cross(center, 1.15 * size, {theme_.ink, 0.52 * size, {}});
      page.Cross(center, 1.1 * size, {color, 0.3 * size, {}});
      return;
    }
    FigurePath disc;
    disc.closed = true;
    disc.points = RegularPolygon(center, 20, (point.fate == PointFate::kKept ? 0.5 : 0.45) * size);
    if (point.fate == PointFate::kKept) {
      disc.fill = color;
      disc.stroke = FigureStroke{theme_.ink, 0.1 * size, {}};
      page.elements.emplace_back(std::move(disc));
      return;
    }
    // A dark ring on a light one is visible on any image.
    disc.stroke = FigureStroke{theme_.background, 0.4 * size, {}};
    page.elements.emplace_back(disc);
    disc.stroke = FigureStroke{theme_.ink, 0.17 * size, {}};
    page.elements.emplace_back(std::move(disc));
  }

 private:
  Eigen::Vector3d ColorOf(const FatedPoint& point) const {
    return point.anomaly > 0.0 ? Viridis((point.anomaly - axis_.low) / (axis_.high - axis_.low))
                               : theme_.muted;
  }

  const FigureTheme& theme_;
  ChartAxis axis_;
};

// Returns the size of marks in points; smaller if there are many.
double MarkSize(const OutliersFigure::Object& object, double usual) {
  constexpr double kMany = 150.0;
  const double share = std::sqrt(kMany / static_cast<double>(std::max<std::size_t>(1, object.points.size())));
  return std::min(4.0, usual) * std::clamp(share, 0.5, 1.0);
}

// Returns the legend of the fates with totals over all objects.
std::vector<std::pair<PointFate, std::string>> FateTexts(const OutliersFigure& figure) {
  std::array<int, 3> counts{};
  for (const OutliersFigure::Object& object : figure.objects) {
    for (const PointFate fate : {PointFate::kKept, PointFate::kIsolated, PointFate::kRemovedBefore}) {
      counts[static_cast<std::size_t>(fate)] += CountOf(object, fate);
    }
  }
  return {{PointFate::kKept, fmt::format("kept ({})", counts[0])},
          {PointFate::kIsolated, fmt::format("isolated, removed ({})", counts[1])},
          {PointFate::kRemovedBefore, fmt::format("removed without score ({})", counts[2])}};
}

constexpr double kLegendHeight = 1.7;  // of the font size
constexpr double kNoteHeight = 1.3;
constexpr const char* kWithoutScore =
    "without score: taken away before the isolation forest, for being seen in too few of the object's boxes, "
    "beside them, or on another thing";

// Returns the note on points removed without a score; empty if there are none.
std::vector<std::string> NoteLines(const OutliersFigure& figure, const FigureTheme& theme, double width) {
  const bool any = std::ranges::any_of(
      figure.objects, [](const auto& o) { return CountOf(o, PointFate::kRemovedBefore) > 0; });
  return any ? WrappedText(kWithoutScore, theme.small, width) : std::vector<std::string>();
}
double RampHeight(const FigureTheme& theme) { return ColorBarHeight(theme) + 0.3 * theme.small; }

PanelGrid LayOutOutliers(const OutliersFigure& figure, const FigureTheme& theme, double width) {
  PanelGrid grid = PanelGrid::Of(static_cast<int>(figure.objects.size()), 1, width);
  const bool images = std::ranges::any_of(figure.objects, [](const auto& o) { return !o.image.empty(); });
  grid.image = images ? 0.75 * grid.width : 0.0;
  grid.height = 0.85 * grid.width;
  grid.texts = 1.7 * theme.font + 1.6 * theme.small;
  grid.below = kLegendHeight * theme.small + RampHeight(theme) +
               kNoteHeight * theme.small * static_cast<double>(NoteLines(figure, theme, width).size());
  return grid;
}

void DrawImagePanel(FigurePage& page, const OutliersFigure::Object& object, const FigureRect& panel,
                    const PointMarks& marks, const FigureTheme& theme) {
  constexpr double kMargin = 0.35;  // share of the box, on each side
  if (object.image.empty()) {
    DrawNoImage(page, panel, theme);
    return;
  }
  const double margin = kMargin * std::max(object.box.width, object.box.height);
  const ImageCrop crop(object.image,
                       {object.box.x - margin, object.box.y - margin, object.box.width + 2.0 * margin,
                        object.box.height + 2.0 * margin},
                       object.quarter_turns, panel);
  crop.Draw(page);
  const Box2d& box = object.box;
  const std::array<Eigen::Vector2d, 5> corners = {
      Eigen::Vector2d(box.x, box.y), Eigen::Vector2d(box.x + box.width, box.y),
      Eigen::Vector2d(box.x + box.width, box.y + box.height), Eigen::Vector2d(box.x, box.y + box.height),
      Eigen::Vector2d(box.x, box.y)};
  for (const FigureStroke& stroke :
       {FigureStroke{{0.0, 0.0, 0.0}, 1.8, {}}, FigureStroke{{1.0, 1.0, 1.0}, 0.9, {}}}) {
    for (std::size_t i = 0; i < 4; ++i) {
      crop.DrawLine(page, corners[i], corners[i + 1], stroke);
    }
  }
  const double size = MarkSize(object, 0.027 * panel.width);
  for (const PointFate fate : {PointFate::kRemovedBefore, PointFate::kKept, PointFate::kIsolated}) {
    for (const FatedPoint& point : object.points) {
      if (point.fate == fate && point.pixel && crop.Contains(*point.pixel)) {
        marks.Draw(page, crop.ToPage(*point.pixel), point, size);
      }
    }
  }
}

// Returns a view of the solid and of its points, except those farther away than kPointReach.
ViewCamera EyeOnOutliers(const OutliersFigure::Object& object, double aspect) {
  const std::vector<Eigen::Vector3d> points = ToVector(object.points, &FatedPoint::p_map);
  return EyeOn(object.map, {object.map.objects.front().superquadric}, points, kPointReach, aspect);
}

// Returns the number of points outside the picture.
int DrawPointsAround(FigurePage& page, const OutliersFigure::Object& object, const ViewCamera& eye,
                     cv::Size pixels, const FigureRect& area, const PointMarks& marks) {
  struct Seen {
    const FatedPoint* point;
    Eigen::Vector2d at;
    double depth;
  };
  const double size = MarkSize(object, 0.032 * area.width);
  std::vector<Seen> seen;
  for (const FatedPoint& point : object.points) {
    const SeenPoint projected = Project(eye, pixels, point.p_map);
    const Eigen::Vector2d at(area.x + projected.pixel.x / pixels.width * area.width,
                             area.y + projected.pixel.y / pixels.height * area.height);
    if (projected.depth > 0.0 &&
        area.Contains({at.x() - 0.6 * size, at.y() - 0.6 * size, 1.2 * size, 1.2 * size})) {
      seen.push_back({&point, at, projected.depth});
    }
  }
  // Layers from bottom to top: removed without a score, kept, isolated; within a layer, far points first.
  const auto layer = [](const Seen& s) {
    return s.point->fate == PointFate::kRemovedBefore ? 0 : s.point->fate == PointFate::kKept ? 1 : 2;
  };
  std::ranges::stable_sort(seen, [&](const Seen& a, const Seen& b) {
    return std::pair(layer(a), -a.depth) < std::pair(layer(b), -b.depth);
  });
  for (const Seen& s : seen) {
    marks.Draw(page, s.at, *s.point, size);
  }
  return static_cast<int>(object.points.size() - seen.size());
}

void DrawOutlierTexts(FigurePage& page, const OutliersFigure::Object& object, int beyond,
                      const FigureRect& panel, const FigureTheme& theme) {
  const Eigen::Vector2d name(panel.Center().x(), panel.Bottom() + 0.9 * theme.font);
  page.Label(object.name, name, theme.font, theme.ink, panel.width);
  std::string counts =
      fmt::format("{} kept, {} isolated, {} without score", CountOf(object, PointFate::kKept),
                  CountOf(object, PointFate::kIsolated), CountOf(object, PointFate::kRemovedBefore));
  if (beyond > 0) {
    counts += fmt::format("; {} not in view", beyond);
  }
  const Eigen::Vector2d below = name + Eigen::Vector2d(0.0, 0.6 * theme.font + 0.8 * theme.small);
  page.Label(counts, below, theme.small, theme.muted, panel.width);
}

void DrawMarkLegend(FigurePage& page, const OutliersFigure& figure, const PointMarks& marks,
                    const ChartAxis& axis, double middle, const FigureRect& area, const FigureTheme& theme) {
  const auto texts = FateTexts(figure);
  const double sign = 1.5 * theme.small;
  const double gap = 1.6 * theme.small;
  double width = gap * static_cast<double>(texts.size() - 1);
  for (const auto& [fate, text] : texts) {
    width += sign + TextWidth(text, theme.small);
  }
  // Shrinks the text on narrow pages.
  const double shrink = std::min(1.0, area.width / width);
  double x = area.Center().x() - 0.5 * shrink * width;
  for (const auto& [fate, text] : texts) {
    FatedPoint sample;
    sample.fate = fate;
    sample.anomaly = fate == PointFate::kIsolated ? 0.5 * (figure.threshold + axis.high)
                                                  : 0.3 * figure.threshold + 0.7 * axis.low;
    marks.Draw(page, {x + 0.45 * shrink * sign, middle}, sample, 0.6 * theme.small * shrink);
    x += shrink * sign;
    page.Text(text, {x, middle}, 0.995 * shrink * theme.small, theme.ink);
    x += shrink * (TextWidth(text, theme.small) + gap);
  }
}

void CheckOutliers(const OutliersFigure& figure) {
  ThrowIf<UsageError>(figure.objects.empty(), "no objects, expected at least one");
  for (const OutliersFigure::Object& object : figure.objects) {
    ThrowIf<UsageError>(object.map.objects.size() != 1, "{}: {} solids, expected one", object.name,
                        object.map.objects.size());
  }
}

}  // namespace

FigurePage DrawOutliers(const OutliersFigure& figure, const FigureOptions& options,
                        const FigureProgress& progress) {
  CheckOutliers(figure);
  FigureSheet sheet = MakeSheet(
      options, figure.objects.size() == 1 ? kColumnWidth : kTextWidth, "Outlier removal",
      [&](double width, const FigureTheme& theme) { return LayOutOutliers(figure, theme, width).Height(); });
  PanelGrid grid = LayOutOutliers(figure, sheet.theme, sheet.area.width);
  const double spare = grid.Spare(sheet.area);  // if the height was given
  const double share = grid.image / (grid.image + grid.height);
  grid.image += share * spare;
  grid.height += (1.0 - share) * spare;
  ThrowIf<UsageError>(grid.height < 10.0, "the figure is too low for its objects, expected a larger height");
  PictureRenderer renderer(
      PanelOptions(options, sheet.page.dpi, grid.width, grid.height, SolidColors(figure)));
  const ChartAxis axis = ScoreAxis(figure);
  const PointMarks marks(sheet.theme, axis);
  for (int i = 0; i < grid.columns; ++i) {
    Tell(progress, i, grid.columns);
    const OutliersFigure::Object& object = figure.objects[static_cast<std::size_t>(i)];
    if (grid.image > 0.0) {
      DrawImagePanel(sheet.page, object, grid.ImageAt(sheet.area, 0, i), marks, sheet.theme);
    }
    const FigureRect panel = grid.PanelAt(sheet.area, 0, i);
    renderer.SetMap(object.map);
    const ViewCamera eye = options.camera.ApplyTo(EyeOnOutliers(object, panel.width / panel.height));
    const cv::Mat picture = renderer.Render(eye);
    PlacePanel(sheet.page, picture, panel);
    const int beyond = DrawPointsAround(sheet.page, object, eye, picture.size(), panel, marks);
    DrawOutlierTexts(sheet.page, object, beyond, panel, sheet.theme);
  }
  Tell(progress, grid.columns, grid.columns);
  const double ramp = RampHeight(sheet.theme);
  const double small = sheet.theme.small;
  double y = sheet.area.Bottom() - grid.below + 0.5 * kLegendHeight * small;
  DrawMarkLegend(sheet.page, figure, marks, axis, y, sheet.area, sheet.theme);
  y += 0.5 * (kLegendHeight - kNoteHeight) * small;
  for (const std::string& line : NoteLines(figure, sheet.theme, sheet.area.width)) {
    y += kNoteHeight * small;
    sheet.page.Text(line, {sheet.area.Center().x(), y}, small, sheet.theme.muted, TextAlign::kCenter);
  }
  DrawColorBar(sheet.page,
               {axis, "anomaly score", figure.threshold, fmt::format("removed above {:g}", figure.threshold)},
               {sheet.area.x, sheet.area.Bottom() - ramp, sheet.area.width, ramp}, sheet.theme);
  return std::move(sheet.page);
}

}  // namespace sqslam
