#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/figures/chart_figures.h"
#include "render/page/chart.h"
#include "render/page/panels.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

constexpr double kIouGap = 6.0;
constexpr double kSlant = 40.0;  // degrees, of names that do not fit side by side

void Check(const IouFigure& figure) {
  if (figure.objects.empty() || figure.series.empty()) {
    throw UsageError("no object to draw, expected at least one");
  }
  for (const IouFigure::Series& series : figure.series) {
    if (series.values.size() != figure.objects.size()) {
      throw UsageError(fmt::format("{}: {} values, expected {}", series.name, series.values.size(),
                                   figure.objects.size()));
    }
  }
}

double Mean(const IouFigure::Series& series) {
  double sum = 0.0;
  for (const std::optional<double>& value : series.values) {
    sum += value.value_or(0.0);
  }
  return sum / static_cast<double>(series.values.size());
}

bool AnyMissed(const IouFigure& figure) {
  return std::any_of(figure.series.begin(), figure.series.end(), [](const IouFigure::Series& series) {
    return std::any_of(series.values.begin(), series.values.end(), [](const auto& v) { return !v; });
  });
}

std::vector<LegendEntry> LegendOf(const IouFigure& figure, const FigureTheme& theme) {
  std::vector<LegendEntry> entries;
  for (std::size_t i = 0; i < figure.series.size() && figure.series.size() > 1; ++i) {
    LegendEntry entry;
    entry.text = figure.series[i].name;
    entry.look = LookOfSeries(static_cast<int>(i));
    entries.push_back(entry);
  }
  if (AnyMissed(figure)) {
    LegendEntry missed;
    missed.kind = LegendEntry::Kind::kMark;
    missed.text = "not found";
    missed.mark = {Mark::Shape::kCross, 5.0, theme.muted};
    entries.push_back(missed);
  }
  return entries;
}

struct Names {
  bool slanted = false;
  double height = 0.0;  // points below the plot
  double left = 0.0;    // how far the first one reaches beyond its place
};

std::string MeanName(const IouFigure& figure) { return fmt::format("mean of {}", figure.objects.size()); }

Names MeasureNames(const IouFigure& figure, double slot, const FigureTheme& theme) {
  double widest = TextWidth(MeanName(figure), theme.small, true);
  for (const std::string& name : figure.objects) {
    widest = std::max(widest, TextWidth(name, theme.small));
  }
  Names names;
  names.slanted = widest > slot - 3.0;
  const double angle = kSlant * std::numbers::pi / 180.0;
  names.height = names.slanted ? 4.0 + widest * std::sin(angle) + theme.small : 4.0 + 1.3 * theme.small;
  names.left = names.slanted ? TextWidth(figure.objects.front(), theme.small) * std::cos(angle) : 0.0;
  return names;
}

// One place more than there are objects for the means, with a gap before it.
constexpr double kMeanGap = 0.5;
double Slots(const IouFigure& figure) { return static_cast<double>(figure.objects.size()) + 1.0 + kMeanGap; }

PlotArea UnitPlot(const FigureRect& area) {
  PlotArea plot;
  plot.area = area;
  plot.x = {0.0, 1.0, 1.0};
  plot.y = {0.0, 1.0, area.height > 70.0 ? 0.2 : 0.5};
  return plot;
}

void DrawValue(FigurePage& page, const PlotArea& plot, double left, double width,
               const std::optional<double>& value, const SeriesLook& look, const FigureTheme& theme) {
  const double middle = left + 0.5 * width;
  if (!value) {
    DrawMark(page, {middle, plot.Y(0.0) - 4.0}, {Mark::Shape::kCross, std::min(5.0, width), theme.muted});
    return;
  }
  const double top = plot.Y(std::clamp(*value, 0.0, 1.0));
  DrawBar(page, {left, top, width, plot.Y(0.0) - top}, look, theme.background);
  const std::string text = fmt::format("{:.2f}", *value);
  const double size = 0.8 * theme.small;
  FigureText number = PlainText(text, {middle, top - 0.65 * size}, size, theme.ink, TextAlign::kCenter);
  number.halo = theme.background;  // grid lines pass behind it
  if (TextWidth(text, size) < width + 1.0) {
    page.Text(number);
  } else if (width > 0.75 * size) {
    number.anchor.y() = top - 2.0;
    number.align = TextAlign::kLeft;
    number.angle = 90.0;
    page.Text(number);
  }
}

void DrawName(FigurePage& page, const std::string& name, double x, double bottom, bool slanted, bool bold,
              const FigureTheme& theme) {
  FigureText text = PlainText(name, {x, bottom + 4.0 + 0.5 * theme.small}, theme.small, theme.ink,
                              TextAlign::kCenter, bold);
  if (slanted) {
    text.anchor = {x + 0.3 * theme.small, bottom + 4.0 + 0.3 * theme.small};
    text.align = TextAlign::kRight;
    text.angle = kSlant;
  }
  page.Text(text);
}

void DrawBars(FigurePage& page, const PlotArea& plot, const IouFigure& figure, const Names& names,
              const FigureTheme& theme) {
  const double slot = plot.area.width / Slots(figure);
  const auto series = static_cast<double>(figure.series.size());
  const double bar = slot * 0.8 / series;
  for (std::size_t i = 0; i <= figure.objects.size(); ++i) {
    const bool mean = i == figure.objects.size();
    const double middle = plot.area.x + (static_cast<double>(i) + 0.5 + (mean ? kMeanGap : 0.0)) * slot;
    for (std::size_t k = 0; k < figure.series.size(); ++k) {
      const double left = middle + (static_cast<double>(k) - 0.5 * series) * bar;
      const std::optional<double> value = mean ? Mean(figure.series[k]) : figure.series[k].values[i];
      DrawValue(page, plot, left + 0.04 * bar, 0.92 * bar, value, LookOfSeries(static_cast<int>(k)), theme);
    }
    DrawName(page, mean ? MeanName(figure) : figure.objects[i], middle, plot.area.Bottom(), names.slanted,
             mean, theme);
  }
  const double between = plot.area.x + (static_cast<double>(figure.objects.size()) + 0.5 * kMeanGap) * slot;
  page.Line({between, plot.area.y}, {between, plot.area.Bottom()}, {theme.muted, 0.6, {2.0, 2.0}});
}

}  // namespace

FigurePage DrawIou(const IouFigure& figure, const FigureOptions& options) {
  Check(figure);
  const bool many = Slots(figure) * static_cast<double>(figure.series.size()) > 14.0;
  const auto slot_width = [&](double width) { return (width - 30.0) / Slots(figure); };
  FigureSheet sheet =
      MakeSheet(options, many ? kTextWidth : kColumnWidth, "3D IoU of objects", [&](double width) {
        const FigureTheme theme(options);
        return LegendHeight(LegendOf(figure, theme), width, theme) + kIouGap + 120.0 +
               MeasureNames(figure, slot_width(width), theme).height;
      });
  const FigureTheme& theme = sheet.theme;
  const FigureRect& area = sheet.area;
  const std::vector<LegendEntry> entries = LegendOf(figure, theme);
  const double legend = LegendHeight(entries, area.width, theme);
  const Names names = MeasureNames(figure, slot_width(area.width), theme);
  FigureRect plot_area{area.x, area.y + legend + kIouGap, area.width,
                       area.height - legend - kIouGap - names.height};
  const double left = std::max(YAxisWidth(UnitPlot(plot_area).y, theme, true) + 2.0,
                               names.left - 0.5 * slot_width(area.width));
  plot_area.x += left;
  plot_area.width -= left;
  if (plot_area.height < 20.0 || plot_area.width / Slots(figure) < 3.0) {
    throw UsageError("the figure is too small for its bars, expected a larger size");
  }
  DrawLegend(sheet.page, entries, {area.x, area.y, area.width, legend}, theme);
  const PlotArea plot = UnitPlot(plot_area);
  DrawYAxis(sheet.page, plot, "3D IoU", theme);
  DrawBars(sheet.page, plot, figure, names, theme);
  sheet.page.Line({plot_area.x, plot_area.Bottom()}, {plot_area.Right(), plot_area.Bottom()}, theme.Axis());
  return std::move(sheet.page);
}

}  // namespace sqslam
