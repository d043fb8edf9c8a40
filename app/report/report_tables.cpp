#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>

#include "app/report/report.h"
#include "render/figures/figures.h"
#include "render/page/page.h"
#include "slam/geometry/angles.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/largest.h"
#include "slam/util/markup.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

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

std::string TopViewSvg(const ReportData& data, const LabelColors& colors) {
  const double scale = data.Scale();
  TrajectoryFigure figure;
  figure.unit = data.Unit();
  if (!data.trajectory.empty()) {
    figure.paths.push_back({"camera", PiecesOf(data.trajectory, {.scale = scale})});
  }
  if (data.evaluation != nullptr && !data.evaluation->truth_positions_map.empty()) {
    constexpr std::size_t kMaxPositions = 500;  // for a plot
    figure.truth = TrajectoryFigure::Path{"ground truth", TrajectoryFigure::Pieces(1)};
    for (const Eigen::Vector3d& p : Thinned(data.evaluation->truth_positions_map, kMaxPositions)) {
      figure.truth->pieces[0].push_back({0.0, scale * p});
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

namespace {

// Returns the cross-section and the side view of one object as two small outlines.
std::string ShapeGlyphSvg(const SnapshotObject& object, const Eigen::Vector3d& color) {
  const Superquadric& shape = object.superquadric.shape;
  constexpr double kGlyphHalfSize = 9.0;  // points
  const double scale = kGlyphHalfSize / shape.half_size.maxCoeff();
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

using TableOutput = std::back_insert_iterator<std::string>;

// Returns the readable name, escaped for HTML.
std::string HtmlName(const auto& object) { return EscapeMarkup(ReadableLabel(ShownName(object))); }

// Returns a dot in the colour that the class has in pictures of the map.
std::string Dot(const LabelColors& colors, const std::string& label) {
  return fmt::format("<span class=\"dot\" style=\"background:{}\"></span>", FormatColor(colors(label)));
}

// Formats the id that distinguishes objects of one class.
std::string HtmlId(int id) { return fmt::format(" <span class=\"id\">{}</span>", id); }

void AppendObjectRow(TableOutput out, const ReportData& data, const SnapshotObject& object,
                     const LabelColors& colors) {
  const Superquadric& shape = object.superquadric.shape;
  const double factor = 2.0 * data.Scale() * (data.IsMetric() ? 100.0 : 1.0);  // centimetres if metric
  const int digits = data.IsMetric() ? 1 : 3;
  fmt::format_to(out, "<tr{}><td class=\"l\">{}{}{}</td>", IsReliable(object) ? "" : " class=\"unsure\"",
                 Dot(colors, object.label), HtmlName(object), HtmlId(object.id));
  fmt::format_to(out, "<td>{}</td><td class=\"wide\">{:.2f}</td><td class=\"wide\">{:.2f}</td>",
                 ShapeGlyphSvg(object, colors(object.label)), shape.e1, shape.e2);
  fmt::format_to(out, "<td>{:.{}f} × {:.{}f} × {:.{}f}</td>", factor * shape.half_size.x(), digits,
                 factor * shape.half_size.y(), digits, factor * shape.half_size.z(), digits);
  fmt::format_to(out,
                 "<td>{}</td><td class=\"wide\">{}</td><td class=\"wide\">{:.2f}</td><td>{:.2f}</td></tr>\n",
                 object.observations, object.points, object.score, object.fit.reliability);
}

// Returns the cells of a ground-truth object: name, id and detections.
std::string TruthCell(const GroundTruthObject& truth) {
  return fmt::format("<td class=\"l\">{}{}</td><td class=\"wide\">{}</td>", HtmlName(truth), HtmlId(truth.id),
                     truth.detections);
}

void AppendMatchRow(TableOutput out, const Evaluation& evaluation, const ObjectMatch& match,
                    const LabelColors& colors) {
  const SnapshotObject& object = evaluation.mapped.at(static_cast<std::size_t>(match.mapped));
  fmt::format_to(out, "<tr>{}<td class=\"l\">{}{}{}</td>",
                 TruthCell(evaluation.truth.at(static_cast<std::size_t>(match.truth))),
                 Dot(colors, object.label), HtmlName(object), HtmlId(object.id));
  fmt::format_to(out,
                 "<td class=\"bars wide\"><span class=\"bar\"><i "
                 "style=\"width:{:.0f}%\"></i></span></td><td>{:.3f}</td>",
                 100.0 * match.iou, match.iou);
  fmt::format_to(out,
                 "<td class=\"wide\">{:.3f}</td><td>{:.1f}</td><td class=\"wide\">{:.1f}</td>"
                 "<td class=\"wide\">{:.1f}</td></tr>\n",
                 match.iou_ellipsoid, 100.0 * match.center_error, 100.0 * match.size_error,
                 kDegreesPerRadian * match.yaw_error);
}

// "chair, cup (2)", or "none".
std::string MappedNames(const Evaluation& evaluation, const auto& items) {
  std::map<std::string, int> counts;
  for (const auto& item : items) {
    ++counts[HtmlName(evaluation.mapped.at(static_cast<std::size_t>(item.mapped)))];
  }
  const std::vector<std::string> names = ToVector(counts, [](const auto& entry) {
    return entry.second > 1 ? fmt::format("{} ({})", entry.first, entry.second) : entry.first;
  });
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

void AppendObjects(std::string& page, const ReportData& data, const LabelColors& colors) {
  const TableOutput out(page);
  if (data.objects.empty()) {
    return;
  }
  fmt::format_to(
      out,
      "<section><h2>Objects</h2>\n<div class=\"scroll\"><table><thead><tr><th class=\"l\">Object</th>"
      "<th>From above, side</th><th class=\"wide\">ε₁</th><th class=\"wide\">ε₂</th><th>Size, "
      "{}</th><th>Seen "
      "in</th><th class=\"wide\">Points</th><th "
      "class=\"wide\">Score</th><th>Reliability</th></tr></thead><tbody>\n",
      data.IsMetric() ? "cm" : "map units");
  for (const SnapshotObject& object : data.objects) {
    AppendObjectRow(out, data, object, colors);
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

void AppendRelations(std::string& page, const ReportData& data, const std::filesystem::path& result) {
  if (!data.recording) {
    return;
  }
  SceneGraph graph = SceneGraphOf(*data.recording->Last(), result);
  std::erase_if(graph.relations, [](const SceneRelation& relation) { return !relation.IsLikely(); });
  if (graph.relations.empty()) {
    return;
  }
  std::ranges::stable_sort(graph.relations, {}, [](const SceneRelation& relation) {
    return std::pair(relation.kind, -relation.probability);
  });
  const TableOutput out(page);
  fmt::format_to(out,
                 "<section><h2>Relations</h2>\n<div class=\"scroll\"><table><thead><tr><th "
                 "class=\"l\">Object</th><th class=\"l\">is</th><th class=\"l\"></th>"
                 "<th>Probability</th></tr></thead><tbody>\n");
  const auto title = [&graph](int node) {
    return EscapeMarkup(TitleOf(graph.nodes[static_cast<std::size_t>(node)]));
  };
  for (const SceneRelation& relation : graph.relations) {
    fmt::format_to(out,
                   "<tr><td class=\"l\">{}</td><td class=\"l\">{}</td><td class=\"l\">{}</td>"
                   "<td>{:.2f}</td></tr>\n",
                   title(relation.subject), NameOf(relation.kind), title(relation.other),
                   relation.probability);
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

void AppendClasses(std::string& page, const ReportData& data) {
  const TableOutput out(page);
  if (!data.stats || data.stats->classes.empty()) {
    return;
  }
  fmt::format_to(
      out,
      "<section><h2>Boxes</h2>\n<div class=\"scroll\"><table><thead><tr><th class=\"l\">Class</th>"
      "<th>Boxes</th><th class=\"wide\">Ignored</th><th class=\"wide\">Used</th><th>Landmarks</th>"
      "<th class=\"wide\">Merged</th><th>Objects</th><th class=\"l\">Left out</th></tr></thead><tbody>\n");
  ClassAccount all;
  for (const auto& [label, account] : data.stats->classes) {
    fmt::format_to(
        out,
        "<tr><td class=\"l\">{}</td><td>{}</td><td class=\"wide\">{}</td><td class=\"wide\">{}</td>"
        "<td>{}</td><td class=\"wide\">{}</td><td>{}</td><td class=\"l\">{}</td></tr>\n",
        EscapeMarkup(ReadableLabel(label)), account.boxes, account.ignored, account.used, account.Landmarks(),
        account.merged, account.shown, LeftOutText(account));
    std::ranges::transform(all.left_out, account.left_out, all.left_out.begin(), std::plus());
  }
  fmt::format_to(out, "</tbody></table></div>\n<div class=\"after\"></div>\n");
  for (std::size_t i = 0; i < kLeftOutReasons; ++i) {
    if (all.left_out[i] > 0) {
      const auto reason = static_cast<LeftOut>(i);
      fmt::format_to(out, "<p class=\"note\">{} {} {}: {}.</p>\n", all.left_out[i],
                     all.left_out[i] == 1 ? "landmark" : "landmarks", TextOf(reason), RemedyFor(reason));
    }
  }
  fmt::format_to(out, "</section>\n");
}

void AppendComparison(std::string& page, const ReportData& data, const LabelColors& colors) {
  const TableOutput out(page);
  if (data.evaluation == nullptr || !data.evaluation->has_objects) {
    return;
  }
  const Evaluation& evaluation = *data.evaluation;
  fmt::format_to(
      out,
      "<section><h2>Against the ground truth</h2>\n<div class=\"scroll\"><table><thead><tr>"
      "<th class=\"l\">Ground truth</th><th class=\"wide\">Boxes</th><th class=\"l\">Mapped as</th><th "
      "class=\"wide\"></th><th>3D IoU</th><th class=\"wide\">as ellipsoid</th><th>Centre off, cm</th><th "
      "class=\"wide\">Size off, cm</th><th class=\"wide\">Yaw off, °</th></tr></thead><tbody>\n");
  for (const ObjectMatch& match : evaluation.objects.matches) {
    AppendMatchRow(out, evaluation, match, colors);
  }
  for (const int missed : evaluation.objects.missed) {
    fmt::format_to(out, "<tr class=\"missed\">{}<td class=\"l\" colspan=\"7\">missed</td></tr>\n",
                   TruthCell(evaluation.truth.at(static_cast<std::size_t>(missed))));
  }
  fmt::format_to(out, "</tbody></table></div>\n<div class=\"after\"></div>\n");
  for (const CoverageCount& count : evaluation.coverage) {
    fmt::format_to(out, "<p class=\"note\">Objects with {} or more detections in the map: {} of {}.</p>\n",
                   count.min_detections, count.mapped, count.total);
  }
  fmt::format_to(out, "<p class=\"note\">Landmarks without ground truth: {}. Duplicates: {}.</p></section>\n",
                 MappedNames(evaluation, evaluation.extra),
                 MappedNames(evaluation, evaluation.objects.duplicates));
}

void AppendTiming(std::string& page, const ReportData& data) {
  const TableOutput out(page);
  if (!data.stats || data.stats->timing_ms.empty()) {
    return;
  }
  const double largest =
      Largest(data.stats->timing_ms, 1e-9, [](const auto& timing) { return timing.second.mean; });
  fmt::format_to(
      out,
      "<section><h2>Time</h2>\n<div class=\"scroll\"><table><thead><tr><th class=\"l\">Stage, milliseconds"
      "</th><th class=\"wide\"></th><th>Mean</th><th class=\"wide\">Median</th><th>95 "
      "%</th><th class=\"wide\">Longest</th><th>Times</th></tr></thead><tbody>\n");
  for (const auto& [stage, summary] : data.stats->timing_ms) {  // sorted: a stage precedes its parts
    const std::size_t dot = stage.find('.');
    const std::string name = StageName(stage);
    fmt::format_to(
        out,
        "<tr class=\"{}\"><td class=\"stage\">{}</td><td class=\"bars wide\"><span class=\"bar\"><i "
        "style=\"width:{:.0f}%\"></i>"
        "</span></td><td>{:.2f}</td><td class=\"wide\">{:.2f}</td><td>{:.2f}</td><td "
        "class=\"wide\">{:.1f}</td>"
        "<td>{}</td></tr>\n",
        dot == std::string::npos ? "stage1" : "sub", EscapeMarkup(name), 100.0 * summary.mean / largest,
        summary.mean, summary.median, summary.p95, summary.max, summary.count);
  }
  fmt::format_to(out, "</tbody></table></div></section>\n");
}

}  // namespace sqslam::app
