#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "slam/calibration/board.h"
#include "slam/map/map.h"
#include "slam/snapshot/map_scale.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A thing whose size somebody knows, in metres.
struct KnownHeight {
  std::string object;  // its id, or a label: then the object of that label whose height is surest
  double metres = 0.0;
};
struct KnownDistance {
  std::string from;  // "4": the centre of object 4; "0.1,-0.2,0.5": the map point nearest to that place
  std::string to;
  double metres = 0.0;
};
using ScaleReference = std::variant<KnownHeight, KnownDistance, CalibrationBoard>;

// "cup=0.096" (or "4=0.096"), "board", or "board=COLUMNSxROWS,SQUARE,MARKER[,DICTIONARY]" (mm). Throws
// UsageError.
ScaleReference ParseScaleReference(const std::string& text);

// Throws UsageError for lengths that are not above 0 and for boards that are none, or no ChArUco board.
void CheckScaleReference(const ScaleReference& reference);

// A length in the units of a map with its standard deviation.
struct MeasuredLength {
  double length = 0.0;
  double deviation = 0.0;
  std::string what;  // "height of 4 cup"
};

// The vertical extent of an object; its deviation is that of the object's covariance. Throws InputError where
// there is no such object, or no height: nothing tells what is up, or the object was never refined.
MeasuredLength MeasureHeight(const MapSnapshot& map, const std::string& object);

// The distance between the centres of two objects or between two map points, with the deviation of their
// covariances, taken to be independent. `points`: the live map of the same frame, in whose `unit` of the
// snapshot's lengths; it is asked for where a place is named. Throws InputError.
MeasuredLength MeasureDistance(const MapSnapshot& map, const KnownDistance& distance,
                               const std::function<Map()>& points, double unit);

// Covariance of a map point by the keypoints that show it, which err by as much as all of the map do on
// average; the keyframes are taken to be right.
Eigen::Matrix3d PointCovariance(const Map& map, const Camera& camera, PointId point, double pixel_variance);

// Mean squared distance of keypoints from their points, px^2 at octave 0, as errors that were not fitted
// away.
double PixelVariance(const Map& map, const Camera& camera);

// A board as one keyframe shows it.
struct BoardSight {
  Rigid3d T_map_camera;
  BoardView view;
};

// Metres per unit of the map, of the best similarity between the board and its corners as the keyframes'
// rays meet; the deviation is what leaving out one keyframe at a time tells (jackknife). Empty where fewer
// than four keyframes show corners from places apart.
struct BoardScale {
  double metres = 0.0;
  double deviation = 0.0;
  double rms = 0.0;  // of the corners after the fit, metres
  int corners = 0;
};
std::optional<BoardScale> ScaleByBoard(const std::vector<BoardSight>& sights, const Camera& camera,
                                       const CalibrationBoard& board);

// The scale of a recording's map from a known thing, whether it has a scale already or not; says in warnings
// what makes it doubtful. `progress` is told of the images that are searched for a board. Throws InputError.
MapScale EstimateScale(const std::filesystem::path& recording, const ScaleReference& reference,
                       const std::function<void(int done, int total)>& progress = {});

}  // namespace sqslam
