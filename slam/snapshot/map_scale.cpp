#include "slam/snapshot/map_scale.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "slam/snapshot/sqlite_file.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace fs = std::filesystem;

std::string ScaleText(const MapScale& scale) {
  return fmt::format("1 map unit is {:.4g} m, give or take {:.2g} ({:.2g} %): by the {}", scale.metres,
                     scale.deviation, 100.0 * scale.deviation / scale.metres, scale.source);
}

void ScaleLengths(double factor, MapSnapshot& snapshot) {
  if (snapshot.T_map_camera) {
    snapshot.T_map_camera->translation *= factor;
  }
  for (SnapshotKeyframe& keyframe : snapshot.keyframes) {
    keyframe.T_map_camera.translation *= factor;
  }
  for (SnapshotPoint& point : snapshot.points) {
    point.p_map *= static_cast<float>(factor);
  }
  Eigen::Matrix<double, 9, 1> of_parameter = Eigen::Matrix<double, 9, 1>::Ones();
  of_parameter.head<6>().setConstant(factor);  // centre and half sizes
  for (SnapshotObject& object : snapshot.objects) {
    object.superquadric.T_map_object.translation *= factor;
    object.superquadric.shape.half_size *= factor;
    object.fit.point_rms *= factor;
    object.fit.covariance = of_parameter.asDiagonal() * object.fit.covariance * of_parameter.asDiagonal();
  }
  if (snapshot.support_height) {
    *snapshot.support_height *= factor;
  }
}

std::optional<MapScale> ReadMapScale(const fs::path& recording) {
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READONLY);
  sqlite::Statement select(db.get(), recording, "SELECT value FROM meta WHERE key = 'map_scale'");
  if (!select.Next()) {
    return std::nullopt;
  }
  try {
    const auto json = nlohmann::json::parse(select.Bytes(0));
    MapScale scale{json.at("metres"), json.at("deviation"),
                   WithoutControls(json.at("source").get<std::string>())};
    if (scale.metres > 0.0 && std::isfinite(scale.metres) && std::isfinite(scale.deviation)) {
      return scale;
    }
  } catch (const nlohmann::json::exception&) {  // thrown below
  }
  throw InputError("{}: its scale is broken, expected metres above 0", recording.string());
}

void KeepMapScale(const fs::path& recording, const std::optional<MapScale>& scale) {
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READWRITE);
  if (!scale) {
    sqlite::Statement(db.get(), recording, "DELETE FROM meta WHERE key = 'map_scale'").Run();
    return;
  }
  const std::string text =
      nlohmann::ordered_json(
          {{"metres", scale->metres}, {"deviation", scale->deviation}, {"source", scale->source}})
          .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  sqlite::Statement(db.get(), recording, "INSERT OR REPLACE INTO meta (key, value) VALUES ('map_scale', ?)",
                    text)
      .Run();
}

}  // namespace sqslam
