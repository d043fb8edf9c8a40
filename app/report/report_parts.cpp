#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "app/report/report.h"
#include "render/figures/figures.h"
#include "render/page/page.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/markup.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace {

constexpr int kOutlinePoints = 72;

// Returns the horizontal cross-section through an object's centre, in the map frame times `scale`.
TrajectoryFigure::Footprint FootprintOf(const SnapshotObject& object, const Eigen::Vector3d& color,
                                        double scale) {
  TrajectoryFigure::Footprint footprint{ReadableLabel(ShownName(object)), color, {}, !IsReliable(object)};
  const PosedSuperquadric& solid = object.superquadric;
  for (int i = 0; i < kOutlinePoints; ++i) {
    const double omega = 2.0 * std::numbers::pi * i / kOutlinePoints - std::numbers::pi;
    footprint.outline.push_back(scale * (solid.T_map_object * solid.shape.PointAt(0.0, omega)));
  }
  return footprint;
}

}  // namespace

std::string DataUri(const std::filesystem::path& file, std::string_view mime_type) {
  return fmt::format("data:{};base64,{}", mime_type, Base64(ReadFile(file, "a picture or a video")));
}

std::string TopViewSvg(const ReportData& data, const LabelColors& colors) {
  const double scale = data.Scale();
  TrajectoryFigure figure;
  figure.unit = data.Unit();
  if (!data.trajectory.empty()) {
    figure.paths.push_back({"camera", PiecesOf(data.trajectory, {.scale = scale})});
  }
  if (data.evaluation != nullptr && !data.evaluation->truth_positions_map.empty()) {
    const std::vector<Eigen::Vector3d>& truth = data.evaluation->truth_positions_map;
    const std::size_t step = (truth.size() + 499) / 500;  // 500 points are enough for a plot
    figure.truth = TrajectoryFigure::Path{"ground truth", TrajectoryFigure::Pieces(1)};
    for (std::size_t i = 0; i < truth.size(); i += step) {
      figure.truth->pieces[0].push_back({0.0, scale * truth[i]});
    }
  }
  std::vector<SnapshotObject> by_size = data.objects;
  std::ranges::stable_sort(by_size, std::greater(), [](const SnapshotObject& object) {
    return object.superquadric.shape.half_size.head<2>().prod();
  });
  for (const SnapshotObject& object : by_size) {  // small ones on top
    figure.objects.push_back(FootprintOf(object, colors(object.label), scale));
  }
  if (!figure.truth && figure.paths.empty() && figure.objects.empty()) {
    return "";
  }
  FigureOptions options;
  options.width_mm = 260.0;
  options.height_mm = 160.0;
  return SvgElement(DrawTrajectories(figure, options));
}

std::string ShapeGlyphSvg(const SnapshotObject& object, const Eigen::Vector3d& color) {
  const Superquadric& shape = object.superquadric.shape;
  constexpr double kHalf = 9.0;  // points
  const double scale = kHalf / shape.half_size.maxCoeff();
  FigurePage page;
  page.width = 45.0;
  page.height = 21.0;
  for (const bool side : {false, true}) {
    FigurePath outline{{}, true, color, 0.25, FigureStroke{color, 1.0, {}}};
    for (int i = 0; i < kOutlinePoints; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kOutlinePoints - std::numbers::pi;
      // The side view runs along +x up to the pole and back along -x.
      const bool front = std::cos(angle) >= 0.0;
      const double eta = std::asin(std::clamp(std::sin(angle), -1.0, 1.0));
      const Eigen::Vector3d p =
          side ? shape.PointAt(eta, front ? 0.0 : std::numbers::pi) : shape.PointAt(0.0, angle);
      outline.points.emplace_back((side ? 0.75 : 0.25) * page.width + scale * p.x(),
                                  0.5 * page.height - scale * (side ? p.z() : p.y()));
    }
    page.elements.emplace_back(std::move(outline));
  }
  return SvgElement(page);
}

}  // namespace sqslam::app
