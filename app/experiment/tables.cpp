#include "app/experiment/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "slam/util/atomic_file.h"
#include "slam/util/largest.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

using Results = std::vector<CellResult>;
using Pointers = std::vector<const CellResult*>;
using Key = std::function<std::string(const ExperimentCell&)>;

using Groups = std::vector<std::pair<std::string, Pointers>>;

// Groups the results by key, in order of first appearance.
Groups GroupsOf(const Pointers& results, const Key& key) {
  Groups groups;
  for (const CellResult* result : results) {
    const std::string value = key(result->cell);
    auto group = std::ranges::find(groups, value, &Groups::value_type::first);
    if (group == groups.end()) {
      group = groups.insert(groups.end(), {value, {}});
    }
    group->second.push_back(result);
  }
  return groups;
}

// Returns the results with the preferred value on one axis, or else with the first value.
Pointers AtUsual(const Pointers& results, const Key& key, const std::string& preferred) {
  const Groups groups = GroupsOf(results, key);
  const auto usual = std::ranges::find(groups, preferred, &Groups::value_type::first);
  return groups.empty() ? results : usual != groups.end() ? usual->second : groups.front().second;
}

Pointers All(const Results& results) {
  return ToVector(results, [](const CellResult& result) { return &result; });
}

Pointers WithObjects(Pointers results) {
  std::erase_if(results,
                [](const CellResult* r) { return !r->has_objects || r->cell.max_objects != kAllObjects; });
  return results;
}

// Names the method of a cell if the results have several, and its variant.
Key LabelOf(const Pointers& results) {
  const bool several = GroupsOf(results, &ExperimentCell::method).size() > 1;
  return [several](const ExperimentCell& cell) {
    const std::string method = several ? cell.method : "";
    return method + (method.empty() || cell.variant.empty() ? "" : ", ") + cell.variant;
  };
}

// Names the value of a cell on one axis, with its label if there is one.
Key ConfigurationOf(const Pointers& results, const Key& axis) {
  return [axis, label = LabelOf(results)](const ExperimentCell& cell) {
    const std::string extra = label(cell);
    return extra.empty() ? axis(cell) : fmt::format("{} ({})", axis(cell), extra);
  };
}

using ObjectFilter = std::function<bool(const CellResult&, const ObjectScore&)>;

bool Counts(const CellResult& result, const ObjectScore& object) {
  return !result.has_scored || object.scored;
}

double CountAbove(const std::vector<ObjectScore>& objects, double iou) {
  return static_cast<double>(
      std::ranges::count_if(objects, [&](const ObjectScore& object) { return object.iou >= iou; }));
}

// IoU of the objects that the filter accepts, one value per repetition.
struct IouFigures {
  std::vector<double> mean;      // over the objects found
  std::vector<double> mean_all;  // over all, a missed one as 0
  std::vector<double> found;
  std::vector<double> found_25;  // with a 3D IoU of at least 0.25
  std::vector<double> found_50;  // with one of at least 0.5
  int total = 0;
};

IouFigures FiguresOf(const Pointers& results, const ObjectFilter& filter) {
  std::map<int, std::vector<ObjectScore>> repetitions;
  for (const CellResult* result : results) {
    for (const ObjectScore& object : result->objects) {
      if (Counts(*result, object) && filter(*result, object)) {
        repetitions[result->cell.repetition].push_back(object);
      }
    }
  }
  IouFigures figures;
  for (const auto& [repetition, objects] : repetitions) {
    const double sum = std::accumulate(objects.begin(), objects.end(), 0.0,
                                       [](double s, const ObjectScore& object) { return s + object.iou; });
    const auto found = static_cast<double>(std::ranges::count(objects, true, &ObjectScore::found));
    if (found > 0) {
      figures.mean.push_back(sum / found);
    }
    figures.mean_all.push_back(sum / static_cast<double>(objects.size()));
    figures.found.push_back(found);
    figures.found_25.push_back(CountAbove(objects, 0.25));
    figures.found_50.push_back(CountAbove(objects, 0.5));
    figures.total = std::max(figures.total, static_cast<int>(objects.size()));
  }
  return figures;
}

// Formats counts without decimals, unless the median (of an even number of runs) has one.
Cell CountCell(std::vector<double> counts) {
  const Spread spread = SpreadOf(std::move(counts));
  return Cell::Of(spread, spread.median == std::floor(spread.median) ? 0 : 1);
}

Cell CountCell(const Pointers& runs, const std::function<double(const CellResult&)>& count) {
  return CountCell(ToVector(runs, [&](const CellResult* run) { return count(*run); }));
}

// Table I or II: a column per configuration, rows per class, object or sequence.
struct IouTable {
  IouTable(const char* name, const char* title, const char* first, const Pointers& results)
      : columns(GroupsOf(results, ConfigurationOf(results, &ExperimentCell::representation))),
        table{name, title, {first, "figure"}, {}, {}} {
    for (const auto& [configuration, runs] : columns) {
      table.columns.push_back(configuration);
    }
  }

  void AddRows(const std::string& name, const ObjectFilter& filter) {
    const std::vector<IouFigures> figures =
        ToVector(columns, [&](const auto& column) { return FiguresOf(column.second, filter); });
    const auto add = [&](const std::string& figure, const auto& cell) {
      std::vector<Cell> row = {Cell::Words(name), Cell::Words(figure)};
      std::ranges::transform(figures, std::back_inserter(row), cell);
      MarkBest(ToVector(row, [](Cell& value) { return &value; }), BestValue::kHighest);
      table.rows.push_back(std::move(row));
    };
    add("3D IoU of those found", [](const IouFigures& f) { return Cell::Of(SpreadOf(f.mean), 3); });
    if (std::ranges::any_of(figures, [](const IouFigures& f) { return f.mean != f.mean_all; })) {
      add("3D IoU, missed as 0", [](const IouFigures& f) { return Cell::Of(SpreadOf(f.mean_all), 3); });
    }
    add(fmt::format("found of {}", Largest(figures, 0, &IouFigures::total)),
        [](const IouFigures& f) { return CountCell(f.found); });
    add("with 3D IoU 0.25 or more", [](const IouFigures& f) { return CountCell(f.found_25); });
    add("with 3D IoU 0.5 or more", [](const IouFigures& f) { return CountCell(f.found_50); });
  }

  Groups columns;
  Table table;
};

// Adds notes under a table: how often each row was measured, and which objects count.
void AddIouNotes(const Pointers& results, Table& table) {
  std::set<int> repetitions;
  bool has_scored = false;
  for (const CellResult* result : results) {
    repetitions.insert(result->cell.repetition);
    has_scored = has_scored || result->has_scored;
  }
  table.notes.push_back(
      fmt::format("{}; association {}.",
                  repetitions.size() > 1
                      ? fmt::format("Median over up to {} runs (lowest to highest)", repetitions.size())
                      : "One run each",
                  results.empty() ? "-" : results.front()->cell.association));
  if (table.columns.size() > 3) {
    table.notes.emplace_back("The best of a row is in bold.");
  }
  if (has_scored) {
    table.notes.emplace_back("Where the ground truth says which objects are scored, only those count.");
  }
}

struct NamedObject {
  std::string label;
  std::string sequence;
  int id = 0;
  std::string name;

  auto operator<=>(const NamedObject&) const = default;
};

std::set<NamedObject> ObjectsOf(const Pointers& results) {
  std::set<NamedObject> objects;
  for (const CellResult* result : results) {
    for (const ObjectScore& object : result->objects) {
      if (Counts(*result, object)) {
        objects.insert({object.label, result->cell.sequence, object.id, object.name});
      }
    }
  }
  return objects;
}

std::string LimitText(const ExperimentCell& cell) {
  return cell.max_objects == kAllObjects ? "all" : std::to_string(cell.max_objects);
}

// Returns the spread over the runs of the mean time of a stage, ms.
Spread TimesOf(const Pointers& runs, const std::string& stage) {
  std::vector<double> values;
  for (const CellResult* run : runs) {
    if (const auto it = run->stats.timing_ms.find(stage); it != run->stats.timing_ms.end()) {
      values.push_back(it->second.mean);
    }
  }
  return SpreadOf(std::move(values));
}

// Adds the rows of one sequence and configuration, fewest objects first; "+" is relative to the first row.
void AddRuntimeRows(const std::string& sequence, const std::string& label, const Pointers& runs,
                    Table& table) {
  Groups limits = GroupsOf(runs, LimitText);
  const auto rank = [](const std::string& text) {
    return text == "all" ? std::numeric_limits<int>::max() : std::stoi(text);
  };
  std::ranges::sort(limits, {}, [&](const auto& group) { return rank(group.first); });
  for (const auto& group : limits) {
    const std::string& limit = group.first;
    const Pointers& runs_here = group.second;
    const auto more = [&](const std::string& stage) {
      const Spread from = TimesOf(limits.front().second, stage);
      const Spread to = TimesOf(runs_here, stage);
      const bool known = limit != limits.front().first && from.count > 0 && to.count > 0;
      return known ? Cell::Number(to.median - from.median, 1) : Cell::Of({}, 1);
    };
    const auto time = [&](const std::string& stage, int decimals) {
      return Cell::Of(TimesOf(runs_here, stage), decimals);
    };
    table.rows.push_back({Cell::Words(sequence), Cell::Words(label), Cell::Words(limit),
                          CountCell(runs_here, [](const CellResult& r) { return r.stats.objects; }),
                          time("tracking", 1), more("tracking"), time("tracking.objects", 2),
                          time("tracking.association", 3), time("mapping", 1), more("mapping"),
                          time("mapping.objects", 1)});
  }
}

// Returns the text above all tables: missing and failed runs, mixed builds.
std::string StateText(const ExperimentOutcome& outcome) {
  std::string text =
      fmt::format("{} of {} runs are in these tables.\n", outcome.results.size(), outcome.cells);
  std::set<std::string> programs;
  for (const CellResult& result : outcome.results) {
    programs.insert(result.program);
  }
  if (programs.size() > 1) {
    text += fmt::format("\nThey were made by {} different builds of the program.\n", programs.size());
  }
  if (!outcome.failures.empty()) {
    text += "\n## Failed runs\n\n| run | exit code | message |\n| --- | ---: | --- |\n";
    for (const CellFailure& failure : outcome.failures) {
      text += fmt::format("| {} | {} | {} |\n", EscapeMarkdown(failure.cell), failure.exit_code,
                          EscapeMarkdown(failure.message));
    }
  }
  return text;
}

}  // namespace

Table RepresentationTable(const Results& all, const std::vector<std::string>& chosen) {
  const Pointers results = AtUsual(WithObjects(All(all)), &ExperimentCell::association, "full");
  IouTable iou("Table I", "3D IoU of objects by representation", "objects", results);
  const std::set<NamedObject> objects = ObjectsOf(results);
  std::set<std::string> labels;
  for (const NamedObject& object : objects) {
    labels.insert(object.label);
  }
  for (const std::string& label : labels) {
    iou.AddRows(label, [&](const auto&, const ObjectScore& object) { return object.label == label; });
  }
  for (const NamedObject& named : objects) {
    const bool wanted = std::ranges::any_of(chosen, [&](const std::string& word) {
      return word == named.name || word == named.label || word == named.sequence + "/" + named.name;
    });
    if (wanted) {
      iou.AddRows(fmt::format("{}: {} {}", named.sequence, named.id, named.name),
                  [&](const CellResult& result, const ObjectScore& object) {
                    return result.cell.sequence == named.sequence && object.id == named.id;
                  });
    }
  }
  if (!objects.empty()) {
    iou.AddRows("all", [](const auto&, const auto&) { return true; });
  }
  AddIouNotes(results, iou.table);
  return iou.table;
}

Table SequenceTable(const Results& all) {
  const Pointers results = AtUsual(WithObjects(All(all)), &ExperimentCell::association, "full");
  IouTable iou("Table II", "Mean 3D IoU of sequences by representation", "sequence", results);
  for (const auto& group : GroupsOf(results, &ExperimentCell::sequence)) {
    iou.AddRows(group.first,
                [&](const CellResult& result, const auto&) { return result.cell.sequence == group.first; });
  }
  AddIouNotes(results, iou.table);
  return iou.table;
}

Table AssociationTable(const Results& all) {
  const Pointers results = AtUsual(WithObjects(All(all)), &ExperimentCell::representation, "superquadric");
  Table table{
      "Table III",
      "Landmarks by association against ground truth",
      {"sequence", "association", "runs", "mapped", "found", "with 3D IoU 0.25 or more",
       "with 3D IoU 0.5 or more", "duplicates", "extra", "ground truth",
       "found of those with 60 or more boxes", "of"},
      {},
      {"found: ground-truth objects matched by a landmark; duplicates: further landmarks on them; "
       "extra: landmarks that match none. Median (lowest to highest); the best of a sequence in bold."}};
  const auto found = [](const CellResult& r) {
    return std::ranges::count(r.objects, true, &ObjectScore::found);
  };
  const auto above = [](const Pointers& runs, double iou) {
    return CountCell(runs, [iou](const CellResult& r) { return CountAbove(r.objects, iou); });
  };
  const Key configuration = ConfigurationOf(results, &ExperimentCell::association);
  for (const auto& [sequence, of_sequence] : GroupsOf(results, &ExperimentCell::sequence)) {
    const std::size_t first = table.rows.size();
    for (const auto& [mode, runs] : GroupsOf(of_sequence, configuration)) {
      table.rows.push_back(
          {Cell::Words(sequence), Cell::Words(mode), Cell::Number(static_cast<double>(runs.size()), 0),
           CountCell(runs, &CellResult::mapped), CountCell(runs, found), above(runs, 0.25), above(runs, 0.5),
           CountCell(runs, &CellResult::duplicates), CountCell(runs, &CellResult::extra),
           CountCell(runs, [](const CellResult& r) { return r.objects.size(); }),
           CountCell(runs, &CellResult::found_60), CountCell(runs, &CellResult::total_60)});
    }
    for (const auto& [column, best] : {std::pair("found", BestValue::kHighest),
                                       {"with 3D IoU 0.25 or more", BestValue::kHighest},
                                       {"with 3D IoU 0.5 or more", BestValue::kHighest},
                                       {"duplicates", BestValue::kLowest},
                                       {"extra", BestValue::kLowest},
                                       {"found of those with 60 or more boxes", BestValue::kHighest}}) {
      const auto at = std::ranges::find(table.columns, column) - table.columns.begin();
      std::vector<Cell*> cells;
      for (std::size_t i = first; i < table.rows.size(); ++i) {
        cells.push_back(&table.rows[i][static_cast<std::size_t>(at)]);
      }
      MarkBest(cells, best);
    }
  }
  return table;
}

Table RuntimeTable(const Results& all) {
  const Pointers results = AtUsual(AtUsual(All(all), &ExperimentCell::association, "full"),
                                   &ExperimentCell::representation, "superquadric");
  Table table{
      "Table IV",
      "Time against the number of objects, ms",
      {"sequence", "method", "objects with boxes", "objects mapped", "tracking", "tracking +",
       "tracking.objects", "tracking.association", "mapping", "mapping +", "mapping.objects"},
      {},
      {"Means per frame (tracking) and per keyframe (mapping), of those the median (lowest to highest) over "
       "the runs; + is the difference of the medians to the row with the fewest objects."}};
  const Key label = LabelOf(results);
  for (const auto& [sequence, of_sequence] : GroupsOf(results, &ExperimentCell::sequence)) {
    for (const auto& [method, runs] : GroupsOf(of_sequence, label)) {
      AddRuntimeRows(sequence, method.empty() ? runs.front()->cell.method : method, runs, table);
    }
  }
  const int jobs = Largest(results, 1, &CellResult::jobs);
  if (jobs > 1) {
    table.notes.push_back(fmt::format(
        "Measured with up to {} runs at a time on one machine, which makes all of them slower.", jobs));
  }
  return table;
}

fs::path WriteTables(const ExperimentConfig& config, const ExperimentOutcome& outcome,
                     const fs::path& folder) {
  const std::vector<Table> tables = {RepresentationTable(outcome.results, config.objects),
                                     SequenceTable(outcome.results), AssociationTable(outcome.results),
                                     RuntimeTable(outcome.results)};
  std::string all = "# Tables\n\n" + StateText(outcome);
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const std::string stem = fmt::format("table-{}", i + 1);
    WriteFileAtomically(folder / (stem + ".md"), ToMarkdown(tables[i]));
    WriteFileAtomically(folder / (stem + ".tex"), ToLatex(tables[i]));
    WriteFileAtomically(folder / (stem + ".csv"), ToCsv(tables[i]));
    all += fmt::format("\n{}", tables[i].rows.empty() ? fmt::format("## {}: {}\n\nNo runs for it.\n",
                                                                    tables[i].name, tables[i].title)
                                                      : ToMarkdown(tables[i]));
  }
  fs::path path = folder / "tables.md";
  WriteFileAtomically(path, all);
  return path;
}

}  // namespace sqslam::app
