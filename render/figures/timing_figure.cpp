#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/figures/chart_figures.h"
#include "render/page/chart.h"
#include "render/page/panels.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

constexpr double kTimingGap = 6.0;

struct Group {
  std::string name;
  std::vector<std::string> stages;
};

std::string GroupOf(const std::string& stage) { return stage.substr(0, stage.find('.')); }

// "bundle_adjustment" of "mapping.bundle_adjustment"; the group itself is its whole.
std::string RowName(const std::string& stage) {
  const std::size_t dot = stage.find('.');
  return dot == std::string::npos ? stage + ", all" : ReadableLabel(stage.substr(dot + 1));
}

std::vector<Group> Groups(const TimingFigure& figure) {
  std::vector<Group> groups;
  for (const std::string& stage : figure.stages) {
    const std::string name = GroupOf(stage);
    const auto found =
        std::find_if(groups.begin(), groups.end(), [&](const Group& group) { return group.name == name; });
    Group& group = found == groups.end() ? groups.emplace_back() : *found;
    group.name = name;
    group.stages.push_back(stage);
  }
  return groups;
}

std::vector<LegendEntry> LegendOf(const TimingFigure& figure, const FigureTheme& theme) {
  std::vector<LegendEntry> entries;
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    LegendEntry entry;
    entry.text = figure.series.size() == 1 ? "mean" : figure.series[i].name;
    entry.look = LookOfSeries(static_cast<int>(i));
    entries.push_back(entry);
  }
  LegendEntry median;
  median.kind = LegendEntry::Kind::kMark;
  median.text = "median";
  median.mark = {Mark::Shape::kDiamond, 4.5, theme.ink};
  entries.push_back(median);
  LegendEntry p95;
  p95.kind = LegendEntry::Kind::kTick;
  p95.text = "95th percentile";
  p95.look.color = theme.ink;
  p95.width = 0.8;
  entries.push_back(p95);
  return entries;
}

double LargestTime(const TimingFigure& figure, const Group& group) {
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

// One bar with its marks: a diamond at the median, a line to the 95th percentile, the mean in numbers.
void DrawTimes(FigurePage& page, const PlotArea& plot, double top, double height,
               const TimingFigure::Times& times, const SeriesLook& look, const FigureTheme& theme) {
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
    page.Text(
        PlainText(MeanText(times.mean), {std::max(p95, plot.X(times.mean)) + 3.5, middle}, size, theme.ink));
  }
}

struct TimingRows {
  double bar = 0.0;  // thickness of one bar
  double row = 0.0;  // a stage's bars with the gap to the next
};

void DrawGroup(FigurePage& page, const TimingFigure& figure, const Group& group, const FigureRect& area,
               const TimingRows& rows, const FigureTheme& theme) {
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
    page.Text(PlainText(RowName(group.stages[i]), {area.x - 4.0, middle}, theme.small, theme.ink,
                        TextAlign::kRight));
    for (std::size_t k = 0; k < figure.series.size(); ++k) {
      const auto found = figure.series[k].stages.find(group.stages[i]);
      const double top = middle + (static_cast<double>(k) - 0.5 * series) * rows.bar;
      if (found != figure.series[k].stages.end()) {
        DrawTimes(page, plot, top + 0.04 * rows.bar, 0.92 * rows.bar, found->second,
                  LookOfSeries(static_cast<int>(k)), theme);
      }
    }
  }
}

// All that is not bars, in points.
double AroundBars(const TimingFigure& figure, const std::vector<Group>& groups, const FigureTheme& theme,
                  double width) {
  return LegendHeight(LegendOf(figure, theme), width, theme) +
         static_cast<double>(groups.size()) * (kTimingGap + XAxisHeight(theme, true));
}

}  // namespace

FigurePage DrawTiming(const TimingFigure& figure, const FigureOptions& options) {
  const std::vector<Group> groups = Groups(figure);
  if (groups.empty() || figure.series.empty()) {
    throw UsageError("no times to draw, expected at least one stage");
  }
  const auto row_count = static_cast<double>(figure.stages.size());
  const auto series = static_cast<double>(figure.series.size());
  FigureSheet sheet = MakeSheet(options, kColumnWidth, "Time of each stage", [&](double width) {
    const FigureTheme theme(options);
    const double row = figure.series.size() == 1 ? 1.7 * theme.small : (series + 0.6) * 0.95 * theme.small;
    return AroundBars(figure, groups, theme, width) + row_count * row;
  });
  const FigureTheme& theme = sheet.theme;
  const FigureRect& area = sheet.area;
  const double legend = LegendHeight(LegendOf(figure, theme), area.width, theme);
  TimingRows rows;
  rows.row = (area.height - AroundBars(figure, groups, theme, area.width)) / row_count;
  rows.bar = rows.row / (series + 0.6);
  double names = 0.0;
  for (const std::string& stage : figure.stages) {
    names = std::max(names, TextWidth(RowName(stage), theme.small) + 6.0);
  }
  if (rows.bar < 1.5 || names > 0.7 * area.width) {
    throw UsageError("the figure is too small for its bars, expected a larger size or fewer stages");
  }
  DrawLegend(sheet.page, LegendOf(figure, theme), {area.x, area.y, area.width, legend}, theme);
  double y = area.y + legend + kTimingGap;
  for (const Group& group : groups) {
    const double height = static_cast<double>(group.stages.size()) * rows.row;
    DrawGroup(sheet.page, figure, group, {area.x + names, y, area.width - names - 4.0, height}, rows, theme);
    y += height + XAxisHeight(theme, true) + kTimingGap;
  }
  return std::move(sheet.page);
}

}  // namespace sqslam
