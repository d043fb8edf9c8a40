#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/camera/scene_framing.h"
#include "render/figures/figures.h"
#include "render/figures/image_crop.h"
#include "render/page/chart.h"
#include "render/picture/picture.h"
#include "render/picture/picture_overlay.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

using PointFate = OutliersFigure::Fate;
using FatedPoint = OutliersFigure::Point;

constexpr double kOutliersGap = 5.0;  // points between panels
constexpr double kPointReach = 2.2;   // half diagonals of the object: how far from it points are framed

int CountOf(const OutliersFigure::Object& object, PointFate fate) {
  return static_cast<int>(std::count_if(object.points.begin(), object.points.end(),
                                        [fate](const FatedPoint& p) { return p.fate == fate; }));
}

// Grey, as colours are for the scores.
std::map<std::string, Eigen::Vector3d> SolidColors(const OutliersFigure& figure) {
  std::map<std::string, Eigen::Vector3d> colors;
  for (const OutliersFigure::Object& object : figure.objects) {
    colors[object.map.objects.front().label] = {0.62, 0.66, 0.72};
  }
  return colors;
}

// The scores of all objects on one ramp.
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

// Draws points: by their fate a disc, a cross or a ring, in the colour of their score.
class PointMarks {
 public:
  PointMarks(const FigureTheme& theme, const ChartAxis& axis) : theme_(theme), axis_(axis) {}

  void Draw(FigurePage& page, const Eigen::Vector2d& center, const FatedPoint& point, double size) const {
    const Eigen::Vector3d color = ColorOf(point);
    if (point.fate == PointFate::kIsolated) {
      DrawCross(page, center, 1.15 * size, {theme_.ink, 0.52 * size, {}});
      DrawCross(page, center, 1.1 * size, {color, 0.3 * size, {}});
      return;
    }
    FigurePath disc;
    disc.closed = true;
    constexpr int kCorners = 20;
    const double radius = (point.fate == PointFate::kKept ? 0.5 : 0.45) * size;
    for (int i = 0; i < kCorners; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kCorners;
      disc.points.emplace_back(center + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    if (point.fate == PointFate::kKept) {
      disc.fill = color;
      disc.stroke = FigureStroke{theme_.ink, 0.1 * size, {}};
      page.elements.emplace_back(std::move(disc));
      return;
    }
    // Light under dark: visible on any image.
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
  static void DrawCross(FigurePage& page, const Eigen::Vector2d& center, double size,
                        const FigureStroke& stroke) {
    const double r = 0.5 * size;
    page.Line(center + Eigen::Vector2d(-r, -r), center + Eigen::Vector2d(r, r), stroke);
    page.Line(center + Eigen::Vector2d(-r, r), center + Eigen::Vector2d(r, -r), stroke);
  }

  const FigureTheme& theme_;
  ChartAxis axis_;
};

// Many points get smaller marks. Points of the page.
double MarkSize(const OutliersFigure::Object& object, double usual) {
  constexpr double kMany = 150.0;
  const double share = std::sqrt(kMany / static_cast<double>(std::max<std::size_t>(1, object.points.size())));
  return std::min(4.0, usual) * std::clamp(share, 0.5, 1.0);
}

struct OutliersLayout {
  double width = 0.0;  // of a panel
  double image = 0.0;  // height of the images; 0: none has one
  double solid = 0.0;  // height of the pictures of the solids
  double texts = 0.0;  // below
  double legend = 0.0;
  double bar = 0.0;

  double Height() const { return image + (image > 0.0 ? kOutliersGap : 0.0) + solid + texts + legend + bar; }
};

// Totals over all objects, in the order of the fates.
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

OutliersLayout LayOutOutliers(const OutliersFigure& figure, const FigureTheme& theme, double width) {
  OutliersLayout layout;
  const auto count = static_cast<double>(figure.objects.size());
  layout.width = (width - kOutliersGap * (count - 1.0)) / count;
  const bool images = std::any_of(figure.objects.begin(), figure.objects.end(),
                                  [](const auto& o) { return !o.image.empty(); });
  layout.image = images ? 0.75 * layout.width : 0.0;
  layout.solid = 0.85 * layout.width;
  layout.texts = 1.7 * theme.font + 1.6 * theme.small;
  layout.legend = 1.7 * theme.small;
  layout.bar = ColorBarHeight(theme) + 0.3 * theme.small;
  return layout;
}

void DrawImagePanel(FigurePage& page, const OutliersFigure::Object& object, const FigureRect& panel,
                    const PointMarks& marks, const FigureTheme& theme) {
  constexpr double kMargin = 0.35;  // of the box on each side
  if (object.image.empty()) {
    page.Rect(panel, theme.faint);
    page.Text("no image", panel.Center(), theme.small, theme.muted, TextAlign::kCenter);
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
      Eigen::Vector2d from = corners[i];
      Eigen::Vector2d to = corners[i + 1];
      if (crop.Clip(from, to)) {
        page.Line(crop.ToPage(from), crop.ToPage(to), stroke);
      }
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

// A three-quarter view that holds the solid, the points it kept, and of the others those that are not far
// off.
ViewCamera EyeOnOutliers(const OutliersFigure::Object& object, double aspect) {
  const PosedSuperquadric& solid = object.map.objects.front().superquadric;
  const std::array<Eigen::Vector3d, 8> corners = BoxCorners(solid);
  std::vector<Eigen::Vector3d> outline(corners.begin(), corners.end());
  for (const FatedPoint& point : object.points) {
    if ((point.p_map - solid.T_map_object.translation).norm() < kPointReach * solid.shape.half_size.norm()) {
      outline.push_back(point.p_map);
    }
  }
  return FitOutline(FrameScene(FindFocus(object.map), aspect), outline, aspect, 0.06);
}

// Returns how many points the picture does not hold.
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
  // What was removed without a score lies below, what the forest removed above; the near before the far.
  const auto layer = [](const Seen& s) {
    return s.point->fate == PointFate::kRemovedBefore ? 0 : s.point->fate == PointFate::kKept ? 1 : 2;
  };
  std::stable_sort(seen.begin(), seen.end(), [&](const Seen& a, const Seen& b) {
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
  page.Text(NarrowText(PlainText(object.name, name, theme.font, theme.ink, TextAlign::kCenter), panel.width));
  std::string counts =
      fmt::format("{} kept, {} isolated, {} without score", CountOf(object, PointFate::kKept),
                  CountOf(object, PointFate::kIsolated), CountOf(object, PointFate::kRemovedBefore));
  if (beyond > 0) {
    counts += fmt::format("; {} not in view", beyond);
  }
  const Eigen::Vector2d below = name + Eigen::Vector2d(0.0, 0.6 * theme.font + 0.8 * theme.small);
  page.Text(NarrowText(PlainText(counts, below, theme.small, theme.muted, TextAlign::kCenter), panel.width));
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
  // Narrow pages get smaller letters.
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
  if (figure.objects.empty()) {
    throw UsageError("no objects, expected at least one");
  }
  for (const OutliersFigure::Object& object : figure.objects) {
    if (object.map.objects.size() != 1) {
      throw UsageError(fmt::format("{}: {} solids, expected one", object.name, object.map.objects.size()));
    }
  }
}

}  // namespace

FigurePage DrawOutliers(const OutliersFigure& figure, const FigureOptions& options,
                        const FigureProgress& progress) {
  CheckOutliers(figure);
  FigureSheet sheet =
      MakeSheet(options, figure.objects.size() == 1 ? kColumnWidth : kTextWidth, "Outlier removal",
                [&](double width) { return LayOutOutliers(figure, FigureTheme(options), width).Height(); });
  OutliersLayout layout = LayOutOutliers(figure, sheet.theme, sheet.area.width);
  const double spare = sheet.area.height - layout.Height();  // where the height was asked for
  const double share = layout.image / (layout.image + layout.solid);
  layout.image += share * spare;
  layout.solid += (1.0 - share) * spare;
  if (layout.solid < 10.0) {
    throw UsageError("the figure is too low for its objects, expected a larger height");
  }
  PictureRenderer renderer(
      PanelOptions(options, sheet.page.dpi, layout.width, layout.solid, SolidColors(figure)));
  const ChartAxis axis = ScoreAxis(figure);
  const PointMarks marks(sheet.theme, axis);
  const int count = static_cast<int>(figure.objects.size());
  for (int i = 0; i < count; ++i) {
    Tell(progress, i, count);
    const OutliersFigure::Object& object = figure.objects[static_cast<std::size_t>(i)];
    FigureRect panel{sheet.area.x + i * (layout.width + kOutliersGap), sheet.area.y, layout.width,
                     layout.image};
    if (layout.image > 0.0) {
      DrawImagePanel(sheet.page, object, panel, marks, sheet.theme);
      panel.y += layout.image + kOutliersGap;
    }
    panel.height = layout.solid;
    renderer.SetMap(object.map);
    const ViewCamera eye = options.camera.ApplyTo(EyeOnOutliers(object, panel.width / panel.height));
    const cv::Mat picture = renderer.Render(eye);
    PlacePanel(sheet.page, picture, panel);
    const int beyond = DrawPointsAround(sheet.page, object, eye, picture.size(), panel, marks);
    DrawOutlierTexts(sheet.page, object, beyond, panel, sheet.theme);
  }
  Tell(progress, count, count);
  const double legend_y = sheet.area.Bottom() - layout.bar - 0.5 * layout.legend;
  DrawMarkLegend(sheet.page, figure, marks, axis, legend_y, sheet.area, sheet.theme);
  DrawColorBar(sheet.page,
               {axis, "anomaly score", figure.threshold, fmt::format("removed above {:g}", figure.threshold)},
               {sheet.area.x, sheet.area.Bottom() - layout.bar, sheet.area.width, layout.bar}, sheet.theme);
  return std::move(sheet.page);
}

}  // namespace sqslam
