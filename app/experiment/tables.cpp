#include "app/experiment/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "slam/util/atomic_file.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

using Results = std::vector<CellResult>;
using Pointers = std::vector<const CellResult*>;
using Key = std::function<std::string(const ExperimentCell&)>;

// The different keys of some results in the order in which they appear.
std::vector<std::string> KeysOf(const Pointers& results, const Key& key) {
  std::vector<std::string> keys;
  for (const CellResult* result : results) {
    const std::string value = key(result->cell);
    if (std::find(keys.begin(), keys.end(), value) == keys.end()) {
      keys.push_back(value);
    }
  }
  return keys;
}

Pointers Where(const Pointers& results, const Key& key, const std::string& value) {
  Pointers chosen;
  std::copy_if(results.begin(), results.end(), std::back_inserter(chosen),
               [&](const CellResult* result) { return key(result->cell) == value; });
  return chosen;
}

std::string RepresentationOf(const ExperimentCell& cell) { return cell.representation; }
std::string AssociationOf(const ExperimentCell& cell) { return cell.association; }
std::string SequenceNameOf(const ExperimentCell& cell) { return cell.sequence; }

// All results, only those with the usual word on one axis: the preferred one, or else the first there is.
Pointers AtUsual(const Pointers& results, const Key& key, const std::string& preferred) {
  const std::vector<std::string> keys = KeysOf(results, key);
  const bool is_there = std::find(keys.begin(), keys.end(), preferred) != keys.end();
  return keys.empty() ? results : Where(results, key, is_there ? preferred : keys.front());
}

Pointers All(const Results& results) {
  Pointers all;
  std::transform(results.begin(), results.end(), std::back_inserter(all), [](const auto& r) { return &r; });
  return all;
}

Pointers WithObjects(Pointers results) {
  std::erase_if(results,
                [](const CellResult* r) { return !r->has_objects || r->cell.max_objects != kAllObjects; });
  return results;
}

// Names method and variant of a cell where the results differ in them.
Key LabelOf(const Pointers& results) {
  const bool several = KeysOf(results, [](const auto& cell) { return cell.method; }).size() > 1;
  return [several](const ExperimentCell& cell) {
    const std::string method = several ? cell.method : "";
    return method + (method.empty() || cell.variant.empty() ? "" : ", ") + cell.variant;
  };
}

// The word of a cell on one axis, with its label where it has one.
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

// Found objects and their IoU, summed over the cells of one repetition.
struct Tally {
  int total = 0;
  int found = 0;
  double sum = 0.0;
};

// Over all objects that the filter lets through, repetition by repetition.
struct IouFigures {
  std::vector<double> mean;      // over those found
  std::vector<double> mean_all;  // a missed one counting 0
  std::vector<double> found;
  int total = 0;
};

IouFigures FiguresOf(const Pointers& results, const ObjectFilter& filter) {
  std::map<int, Tally> tallies;  // by repetition
  for (const CellResult* result : results) {
    for (const ObjectScore& object : result->objects) {
      if (Counts(*result, object) && filter(*result, object)) {
        Tally& tally = tallies[result->cell.repetition];
        ++tally.total;
        tally.found += object.found ? 1 : 0;
        tally.sum += object.iou;
      }
    }
  }
  IouFigures figures;
  for (const auto& [repetition, tally] : tallies) {
    if (tally.found > 0) {
      figures.mean.push_back(tally.sum / tally.found);
    }
    figures.mean_all.push_back(tally.sum / tally.total);
    figures.found.push_back(tally.found);
    figures.total = std::max(figures.total, tally.total);
  }
  return figures;
}

// A count: a whole number, but for the median of an even number of runs.
Cell CountCell(std::vector<double> counts) {
  const Spread spread = SpreadOf(std::move(counts));
  return Cell::Of(spread, spread.median == std::floor(spread.median) ? 0 : 1);
}

Cell CountCell(const Pointers& runs, const std::function<double(const CellResult&)>& count) {
  std::vector<double> counts;
  std::transform(runs.begin(), runs.end(), std::back_inserter(counts),
                 [&](const CellResult* run) { return count(*run); });
  return CountCell(std::move(counts));
}

// The rows of one thing (a class, a sequence) in Tables I and II.
void AddIouRows(const Pointers& results, const Key& configuration, const std::string& name,
                const ObjectFilter& filter, Table& table) {
  std::vector<Cell> mean = {Cell::Words(name), Cell::Words("3D IoU of those found")};
  std::vector<Cell> mean_all = {Cell::Words(name), Cell::Words("3D IoU, missed as 0")};
  std::vector<Cell> found = {Cell::Words(name), {}};
  int total = 0;
  bool all_found = true;
  for (const std::string& column : KeysOf(results, configuration)) {
    const IouFigures figures = FiguresOf(Where(results, configuration, column), filter);
    total = std::max(total, figures.total);
    all_found = all_found && figures.mean == figures.mean_all;
    mean.push_back(Cell::Of(SpreadOf(figures.mean), 3));
    mean_all.push_back(Cell::Of(SpreadOf(figures.mean_all), 3));
    found.push_back(CountCell(figures.found));
  }
  found[1] = Cell::Words(fmt::format("found of {}", total));
  table.rows.push_back(std::move(mean));
  if (!all_found) {
    table.rows.push_back(std::move(mean_all));
  }
  table.rows.push_back(std::move(found));
}

// A table without rows, with a column for each configuration.
Table IouTable(const char* name, const char* title, const char* first, const Pointers& results,
               const Key& configuration) {
  Table table{name, title, {first, "figure"}, {}, {}};
  const std::vector<std::string> keys = KeysOf(results, configuration);
  table.columns.insert(table.columns.end(), keys.begin(), keys.end());
  return table;
}

// Notes under a table: how often each row was measured, and which objects count.
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

// Mean milliseconds of a stage in each run that has it.
Spread TimesOf(const Pointers& runs, const std::string& stage) {
  std::vector<double> values;
  for (const CellResult* run : runs) {
    if (const auto it = run->stats.timing_ms.find(stage); it != run->stats.timing_ms.end()) {
      values.push_back(it->second.mean);
    }
  }
  return SpreadOf(std::move(values));
}

// The rows of one sequence and configuration, fewest objects first; the first is what "+" counts from.
void AddRuntimeRows(const std::string& sequence, const std::string& label, const Pointers& runs,
                    Table& table) {
  std::vector<std::string> limits = KeysOf(runs, LimitText);
  const auto rank = [](const std::string& text) {
    return text == "all" ? std::numeric_limits<int>::max() : std::stoi(text);
  };
  std::sort(limits.begin(), limits.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  const Pointers base = limits.empty() ? Pointers{} : Where(runs, LimitText, limits.front());
  for (const std::string& limit : limits) {
    const Pointers here = Where(runs, LimitText, limit);
    const auto more = [&](const std::string& stage) {
      const Spread from = TimesOf(base, stage);
      const Spread to = TimesOf(here, stage);
      const bool known = limit != limits.front() && from.count > 0 && to.count > 0;
      return known ? Cell::Number(to.median - from.median, 1) : Cell::Of({}, 1);
    };
    const auto time = [&](const std::string& stage, int decimals) {
      return Cell::Of(TimesOf(here, stage), decimals);
    };
    table.rows.push_back({Cell::Words(sequence), Cell::Words(label), Cell::Words(limit),
                          CountCell(here, [](const CellResult& r) { return r.stats.objects; }),
                          time("tracking", 1), more("tracking"), time("tracking.objects", 2),
                          time("tracking.association", 3), time("mapping", 1), more("mapping"),
                          time("mapping.objects", 1)});
  }
}

// Notes above all tables: missing runs, mixed builds.
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
  const Pointers results = AtUsual(WithObjects(All(all)), AssociationOf, "full");
  const Key configuration = ConfigurationOf(results, RepresentationOf);
  Table table = IouTable("Table I", "3D IoU of objects by representation", "objects", results, configuration);
  const std::set<NamedObject> objects = ObjectsOf(results);
  std::set<std::string> labels;
  for (const NamedObject& object : objects) {
    labels.insert(object.label);
  }
  for (const std::string& label : labels) {
    AddIouRows(
        results, configuration, label,
        [&](const auto&, const ObjectScore& object) { return object.label == label; }, table);
  }
  for (const NamedObject& named : objects) {
    const bool wanted = std::any_of(chosen.begin(), chosen.end(), [&](const std::string& word) {
      return word == named.name || word == named.label || word == named.sequence + "/" + named.name;
    });
    if (wanted) {
      AddIouRows(
          results, configuration, fmt::format("{}: {} {}", named.sequence, named.id, named.name),
          [&](const CellResult& result, const ObjectScore& object) {
            return result.cell.sequence == named.sequence && object.id == named.id;
          },
          table);
    }
  }
  if (!objects.empty()) {
    AddIouRows(
        results, configuration, "all", [](const auto&, const auto&) { return true; }, table);
  }
  AddIouNotes(results, table);
  return table;
}

Table SequenceTable(const Results& all) {
  const Pointers results = AtUsual(WithObjects(All(all)), AssociationOf, "full");
  const Key configuration = ConfigurationOf(results, RepresentationOf);
  Table table =
      IouTable("Table II", "Mean 3D IoU of sequences by representation", "sequence", results, configuration);
  for (const std::string& sequence : KeysOf(results, SequenceNameOf)) {
    AddIouRows(
        results, configuration, sequence,
        [&](const CellResult& result, const auto&) { return result.cell.sequence == sequence; }, table);
  }
  AddIouNotes(results, table);
  return table;
}

Table AssociationTable(const Results& all) {
  const Pointers results = AtUsual(WithObjects(All(all)), RepresentationOf, "superquadric");
  Table table{"Table III",
              "Landmarks by association against ground truth",
              {"sequence", "association", "runs", "mapped", "found", "duplicates", "extra", "ground truth",
               "found of those with 60 or more boxes", "of"},
              {},
              {"found: ground-truth objects that a landmark stands for; duplicates: further landmarks on "
               "them; extra: "
               "landmarks on none. Median (lowest to highest)."}};
  const Key configuration = ConfigurationOf(results, AssociationOf);
  for (const std::string& sequence : KeysOf(results, SequenceNameOf)) {
    const Pointers of_sequence = Where(results, SequenceNameOf, sequence);
    for (const std::string& mode : KeysOf(of_sequence, configuration)) {
      const Pointers runs = Where(of_sequence, configuration, mode);
      const auto found = [](const CellResult& r) {
        return std::count_if(r.objects.begin(), r.objects.end(), [](const auto& o) { return o.found; });
      };
      table.rows.push_back(
          {Cell::Words(sequence), Cell::Words(mode), Cell::Number(static_cast<double>(runs.size()), 0),
           CountCell(runs, [](const CellResult& r) { return r.mapped; }), CountCell(runs, found),
           CountCell(runs, [](const CellResult& r) { return r.duplicates; }),
           CountCell(runs, [](const CellResult& r) { return r.extra; }),
           CountCell(runs, [](const CellResult& r) { return r.objects.size(); }),
           CountCell(runs, [](const CellResult& r) { return r.found_60; }),
           CountCell(runs, [](const CellResult& r) { return r.total_60; })});
    }
  }
  return table;
}

Table RuntimeTable(const Results& all) {
  const Pointers results =
      AtUsual(AtUsual(All(all), AssociationOf, "full"), RepresentationOf, "superquadric");
  Table table{
      "Table IV",
      "Time against the number of objects, ms",
      {"sequence", "method", "objects with boxes", "objects mapped", "tracking", "tracking +",
       "tracking.objects", "tracking.association", "mapping", "mapping +", "mapping.objects"},
      {},
      {"Means per frame (tracking) and per keyframe (mapping), of those the median (lowest to highest) over "
       "the runs; + is the difference of the medians to the row with the fewest objects."}};
  const Key label = LabelOf(results);
  for (const std::string& sequence : KeysOf(results, SequenceNameOf)) {
    const Pointers of_sequence = Where(results, SequenceNameOf, sequence);
    for (const std::string& method : KeysOf(of_sequence, label)) {
      AddRuntimeRows(sequence, method.empty() ? of_sequence.front()->cell.method : method,
                     Where(of_sequence, label, method), table);
    }
  }
  int jobs = 1;
  for (const CellResult* result : results) {
    jobs = std::max(jobs, result->jobs);
  }
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
