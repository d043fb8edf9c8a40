#include "app/report/report_data.h"

#include <fmt/format.h>

#include <array>

#include "render/scene/style.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace {

ReportEvaluation ReadEvaluation(const std::filesystem::path& path) {
  try {
    ReportEvaluation evaluation;
    evaluation.json = nlohmann::json::parse(ReadFile(path, "an eval.json"));
    evaluation.scale = evaluation.json.at("trajectory").at("S_world_map").at("scale").get<double>();
    for (const auto& position : evaluation.json.at("ground_truth_positions_map")) {
      const auto p = position.get<std::array<double, 3>>();
      evaluation.truth_positions_map.emplace_back(p[0], p[1], p[2]);
    }
    evaluation.has_objects = evaluation.json.contains("objects");
    return evaluation;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(
        fmt::format("{}: expected an eval.json as sqslam eval writes it ({})", path.string(), error.what()));
  }
}

}  // namespace

ReportData ReadReportData(const std::filesystem::path& folder, const FinishedRun* run) {
  if (!std::filesystem::is_directory(folder)) {
    throw InputError(fmt::format("{}: no such folder; expected the result folder of a run", folder.string()));
  }
  const auto has = [&](const char* name) { return std::filesystem::exists(folder / name); };
  ReportData data;
  data.folder = folder;
  if (run != nullptr) {
    data.trajectory = run->result.map.trajectory;
    data.objects = run->result.map.snapshot->objects;
    data.stats = run->stats;
  } else {
    data.trajectory = has("trajectory.txt") ? ReadTrajectory(folder / "trajectory.txt") : Trajectory();
    data.objects = has("objects.json") ? ReadObjects(folder / "objects.json") : data.objects;
    data.stats = has("stats.json") ? std::optional(ReadStats(folder / "stats.json")) : std::nullopt;
  }
  if (has("eval.json")) {
    data.evaluation = ReadEvaluation(folder / "eval.json");
  }
  std::vector<std::string> labels;
  for (const SnapshotObject& object : data.objects) {
    labels.push_back(object.label);
  }
  const LabelColors colors(labels);
  for (const std::string& label : labels) {
    const Eigen::Vector3i rgb = (255.0 * colors(label)).array().round().cast<int>();
    data.colors[label] = fmt::format("#{:02x}{:02x}{:02x}", rgb.x(), rgb.y(), rgb.z());
  }
  return data;
}

}  // namespace sqslam::app
