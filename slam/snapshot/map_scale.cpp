#include "slam/snapshot/map_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>

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

// Returns the stored scale as text, or nothing if there is none.
std::optional<std::string> ScaleRow(sqlite3* db, const fs::path& recording) {
  sqlite::Statement select(db, recording, "SELECT value FROM meta WHERE key = 'map_scale'");
  return select.Next() ? std::optional(select.Bytes(0)) : std::nullopt;
}

// Returns nothing for a broken scale.
std::optional<MapScale> ParseScaleRow(const std::string& text) {
  try {
    const auto json = nlohmann::json::parse(text);
    MapScale scale{json.at("metres"), json.at("deviation"),
                   WithoutControls(json.at("source").get<std::string>())};
    return IsPossible(scale) ? std::optional(std::move(scale)) : std::nullopt;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

void PutScaleRow(sqlite3* db, const fs::path& recording, const std::optional<MapScale>& scale) {
  if (!scale) {
    sqlite::Statement(db, recording, "DELETE FROM meta WHERE key = 'map_scale'").Run();
    return;
  }
  const std::string text =
      nlohmann::ordered_json(
          {{"metres", scale->metres}, {"deviation", scale->deviation}, {"source", scale->source}})
          .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  sqlite::Statement(db, recording, "INSERT OR REPLACE INTO meta (key, value) VALUES ('map_scale', ?)", text)
      .Run();
}

// New files lie beside the old ones until the new scale is stored, in one transaction with the row `rescaled`
// of `meta`: from then on they are to be renamed, after which the row is removed. Whoever writes, renames or
// removes them holds the lock of a transaction. Files without the row are what a program left that was killed
// before it stored its scale.

fs::path RescaledPath(const fs::path& recording, const char* name) {
  return recording.parent_path() / fmt::format("{}.rescaled", name);
}

bool AwaitsRenaming(sqlite3* db, const fs::path& recording) {
  return sqlite::Statement(db, recording, "SELECT 1 FROM meta WHERE key = 'rescaled'").Next();
}

// Renames the new files, in a transaction. Returns false if there are none that wait for it.
bool PlaceRescaled(sqlite3* db, const fs::path& recording) {
  if (!AwaitsRenaming(db, recording)) {
    return false;
  }
  for (const char* name : kScaledFiles) {
    std::error_code error;
    fs::rename(RescaledPath(recording, name), recording.parent_path() / name, error);
    if (error && error != std::errc::no_such_file_or_directory) {  // that one was renamed before the kill
      throw InputError("{}: cannot be renamed ({}), expected a folder that can be written",
                       RescaledPath(recording, name).string(), error.message());
    }
  }
  sqlite::Statement(db, recording, "DELETE FROM meta WHERE key = 'rescaled'").Run();
  return true;
}

void RemoveRescaled(const fs::path& recording) {
  for (const char* name : kScaledFiles) {
    std::error_code error;
    fs::remove(RescaledPath(recording, name), error);
    ThrowIf<InputError>(static_cast<bool>(error), "{}: cannot be removed ({})",
                        RescaledPath(recording, name).string(), error.message());
  }
}

// Writes the new files, in a transaction in which the old scale is still stored.
void WriteRescaled(sqlite3* db, const fs::path& recording, double metres, const RescaleFile& rescale) {
  RemoveRescaled(recording);
  std::optional<double> factor = metres;
  if (const std::optional<std::string> before = ScaleRow(db, recording)) {
    const std::optional<MapScale> scale = ParseScaleRow(*before);
    factor = scale ? std::optional(metres / scale->metres) : std::nullopt;
  }
  for (const char* name : kScaledFiles) {
    const fs::path file = recording.parent_path() / name;
    if (fs::exists(file)) {
      rescale(file, RescaledPath(recording, name), factor);
    }
  }
  sqlite::Statement(db, recording, "INSERT INTO meta (key, value) VALUES ('rescaled', '')").Run();
}

}  // namespace

std::optional<MapScale> ReadMapScale(const fs::path& recording) {
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READONLY);
  const std::optional<std::string> text = ScaleRow(db.get(), recording);
  std::optional<MapScale> scale = text ? ParseScaleRow(*text) : std::nullopt;
  ThrowIf<InputError>(text && !scale,
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

void KeepMapScale(const fs::path& recording, const std::optional<MapScale>& scale,
                  const RescaleFile& rescale) {
  if (scale) {
    CheckMapScale(recording, *scale);
  }
  const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READWRITE);
  sqlite::Execute(db.get(), recording, "BEGIN IMMEDIATE");
  while (PlaceRescaled(db.get(), recording)) {
    sqlite::Execute(db.get(), recording, "COMMIT; BEGIN IMMEDIATE");
  }
  try {
    if (rescale) {
      WriteRescaled(db.get(), recording, scale ? scale->metres : 1.0, rescale);
    }
    PutScaleRow(db.get(), recording, scale);
    sqlite::Execute(db.get(), recording, "COMMIT");
  } catch (...) {
    if (rescale) {
      RemoveRescaled(recording);
    }
    throw;
  }
  if (rescale) {
    sqlite::Execute(db.get(), recording, "BEGIN IMMEDIATE");
    PlaceRescaled(db.get(), recording);
    sqlite::Execute(db.get(), recording, "COMMIT");
  }
}

void FinishRescaling(const fs::path& recording) {
  const bool waits = fs::exists(recording) && std::ranges::any_of(kScaledFiles, [&](const char* name) {
                       return fs::exists(RescaledPath(recording, name));
                     });
  if (!waits || !AwaitsRenaming(sqlite::OpenRecording(recording, SQLITE_OPEN_READONLY).get(), recording)) {
    return;
  }
  try {
    const sqlite::Database db = sqlite::OpenRecording(recording, SQLITE_OPEN_READWRITE);
    sqlite::Execute(db.get(), recording, "BEGIN IMMEDIATE");
    PlaceRescaled(db.get(), recording);
    sqlite::Execute(db.get(), recording, "COMMIT");
  } catch (const InputError& error) {
    throw InputError(
        "{}; a program was killed while it changed the scale, expected a folder in which this can be "
        "completed",
        error.what());
  }
}

}  // namespace sqslam
