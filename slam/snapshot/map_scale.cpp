#include "slam/snapshot/map_scale.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "slam/snapshot/sqlite_file.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

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

namespace {

bool IsPossible(const MapScale& scale) {
  return scale.metres >= 1.0 / kMaxMetresPerUnit && scale.metres <= kMaxMetresPerUnit &&
         scale.deviation >= 0.0 && std::isfinite(scale.deviation);
}

// Returns nothing for a broken scale.
std::optional<MapScale> ParseScale(const std::string& text) {
  try {
    const auto json = nlohmann::json::parse(text);
    MapScale scale{json.at("metres"), json.at("deviation"),
                   ReplaceControls(json.at("source").get<std::string>())};
    return IsPossible(scale) ? std::optional(std::move(scale)) : std::nullopt;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

constexpr std::string_view kUnitComment = "1 map unit = ";

}  // namespace

std::optional<MapScale> ReadMapScale(const fs::path& recording) {
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READONLY);
  sqlite::Statement select(db.get(), recording, "SELECT value FROM meta WHERE key = 'map_scale'");
  if (!select.Next()) {
    return std::nullopt;
  }
  const std::optional<MapScale> scale = ParseScale(select.Bytes(0));
  ThrowIf<InputError>(!scale,
                      "{}: its scale is broken, expected metres above 0; sqslam scale --none removes it",
                      recording.string());
  return scale;
}

void CheckMapScale(const fs::path& recording, const MapScale& scale) {
  ThrowIf<InputError>(
      !IsPossible(scale),
      "{}: a map unit would be {:.4g} m, give or take {:.2g}, expected {:g} to {:g} m: is the "
      "known length right?",
      recording.string(), scale.metres, scale.deviation, 1.0 / kMaxMetresPerUnit, kMaxMetresPerUnit);
}

void StoreMapScale(const fs::path& recording, const std::optional<MapScale>& scale) {
  if (scale) {
    CheckMapScale(recording, *scale);
  }
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

std::string UnitComment(double metres) {
  return metres == 1.0 ? "" : fmt::format("{}{} m", kUnitComment, metres);
}

double MetresPerUnitIn(std::string_view text) {
  constexpr std::size_t kFirstLines = 500;  // bytes, more than the header of any file
  const std::size_t comment = text.substr(0, kFirstLines).find(kUnitComment);
  if (comment == std::string_view::npos) {
    return 1.0;
  }
  const std::string_view number = text.substr(comment + kUnitComment.size(), kFirstLines);
  const double metres = ParseNumber<double>(number.substr(0, number.find(' '))).value_or(1.0);
  return metres > 0.0 && std::isfinite(metres) ? metres : 1.0;
}

}  // namespace sqslam
