#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "render/page/figure_options.h"
#include "slam/geometry/box2.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Figures made of pictures of maps, with texts beside and over them as texts. Throw UsageError where the size
// leaves no room, std::runtime_error without OpenGL.

// Told at the start and after each picture.
using FigureProgress = std::function<void(int done, int total)>;

// Superquadrics of equal half sizes on a grid of their exponents: rows e1, columns e2.
struct ShapesFigure {
  std::vector<double> e1 = {0.1, 0.5, 1.0, 1.5, 2.0};
  std::vector<double> e2 = {0.1, 0.5, 1.0, 1.5, 2.0};
  Eigen::Vector3d color = Eigen::Vector3d(0.34, 0.71, 0.91);
  double azimuth = 35.0;    // of the eye, from the shapes' x axis, degrees
  double elevation = 25.0;  // of the eye above their equator, degrees
};
FigurePage DrawShapes(const ShapesFigure& figure, const FigureOptions& options,
                      const FigureProgress& progress = {});

// Objects, each as several solids over the same points, seen from the same place.
struct CompareFigure {
  struct Kind {
    std::string name;
    Eigen::Vector3d color;
  };
  struct Object {
    std::string name;
    MapSnapshot map;  // the object's points and the keyframes, from which the view comes
    std::vector<PosedSuperquadric> solids;  // one of each kind
    std::vector<std::string> notes;         // below each solid; empty: none
  };
  std::vector<Kind> kinds;
  std::vector<Object> objects;
};
FigurePage DrawComparison(const CompareFigure& figure, const FigureOptions& options,
                          const FigureProgress& progress = {});

// Maps in a row, each below an input image, with one legend of all their classes.
struct MapsFigure {
  struct Box {
    std::string label;
    Box2d box;  // pixels of the image
  };
  struct Panel {
    std::string name;
    MapSnapshot map;
    cv::Mat image;  // empty: none
    std::vector<Box> boxes;
  };
  std::vector<Panel> panels;
  int columns = 0;      // 0: all in one row up to five
  bool labels = false;  // names over the objects
};
FigurePage DrawMaps(const MapsFigure& figure, const FigureOptions& options,
                    const FigureProgress& progress = {});

}  // namespace sqslam
