#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/report/report.h"
#include "slam/evaluation/comparison.h"
#include "slam/evaluation/dense_evaluation.h"
#include "slam/evaluation/evaluation.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace {

constexpr const char* kEvalNotes = R"(
Examples:
  sqslam eval out/kitchen --ground-truth data/kitchen
  sqslam eval out/desk --ground-truth data/desk --set min_iou=0.25
  sqslam eval out/fire --ground-truth fire/seq-01
  sqslam eval out/desk out/desk-2 out/desk-3 --ground-truth data/desk    several runs side by side
  sqslam eval out/desk --dense --ground-truth data/desk    after sqslam densify out/desk
  sqslam eval out/sq out/quadric --ground-truth data/desk -o compared.tex

The trajectory is aligned with the ground truth by a similarity (scale, rotation, translation), which is also
applied to the objects; --set alignment=poses aligns the camera orientations as well. A mapped object matches a
ground-truth object if they overlap (3D IoU of at least min_iou, 0.1), or if their centres are near and their
sizes similar; labels need not agree. Recall is the share of the ground-truth objects whose match reaches a 3D IoU
of 0.25 or 0.5. The column "ellips." is the 3D IoU of the ellipsoid that comes nearest to the mapped object, as of
sqslam run --representation ellipsoid. Thin objects (a half size below 15 mm or 5 % of the largest) also get a
footprint IoU, of their outlines seen from above. Landmarks that match no ground-truth object are listed with their
positions.

--dense compares the dense.ply of a densified result with that of the sequence (true surface points in the frame of
objects_gt.json): accuracy is the distance of the estimated points to the true ones, completeness that of the true
points to the estimated ones.
)";

struct EvalArguments {
  std::vector<std::string> results;
  std::string ground_truth;
  std::string output;
  std::vector<std::string> set;
  bool dense = false;
  bool quiet = false;
};

// Evaluates one folder and writes eval.json into it; updates report.html if there is one.
Evaluation EvaluateFolder(const std::filesystem::path& result, const std::string& ground_truth,
                          const EvaluationOptions& options) {
  Evaluation evaluation = EvaluateResult(result, ground_truth, options);
  WriteEvaluation(result / "eval.json", evaluation);
  if (std::filesystem::exists(result / "report.html")) {
    WriteReport(
        {result, "", "", {}, nullptr, &evaluation});  // the run's page, now with what the evaluation found
  }
  return evaluation;
}

void PrintEvaluations(const std::vector<NamedEvaluation>& results) {
  if (results.size() == 1) {
    fmt::print("{}\n", FormatEvaluation(results.front().evaluation));
    return;
  }
  for (const Table& table : CompareEvaluations(results)) {
    fmt::print("{}\n", ToText(table));
  }
}

// Evaluates the dense clouds of densified results.
void EvaluateClouds(const EvalArguments& arguments, const std::vector<std::string>& names,
                    const EvaluationOptions& options) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::filesystem::path result = arguments.results[i];
    const DenseEvaluation evaluation = EvaluateDense(result, arguments.ground_truth, options);
    WriteDenseEvaluation(result / "dense_eval.json", evaluation);
    if (!arguments.quiet) {
      fmt::print("{}{}", names.size() > 1 ? names[i] + "\n" : "", FormatDense(evaluation));
    }
  }
}

void Evaluate(const EvalArguments& arguments) {
  const std::vector<std::string> names = ShortNames({arguments.results.begin(), arguments.results.end()});
  EvaluationOptions options;
  SetOptions(arguments.set, options);
  CheckOptions(options);
  if (arguments.dense) {
    EvaluateClouds(arguments, names, options);
    return;
  }
  if (!arguments.output.empty()) {
    CheckComparisonPath(arguments.output);
  }
  std::vector<NamedEvaluation> results;
  for (std::size_t i = 0; i < names.size(); ++i) {
    results.push_back({names[i], EvaluateFolder(arguments.results[i], arguments.ground_truth, options)});
  }
  if (!arguments.output.empty()) {
    WriteComparison(arguments.output, results);
  }
  if (arguments.quiet) {
    return;
  }
  PrintEvaluations(results);
  for (const std::string& result : arguments.results) {
    fmt::print("written: {}\n", (std::filesystem::path(result) / "eval.json").string());
  }
  if (!arguments.output.empty()) {
    fmt::print("written: {}\n", arguments.output);
  }
}

}  // namespace

void AddEvalCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "eval", "Evaluate a result: trajectory error, 3D IoU, object counts", kEvalNotes, Evaluate);
  command.Group("Input");
  command
      .Positional("RESULT", a.results,
                  "Result folders of sqslam run, all of one sequence; writes eval.json to each and updates "
                  "its report.html")
      .Required();
  command
      .Option("--ground-truth DIR", a.ground_truth,
              "Sequence folder with true poses: groundtruth.txt, or the files of 7-Scenes, RGB-D Scenes v2, "
              "ICL-NUIM, EuRoC or KITTI; objects_gt.json is optional")
      .Required();
  command.Flag(
      "--dense", a.dense,
      "Instead, compare the cloud of sqslam densify with the sequence's dense.ply (dense_eval.json)");
  command.Option("--set KEY=VALUE", a.set, "Override one option of the evaluation; may be repeated");
  command.Group("Output");
  command.Option("--output,-o FILE", a.output,
                 "Also write the tables to this file: .md, .tex, .csv (one line per object) or .json");
  command.QuietFlag(a.quiet, "Only write files, print nothing");
}

}  // namespace sqslam::app
