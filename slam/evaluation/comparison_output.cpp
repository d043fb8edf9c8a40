#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "slam/evaluation/comparison.h"
#include "slam/geometry/angles.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

// The columns of ListObjects: what it is, then what was measured.
struct ObjectRow {
  std::string kind;
  const GroundTruthObject* truth = nullptr;
  const SnapshotObject* mapped = nullptr;
  const ObjectMatch* match = nullptr;
  const ExtraLandmark* extra = nullptr;
};

Cell Measured(bool known, double value, int decimals) {
  return known ? Cell::Number(value, decimals) : Cell::Of({}, decimals);
}

std::vector<Cell> ToCells(const std::string& result, const ObjectRow& row) {
  const auto* truth = row.truth;
  const auto* mapped = row.mapped;
  const bool is_match = row.match != nullptr;
  const ObjectMatch match = is_match ? *row.match : ObjectMatch{};
  const bool is_thin = is_match && IsThin(truth->solid);
  const ExtraLandmark extra = row.extra != nullptr ? *row.extra : ExtraLandmark{};
  std::vector<Cell> cells = {Cell::Words(result),
                             Cell::Words(row.kind),
                             Measured(truth != nullptr, truth != nullptr ? truth->id : 0, 0),
                             Cell::Words(truth != nullptr ? ShownName(*truth) : ""),
                             Measured(truth != nullptr, truth != nullptr ? truth->detections : 0, 0),
                             Cell::Words(truth == nullptr ? ""
                                         : truth->scored  ? "yes"
                                                          : "no"),
                             Measured(mapped != nullptr, mapped != nullptr ? mapped->id : 0, 0),
                             Cell::Words(mapped != nullptr ? mapped->label : ""),
                             Measured(mapped != nullptr, mapped != nullptr ? mapped->observations : 0, 0)};
  for (const double value : {match.iou, match.iou_ellipsoid}) {
    cells.push_back(Measured(is_match, value, 3));
  }
  cells.push_back(Measured(is_thin, match.footprint_iou, 3));
  cells.push_back(Measured(is_match, match.center_error, 4));
  cells.push_back(Measured(is_match, match.size_error, 4));
  cells.push_back(Measured(is_match, match.tilt_error * kDegreesPerRadian, 1));
  cells.push_back(Measured(is_match, match.yaw_error * kDegreesPerRadian, 1));
  for (int axis = 0; axis < 3; ++axis) {
    cells.push_back(Measured(row.extra != nullptr, extra.center_world[axis], 3));
  }
  return cells;
}

std::vector<ObjectRow> RowsOf(const Evaluation& evaluation) {
  const auto truth = [&](int index) { return &evaluation.truth[static_cast<std::size_t>(index)]; };
  const auto mapped = [&](int index) { return &evaluation.mapped[static_cast<std::size_t>(index)]; };
  std::vector<ObjectRow> rows;
  for (const ObjectMatch& match : evaluation.objects.matches) {
    rows.push_back({"matched", truth(match.truth), mapped(match.mapped), &match, nullptr});
  }
  for (const int index : evaluation.objects.missed) {
    rows.push_back({"missed", truth(index), nullptr, nullptr, nullptr});
  }
  for (const ObjectDuplicate& twice : evaluation.objects.duplicates) {
    rows.push_back({"double", truth(twice.truth), mapped(twice.mapped), nullptr, nullptr});
  }
  for (const ExtraLandmark& extra : evaluation.extra) {
    rows.push_back({"extra", nullptr, mapped(extra.mapped), nullptr, &extra});
  }
  return rows;
}

template <typename Write>
std::string Joined(const std::vector<Table>& tables, Write write) {
  std::string text;
  for (const Table& table : tables) {
    text += text.empty() ? "" : "\n";
    text += write(table);
  }
  return text;
}

}  // namespace

Table ListObjects(const std::vector<NamedEvaluation>& results) {
  Table table{"",
              "Objects",
              {"result", "kind", "ground truth", "name", "boxes", "scored", "landmark", "label", "seen",
               "3D IoU", "3D IoU as ellipsoid", "footprint IoU", "centre error m", "size error m",
               "tilt error deg", "yaw error deg", "world x m", "world y m", "world z m"},
              {},
              {}};
  for (const NamedEvaluation& result : results) {
    for (const ObjectRow& row : RowsOf(result.evaluation)) {
      table.rows.push_back(ToCells(result.name, row));
    }
  }
  return table;
}

void CheckComparisonPath(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".md" && extension != ".csv" && extension != ".tex" && extension != ".json") {
    throw UsageError(fmt::format("--output {}: expected a file name that ends in .md, .csv, .tex or .json",
                                 path.string()));
  }
}

void WriteComparison(const std::filesystem::path& path, const std::vector<NamedEvaluation>& results) {
  CheckComparisonPath(path);
  const std::string extension = path.extension().string();
  if (extension == ".csv") {
    WriteFileAtomically(path, ToCsv(ListObjects(results)));
    return;
  }
  if (extension == ".json") {
    nlohmann::ordered_json document = {{"format", "sqslam-comparison"}, {"version", 1}};
    document["results"] = nlohmann::ordered_json::array();
    for (const NamedEvaluation& result : results) {
      nlohmann::ordered_json entry = nlohmann::ordered_json::parse(EvaluationJson(result.evaluation));
      entry.erase("ground_truth_positions_map");
      entry["name"] = result.name;
      document["results"].push_back(std::move(entry));
    }
    WriteFileAtomically(path, document.dump(1) + "\n");
    return;
  }
  const std::vector<Table> tables = CompareEvaluations(results);
  WriteFileAtomically(path, extension == ".md" ? Joined(tables, ToMarkdown) : Joined(tables, ToLatex));
}

}  // namespace sqslam
