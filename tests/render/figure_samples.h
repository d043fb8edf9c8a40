#pragma once

#include <cstdlib>
#include <string>

#include "hand_made_map.h"
#include "render/figures/figures.h"

namespace sqslam {

// Small figures of synthetic data, one of each kind.
inline FigureOptions SmallFigure() {
  unsetenv("DISPLAY");
  FigureOptions options;
  options.pixels = {360, 270};
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
  figure.panels.push_back({"desk", HandMadeMap(), image, {{"book", 1.0, {40.0, 50.0, 60.0, 40.0}}}});
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

// A book and a cup: 24 points kept each, with scores that grow around them; one isolated above and two
// without a score beside each. The book's image shows some of them.
inline OutliersFigure TwoJudged() {
  using Fate = OutliersFigure::Fate;
  const MapSnapshot map = HandMadeMap();
  OutliersFigure figure;
  figure.threshold = 0.6;
  for (const int index : {0, 1}) {
    const SnapshotObject& object = map.objects[static_cast<std::size_t>(index)];
    OutliersFigure::Object judged;
    judged.name = object.label;
    judged.map = map;
    judged.map.points.clear();
    judged.map.support_height.reset();
    judged.map.T_map_camera.reset();
    judged.map.objects = {object};
    const auto add = [&](const Eigen::Vector3d& p_object, double anomaly, Fate fate) {
      judged.points.push_back({object.superquadric.T_map_object * p_object, anomaly, fate, std::nullopt});
    };
    for (int i = 0; i < 24; ++i) {
      add(object.superquadric.shape.PointAt(0.3 * (i % 5) - 0.6, 0.26 * i), 0.36 + 0.01 * i, Fate::kKept);
    }
    const Eigen::Vector3d& half = object.superquadric.shape.half_size;
    add({0.0, 0.3 * half.y(), 2.2 * half.z()}, 0.74, Fate::kIsolated);
    add({1.5 * half.x(), 0.0, 0.0}, 0.0, Fate::kRemovedBefore);
    add({0.0, -1.6 * half.y(), 0.2 * half.z()}, 0.0, Fate::kRemovedBefore);
    figure.objects.push_back(judged);
  }
  OutliersFigure::Object& book = figure.objects[0];
  book.image = cv::Mat(120, 160, CV_8UC3, cv::Scalar(150, 160, 170));
  book.image(cv::Rect(50, 40, 60, 40)).setTo(cv::Scalar(60, 80, 140));
  book.box = {48.0, 38.0, 64.0, 44.0};
  for (std::size_t i = 0; i < 24; ++i) {
    book.points[i].pixel =
        Eigen::Vector2d(54.0 + 10.0 * static_cast<double>(i % 6), 44.0 + 9.0 * static_cast<double>(i / 6));
  }
  book.points[24].pixel = Eigen::Vector2d(80.0, 60.0);
  book.points[25].pixel = Eigen::Vector2d(122.0, 60.0);
  return figure;
}

// A box turned by 30 degrees, seen from above, with a line along each of its sides and one across.
inline YawFigure OneTurned() {
  using Eigen::Vector2d;
  YawFigure::Object object;
  object.name = "book";
  object.image = cv::Mat(120, 160, CV_8UC3, cv::Scalar(150, 160, 170));
  const double c = std::cos(0.5236);
  const double s = std::sin(0.5236);
  const Vector2d middle(80.0, 60.0);
  const auto at = [&](double x, double y) {
    return Vector2d(middle + Vector2d(c * x + s * y, s * x - c * y));
  };
  for (double x = -32.0; x <= 32.0; x += 0.4) {
    for (double y = -20.0; y <= 20.0; y += 0.4) {
      const Vector2d p = at(x, y);
      object.image.at<cv::Vec3b>(static_cast<int>(p.y()), static_cast<int>(p.x())) = {60, 80, 140};
    }
  }
  object.before.corner = middle + Vector2d(-32.0, 20.0);
  object.before.ends = {middle + Vector2d(32.0, 20.0), middle + Vector2d(-32.0, -20.0),
                        middle + Vector2d(-34.0, 34.0)};
  object.after.corner = at(-32.0, -20.0);
  object.after.ends = {at(32.0, -20.0), at(-32.0, 20.0), at(-32.0, -20.0) + Vector2d(-2.0, 14.0)};
  object.lines = {{at(-30.0, -20.0), at(28.0, -20.0), 0},
                  {at(-30.0, 20.0), at(30.0, 20.0), 0},
                  {at(32.0, -18.0), at(32.0, 18.0), 1},
                  {at(-20.0, 0.0), at(10.0, 12.0), -1}};
  object.before.mean_angle = 30.0;
  object.after.mean_angle = 0.25;
  object.yaw_lines = 3;
  object.yaw = 30.0;
  object.region = {36.0, 16.0, 88.0, 88.0};
  return {{object}};
}

}  // namespace sqslam
