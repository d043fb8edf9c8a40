#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/page/figure_options.h"
#include "slam/calibration/calibration.h"
#include "slam/geometry/box2.h"
#include "slam/geometry/rigid3.h"
#include "slam/io/trajectory.h"
#include "slam/scene/wall_lines.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/options.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// A request for a figure, without the figure's own options. If a list is empty, the figure chooses.
struct FigureRequest {
  FigureOptions page;
  std::vector<std::string> results;  // folders or files
  std::vector<std::string> names;    // of the results, in their order
  std::vector<int> objects;          // ids
  std::vector<std::int64_t> frames;
  // Opens the recording of a result; for example with edits, or without some objects.
  std::function<RecordingReader(const std::filesystem::path& recording)> open_map =
      [](const std::filesystem::path& recording) { return RecordingReader(recording); };
};

// Returns a readable name of a part of a stage of stats.json: "bundle adjustment" for
// "mapping.bundle_adjustment". The stage itself has its own name: "mapping".
std::string StageName(const std::string& stage);

using OptionWords = std::initializer_list<const char*>;  // that a figure's option allows

// A command-line option that belongs to one figure.
struct FigureOption {
  std::string names;  // with the placeholder of the value: "--columns N"
  std::string help;
  OptionField field;
};

// Describes a figure for `sqslam figure NAME`: its arguments and how it is drawn.
struct FigureEntry {
  std::string name{};
  std::string help{};          // one line
  std::string details{};       // with examples, below the options
  std::string results_help{};  // empty: takes no results
  bool several = false;        // accepts several results, each with a name, and frames
  std::string names_help = "Name in the legend; repeated for each result, in their order";
  bool maps = false;  // reads maps: accepts edits and a choice of their objects
  bool objects = false;
  std::string frames_help{};                               // empty: takes no frames
  bool pictures = false;                                   // draws maps: accepts a rendering back end
  bool view = false;                                       // accepts camera angles
  void (*adapt_style)(SceneStyle&) = nullptr;              // applied before the user's own settings
  std::vector<FigureOption> options{};                     // its own, whose values `draw` reads
  std::function<FigurePage(const FigureRequest&)> draw{};  // throws InputError or UsageError

  // Adds the figure's own options, a struct with VisitFields(visit(names, help, value, limits...)).
  template <typename Options>
  FigureEntry DrawnBy(FigurePage (*draw_figure)(const FigureRequest&, const Options&)) && {
    const auto values = std::make_shared<Options>();
    values->VisitFields([this](const char* option, const char* text, auto& value, const auto&... limits) {
      std::vector<OptionField> fields;
      OptionCollector(fields, "")(option, value, limits...);
      options.push_back({option, text, std::move(fields.front())});
    });
    draw = [values, draw_figure](const FigureRequest& request) { return draw_figure(request, *values); };
    return std::move(*this);
  }
};

// ---- All figures, each as the values that it shows. A figure's own file draws them, reads them from results
// and declares its options. Drawing throws UsageError if the size leaves no room, and std::runtime_error
// without OpenGL.

// Superquadrics of equal half sizes on a grid of exponents: rows e1, columns e2.
struct ShapesFigure {
  std::vector<double> e1 = {0.1, 0.5, 1.0, 1.5, 2.0};
  std::vector<double> e2 = {0.1, 0.5, 1.0, 1.5, 2.0};
  Eigen::Vector3d color = Eigen::Vector3d(0.34, 0.71, 0.91);
  double azimuth = 35.0;    // of the eye, from the shapes' x axis, degrees
  double elevation = 25.0;  // of the eye above their equator, degrees
};
FigurePage DrawShapes(const ShapesFigure& figure, const FigureOptions& options);

// Objects, each as several solids over the same points, seen from the same place.
struct CompareFigure {
  struct Kind {
    std::string name;
    Eigen::Vector3d color;
  };
  struct Object {
    std::string name;
    MapSnapshot map;  // the object's points, and the keyframes, which determine the view
    std::vector<PosedSuperquadric> solids;  // one of each kind
    std::vector<std::string> notes;         // below each solid; empty: none
  };
  std::vector<Kind> kinds;
  std::vector<Object> objects;
};
FigurePage DrawComparison(const CompareFigure& figure, const FigureOptions& options);

// Maps in a row, each below an input image, with one legend of all their classes.
struct MapsFigure {
  struct Panel {
    std::string name;
    MapSnapshot map;
    cv::Mat image;  // empty: none
    std::vector<Detection> boxes;
    CloudLayerPtr dense_cloud;  // null: none
  };
  std::vector<Panel> panels;
  int columns = 0;      // 0: all in one row up to five
  bool labels = false;  // names over objects and in boxes; always shown with more than twelve classes
};
FigurePage DrawMaps(const MapsFigure& figure, const FigureOptions& options);

// Camera paths seen from above, x to the right and y up, at one scale for both.
struct TrajectoryFigure {
  struct Pose {
    double time = 0.0;  // seconds
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
  };
  using Pieces = std::vector<std::vector<Pose>>;  // split where tracking was lost
  struct Path {
    std::string name;
    Pieces pieces;
  };
  struct Footprint {
    std::string name;
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> outline;
    bool uncertain = false;  // drawn dashed and unfilled
  };
  std::optional<Path> truth;
  std::vector<Path> paths;
  std::vector<Footprint> objects;  // drawn over the paths, in this order
  std::string unit = "m";
  bool heights = false;  // z over time below
};
FigurePage DrawTrajectories(const TrajectoryFigure& figure, const FigureOptions& options);

// A floor plan in map units, x to the right and y up on the page.
struct PlanFigure {
  std::vector<TrajectoryFigure::Footprint> objects;  // z is not used; drawn in this order
  std::vector<Eigen::Vector2d> path;                 // of the camera
  std::vector<WallLine> walls;                       // empty: the plan gives no size of the room
  bool metric = false;                               // map units are metres
};
FigurePage DrawPlan(const PlanFigure& figure, const FigureOptions& options);

// Makes a plan whose longest wall, or path, runs across the page, with the front below. `cloud`: dense, may
// be null; the plan then has no walls.
PlanFigure MakePlan(const MapSnapshot& map, const CloudLayerPtr& cloud, const SceneStyle& style);

// Returns the outline of a solid seen along right x top (unit length, map frame), counter-clockwise; it
// deviates from the true one by at most a five-thousandth of the solid's longest half axis. z is 0.
std::vector<Eigen::Vector3d> OutlineFromAbove(const PosedSuperquadric& solid, const Eigen::Vector3d& right,
                                              const Eigen::Vector3d& top);

// Returns a camera path in the figure's frame.
TrajectoryFigure::Pieces PiecesOf(const Trajectory& trajectory, const Sim3d& S_figure_map);

// Stage times as bars of the means, with medians and 95th percentiles. A stage is named "group" or
// "group.stage"; each group has its own axis.
struct TimingFigure {
  struct Series {
    std::string name;
    std::map<std::string, StageTimes::Summary> stages;
  };
  std::vector<Series> series;
  std::vector<std::string> stages;  // in this order within a group
};
FigurePage DrawTiming(const TimingFigure& figure, const FigureOptions& options);

// 3D IoU per object and the means over all objects, where objects not found by a series count 0. The legend
// adds the means over the objects found.
struct IouFigure {
  struct Series {
    std::string name;
    std::vector<std::optional<double>> values;  // one an object, in [0, 1]; empty: not found
  };
  std::vector<std::string> objects;
  std::vector<Series> series;
  std::size_t not_shown = 0;  // further objects, which no series has found
};
FigurePage DrawIou(const IouFigure& figure, const FigureOptions& options);

// Inliers and outliers of an object's points, over an image with the object's box and around the translucent
// superquadric.
struct OutliersFigure {
  // In drawing order. Isolated: removed for its anomaly score; before: removed without a score.
  enum class Fate { kRemovedBefore, kKept, kIsolated };
  struct Point {
    Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
    double anomaly = 0.0;  // in [0, 1]; 0: no score
    Fate fate = Fate::kKept;
    std::optional<Eigen::Vector2d> pixel;  // empty: outside the image
  };
  struct Object {
    std::string name;
    MapSnapshot map;  // the one object, and the keyframes, which determine the view
    std::vector<Point> points;
    cv::Mat image;          // with lens distortion; empty: none
    Box2d box;              // of the object, pixels of the image
    int quarter_turns = 0;  // clockwise, that turn the image upright
  };
  std::vector<Object> objects;
  double threshold = 0.0;  // score above which points are removed
};
FigurePage DrawOutliers(const OutliersFigure& figure, const FigureOptions& options);

// Line segments in an object's image and the object's axes, drawn from a corner of its bounding box, before
// and after yaw estimation.
struct YawFigure {
  struct Line {
    Eigen::Vector2d from = Eigen::Vector2d::Zero();  // pixels of the image
    Eigen::Vector2d to = Eigen::Vector2d::Zero();
    int axis = -1;  // matched axis: 0, 1, 2 (x, y, z); -1: none
  };
  struct View {
    Eigen::Vector2d corner = Eigen::Vector2d::Zero();  // pixels of the image
    std::array<Eigen::Vector2d, 3> ends{};             // of the axes
    double mean_angle = 0.0;  // between the lines that constrain yaw and their axes, degrees
  };
  struct Object {
    std::string name;
    cv::Mat image;          // without distortion
    Box2d region;           // least part of the image to show
    int quarter_turns = 0;  // clockwise, that turn the image upright
    View before;
    View after;
    std::vector<Line> lines;
    int yaw_lines = 0;  // matched lines that constrain yaw
    double yaw = 0.0;   // rotation from the axes before to those after, degrees
  };
  std::vector<Object> objects;
};
FigurePage DrawYaw(const YawFigure& figure, const FigureOptions& options);

// Draws the fit of a calibration: the error of each corner at its place in the image, the coverage of the
// image with corners, and a histogram of the errors. Throws UsageError if the size leaves no room or there
// are no corners.
FigurePage DrawCalibration(const Calibration& calibration, const FigureOptions& options);

// Draws a board at true scale on a page with a margin: A4 (portrait or landscape) if it fits, otherwise a
// page of its size.
FigurePage DrawBoardSheet(const CalibrationBoard& board, double dpi);

// All figures, in the order of the command line's help.
FigureEntry ShapesEntry();
FigureEntry CompareEntry();
FigureEntry MapsEntry();
FigureEntry PlanEntry();
FigureEntry TrajectoryEntry();
FigureEntry TimingEntry();
FigureEntry IouEntry();
FigureEntry OutliersEntry();
FigureEntry YawEntry();
inline std::vector<FigureEntry> AllFigures() {
  return {ShapesEntry(), CompareEntry(), MapsEntry(),     PlanEntry(), TrajectoryEntry(),
          TimingEntry(), IouEntry(),     OutliersEntry(), YawEntry()};
}

}  // namespace sqslam
