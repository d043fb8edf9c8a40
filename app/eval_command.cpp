#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/report.h"
#include "slam/evaluation/evaluation.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace {

constexpr const char* kExamples = R"(
Examples:
  sqslam eval out/kitchen --ground-truth data/kitchen
  sqslam eval out/desk --ground-truth data/desk --set matching.min_iou=0.25
  sqslam eval out/fire --ground-truth fire/seq-01

The trajectory is aligned to the ground truth by a similarity (scale, rotation, translation); the objects go
with it. A mapped object stands for a ground-truth object where they overlap (3D IoU of matching.min_iou or
more), or where their centres are near and their sizes alike; labels do not decide.
)";

struct EvalArguments {
  std::string result;
  std::string ground_truth;
  std::vector<std::string> set;
  bool quiet = false;
};

void Evaluate(const EvalArguments& arguments) {
  EvaluationOptions options;
  for (const std::string& assignment : arguments.set) {
    SetOption(assignment, options);
  }
  CheckOptions(options);
  const Evaluation evaluation = EvaluateResult(arguments.result, arguments.ground_truth, options);
  const std::filesystem::path file = std::filesystem::path(arguments.result) / "eval.json";
  WriteEvaluation(file, evaluation);
  if (!arguments.quiet) {
    fmt::print("{}\nwritten: {}\n", FormatEvaluation(evaluation), file.string());
  }
  if (std::filesystem::exists(std::filesystem::path(arguments.result) / "report.html")) {
    WriteReport({arguments.result, "", "", {}});  // the run's page, now with what the evaluation found
  }
}

}  // namespace

void AddEvalCommand(CLI::App& app, int& /*exit_code*/) {
  const auto arguments = std::make_shared<EvalArguments>();
  CLI::App* eval =
      app.add_subcommand("eval", "Hold a result against ground truth: trajectory error, 3D IoU, counts");
  eval->footer(kExamples);
  eval->add_option(
          "RESULT", arguments->result,
          "Result folder of sqslam run; eval.json is written into it, its report.html brought up to date")
      ->required();
  eval->add_option(
          "--ground-truth", arguments->ground_truth,
          "Sequence folder with poses: groundtruth.txt, or those of 7-Scenes, RGB-D Scenes v2 or ICL-NUIM; "
          "objects_gt.json if there is one")
      ->required();
  eval->add_option("--set", arguments->set, "Override one option, key=value; may be repeated")
      ->expected(1)
      ->take_all();
  eval->add_flag("--quiet", arguments->quiet, "Write eval.json only");
  eval->callback([arguments] { Evaluate(*arguments); });
}

}  // namespace sqslam::app
