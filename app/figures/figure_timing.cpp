#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

#include "app/figures/figure_common.h"
#include "render/figures/chart_figures.h"
#include "render/page/write_figure.h"
#include "slam/io/result_files.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kTimingFooter = R"(
Times of one call of each stage, from stats.json: a bar to the mean (its number beside it), a diamond at the
median, a line to the 95th percentile. A stage is called once a frame (tracking) or once a keyframe (mapping).
Stages that ran only once in every result are left out unless --stage names them; the longest come first.

Examples:
  sqslam figure timing out/kitchen --output timing.pdf
  sqslam figure timing out/full out/iou --name "full" --name "IoU only" --output timing.png --width-mm 120
  sqslam figure timing out/kitchen --stage tracking --stage tracking.objects --output tracking.svg
)";

struct TimingArguments : FigureArguments {
  std::vector<std::string> results;
  std::vector<std::string> names;
  std::vector<std::string> stages;
};

RunStats StatsOf(const fs::path& result) {
  return ReadStats(fs::is_directory(result) ? result / "stats.json" : result);
}

// Wholes ("tracking") before their parts, the slowest part first.
std::vector<std::string> StagesOf(const std::vector<RunStats>& runs) {
  std::map<std::string, double> slowest;
  for (const RunStats& run : runs) {
    for (const auto& [stage, times] : run.timing_ms) {
      if (times.count > 1) {
        slowest[stage] = std::max(slowest[stage], times.mean);
      }
    }
  }
  std::vector<std::string> stages;
  for (const auto& [stage, mean] : slowest) {
    stages.push_back(stage);
  }
  const auto rank = [&slowest](const std::string& stage) {
    const bool whole = stage.find('.') == std::string::npos;
    return std::make_pair(whole ? 0 : 1, -slowest.at(stage));
  };
  std::stable_sort(stages.begin(), stages.end(),
                   [&rank](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
  // Tracking before mapping, as a frame goes through them.
  std::stable_partition(stages.begin(), stages.end(),
                        [](const std::string& stage) { return stage.starts_with("tracking"); });
  return stages;
}

void CheckStages(const std::vector<std::string>& wanted, const std::vector<RunStats>& runs) {
  std::set<std::string> known;
  for (const RunStats& run : runs) {
    for (const auto& [stage, times] : run.timing_ms) {
      known.insert(stage);
    }
  }
  for (const std::string& stage : wanted) {
    if (!known.contains(stage)) {
      throw InputError(fmt::format("--stage {}: in none of the results, expected one of {}", stage,
                                   fmt::join(known, ", ")));
    }
  }
}

void Draw(const TimingArguments& a) {
  const FigureOptions options = MakeFigureOptions(a);
  const std::vector<std::string> names = NamesOf(a.results, a.names);
  std::vector<RunStats> runs;
  TimingFigure figure;
  for (std::size_t i = 0; i < a.results.size(); ++i) {
    runs.push_back(StatsOf(a.results[i]));
    TimingFigure::Series series;
    series.name = names[i];
    for (const auto& [stage, times] : runs.back().timing_ms) {
      series.stages[stage] = {times.mean, times.median, times.p95};
    }
    figure.series.push_back(std::move(series));
  }
  CheckStages(a.stages, runs);
  figure.stages = a.stages.empty() ? StagesOf(runs) : a.stages;
  if (figure.stages.empty()) {
    throw InputError(fmt::format("{}: no stage ran more than once, expected timing_ms of a run",
                                 fmt::join(a.results, ", ")));
  }
  WriteFigure(DrawTiming(figure, options), a.output);
}

}  // namespace

void AddTimingFigure(CLI::App& figure) {
  const auto a = std::make_shared<TimingArguments>();
  CLI::App* command = AddFigure(figure, "timing", "How long each stage takes: mean, median, 95th percentile",
                                kTimingFooter, FigureKind::kChart, *a);
  command->add_option("RESULT", a->results, "Result folders of sqslam run, or their stats.json")->required();
  command->add_option("--name", a->names, "Name of a result in the legend, repeatable, in their order")
      ->expected(1)
      ->take_all();
  command->add_option("--stage", a->stages, "Only this stage, repeatable")->expected(1)->take_all();
  command->callback([a] { Draw(*a); });
}

}  // namespace sqslam::app
