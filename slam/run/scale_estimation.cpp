#include "slam/run/scale_estimation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "slam/estimation/reprojection_error.h"
#include "slam/io/input_images.h"
#include "slam/run/map_to_extend.h"
#include "slam/snapshot/recording.h"
#include "slam/system_parts.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr double kMaxRelativeDeviation = 0.05;  // of a scale; a larger one is warned of

CalibrationBoard ParseBoard(const std::string& text) {
  const std::vector<std::string> parts = Split(text, ',');
  const std::vector<std::string> sides = parts.empty() ? parts : Split(parts[0], 'x');
  CalibrationBoard board{.kind = BoardKind::kCharuco};
  const auto columns = sides.size() == 2 ? ParseNumber<int>(sides[0]) : std::nullopt;
  const auto rows = sides.size() == 2 ? ParseNumber<int>(sides[1]) : std::nullopt;
  const auto square = parts.size() >= 3 ? ParseNumber<double>(parts[1]) : std::nullopt;
  const auto marker = parts.size() >= 3 ? ParseNumber<double>(parts[2]) : std::nullopt;
  ThrowIf<UsageError>(!columns || !rows || !square || !marker || parts.size() > 4,
                      "board={}: expected COLUMNSxROWS,SQUARE,MARKER in mm, such as board=10x7,25,18,4X4_50",
                      text);
  board.columns = *columns;
  board.rows = *rows;
  board.square_mm = *square;
  board.marker_mm = *marker;
  board.dictionary = parts.size() == 4 ? parts[3] : board.dictionary;
  return board;
}

std::string NameOf(const SnapshotObject& object) { return fmt::format("{} {}", object.id, object.label); }

// Returns the vertical extent and its standard deviation from the half sizes' covariance; 0 if unknown.
std::pair<double, double> HeightOf(const SnapshotObject& object) {
  const Superquadric& shape = object.superquadric.shape;
  const Eigen::Vector3d up = object.superquadric.T_map_object.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  // The support point scales with the half sizes: its components are their shares in the extent.
  const Eigen::Vector3d by_half_size =
      2.0 * shape.SupportPoint(up).cwiseProduct(up).cwiseQuotient(shape.half_size);
  const double variance = by_half_size.dot(object.fit.covariance.block<3, 3>(3, 3) * by_half_size);
  return {2.0 * shape.SupportExtent(up), std::sqrt(std::max(0.0, variance))};
}

[[noreturn]] void RefuseObject(const MapSnapshot& map, const std::string& wanted) {
  const std::vector<std::string> names =
      ToVector(map.objects, [](const SnapshotObject& object) { return NameOf(object); });
  throw InputError(names.empty() ? fmt::format("the map has no objects, expected {}", wanted)
                                 : fmt::format("the map has no object {}, expected one of {}", wanted,
                                               fmt::join(names, ", ")));
}

void WarnIfUncertain(const SnapshotObject& object) {
  if (!IsReliable(object)) {
    spdlog::warn(
        "{} is uncertain (reliability {:.2f}): its size may be wrong by much more than its standard "
        "deviation",
        NameOf(object), object.fit.reliability);
  }
}

// Returns the object with this id, or the one of this label with the smallest relative deviation of its
// height; uncertain ones come last.
const SnapshotObject& FindObject(const MapSnapshot& map, const std::string& wanted) {
  const auto id = ParseNumber<int>(wanted);
  const SnapshotObject* best = nullptr;
  const auto rank = [](const SnapshotObject& object) {
    const auto [height, deviation] = HeightOf(object);
    return std::pair(!IsReliable(object),
                     deviation > 0.0 ? deviation / height : std::numeric_limits<double>::infinity());
  };
  for (const SnapshotObject& object : map.objects) {
    const bool fits = id ? object.id == *id : object.label == wanted;
    if (fits && (best == nullptr || rank(object) < rank(*best))) {
      best = &object;
    }
  }
  if (best == nullptr) {
    RefuseObject(map, wanted);
  }
  return *best;
}

// A point with its covariance, in units of the snapshot.
struct Place {
  Eigen::Vector3d at;
  Eigen::Matrix3d covariance;
  std::string what;
};

Place PlaceOfObject(const MapSnapshot& map, const std::string& text) {
  const SnapshotObject& object = FindObject(map, text);
  WarnIfUncertain(object);
  const Eigen::Matrix3d covariance = object.fit.covariance.topLeftCorner<3, 3>();
  ThrowIf<InputError>(!(covariance.trace() > 0.0),
                      "{} was never refined, so the error of its centre is unknown, expected another object",
                      NameOf(object));
  return {object.superquadric.T_map_object.translation, covariance, NameOf(object)};
}

Place PlaceOfPoint(const MapSnapshot& map, const Eigen::Vector3d& wanted, const Map& live, double unit) {
  constexpr double kMaxDistanceShare = 0.02;  // of its distance to the nearest keyframe
  const MapPoint* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const MapPoint& point : live.Points()) {
    const double distance = (unit * point.p_map - wanted).norm();
    if (distance < least) {
      nearest = &point;
      least = distance;
    }
  }
  double view = std::numeric_limits<double>::infinity();
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    view = std::min(view, (keyframe.T_map_camera.translation - wanted).norm());
  }
  ThrowIf<InputError>(nearest == nullptr || least > kMaxDistanceShare * view,
                      "no map point lies at {:.4g},{:.4g},{:.4g}{}", wanted.x(), wanted.y(), wanted.z(),
                      nearest == nullptr
                          ? std::string()
                          : fmt::format(", the nearest is {:.2g} {} away", least, UnitOf(map)));
  const double variance = PixelVariance(live, map.camera);
  return {unit * nearest->p_map, unit * unit * PointCovariance(live, map.camera, nearest->id, variance),
          fmt::format("{:.4g},{:.4g},{:.4g}", wanted.x(), wanted.y(), wanted.z())};
}

std::vector<BoardSighting> FindBoards(const RecordingReader& recording, const MapSnapshot& map,
                                      const CalibrationBoard& board,
                                      const std::function<void(int, int)>& progress) {
  constexpr std::size_t kMaxSearchedKeyframes = 120;  // keyframes that are searched
  std::vector<SnapshotKeyframe> keyframes = map.keyframes;
  std::ranges::sort(keyframes, {}, &SnapshotKeyframe::frame_index);
  InputImages images(recording);
  std::vector<BoardSighting> sightings;
  bool any = false;
  const std::size_t count = std::min(kMaxSearchedKeyframes, keyframes.size());
  for (std::size_t i = 0; i < count; ++i) {
    const SnapshotKeyframe& keyframe = keyframes[i * keyframes.size() / count];
    const cv::Mat image = images.Read(keyframe.frame_index);
    if (!image.empty()) {
      any = true;
      cv::Mat gray;
      cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
      if (std::optional<BoardView> view = FindBoard(gray, board)) {
        sightings.push_back({keyframe.T_map_camera, std::move(*view)});
      }
    }
    if (progress) {
      progress(static_cast<int>(i) + 1, static_cast<int>(count));
    }
  }
  ThrowIf<InputError>(!any, "{}: the mapped images are needed to find a board: {}",
                      recording.Info().sequence_path, images.WhyNot());
  return sightings;
}

MapScale ScaleFrom(const MeasuredLength& measured, double metres) {
  return {metres / measured.length, metres * measured.deviation / (measured.length * measured.length),
          fmt::format("{}, {:.4g} m", measured.what, metres)};
}

// Measures in units of the snapshot.
MapScale ScaleByBoardIn(const RecordingReader& recording, const MapSnapshot& map,
                        const CalibrationBoard& board, const std::function<void(int, int)>& progress) {
  const std::vector<BoardSighting> sightings = FindBoards(recording, map, board, progress);
  const std::optional<BoardScale> scale = ScaleByBoard(sightings, map.camera, board);
  ThrowIf<InputError>(!scale,
                      "a {} is seen in {} of {} keyframes, expected at least four from different positions",
                      BoardText(board), sightings.size(), map.keyframes.size());
  return {scale->metres, scale->deviation,
          fmt::format("{}, in {} keyframes", BoardText(board), sightings.size())};
}

}  // namespace

ScaleReference ParseScaleReference(const std::string& text) {
  ScaleReference reference;
  const std::size_t equals = text.find('=');
  const std::string what = text.substr(0, equals);
  if (what == "board") {
    reference = equals == std::string::npos ? CalibrationBoard{.kind = BoardKind::kCharuco}
                                            : ParseBoard(text.substr(equals + 1));
  } else {
    const auto metres =
        equals == std::string::npos ? std::nullopt : ParseNumber<double>(text.substr(equals + 1));
    ThrowIf<UsageError>(
        what.empty() || !metres,
        "{}: expected LABEL=METRES such as cup=0.096, board, or board=COLUMNSxROWS,SQUARE,MARKER", text);
    reference = KnownHeight{what, *metres};
  }
  CheckScaleReference(reference);
  return reference;
}

void CheckScaleReference(const ScaleReference& reference) {
  const auto check = [](double metres) {
    ThrowIf<UsageError>(!(metres > 0.0) || !std::isfinite(metres), "{} m: expected a length above 0", metres);
  };
  if (const auto* board = std::get_if<CalibrationBoard>(&reference)) {
    CheckBoard(*board);
  } else if (const auto* height = std::get_if<KnownHeight>(&reference)) {
    check(height->metres);
  } else {
    check(std::get<KnownDistance>(reference).metres);
  }
}

MeasuredLength MeasureHeight(const MapSnapshot& map, const std::string& wanted) {
  const SnapshotObject& object = FindObject(map, wanted);
  ThrowIf<InputError>(
      !map.gravity_known,
      "the map's up direction is unknown, so objects have no height; expected --distance or --board");
  const auto [height, deviation] = HeightOf(object);
  ThrowIf<InputError>(!(deviation > 0.0),
                      "{} was never refined, so the error of its height is unknown, expected another object",
                      NameOf(object));
  WarnIfUncertain(object);
  return {height, deviation, "height of " + NameOf(object)};
}

MeasuredLength MeasureDistance(const MapSnapshot& map, const KnownDistance& distance,
                               const std::function<Map()>& points, double unit) {
  std::optional<Map> live;
  const auto place = [&](const std::string& text) {
    const std::vector<std::string> parts = Split(text, ',');
    if (parts.size() != 3) {
      return PlaceOfObject(map, text);
    }
    Eigen::Vector3d at;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto number = ParseNumber<double>(parts[i]);
      ThrowIf<UsageError>(!number || !std::isfinite(*number),
                          "{}: expected the id of an object, or a position X,Y,Z", text);
      at[static_cast<Eigen::Index>(i)] = *number;
    }
    if (!live) {
      live.emplace(points());
    }
    return PlaceOfPoint(map, at, *live, unit);
  };
  const Place a = place(distance.from);
  const Place b = place(distance.to);
  const Eigen::Vector3d difference = b.at - a.at;
  const double length = difference.norm();
  const Eigen::Matrix3d covariance = a.covariance + b.covariance;
  ThrowIf<InputError>(!(length > 0.0), "{} and {} are the same place, expected two", a.what, b.what);
  return {length, std::sqrt(difference.dot(covariance * difference)) / length,
          fmt::format("distance of {} and {}", a.what, b.what)};
}

Eigen::Matrix3d PointCovariance(const Map& map, const Camera& camera, PointId id, double pixel_variance) {
  const MapPoint& point = map.Point(id);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const Observation& observation : point.observations) {
    const Rigid3d& T_camera_map = map.At(observation.keyframe).T_camera_map;
    const Eigen::Vector3d p = T_camera_map * point.p_map;
    const Eigen::Matrix<double, 2, 3> by_map = ProjectionJacobian(camera, p) * T_camera_map.RotationMatrix();
    information += by_map.transpose() * by_map /
                   (pixel_variance * map.Levels().Variance(map.KeypointOf(observation).octave));
  }
  return information.inverse();
}

double PixelVariance(const Map& map, const Camera& camera) {
  constexpr double kMinVariance = 1e-6;  // px^2
  double squares = 0.0, freedom = 0.0;
  for (const MapPoint& point : map.Points()) {
    for (const Observation& observation : point.observations) {
      const Keypoint& keypoint = map.KeypointOf(observation);
      const Eigen::Vector2d error =
          camera.Project(map.At(observation.keyframe).T_camera_map * point.p_map) - keypoint.pixel;
      squares += error.squaredNorm() / map.Levels().Variance(keypoint.octave);
      freedom += 2.0;
    }
    freedom -= 3.0;  // of its position
  }
  return std::max(kMinVariance, squares / std::max(1.0, freedom));
}

MapScale EstimateScale(const fs::path& recording, const ScaleReference& reference,
                       const std::function<void(int, int)>& progress) {
  CheckScaleReference(reference);
  const RecordingReader reader(recording);
  const MapSnapshotPtr map = reader.Last();
  const double unit = reader.Info().scale ? reader.Info().scale->metres : 1.0;
  const auto live = [&] {
    const MapToExtend known = ReadKnownMap(recording);
    return MainMapOf(known.map, recording.string(), known.options);
  };
  MapScale scale;
  try {
    if (const auto* height = std::get_if<KnownHeight>(&reference)) {
      scale = ScaleFrom(MeasureHeight(*map, height->object), height->metres);
    } else if (const auto* distance = std::get_if<KnownDistance>(&reference)) {
      scale = ScaleFrom(MeasureDistance(*map, *distance, live, unit), distance->metres);
    } else {
      scale = ScaleByBoardIn(reader, *map, std::get<CalibrationBoard>(reference), progress);
    }
  } catch (const InputError& error) {
    const std::string what = error.what();
    const bool names_file = what.starts_with(recording.string());
    throw InputError(names_file ? what : fmt::format("{}: {}", recording.string(), what));
  }
  scale.metres *= unit;
  scale.deviation *= unit;
  CheckMapScale(recording, scale);
  if (scale.deviation > kMaxRelativeDeviation * scale.metres) {
    spdlog::warn("the standard deviation of the scale is {:.0f} %: {}",
                 100.0 * scale.deviation / scale.metres, scale.source);
  }
  return scale;
}

}  // namespace sqslam
