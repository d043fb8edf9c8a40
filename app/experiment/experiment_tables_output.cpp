#include <fmt/format.h>

#include <set>

#include "app/experiment/experiment_tables.h"
#include "slam/util/atomic_file.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// What a reader of the tables must know beyond them: missing runs, mixed builds.
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
    all += "\n" + (tables[i].rows.empty()
                       ? fmt::format("## {}: {}\n\nNo runs for it.\n", tables[i].name, tables[i].title)
                       : ToMarkdown(tables[i]));
  }
  fs::path path = folder / "tables.md";
  WriteFileAtomically(path, all);
  return path;
}

}  // namespace sqslam::app
