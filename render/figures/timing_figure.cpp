#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "slam/io/result_files.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/largest.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kTimingGap = 6.0;

struct StageGroup {
  std::string name;
  std::vector<std::string> stages;
};

std::string GroupOfStage(const std::string& stage) { return stage.substr(0, stage.find('.')); }

// Returns "bundle adjustment" for "mapping.bundle_adjustment", and "mapping, all" for the group "mapping".
std::string RowName(const std::string& stage) {
  const std::size_t dot = stage.find('.');
  return dot == std::string::npos ? stage + ", all" : ReadableLabel(stage.substr(dot + 1));
}

std::vector<StageGroup> StageGroups(const TimingFigure& figure) {
  std::vector<StageGroup> groups;
  for (const std::string& stage : figure.stages) {
    const std::string name = GroupOfStage(stage);
    const auto found =
        std::ranges::find_if(groups, [&](const StageGroup& group) { return group.name == name; });
    StageGroup& group = found == groups.end() ? groups.emplace_back() : *found;
    group.name = name;
    group.stages.push_back(stage);
  }
  return groups;
}

std::vector<LegendEntry> TimingLegend(const TimingFigure& figure, const FigureTheme& theme) {
  std::vector<LegendEntry> entries;
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    entries.push_back(
        LegendEntry::Bar(figure.series.size() == 1 ? "mean" : figure.series[i].name, LookOfSeries(i)));
  }
  entries.push_back(LegendEntry::OfMark("median", {Mark::Shape::kDiamond, 4.5, theme.ink}));
  entries.push_back(LegendEntry::Tick("95th percentile", {theme.ink, 0.8, {}}));
  return entries;
}

double LargestTime(const TimingFigure& figure, const StageGroup& group) {
  double largest = 0.0;
  for (const TimingFigure::Series& series : figure.series) {
    for (const std::string& stage : group.stages) {
      const auto found = series.stages.find(stage);
      if (found != series.stages.end()) {
        largest = std::max({largest, found->second.mean, found->second.p95, found->second.median});
      }
    }
  }
  return std::max(largest, 1e-3);
}

std::string MeanText(double milliseconds) {
  return milliseconds < 10.0    ? fmt::format("{:.2f}", milliseconds)
         : milliseconds < 100.0 ? fmt::format("{:.1f}", milliseconds)
                                : fmt::format("{:.0f}", milliseconds);
}

// Draws a bar of the mean with its value, a diamond at the median and a line to the 95th percentile.
void DrawTimes(FigurePage& page, const PlotArea& plot, double top, double height,
               const StageTimes::Summary& times, const SeriesLook& look, const FigureTheme& theme) {
  const double middle = top + 0.5 * height;
  DrawBar(page, {plot.X(0.0), top, plot.X(times.mean) - plot.X(0.0), height}, look, theme.background);
  const FigureStroke thin{theme.ink, 0.8, {}};
  const double p95 = plot.X(times.p95);
  page.Line({std::min(plot.X(times.mean), p95), middle}, {std::max(plot.X(times.mean), p95), middle}, thin);
  page.Line({p95, middle - 0.3 * height}, {p95, middle + 0.3 * height}, thin);
  DrawMark(page, {plot.X(times.median), middle}, {Mark::Shape::kDiamond, 5.6, theme.background});
  DrawMark(page, {plot.X(times.median), middle}, {Mark::Shape::kDiamond, 4.5, theme.ink});
  const double size = std::min(theme.small, 1.15 * height);
  if (size >= 3.5) {
    const double right = std::max({p95, plot.X(times.mean), plot.X(times.median) + 3.0});  // of all marks
    FigureText number{MeanText(times.mean), {right + 3.5, middle}, size, theme.ink};
    number.halo = theme.background;  // over grid lines
    page.Text(number);
  }
}

struct TimingRows {
  double bar = 0.0;  // thickness of one bar
  double row = 0.0;  // a stage's bars and the gap to the next stage
};

void DrawStageGroup(FigurePage& page, const TimingFigure& figure, const StageGroup& group,
                    const FigureRect& area, const TimingRows& rows, const FigureTheme& theme) {
  PlotArea plot;
  plot.area = area;
  const double largest = LargestTime(figure, group);
  const double numbers = TextWidth("888.8", theme.small) + 6.0;  // right of the longest bar
  plot.x = RoundAxis(0.0, largest * area.width / std::max(area.width - numbers, 0.2 * area.width),
                     std::clamp(static_cast<int>(area.width / 26.0), 2, 10), false);
  DrawXAxis(page, plot, "time per call [ms]", theme);
  page.Line({area.x, area.y}, {area.x, area.Bottom()}, theme.Axis());
  const auto series = static_cast<double>(figure.series.size());
  for (std::size_t i = 0; i < group.stages.size(); ++i) {
    const double middle = area.y + (static_cast<double>(i) + 0.5) * rows.row;
    page.Text(RowName(group.stages[i]), {area.x - 4.0, middle}, theme.small, theme.ink, TextAlign::kRight);
    for (std::size_t k = 0; k < figure.series.size(); ++k) {
      const auto found = figure.series[k].stages.find(group.stages[i]);
      const double top = middle + (static_cast<double>(k) - 0.5 * series) * rows.bar;
      if (found != figure.series[k].stages.end()) {
        DrawTimes(page, plot, top + 0.04 * rows.bar, 0.92 * rows.bar, found->second, LookOfSeries(k), theme);
      }
    }
  }
}

// Returns the height of everything but the bars, in points.
double AroundBars(const TimingFigure& figure, const std::vector<StageGroup>& groups, const FigureTheme& theme,
                  double width) {
  return LegendHeight(TimingLegend(figure, theme), width, theme) +
         static_cast<double>(groups.size()) * (kTimingGap + XAxisHeight(theme));
}

}  // namespace

FigurePage DrawTiming(const TimingFigure& figure, const FigureOptions& options) {
  const std::vector<StageGroup> groups = StageGroups(figure);
  ThrowIf<UsageError>(groups.empty() || figure.series.empty(),
                      "no times to draw, expected at least one stage");
  const auto row_count = static_cast<double>(figure.stages.size());
  const auto series = static_cast<double>(figure.series.size());
  FigureSheet sheet =
      MakeSheet(options, kColumnWidth, "Time of each stage", [&](double width, const FigureTheme& theme) {
        const double row =
            figure.series.size() == 1 ? 1.7 * theme.small : (series + 0.6) * 0.95 * theme.small;
        return AroundBars(figure, groups, theme, width) + row_count * row;
      });
  const FigureTheme& theme = sheet.theme;
  const FigureRect& area = sheet.area;
  const double legend = LegendHeight(TimingLegend(figure, theme), area.width, theme);
  TimingRows rows;
  rows.row = (area.height - AroundBars(figure, groups, theme, area.width)) / row_count;
  rows.bar = rows.row / (series + 0.6);
  const double names = Largest(figure.stages, 0.0, [&](const std::string& stage) {
    return TextWidth(RowName(stage), theme.small) + 6.0;
  });
  ThrowIf<UsageError>(rows.bar < 1.5 || names > 0.7 * area.width,
                      "the figure is too small for its bars, expected a larger size or fewer stages");
  DrawLegend(sheet.page, TimingLegend(figure, theme), {area.x, area.y, area.width, legend}, theme);
  double y = area.y + legend + kTimingGap;
  for (const StageGroup& group : groups) {
    const double height = static_cast<double>(group.stages.size()) * rows.row;
    DrawStageGroup(sheet.page, figure, group, {area.x + names, y, area.width - names - 4.0, height}, rows,
                   theme);
    y += height + XAxisHeight(theme) + kTimingGap;
  }
  return std::move(sheet.page);
}

namespace {

struct TimingOptions {
  std::vector<std::string> stages;
  void VisitFields(auto&& visit) { visit("--stage NAME", "Only this stage; may be repeated", stages); }
};

// Sorts groups ("tracking") before their stages, and each by decreasing time.
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
  const auto rank = [&slowest](const std::string& stage) {
    const bool whole = stage.find('.') == std::string::npos;
    return std::make_pair(whole ? 0 : 1, -slowest.at(stage));
  };
  std::ranges::stable_sort(stages,
                           [&rank](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
  // Tracking comes first, as it does for a frame.
  std::stable_partition(stages.begin(), stages.end(),
                        [](const std::string& stage) { return stage.starts_with("tracking"); });
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
  return {.name = "timing",
          .help = "How long each stage takes: mean, median, 95th percentile",
          .details = R"(
Times of one call of each stage, from stats.json: a bar to the mean (its number beside it), a diamond at the
median, a line to the 95th percentile. A stage is called once a frame (tracking) or once a keyframe (mapping).
Stages that ran only once in every result are left out unless --stage names them; the longest come first.

Examples:
  sqslam figure timing out/kitchen -o timing.pdf
  sqslam figure timing out/full out/iou --name "full" --name "IoU only" -o timing.png --width-mm 120
  sqslam figure timing out/kitchen --stage tracking --stage tracking.objects -o tracking.svg
)",
          .results_help = "Result folders of sqslam run, or their stats.json",
          .several = true,
          .names_help = kNameInLegend,
          .make = FigureEntry::Maker(DrawTimingOf)};
}

}  // namespace sqslam
