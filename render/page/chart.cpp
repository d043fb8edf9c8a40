#include "render/page/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "slam/util/largest.h"

namespace sqslam {
namespace {

constexpr double kTickGap = 3.0;       // points between the plot and its numbers
constexpr double kMinNumberGap = 0.5;  // between the numbers of a horizontal axis, of the font size

constexpr double kSwatch = 2.0;    // width of a legend symbol, of the font size
constexpr double kSignGap = 0.5;   // between symbol and text
constexpr double kEntryGap = 1.6;  // between entries
constexpr double kLineHeight = 1.55;

double EntryWidth(const LegendEntry& entry, double size) {
  return (kSwatch + kSignGap) * size + TextWidth(entry.text, size);
}

std::vector<std::vector<int>> LegendLines(const std::vector<LegendEntry>& entries, double width,
                                          double size) {
  std::vector<std::vector<int>> lines;
  double used = 0.0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const double needed = EntryWidth(entries[i], size);
    if (lines.empty() || used + kEntryGap * size + needed > width) {
      lines.emplace_back();
      used = needed;
    } else {
      used += kEntryGap * size + needed;
    }
    lines.back().push_back(static_cast<int>(i));
  }
  return lines;
}

// Returns the next smaller of the steps 1, 2 and 5 times a power of ten.
double FinerStep(double step) {
  const double power = std::pow(10.0, std::floor(std::log10(step) + 1e-9));
  const double lead = std::round(step / power);
  return (lead == 5.0 ? 2.0 : lead == 2.0 ? 1.0 : 0.5) * power;
}

}  // namespace

std::vector<double> ChartAxis::Ticks() const {
  constexpr double kMinRelativeStep =
      1e-12;  // relative to the numbers: finer steps are lost in their rounding
  constexpr int kMaxTicks = 1000;
  std::vector<double> ticks;
  if (!(step > kMinRelativeStep * std::max(std::abs(low), std::abs(high)))) {
    return ticks;
  }
  const double slack = 1e-6 * step;
  const double first = std::ceil((low - slack) / step);
  for (int k = 0; k < kMaxTicks && (first + k) * step <= high + slack; ++k) {
    const double i = first + k;
    ticks.push_back(i == 0.0 ? 0.0 : i * step);
  }
  return ticks;
}

std::vector<double> ChartAxis::NumberedTicks(double length, double room) const {
  const double apart = step / (high - low) * length;  // points between ticks
  double every = 1.0;
  for (int i = 0; every * apart < room && i < 30; ++i) {
    every *= i % 3 == 1 ? 2.5 : 2.0;  // 1, 2, 5, 10, ...
  }
  std::vector<double> numbered = Ticks();
  std::erase_if(numbered, [&](double tick) {
    const double index = std::round(tick / step);
    return index != every * std::round(index / every);
  });
  return numbered;
}

std::string ChartAxis::TickText(double value) const {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  const std::string text = fmt::format("{:.{}f}", std::abs(value), decimals);
  return value < -1e-9 * step ? "\u2212" + text : text;
}

ChartAxis RoundAxis(double low, double high, int ticks, bool whole_steps) {
  if (!(high > low)) {
    const double around = std::max(1e-6, 0.1 * std::abs(low));
    low -= around;
    high += around;
  }
  const double rough = (high - low) / std::max(ticks, 1);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double lead = rough / power;
  ChartAxis axis{low, high, (lead > 7.0 ? 10.0 : lead > 3.2 ? 5.0 : lead > 1.5 ? 2.0 : 1.0) * power};
  for (int i = 0; i < 3 && !whole_steps && axis.Ticks().size() < 2; ++i) {
    axis.step = FinerStep(axis.step);
  }
  if (whole_steps) {
    axis.low = axis.step * std::floor(low / axis.step + 1e-9);
    axis.high = axis.step * std::ceil(high / axis.step - 1e-9);
  }
  return axis;
}

SeriesLook LookOfSeries(std::size_t index) {
  // Palette of Okabe and Ito, starting with the pairs that differ most in lightness.
  static constexpr std::array<const char*, 6> kColors = {"#0072b2", "#e69f00", "#009e73",
                                                         "#d55e00", "#56b4e9", "#cc79a7"};
  // Five dashes, like the hatches: with six colours, thirty series can be distinguished.
  static const std::array<std::vector<double>, 5> kDashes = {
      std::vector<double>{}, {5.0, 2.0}, {1.5, 1.5}, {6.0, 1.5, 1.5, 1.5}, {9.0, 3.0}};
  SeriesLook look;
  look.color = ParseColor(kColors[index % kColors.size()]);
  look.dash = kDashes[index % kDashes.size()];
  look.hatch = static_cast<int>(index % 5);
  return look;
}

std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> HatchLines(const FigureRect& rect, int hatch,
                                                                    double spacing) {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> lines;
  if (hatch == 3) {
    for (double y = rect.y + 0.5 * spacing; y < rect.Bottom(); y += spacing) {
      lines.push_back({{rect.x, y}, {rect.Right(), y}});
    }
    return lines;
  }
  // Lines x + y = c (rising on the page) and x - y = c, cut to the rectangle.
  const auto add = [&](double sign) {
    const double first = rect.x + std::min(sign * rect.y, sign * rect.Bottom());
    const double last = rect.Right() + std::max(sign * rect.y, sign * rect.Bottom());
    const double step = spacing * std::numbers::sqrt2;
    for (double c = first + 0.5 * step; c < last; c += step) {
      const double low = std::max(rect.x, std::min(c - sign * rect.y, c - sign * rect.Bottom()));
      const double high = std::min(rect.Right(), std::max(c - sign * rect.y, c - sign * rect.Bottom()));
      if (high - low > 1e-6) {
        lines.push_back({{low, sign * (c - low)}, {high, sign * (c - high)}});
      }
    }
  };
  if (hatch == 1 || hatch == 4) {
    add(1.0);
  }
  if (hatch == 2 || hatch == 4) {
    add(-1.0);
  }
  return lines;
}

void DrawBar(FigureSheet& sheet, const FigureRect& bar, const SeriesLook& look) {
  if (bar.width <= 0.0 || bar.height <= 0.0) {
    return;
  }
  sheet.page.Rect(bar, look.color);
  for (const auto& [from, to] : HatchLines(bar, look.hatch, 3.0)) {
    // One dash as long as the line: its ends are butt caps, which stay inside the bar.
    sheet.page.Line(from, to, {sheet.theme.background, 0.7, {(to - from).norm() + 1.0, 1.0}});
  }
}

LegendEntry LegendEntry::Bar(std::string text, const SeriesLook& look) {
  return {std::move(text), [look](FigureSheet& sheet, const FigureRect& box) {
            DrawBar(sheet, {box.x + 0.25 * box.width, box.y, 0.75 * box.width, box.height}, look);
          }};
}

LegendEntry LegendEntry::Line(std::string text, const FigureStroke& stroke) {
  return {std::move(text), [stroke](FigureSheet& sheet, const FigureRect& box) {
            sheet.page.Line({box.x, box.Center().y()}, {box.Right(), box.Center().y()}, stroke);
          }};
}

LegendEntry LegendEntry::Mark(
    std::string text, std::function<void(FigureSheet& sheet, const Eigen::Vector2d& center)> draw_mark) {
  return {std::move(text), [draw_mark = std::move(draw_mark)](FigureSheet& sheet, const FigureRect& box) {
            draw_mark(sheet, {box.Right() - 0.4 * box.width, box.Center().y()});
          }};
}

double LegendHeight(const std::vector<LegendEntry>& entries, double width, const FigureTheme& theme) {
  return static_cast<double>(LegendLines(entries, width, theme.small).size()) * kLineHeight * theme.small;
}

void DrawLegend(FigureSheet& sheet, const std::vector<LegendEntry>& entries, const FigureRect& area) {
  const double size = sheet.theme.small;
  double y = area.y + 0.5 * kLineHeight * size;
  for (const std::vector<int>& line : LegendLines(entries, area.width, size)) {
    double used = -kEntryGap * size;
    for (const int index : line) {
      used += kEntryGap * size + EntryWidth(entries[static_cast<std::size_t>(index)], size);
    }
    double x = area.x + std::max(0.0, 0.5 * (area.width - used));
    for (const int index : line) {
      const LegendEntry& entry = entries[static_cast<std::size_t>(index)];
      entry.draw_sign(sheet, {x, y - 0.45 * size, kSwatch * size, 0.9 * size});
      const double room = area.width - (kSwatch + kSignGap) * size;
      sheet.page.Text(FittingText(entry.text, size, room), {x + (kSwatch + kSignGap) * size, y}, size,
                      sheet.theme.ink);
      x += EntryWidth(entry, size) + kEntryGap * size;
    }
    y += kLineHeight * size;
  }
}

FigureSheet MakeChartSheet(const FigureOptions& options, double own_width, const std::string& description,
                           const std::vector<LegendEntry>& legend, double gap_below_legend,
                           const std::function<double(double, const FigureTheme&)>& own_height) {
  const auto head = [&](double width, const FigureTheme& theme) {
    return LegendHeight(legend, width, theme) + gap_below_legend;
  };
  FigureSheet sheet = MakeSheet(options, own_width, description, [&](double width, const FigureTheme& theme) {
    return head(width, theme) + own_height(width, theme);
  });
  DrawLegend(sheet, legend, sheet.area);
  const double above = head(sheet.area.width, sheet.theme);
  sheet.area.y += above;
  sheet.area.height -= above;
  return sheet;
}

void DrawXAxis(FigureSheet& sheet, const PlotArea& plot, const std::string& label, bool grid) {
  auto& [page, whole, theme] = sheet;
  const FigureRect& area = plot.area;
  const double numbers_y = area.Bottom() + kTickGap + 0.5 * theme.small;
  const std::vector<double> ticks = plot.x.Ticks();
  const double widest =
      Largest(ticks, 0.0, [&](double tick) { return TextWidth(plot.x.TickText(tick), theme.small); });
  for (const double tick : ticks) {
    if (grid) {
      page.Line({plot.X(tick), area.y}, {plot.X(tick), area.Bottom()}, theme.Grid());
    }
  }
  for (const double tick : plot.x.NumberedTicks(area.width, widest + kMinNumberGap * theme.small)) {
    page.Text(plot.x.TickText(tick), {plot.X(tick), numbers_y}, theme.small, theme.muted, TextAlign::kCenter);
  }
  page.Line({area.x, area.Bottom()}, {area.Right(), area.Bottom()}, theme.Axis());
  if (!label.empty()) {
    page.Text(label, {area.Center().x(), numbers_y + 0.6 * theme.small + 0.9 * theme.font}, theme.font,
              theme.ink, TextAlign::kCenter);
  }
}

void DrawYAxis(FigureSheet& sheet, const PlotArea& plot, const std::string& label) {
  auto& [page, whole, theme] = sheet;
  const FigureRect& area = plot.area;
  for (const double tick : plot.y.Ticks()) {
    page.Line({area.x, plot.Y(tick)}, {area.Right(), plot.Y(tick)}, theme.Grid());
  }
  for (const double tick : plot.y.NumberedTicks(area.height, theme.small)) {
    page.Text(plot.y.TickText(tick), {area.x - kTickGap, plot.Y(tick)}, theme.small, theme.muted,
              TextAlign::kRight);
  }
  page.Line({area.x, area.y}, {area.x, area.Bottom()}, theme.Axis());
  const double x = area.x - YAxisWidth(plot.y, theme) + 0.5 * theme.font;
  page.Text({label, {x, area.Center().y()}, theme.font, theme.ink, TextAlign::kCenter, false, 90.0});
}

double XAxisHeight(const FigureTheme& theme) { return kTickGap + 1.1 * theme.small + 1.4 * theme.font; }

double YAxisWidth(const ChartAxis& axis, const FigureTheme& theme) {
  const double widest =
      Largest(axis.Ticks(), 0.0, [&](double tick) { return TextWidth(axis.TickText(tick), theme.small); });
  return kTickGap + widest + 1.5 * theme.font;
}

}  // namespace sqslam
