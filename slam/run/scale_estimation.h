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

// An object of known height, in metres.
struct KnownHeight {
  std::string object;  // its id, or a label: the object of that label with the most certain height
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

// Throws UsageError for lengths that are not positive and for boards that are invalid or not ChArUco.
void CheckScaleReference(const ScaleReference& reference);

// A length in the units of a map with its standard deviation.
struct MeasuredLength {
  double length = 0.0;
  double deviation = 0.0;
  std::string what;  // "height of 4 cup"
};

// Returns the vertical extent of an object with the deviation from its covariance. Throws InputError if there
// is no such object, the up direction is unknown, or the object was never refined.
MeasuredLength MeasureHeight(const MapSnapshot& map, const std::string& object);

// Returns the distance between the centres of two objects or between two map points, with the deviation from
// their covariances, taken to be independent. `points`: returns the live map of the same frame, called only
// for map points. `unit`: of that map, in units of the snapshot. Throws InputError.
MeasuredLength MeasureDistance(const MapSnapshot& map, const KnownDistance& distance,
                               const std::function<Map()>& points, double unit);

// Returns the covariance of a map point from its observations, with `pixel_variance` at octave 0; the
// keyframes are taken to be exact.
Eigen::Matrix3d PointCovariance(const Map& map, const Camera& camera, PointId point, double pixel_variance);

// Returns the variance of all reprojection errors, px^2 at octave 0, corrected for the degrees of freedom of
// the points.
double PixelVariance(const Map& map, const Camera& camera);

// A board in one keyframe.
struct BoardSighting {
  Rigid3d T_map_camera;
  BoardView view;
};

// Metres per unit of the map, from the best similarity between the board and its corners as triangulated from
// the keyframes; the deviation is a jackknife over the keyframes. Empty if fewer than four keyframes show
// corners from different positions.
struct BoardScale {
  double metres = 0.0;
  double deviation = 0.0;
  double rms = 0.0;  // of the corners after the fit, metres
  int corners = 0;
};
std::optional<BoardScale> ScaleByBoard(const std::vector<BoardSighting>& sightings, const Camera& camera,
                                       const CalibrationBoard& board);

// Returns the scale of a recording's map from a known object, whether or not it has a scale already; warns
// about doubtful values. `progress`: over the images searched for a board. Throws InputError.
MapScale EstimateScale(const std::filesystem::path& recording, const ScaleReference& reference,
                       const std::function<void(int done, int total)>& progress = {});

}  // namespace sqslam
