#pragma once

#include <cstdlib>
#include <string>

#include "hand_made_map.h"
#include "render/figure/chart_figures.h"
#include "render/figure/panel_figures.h"

namespace sqslam {

// Small figures of made-up data, one of each kind.
inline FigureOptions SmallFigure() {
  unsetenv("DISPLAY");
  FigureOptions options;
  options.width_px = 360;
  options.height_px = 270;
  options.dpi = 110.0;
  options.font_size = 7.0;
  options.backend = RenderBackend::kOsmesa;
  return options;
}

inline ShapesFigure FewShapes() {
  ShapesFigure figure;
  figure.e1 = {0.1, 1.0, 2.0};
  figure.e2 = {0.1, 1.0, 2.0};
  return figure;
}

inline CompareFigure TwoCompared() {
  const MapSnapshot map = HandMadeMap();
  CompareFigure figure;
  figure.kinds = {{"Superquadric", {0.0, 0.62, 0.45}}, {"Quadric", {0.0, 0.45, 0.7}}};
  for (const int index : {0, 1}) {
    const SnapshotObject& object = map.objects[static_cast<std::size_t>(index)];
    CompareFigure::Object compared{object.label, map, {object.superquadric, object.superquadric}, {}};
    compared.solids[1].shape.e1 = compared.solids[1].shape.e2 = 1.0;
    compared.map.points.clear();
    for (int i = 0; i < 24; ++i) {
      const Eigen::Vector3d p = object.superquadric.shape.PointAt(0.3 * (i % 5) - 0.6, 0.26 * i);
      compared.map.points.push_back(
          {(object.superquadric.T_map_object * p).cast<float>(), {30, 30, 30}, object.id});
    }
    figure.objects.push_back(compared);
  }
  return figure;
}

inline MapsFigure TwoMaps() {
  MapsFigure figure;
  figure.labels = true;
  cv::Mat image(120, 160, CV_8UC3, cv::Scalar(150, 160, 170));
  image(cv::Rect(40, 50, 60, 40)).setTo(cv::Scalar(60, 80, 140));
  figure.panels.push_back({"desk", HandMadeMap(), image, {{"book", {40.0, 50.0, 60.0, 40.0}}}});
  MapSnapshot other = HandMadeMap();
  other.objects[0].label = "laptop";
  other.objects.pop_back();
  figure.panels.push_back({"table", other, image, {}});
  return figure;
}

inline TrajectoryFigure TwoPaths() {
  TrajectoryFigure figure;
  figure.truth = TrajectoryFigure::Path{"ground truth", {{}}};
  figure.paths = {{"run (ATE 3 cm)", {{}, {}}}};
  for (int i = 0; i < 100; ++i) {
    const double angle = 0.06 * i;
    const Eigen::Vector3d p(2.0 * std::cos(angle), std::sin(angle), 0.2 * std::sin(3.0 * angle));
    figure.truth->pieces[0].push_back({0.1 * i, p});
    if (i < 50 || i > 60) {
      figure.paths[0].pieces[i < 50 ? 0 : 1].push_back({0.1 * i, 1.05 * p});
    }
  }
  return figure;
}

inline TimingFigure TwoTimings() {
  TimingFigure figure;
  figure.stages = {"tracking", "tracking.features", "mapping"};
  figure.series = {{"first",
                    {{"tracking", {12.0, 11.0, 20.0}},
                     {"tracking.features", {7.0, 6.5, 9.0}},
                     {"mapping", {150.0, 170.0, 240.0}}}},
                   {"second",
                    {{"tracking", {9.0, 8.0, 15.0}},
                     {"tracking.features", {5.0, 5.0, 8.0}},
                     {"mapping", {130.0, 100.0, 260.0}}}}};
  return figure;
}

inline IouFigure TwoScored() {
  return {{"book", "cup", "sports ball"},
          {{"superquadrics", {0.75, 0.5, 0.875}}, {"quadrics", {0.5, std::nullopt, 0.875}}}};
}

}  // namespace sqslam
