#include "slam/evaluation/comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "slam/geometry/angles.h"
#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/json_file.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using Results = std::vector<NamedEvaluation>;

const Evaluation& First(const Results& results) { return results.front().evaluation; }

const ObjectMatch* MatchOf(const Evaluation& evaluation, std::size_t truth) {
  const auto& matches = evaluation.objects.matches;
  const auto it = std::ranges::find(matches, static_cast<int>(truth), &ObjectMatch::truth);
  return it == matches.end() ? nullptr : &*it;
}

std::vector<std::string> Columns(std::string first, const Results& results) {
  std::vector<std::string> columns = {std::move(first)};
  std::ranges::transform(results, std::back_inserter(columns), &NamedEvaluation::name);
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
  add("  with 3D IoU 0.25 or more",
      [](const auto& e) { return Cell::Words(SharesText(e.iou.matched_25, e.iou.objects)); });
  add("  with 3D IoU 0.5 or more",
      [](const auto& e) { return Cell::Words(SharesText(e.iou.matched_50, e.iou.objects)); });
  for (std::size_t i = 0; i < First(results).coverage.size(); ++i) {
    add(fmt::format("  of those with {} or more boxes", First(results).coverage[i].min_detections),
        [i](const auto& e) { return Cell::Words(SharesText(e.coverage[i].mapped, e.coverage[i].total)); });
  }
  add("duplicates",
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
    add("  with 3D IoU 0.25 or more",
        [](const auto& e) { return Cell::Words(SharesText(e.scored_iou.matched_25, e.scored_iou.objects)); });
    add("  with 3D IoU 0.5 or more",
        [](const auto& e) { return Cell::Words(SharesText(e.scored_iou.matched_50, e.scored_iou.objects)); });
    add("  mean 3D IoU of those found", [](const auto& e) { return Cell::Number(e.scored_iou.mean, 3); });
    add("  mean 3D IoU, missed as 0", [](const auto& e) { return Cell::Number(e.scored_iou.mean_all, 3); });
  }
  return table;
}

using Measure = std::function<double(const ObjectMatch&)>;
using Choice = std::function<bool(const GroundTruthObject&)>;

// Returns a table with a row for each chosen ground-truth object, and the mean over those found.
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
    const double sum = std::accumulate(values.begin(), values.end(), 0.0);
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
              "Landmarks that match no ground-truth object",
              {"result", "landmark", "seen", "centre in the world m", "half sizes m", "nearest ground truth",
               "distance m", "3D IoU", "inside %"},
              {},
              {"seen: frames with a box of it; inside: share of its volume within the nearest object."}};
  for (const NamedEvaluation& result : results) {
    const Evaluation& evaluation = result.evaluation;
    for (const ExtraLandmark& extra : evaluation.extra) {
      const SnapshotObject& mapped = evaluation.Mapped(extra.mapped);
      const bool near = extra.nearest >= 0;
      const auto measured = [near](double value, int decimals) {
        return near ? Cell::Number(value, decimals) : Cell::Of({}, decimals);
      };
      table.rows.push_back(
          {Cell::Words(result.name), Cell::Words(NumberedName(mapped)), Cell::Number(mapped.observations, 0),
           Cell::Words(fmt::format("{:.2f}", fmt::join(extra.center_world, " "))),
           Cell::Words(fmt::format("{:.3f}", fmt::join(extra.half_size, " "))),
           Cell::Words(near ? NumberedName(evaluation.Truth(extra.nearest)) : "-"),
           measured(extra.distance, 2), measured(extra.iou, 3), measured(100.0 * extra.inside, 0)});
    }
  }
  return table;
}

void CheckSameTruth(const Results& results) {
  for (const NamedEvaluation& result : results) {
    const Evaluation& evaluation = result.evaluation;
    ThrowIf<UsageError>(
        evaluation.frames != First(results).frames || evaluation.truth.size() != First(results).truth.size(),
        "{} and {}: evaluated against different ground truth, expected the same sequence",
        results.front().name, result.name);
  }
}

// Returns a row of ListObjects: what it is, then its measurements; null arguments give empty cells.
std::vector<Cell> ObjectRow(const std::string& result, const char* kind, const GroundTruthObject* truth,
                            const SnapshotObject* mapped, const ObjectMatch* match,
                            const ExtraLandmark* extra) {
  const auto number = [](const auto* of, auto member, int decimals, double unit = 1.0) {
    return of != nullptr ? Cell::Number(unit * static_cast<double>(of->*member), decimals)
                         : Cell::Of({}, decimals);
  };
  const ObjectMatch* thin = match != nullptr && IsThin(truth->solid) ? match : nullptr;
  std::vector<Cell> cells = {Cell::Words(result),
                             Cell::Words(kind),
                             number(truth, &GroundTruthObject::id, 0),
                             Cell::Words(truth != nullptr ? ShownName(*truth) : ""),
                             number(truth, &GroundTruthObject::detections, 0),
                             Cell::Words(truth == nullptr ? ""
                                         : truth->scored  ? "yes"
                                                          : "no"),
                             number(mapped, &SnapshotObject::id, 0),
                             Cell::Words(mapped != nullptr ? mapped->label : ""),
                             number(mapped, &SnapshotObject::observations, 0),
                             number(match, &ObjectMatch::iou, 3),
                             number(match, &ObjectMatch::iou_ellipsoid, 3),
                             number(thin, &ObjectMatch::footprint_iou, 3),
                             number(match, &ObjectMatch::center_error, 4),
                             number(match, &ObjectMatch::size_error, 4),
                             number(match, &ObjectMatch::tilt_error, 1, kDegreesPerRadian),
                             number(match, &ObjectMatch::yaw_error, 1, kDegreesPerRadian)};
  for (int axis = 0; axis < 3; ++axis) {
    cells.push_back(extra != nullptr ? Cell::Number(extra->center_world[axis], 3) : Cell::Of({}, 3));
  }
  return cells;
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
  std::vector<std::string> names =
      ToVector(paths, [](const auto& path) { return AbsolutePath(path).filename().string(); });
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
  for (const auto& [name, e] : results) {
    const auto add = [&table, &name = name](const auto&... row) {
      table.rows.push_back(ObjectRow(name, row...));
    };
    for (const ObjectMatch& match : e.objects.matches) {
      add("matched", &e.Truth(match.truth), &e.Mapped(match.mapped), &match, nullptr);
    }
    for (const int index : e.objects.missed) {
      add("missed", &e.Truth(index), nullptr, nullptr, nullptr);
    }
    for (const ObjectDuplicate& duplicate : e.objects.duplicates) {
      add("duplicate", &e.Truth(duplicate.truth), &e.Mapped(duplicate.mapped), nullptr, nullptr);
    }
    for (const ExtraLandmark& extra : e.extra) {
      add("extra", nullptr, &e.Mapped(extra.mapped), nullptr, &extra);
    }
  }
  return table;
}

void CheckComparisonPath(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  ThrowIf<UsageError>(
      extension != ".md" && extension != ".csv" && extension != ".tex" && extension != ".json",
      "--output {}: expected a file name that ends in .md, .csv, .tex or .json", path.string());
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
    WriteJsonFile(path, document);
    return;
  }
  const std::vector<Table> tables = CompareEvaluations(results);
  WriteFileAtomically(path, extension == ".md" ? Joined(tables, ToMarkdown) : Joined(tables, ToLatex));
}

}  // namespace sqslam
