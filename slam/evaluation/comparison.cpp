#include "slam/evaluation/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "slam/geometry/angles.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

using Results = std::vector<NamedEvaluation>;

const Evaluation& First(const Results& results) { return results.front().evaluation; }

std::string NumberedName(const GroundTruthObject& object) {
  return fmt::format("{} {}", object.id, ShownName(object));
}

std::string NumberedName(const SnapshotObject& object) {
  return fmt::format("{} {}", object.id, object.label);
}

const ObjectMatch* MatchOf(const Evaluation& evaluation, std::size_t truth) {
  const auto& matches = evaluation.objects.matches;
  const auto it = std::find_if(matches.begin(), matches.end(),
                               [&](const auto& match) { return match.truth == static_cast<int>(truth); });
  return it == matches.end() ? nullptr : &*it;
}

std::vector<std::string> Columns(std::string first, const Results& results) {
  std::vector<std::string> columns = {std::move(first)};
  std::transform(results.begin(), results.end(), std::back_inserter(columns),
                 [](const auto& result) { return result.name; });
  return columns;
}

std::string SharesText(int part, int whole) { return fmt::format("{} of {}", part, whole); }

using Value = std::function<Cell(const Evaluation&)>;

void AddRow(const Results& results, const std::string& name, const Value& value, Table& table) {
  std::vector<Cell> row = {Cell::Words(name)};
  std::transform(results.begin(), results.end(), std::back_inserter(row),
                 [&](const auto& result) { return value(result.evaluation); });
  table.rows.push_back(std::move(row));
}

void AddCounts(const Results& results, Table& table) {
  const auto add = [&](const std::string& name, const Value& value) { AddRow(results, name, value, table); };
  add("landmarks mapped",
      [](const auto& e) { return Cell::Number(static_cast<double>(e.mapped.size()), 0); });
  add("objects found", [](const auto& e) {
    return Cell::Words(
        SharesText(static_cast<int>(e.objects.matches.size()), static_cast<int>(e.truth.size())));
  });
  for (std::size_t i = 0; i < First(results).coverage.size(); ++i) {
    add(fmt::format("  of those with {} or more boxes", First(results).coverage[i].min_detections),
        [i](const auto& e) { return Cell::Words(SharesText(e.coverage[i].mapped, e.coverage[i].total)); });
  }
  add("doubles",
      [](const auto& e) { return Cell::Number(static_cast<double>(e.objects.duplicates.size()), 0); });
  add("extra", [](const auto& e) { return Cell::Number(static_cast<double>(e.objects.extra.size()), 0); });
}

Table SummaryTable(const Results& results) {
  Table table{"", "Results side by side", Columns("", results), {}, {}};
  const auto add = [&](const std::string& name, const Value& value) { AddRow(results, name, value, table); };
  add("frames tracked", [](const auto& e) { return Cell::Words(SharesText(e.tracked, e.frames)); });
  add("ATE RMSE m", [](const auto& e) { return Cell::Number(e.trajectory.rmse, 4); });
  if (!First(results).has_objects) {
    return table;
  }
  AddCounts(results, table);
  add("mean 3D IoU of those found", [](const auto& e) { return Cell::Number(e.iou.mean, 3); });
  add("mean 3D IoU, missed as 0", [](const auto& e) { return Cell::Number(e.iou.mean_all, 3); });
  add("  found ones as ellipsoids", [](const auto& e) { return Cell::Number(e.iou.mean_ellipsoid, 3); });
  if (First(results).has_scored) {
    add("scored objects found",
        [](const auto& e) { return Cell::Words(SharesText(e.scored_iou.matched, e.scored_iou.objects)); });
    add("  mean 3D IoU of those found", [](const auto& e) { return Cell::Number(e.scored_iou.mean, 3); });
    add("  mean 3D IoU, missed as 0", [](const auto& e) { return Cell::Number(e.scored_iou.mean_all, 3); });
  }
  return table;
}

using Measure = std::function<double(const ObjectMatch&)>;
using Choice = std::function<bool(const GroundTruthObject&)>;

// A row for each chosen ground-truth object, and the mean over those that are found.
Table ObjectTable(const Results& results, const std::string& title, int decimals, const Choice& chosen,
                  const Measure& measure) {
  Table table{"", title, Columns("ground truth", results), {}, {}};
  std::vector<std::vector<double>> found(results.size());
  const auto& truth = First(results).truth;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!chosen(truth[i])) {
      continue;
    }
    const bool marked = First(results).has_scored && truth[i].scored;
    std::vector<Cell> row = {Cell::Words(NumberedName(truth[i]) + (marked ? " (scored)" : ""))};
    for (std::size_t j = 0; j < results.size(); ++j) {
      const ObjectMatch* match = MatchOf(results[j].evaluation, i);
      row.push_back(match != nullptr ? Cell::Number(measure(*match), decimals) : Cell::Words("missed"));
      if (match != nullptr) {
        found[j].push_back(measure(*match));
      }
    }
    table.rows.push_back(std::move(row));
  }
  const auto total = table.rows.size();
  std::vector<Cell> means = {Cell::Words("mean of those found")};
  std::vector<Cell> counts = {Cell::Words("found")};
  for (const auto& values : found) {
    double sum = 0.0;
    for (const double value : values) {
      sum += value;
    }
    means.push_back(values.empty() ? Cell::Words("-")
                                   : Cell::Number(sum / static_cast<double>(values.size()), decimals));
    counts.push_back(Cell::Words(SharesText(static_cast<int>(values.size()), static_cast<int>(total))));
  }
  table.rows.push_back(std::move(means));
  table.rows.push_back(std::move(counts));
  return table;
}

Table ExtraTable(const Results& results) {
  Table table{"",
              "Landmarks that are no ground-truth object",
              {"result", "landmark", "seen", "centre in the world m", "half sizes m", "nearest ground truth",
               "distance m", "3D IoU", "inside %"},
              {},
              {"seen: frames with a box of it; inside: share of its volume within the nearest object."}};
  for (const NamedEvaluation& result : results) {
    const Evaluation& evaluation = result.evaluation;
    for (const ExtraLandmark& extra : evaluation.extra) {
      const SnapshotObject& mapped = evaluation.mapped[static_cast<std::size_t>(extra.mapped)];
      const Eigen::Vector3d& c = extra.center_world;
      const Eigen::Vector3d& h = extra.half_size;
      const bool near = extra.nearest >= 0;
      const Spread none;
      table.rows.push_back(
          {Cell::Words(result.name), Cell::Words(NumberedName(mapped)), Cell::Number(mapped.observations, 0),
           Cell::Words(fmt::format("{:.2f} {:.2f} {:.2f}", c.x(), c.y(), c.z())),
           Cell::Words(fmt::format("{:.3f} {:.3f} {:.3f}", h.x(), h.y(), h.z())),
           Cell::Words(near ? NumberedName(evaluation.truth[static_cast<std::size_t>(extra.nearest)]) : "-"),
           near ? Cell::Number(extra.distance, 2) : Cell::Of(none, 2),
           near ? Cell::Number(extra.iou, 3) : Cell::Of(none, 3),
           near ? Cell::Number(100.0 * extra.inside, 0) : Cell::Of(none, 0)});
    }
  }
  return table;
}

void CheckSameTruth(const Results& results) {
  for (const NamedEvaluation& result : results) {
    const Evaluation& evaluation = result.evaluation;
    if (evaluation.frames != First(results).frames ||
        evaluation.truth.size() != First(results).truth.size()) {
      throw UsageError(
          fmt::format("{} and {}: held against different ground truth, expected the same sequence",
                      results.front().name, result.name));
    }
  }
}

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

std::vector<std::string> ShortNames(const std::vector<std::filesystem::path>& paths) {
  std::vector<std::string> names;
  for (const std::filesystem::path& path : paths) {
    const std::filesystem::path whole = std::filesystem::absolute(path).lexically_normal();
    names.push_back((whole.has_filename() ? whole : whole.parent_path()).filename().string());
  }
  if (std::set<std::string>(names.begin(), names.end()).size() < names.size()) {
    std::transform(paths.begin(), paths.end(), names.begin(), [](const auto& path) { return path.string(); });
  }
  return names;
}

std::vector<Table> CompareEvaluations(const std::vector<NamedEvaluation>& results) {
  if (results.empty()) {
    return {};
  }
  CheckSameTruth(results);
  std::vector<Table> tables = {SummaryTable(results)};
  if (!First(results).has_objects) {
    return tables;
  }
  const auto all = [](const GroundTruthObject&) { return true; };
  const auto thin = [](const GroundTruthObject& object) { return IsThin(object.solid); };
  const auto add = [&](const std::string& title, int decimals, const Choice& chosen, const Measure& measure) {
    tables.push_back(ObjectTable(results, title, decimals, chosen, measure));
  };
  add("3D IoU", 3, all, [](const auto& match) { return match.iou; });
  if (std::any_of(First(results).truth.begin(), First(results).truth.end(), thin)) {
    add("Footprint IoU of thin objects", 3, thin, [](const auto& match) { return match.footprint_iou; });
  }
  add("Centre error, m", 4, all, [](const auto& match) { return match.center_error; });
  add("Size error, m", 4, all, [](const auto& match) { return match.size_error; });
  add("Yaw error, degrees", 1, all, [](const auto& match) { return match.yaw_error * kDegreesPerRadian; });
  if (Table extra = ExtraTable(results); !extra.rows.empty()) {
    tables.push_back(std::move(extra));
  }
  return tables;
}

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
