#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "app/report/report_data.h"
#include "app/report/report_html.h"

namespace sqslam::app {
namespace {

using Eigen::Vector2d;
using Output = std::back_insert_iterator<std::string>;

constexpr double kPlotWidth = 1000.0;  // of the drawing, SVG units
constexpr double kMaxHeight = 620.0;
constexpr double kMargin = 44.0;
constexpr int kOutlinePoints = 72;

// Horizontal cross-section of an object at its middle, in the map's x and y.
std::vector<Vector2d> Footprint(const PosedSuperquadric& object) {
  std::vector<Vector2d> outline;
  for (int i = 0; i < kOutlinePoints; ++i) {
    const double omega = 2.0 * std::numbers::pi * i / kOutlinePoints - std::numbers::pi;
    outline.push_back((object.T_map_object * object.shape.PointAt(0.0, omega)).head<2>());
  }
  return outline;
}

// Map x, y -> drawing.
struct View {
  Eigen::AlignedBox2d bounds;
  double scale = 1.0;  // drawing units per map unit
  double height = 0.0;
  double offset_x = 0.0;

  Vector2d operator()(const Vector2d& p) const {
    return {offset_x + (p.x() - bounds.min().x()) * scale,
            height - kMargin - (p.y() - bounds.min().y()) * scale};
  }
};

View FitView(const Eigen::AlignedBox2d& bounds) {
  View view;
  view.bounds = bounds;
  const Vector2d size = bounds.sizes().cwiseMax(1e-6);
  view.scale = std::min((kPlotWidth - 2 * kMargin) / size.x(), (kMaxHeight - 2 * kMargin) / size.y());
  view.height = size.y() * view.scale + 2 * kMargin;
  view.offset_x = 0.5 * (kPlotWidth - size.x() * view.scale);
  return view;
}

// 1, 2 or 5 times a power of ten, not above `length`.
double RoundStep(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  const double ratio = length / power;
  return power * (ratio >= 5.0 ? 5.0 : ratio >= 2.0 ? 2.0 : 1.0);
}

void AppendPath(Output out, const View& view, const std::vector<Vector2d>& points, bool closed,
                std::string_view attributes) {
  fmt::format_to(out, "<path {} d=\"", attributes);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2d p = view(points[i]);
    fmt::format_to(out, "{}{:.1f} {:.1f}", i == 0 ? "M" : "L", p.x(), p.y());
  }
  fmt::format_to(out, "{}\"/>\n", closed ? "Z" : "");
}

void AppendGrid(Output out, const View& view, double step) {
  fmt::format_to(out, "<g stroke=\"#eef0f3\" stroke-width=\"1\">\n");
  const Vector2d corner = view(view.bounds.min());
  const double left = view.bounds.min().x() - corner.x() / view.scale;
  const double right = left + kPlotWidth / view.scale;
  const double bottom = view.bounds.min().y() - kMargin / view.scale;
  const double top = bottom + view.height / view.scale;
  for (double x = std::ceil(left / step) * step; x < right; x += step) {
    const double u = view({x, 0}).x();
    fmt::format_to(out, "<path d=\"M{:.1f} 0V{:.1f}\"/>", u, view.height);
  }
  for (double y = std::ceil(bottom / step) * step; y < top; y += step) {
    const double v = view({0, y}).y();
    fmt::format_to(out, "<path d=\"M0 {:.1f}H{:.1f}\"/>", v, kPlotWidth);
  }
  fmt::format_to(out, "</g>\n");
}

void AppendObjects(Output out, const View& view, const ReportData& data) {
  struct Name {
    Vector2d position;
    std::string text;
  };
  std::vector<Name> names;
  std::vector<const SnapshotObject*> by_size;
  for (const SnapshotObject& object : data.objects) {
    by_size.push_back(&object);
  }
  std::stable_sort(by_size.begin(), by_size.end(), [](const SnapshotObject* a, const SnapshotObject* b) {
    return a->superquadric.shape.half_size.head<2>().prod() >
           b->superquadric.shape.half_size.head<2>().prod();
  });
  for (const SnapshotObject* object : by_size) {  // small ones on top
    const std::string& color = data.colors.at(object->label);
    AppendPath(out, view, Footprint(object->superquadric), true,
               fmt::format("fill=\"{0}\" fill-opacity=\"0.22\" stroke=\"{0}\" stroke-width=\"1.6\"", color));
    names.push_back({view(object->superquadric.T_map_object.translation.head<2>()),
                     fmt::format("{} {}", object->id, EscapeHtml(object->label))});
  }
  // Names from top to bottom; each moves down until it covers none before it.
  std::sort(names.begin(), names.end(),
            [](const Name& a, const Name& b) { return a.position.y() < b.position.y(); });
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double half_widths = 3.2 * static_cast<double>(names[i].text.size() + names[j].text.size());
      if (std::abs(names[i].position.x() - names[j].position.x()) < half_widths &&
          std::abs(names[i].position.y() - names[j].position.y()) < 14.0) {
        names[i].position.y() = names[j].position.y() + 14.0;
        j = static_cast<std::size_t>(-1);  // once more from the first
      }
    }
    fmt::format_to(
        out,
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" dominant-baseline=\"middle\" "
        "paint-order=\"stroke\" stroke=\"#fff\" stroke-width=\"3.5\" stroke-linejoin=\"round\">{}</text>\n",
        names[i].position.x(), names[i].position.y(), names[i].text);
  }
}

void AppendScaleBar(Output out, const View& view, double step_map, const std::string& text) {
  const double length = step_map * view.scale;
  const double y = view.height - 18.0;
  fmt::format_to(out,
                 "<g stroke=\"#1d2229\" stroke-width=\"1.5\" fill=\"none\"><path d=\"M20 "
                 "{0:.1f}v-6v3h{1:.1f}v-3v6\"/></g>"
                 "<text x=\"{2:.1f}\" y=\"{3:.1f}\" paint-order=\"stroke\" stroke=\"#fff\" "
                 "stroke-width=\"3\">{4}</text>\n",
                 y, length, 28.0 + length, y + 1.0, text);
}

// What the lines mean, at the top left.
void AppendLegend(Output out, bool has_truth) {
  fmt::format_to(
      out,
      "<g><rect x=\"12\" y=\"12\" width=\"{}\" height=\"26\" rx=\"3\" fill=\"#fff\" fill-opacity=\"0.85\"/>"
      "<path d=\"M22 25h26\" stroke=\"#4fa3c0\" stroke-width=\"3.4\"/><text x=\"56\" y=\"29\">camera</text>",
      has_truth ? 226 : 102);
  if (has_truth) {
    fmt::format_to(out,
                   "<path d=\"M118 25h26\" stroke=\"#1d2229\" stroke-width=\"1\" stroke-dasharray=\"5 4\"/>"
                   "<text x=\"152\" y=\"29\">ground truth</text>");
  }
  fmt::format_to(out, "</g>\n");
}

}  // namespace

std::string TopViewSvg(const ReportData& data) {
  std::vector<Vector2d> path;
  std::vector<Vector2d> truth;
  Eigen::AlignedBox2d bounds;
  for (const TimedPose& pose : data.trajectory) {
    path.emplace_back(pose.T_map_camera.translation.head<2>());
    bounds.extend(path.back());
  }
  for (const Eigen::Vector3d& p :
       data.evaluation ? data.evaluation->truth_positions_map : std::vector<Eigen::Vector3d>{}) {
    truth.emplace_back(p.head<2>());
    bounds.extend(truth.back());
  }
  for (const SnapshotObject& object : data.objects) {
    for (const Vector2d& p : Footprint(object.superquadric)) {
      bounds.extend(p);
    }
  }
  if (bounds.isEmpty()) {
    return "";
  }
  const View view = FitView(bounds);
  const double step =
      RoundStep(150.0 / view.scale * data.Scale());  // about 150 drawing units, in the shown unit
  const double step_map = step / data.Scale();
  std::string svg;
  const Output out = std::back_inserter(svg);
  fmt::format_to(
      out,
      "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" "
      "aria-label=\"Top view of camera path and objects\" font-family=\"Inter, Helvetica Neue, Arial, DejaVu "
      "Sans, sans-serif\" font-size=\"12\" fill=\"#1d2229\">\n<rect width=\"100%\" height=\"100%\" "
      "fill=\"#fff\"/>\n",
      kPlotWidth, view.height);
  AppendGrid(out, view, step_map);
  if (!path.empty()) {
    AppendPath(out, view, path, false,
               "fill=\"none\" stroke=\"#4fa3c0\" stroke-width=\"3.4\" stroke-linejoin=\"round\"");
  }
  if (!truth.empty()) {  // thin and on top: the two lie within millimetres of each other
    AppendPath(out, view, truth, false,
               "fill=\"none\" stroke=\"#1d2229\" stroke-width=\"1\" stroke-dasharray=\"5 4\"");
  }
  if (!path.empty()) {
    const Vector2d start = view(path.front());
    const Vector2d end = view(path.back());
    fmt::format_to(out,
                   "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\" fill=\"#1f6f8b\"/>\n<circle cx=\"{:.1f}\" "
                   "cy=\"{:.1f}\" r=\"5\" fill=\"#fff\" stroke=\"#1f6f8b\" stroke-width=\"2.4\"/>\n",
                   start.x(), start.y(), end.x(), end.y());
  }
  AppendObjects(out, view, data);
  AppendScaleBar(out, view, step_map, fmt::format("{:g} {}", step, data.Unit()));
  AppendLegend(out, !truth.empty());
  fmt::format_to(out, "</svg>\n");
  return svg;
}

std::string ShapeGlyphSvg(const SnapshotObject& object, std::string_view color) {
  const Superquadric& shape = object.superquadric.shape;
  constexpr double kHalf = 12.0;
  const double scale = kHalf / shape.half_size.maxCoeff();
  std::string svg = fmt::format(
      "<svg class=\"glyph\" width=\"60\" height=\"28\" viewBox=\"0 0 60 28\" fill=\"{0}\" "
      "fill-opacity=\"0.25\" "
      "stroke=\"{0}\" stroke-width=\"1.3\" aria-hidden=\"true\">",
      color);
  const Output out = std::back_inserter(svg);
  for (const bool side : {false, true}) {
    fmt::format_to(out, "<path d=\"");
    for (int i = 0; i < kOutlinePoints; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kOutlinePoints - std::numbers::pi;
      // The side view runs along +x up to the pole and back along -x.
      const bool front = std::cos(angle) >= 0.0;
      const double eta = std::asin(std::clamp(std::sin(angle), -1.0, 1.0));
      const Eigen::Vector3d p =
          side ? shape.PointAt(eta, front ? 0.0 : std::numbers::pi) : shape.PointAt(0.0, angle);
      fmt::format_to(out, "{}{:.1f} {:.1f}", i == 0 ? "M" : "L", (side ? 45.0 : 15.0) + scale * p.x(),
                     14.0 - scale * (side ? p.z() : p.y()));
    }
    fmt::format_to(out, "Z\"/>");
  }
  svg += "</svg>";
  return svg;
}

}  // namespace sqslam::app
