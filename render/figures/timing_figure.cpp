#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "slam/io/result_files.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/largest.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {

std::string StageName(const std::string& stage) {
  static const std::map<std::string, std::string> kNames = {
      {"mapping.keep", "recovery state"},  // saved now and then, from which a killed run resumes
      {"mapping.view", "map for tracking"},
      {"mapping.take_adjustment", "applying adjustment"}};
  const auto name = kNames.find(stage);
  return name != kNames.end() ? name->second : ReadableLabel(stage.substr(stage.find('.') + 1));
}

namespace {

constexpr double kTimingGap = 6.0;      // points
constexpr double kMedianRadius = 2.79;  // of the diamond, points

// A group ("tracking") and its stages ("tracking.features"), which share an axis.
using StageGroups = std::vector<std::pair<std::string, std::vector<std::string>>>;

// Returns the name of a part, and "mapping, all" for the group "mapping".
std::string RowName(const std::string& stage) {
  return stage.find('.') == std::string::npos ? stage + ", all" : StageName(stage);
}

StageGroups GroupStages(const std::vector<std::string>& stages) {
  StageGroups groups;
  for (const std::string& stage : stages) {
    const std::string name = stage.substr(0, stage.find('.'));
    const auto found = std::ranges::find(groups, name, &StageGroups::value_type::first);
    (found == groups.end() ? groups.emplace_back(name, StageGroups::value_type::second_type()) : *found)
        .second.push_back(stage);
  }
  return groups;
}

std::vector<LegendEntry> TimingLegend(const TimingFigure& figure) {
  std::vector<LegendEntry> entries;
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    entries.push_back(
        LegendEntry::Bar(figure.series.size() == 1 ? "mean" : figure.series[i].name, LookOfSeries(i)));
  }
  entries.push_back(LegendEntry::Mark("median", [](FigureSheet& sheet, const Eigen::Vector2d& center) {
    sheet.page.Polygon(center, 4, kMedianRadius, sheet.theme.ink);
  }));
  entries.push_back({"95th percentile", [](FigureSheet& sheet, const FigureRect& box) {
                       const double x = box.Right() - 0.4 * box.width;
                       sheet.page.Line({x, box.y}, {x, box.Bottom()}, {sheet.theme.ink, 0.8, {}});
                     }});
  return entries;
}

double LargestTime(const TimingFigure& figure, const std::vector<std::string>& stages) {
  double largest = 1e-3;
  for (const TimingFigure::Series& series : figure.series) {
    for (const std::string& stage : stages) {
      const auto found = series.stages.find(stage);
      if (found != series.stages.end()) {
        largest = std::max({largest, found->second.mean, found->second.p95, found->second.median});
      }
    }
  }
  return largest;
}

std::string MeanText(double milliseconds) {
  return milliseconds < 10.0    ? fmt::format("{:.2f}", milliseconds)
         : milliseconds < 100.0 ? fmt::format("{:.1f}", milliseconds)
                                : fmt::format("{:.0f}", milliseconds);
}

// Draws a bar of the mean, a diamond at the median and a line to the 95th percentile; the mean's value ends
// at `right`.
void DrawTimes(FigureSheet& sheet, const PlotArea& plot, double top, double height, double right,
               const StageTimes::Summary& times, const SeriesLook& look) {
  auto& [page, area, theme] = sheet;
  const double middle = top + 0.5 * height;
  DrawBar(sheet, {plot.X(0.0), top, plot.X(times.mean) - plot.X(0.0), height}, look);
  const FigureStroke thin{theme.ink, 0.8, {}};
  const double p95 = plot.X(times.p95);
  page.Line({std::min(plot.X(times.mean), p95), middle}, {std::max(plot.X(times.mean), p95), middle}, thin);
  page.Line({p95, middle - 0.3 * height}, {p95, middle + 0.3 * height}, thin);
  page.Polygon({plot.X(times.median), middle}, 4, kMedianRadius + 0.682, theme.background);  // a rim
  page.Polygon({plot.X(times.median), middle}, 4, kMedianRadius, theme.ink);
  if (const double size = std::min(theme.small, 1.05 * height); size >= 3.5) {
    page.Text(MeanText(times.mean), {right, middle}, size, theme.ink, TextAlign::kRight);
  }
}

double HeadingHeight(const FigureTheme& theme) { return 1.3 * theme.small; }

// Draws the bars of a group below the heading of the column of means. `row`: height of a stage's bars and the
// gap to the next stage.
void DrawStageGroup(FigureSheet& sheet, const TimingFigure& figure, const std::vector<std::string>& stages,
                    const FigureRect& whole, double row) {
  const FigureTheme& theme = sheet.theme;
  FigureRect area = whole;
  area.y += HeadingHeight(theme);
  area.height -= HeadingHeight(theme);
  area.width -= std::max(TextWidth("8888", theme.small), TextWidth("mean", theme.small)) + 6.0;
  sheet.page.Text("mean", {whole.Right(), whole.y + 0.5 * HeadingHeight(theme)}, theme.small, theme.muted,
                  TextAlign::kRight);
  PlotArea plot{area, {}, {}};
  plot.x = RoundAxis(0.0, 1.04 * LargestTime(figure, stages),
                     std::clamp(static_cast<int>(area.width / 26.0), 2, 10), false);
  DrawXAxis(sheet, plot, "time per call [ms]");
  sheet.page.Line({area.x, area.y}, {area.x, area.Bottom()}, theme.Axis());
  const auto series = static_cast<double>(figure.series.size());
  const double bar = row / (series + 0.6);
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const double middle = area.y + (static_cast<double>(i) + 0.5) * row;
    sheet.page.Text(RowName(stages[i]), {area.x - 4.0, middle}, theme.small, theme.ink, TextAlign::kRight);
    for (std::size_t k = 0; k < figure.series.size(); ++k) {
      const auto found = figure.series[k].stages.find(stages[i]);
      const double top = middle + (static_cast<double>(k) - 0.5 * series) * bar;
      if (found != figure.series[k].stages.end()) {
        DrawTimes(sheet, plot, top + 0.04 * bar, 0.92 * bar, whole.Right(), found->second, LookOfSeries(k));
      }
    }
  }
}

}  // namespace

FigurePage DrawTiming(const TimingFigure& figure, const FigureOptions& options) {
  const StageGroups groups = GroupStages(figure.stages);
  ThrowIf<UsageError>(groups.empty() || figure.series.empty(),
                      "no times to draw, expected at least one stage");
  const auto rows = static_cast<double>(figure.stages.size());
  const auto series = static_cast<double>(figure.series.size());
  const auto axes = [&](const FigureTheme& theme) {  // height above and below the bars of all groups
    return static_cast<double>(groups.size()) * (HeadingHeight(theme) + XAxisHeight(theme)) +
           static_cast<double>(groups.size() - 1) * kTimingGap;
  };
  FigureSheet sheet = MakeChartSheet(
      options, kColumnWidth, "Time of each stage", TimingLegend(figure), kTimingGap,
      [&](double, const FigureTheme& theme) {
        return axes(theme) + rows * (series == 1.0 ? 1.7 : (series + 0.6) * 0.95) * theme.small;
      });
  const FigureRect& area = sheet.area;
  const double row = (area.height - axes(sheet.theme)) / rows;
  const double names = Largest(figure.stages, 0.0, [&](const std::string& stage) {
    return TextWidth(RowName(stage), sheet.theme.small) + 6.0;
  });
  ThrowIf<UsageError>(row / (series + 0.6) < 1.5 || names > 0.7 * area.width,
                      "the figure is too small for its bars, expected a larger size or fewer stages");
  double y = area.y;
  for (const auto& [name, stages] : groups) {
    const double height = HeadingHeight(sheet.theme) + static_cast<double>(stages.size()) * row;
    DrawStageGroup(sheet, figure, stages, {area.x + names, y, area.width - names - 4.0, height}, row);
    y += height + XAxisHeight(sheet.theme) + kTimingGap;
  }
  return std::move(sheet.page);
}

namespace {

struct TimingOptions {
  std::vector<std::string> stages;
  void VisitFields(auto&& visit) { visit("--stage NAME", "Only this stage; may be repeated", stages); }
};

// Returns the stages that ran more than once: first "tracking" and its stages, as they come first for a
// frame; groups before their stages; the longest first.
std::vector<std::string> SlowestStages(const TimingFigure& figure) {
  std::map<std::string, double> slowest;
  for (const TimingFigure::Series& run : figure.series) {
    for (const auto& [stage, times] : run.stages) {
      if (times.count > 1) {
        slowest[stage] = std::max(slowest[stage], times.mean);
      }
    }
  }
  std::vector<std::string> stages = ToVector(slowest, [](const auto& stage) { return stage.first; });
  std::ranges::stable_sort(stages, std::less(), [&slowest](const std::string& stage) {
    const bool is_part = stage.find('.') != std::string::npos;
    return std::tuple(!stage.starts_with("tracking"), is_part, -slowest.at(stage));
  });
  return stages;
}

void CheckStages(const std::vector<std::string>& wanted, const TimingFigure& figure) {
  std::set<std::string> known;
  for (const TimingFigure::Series& run : figure.series) {
    for (const auto& [stage, times] : run.stages) {
      known.insert(stage);
    }
  }
  for (const std::string& stage : wanted) {
    ThrowIf<InputError>(!known.contains(stage), "--stage {}: in none of the results, expected one of {}",
                        stage, fmt::join(known, ", "));
  }
}

FigurePage DrawTimingOf(const FigureRequest& request, const TimingOptions& options) {
  const std::vector<std::string> names = ResultNames(request);
  TimingFigure figure;
  for (std::size_t i = 0; i < request.results.size(); ++i) {
    figure.series.push_back({names[i], ReadStats(ResultFile(request.results[i], "stats.json")).timing_ms});
  }
  CheckStages(options.stages, figure);
  figure.stages = options.stages.empty() ? SlowestStages(figure) : options.stages;
  ThrowIf<InputError>(figure.stages.empty(), "{}: no stage ran more than once, expected timing_ms of a run",
                      fmt::join(request.results, ", "));
  return DrawTiming(figure, request.page);
}

}  // namespace

FigureEntry TimingEntry() {
  return FigureEntry{.name = "timing",
                     .help = "How long each stage takes: mean, median, 95th percentile",
                     .details = R"(
Times of one call of each stage, from stats.json: a bar to the mean, whose number is at the right, a diamond at
the median, a line to the 95th percentile. A stage is called once a frame (tracking) or once a keyframe (mapping).
Stages that ran only once in every result are left out unless --stage names them. The longest come first.

Examples:
  sqslam figure timing out/kitchen -o timing.pdf
  sqslam figure timing out/full out/iou --name "full" --name "IoU only" -o timing.png --width-mm 120
  sqslam figure timing out/kitchen --stage tracking --stage tracking.objects -o tracking.svg
)",
                     .results_help = "Result folders of sqslam run, or their stats.json",
                     .several = true}
      .DrawnBy(DrawTimingOf);
}

}  // namespace sqslam
