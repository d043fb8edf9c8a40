#include "app/experiment/experiment_results.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

ObjectScore ScoreOf(const json& entry, bool found) {
  return {entry.at("ground_truth").get<int>(),
          entry.at("name").get<std::string>(),
          entry.at("label").get<std::string>(),
          entry.at("scored").get<bool>(),
          found,
          found ? entry.at("iou").get<double>() : 0.0};
}

void ReadScores(const json& eval, CellResult& result) {
  if (!eval.contains("objects")) {
    return;  // the sequence knows no objects
  }
  const json& summary = eval.at("summary");
  const json& objects = eval.at("objects");
  result.has_objects = true;
  result.has_scored = summary.contains("scored");
  result.mapped = summary.at("mapped").get<int>();
  result.doubles = summary.at("doubles").get<int>();
  result.extra = summary.at("extra").get<int>();
  for (const json& count : summary.at("coverage")) {
    if (count.at("min_detections").get<int>() == 60) {
      result.found_60 = count.at("mapped").get<int>();
      result.total_60 = count.at("total").get<int>();
    }
  }
  for (const json& entry : objects.at("matched")) {
    result.objects.push_back(ScoreOf(entry, true));
  }
  for (const json& entry : objects.at("missed")) {
    result.objects.push_back(ScoreOf(entry, false));
  }
  std::sort(result.objects.begin(), result.objects.end(),
            [](const ObjectScore& a, const ObjectScore& b) { return a.id < b.id; });
}

}  // namespace

void WriteCellRecord(const fs::path& run, const nlohmann::ordered_json& settings, int jobs,
                     const std::string& program) {
  const nlohmann::ordered_json record = {{"format", "sqslam-cell"},
                                         {"version", 1},
                                         {"jobs", jobs},
                                         {"program", program},
                                         {"settings", settings}};
  WriteFileAtomically(run / "cell.json", record.dump(1) + "\n");
}

std::optional<CellResult> ReadCellResult(const fs::path& run, const ExperimentCell& cell,
                                         const nlohmann::ordered_json& settings) {
  if (!fs::exists(run / "cell.json")) {
    return std::nullopt;
  }
  try {
    const auto record = nlohmann::ordered_json::parse(ReadFile(run / "cell.json", "the record of a cell"));
    if (record.at("settings") != settings) {
      return std::nullopt;
    }
    CellResult result;
    result.cell = cell;
    result.jobs = record.at("jobs").get<int>();
    result.program = record.at("program").get<std::string>();
    result.stats = ReadStats(run / "stats.json");
    if (!settings.at("eval").empty()) {
      ReadScores(json::parse(ReadFile(run / "eval.json", "an evaluation")), result);
    }
    return result;
  } catch (const InputError&) {
    return std::nullopt;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

std::string ProgramFingerprint() {
  std::ifstream file("/proc/self/exe", std::ios::binary);
  return Fingerprint(std::string(std::istreambuf_iterator<char>(file), {}));
}

}  // namespace sqslam::app
