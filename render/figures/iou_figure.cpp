#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "render/figures/figure_input.h"
#include "render/page/chart.h"
#include "slam/evaluation/evaluation.h"
#include "slam/geometry/angles.h"
#include "slam/io/result_files.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/json_file.h"
#include "slam/util/largest.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

constexpr double kIouGap = 6.0;   // points
constexpr double kSlant = 40.0;   // degrees; slant of names that do not fit side by side
constexpr double kMeanGap = 0.5;  // between the objects and the means, in slots of an object

std::size_t AllObjects(const IouFigure& figure) { return figure.objects.size() + figure.not_shown; }

// One slot per object and one for the means, after a gap.
double IouSlots(const IouFigure& figure) {
  return static_cast<double>(figure.objects.size()) + 1.0 + kMeanGap;
}

double SlotWidth(const IouFigure& figure, double width) { return (width - 30.0) / IouSlots(figure); }

// Returns the mean over all objects, as sqslam eval: those not found count 0.
double MeanOverAll(const IouFigure& figure, const IouFigure::Series& series) {
  double sum = 0.0;
  for (const std::optional<double>& value : series.values) {
    sum += value.value_or(0.0);
  }
  return sum / static_cast<double>(AllObjects(figure));
}

std::string MeansText(const IouFigure& figure, const IouFigure::Series& series) {
  const auto all = AllObjects(figure);
  const double mean = MeanOverAll(figure, series);
  const auto found =
      std::ranges::count_if(series.values, [](const auto& value) { return value.has_value(); });
  return fmt::format("{}: mean {:.2f} of {}, ", series.name, mean, all) +
         (found > 0 ? fmt::format("{} found: {:.2f}", found,
                                  mean * static_cast<double>(all) / static_cast<double>(found))
                    : "none found");
}

std::vector<LegendEntry> IouLegend(const IouFigure& figure) {
  std::vector<LegendEntry> entries;
  bool any_missed = false;
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    const IouFigure::Series& series = figure.series[i];
    entries.push_back(LegendEntry::Bar(MeansText(figure, series), LookOfSeries(i)));
    any_missed = any_missed || std::ranges::count(series.values, std::optional<double>()) > 0;
  }
  if (any_missed) {
    entries.push_back(LegendEntry::Mark("not found", [](FigureSheet& sheet, const Eigen::Vector2d& center) {
      sheet.page.Cross(center, 4.2, {sheet.theme.muted, 1.0, {}});
    }));
  }
  return entries;
}

std::string MeanName(const IouFigure& figure) { return fmt::format("mean of {}", AllObjects(figure)); }

struct NameRoom {
  bool slanted = false;
  double height = 0.0;  // points below the plot
  double left = 0.0;    // points by which the first name extends beyond its slot
};

NameRoom MeasureNames(const IouFigure& figure, double width, const FigureTheme& theme) {
  const double slot = SlotWidth(figure, width);
  const double widest = Largest(figure.objects, TextWidth(MeanName(figure), theme.small, true),
                                [&](const std::string& name) { return TextWidth(name, theme.small); });
  if (widest <= slot - 3.0) {
    return {false, 4.0 + 1.3 * theme.small, 0.0};
  }
  const double angle = kSlant * kRadiansPerDegree;
  return {true, 4.0 + widest * std::sin(angle) + theme.small,
          TextWidth(figure.objects.front(), theme.small) * std::cos(angle) - 0.5 * slot};
}

void DrawIouBar(FigureSheet& sheet, const PlotArea& plot, double left, double width,
                const std::optional<double>& value, const SeriesLook& look) {
  auto& [page, area, theme] = sheet;
  const double middle = left + 0.5 * width;
  if (!value) {
    page.Cross({middle, plot.Y(0.0) - 4.0}, 0.84 * std::min(5.0, width), {theme.muted, 1.0, {}});
    return;
  }
  const double top = plot.Y(std::clamp(*value, 0.0, 1.0));
  DrawBar(sheet, {left, top, width, plot.Y(0.0) - top}, look);
  const double size = 0.8 * theme.small;
  FigureText number{
      fmt::format("{:.2f}", *value), {middle, top - 0.65 * size}, size, theme.ink, TextAlign::kCenter};
  number.halo = theme.background;  // over grid lines
  const double room = TextWidth(number.text, size);
  if (room >=
      width - 1.0) {  // would touch its neighbour: upright, inside the bar if it would overlap the legend
    const bool above = top - 2.0 - room > plot.area.y - kIouGap;
    number.anchor.y() = above ? top - 2.0 : top + 2.0 + room;
    number.align = TextAlign::kLeft;
    number.angle = 90.0;
  }
  if (room < width - 1.0 || width > 0.75 * size) {
    page.Text(number);
  }
}

void DrawIouName(FigureSheet& sheet, const std::string& name, double x, double bottom, bool slanted,
                 bool bold) {
  const FigureTheme& theme = sheet.theme;
  FigureText text{name, {x, bottom + 4.0 + 0.5 * theme.small}, theme.small, theme.ink, TextAlign::kCenter,
                  bold};
  if (slanted) {
    text.anchor = {x + 0.3 * theme.small, bottom + 4.0 + 0.3 * theme.small};
    text.align = TextAlign::kRight;
    text.angle = kSlant;
  }
  sheet.page.Text(text);
}

void DrawIouBars(FigureSheet& sheet, const PlotArea& plot, const IouFigure& figure, bool slanted) {
  const double slot = plot.area.width / IouSlots(figure);
  const auto series = static_cast<double>(figure.series.size());
  const double bar = slot * 0.8 / series;
  for (std::size_t i = 0; i <= figure.objects.size(); ++i) {
    const bool mean = i == figure.objects.size();
    const double middle = plot.area.x + (static_cast<double>(i) + 0.5 + (mean ? kMeanGap : 0.0)) * slot;
    for (std::size_t k = 0; k < figure.series.size(); ++k) {
      const double left = middle + (static_cast<double>(k) - 0.5 * series) * bar;
      const std::optional<double> value =
          mean ? MeanOverAll(figure, figure.series[k]) : figure.series[k].values[i];
      DrawIouBar(sheet, plot, left + 0.04 * bar, 0.92 * bar, value, LookOfSeries(k));
    }
    DrawIouName(sheet, mean ? MeanName(figure) : figure.objects[i], middle, plot.area.Bottom(), slanted,
                mean);
  }
  const double between = plot.area.x + (static_cast<double>(figure.objects.size()) + 0.5 * kMeanGap) * slot;
  sheet.page.Line({between, plot.area.y}, {between, plot.area.Bottom()},
                  {sheet.theme.muted, 0.6, {2.0, 2.0}});
}

}  // namespace

FigurePage DrawIou(const IouFigure& figure, const FigureOptions& options) {
  ThrowIf<UsageError>(figure.objects.empty() || figure.series.empty(),
                      "no object to draw, expected at least one");
  for (const IouFigure::Series& series : figure.series) {
    ThrowIf<UsageError>(series.values.size() != figure.objects.size(), "{}: {} values, expected {}",
                        series.name, series.values.size(), figure.objects.size());
  }
  const bool wide = IouSlots(figure) * static_cast<double>(figure.series.size()) > 14.0;
  FigureSheet sheet = MakeChartSheet(options, wide ? kTextWidth : kColumnWidth, "3D IoU of objects",
                                     IouLegend(figure), kIouGap, [&](double width, const FigureTheme& theme) {
                                       return 120.0 + MeasureNames(figure, width, theme).height;
                                     });
  const NameRoom names = MeasureNames(figure, sheet.area.width, sheet.theme);
  PlotArea plot{sheet.area, {0.0, 1.0, 1.0}, {0.0, 1.0, 0.5}};
  plot.area.height -= names.height;
  plot.y.step = plot.area.height > 70.0 ? 0.2 : 0.5;
  const double left = std::max(YAxisWidth(plot.y, sheet.theme) + 2.0, names.left);
  plot.area.x += left;
  plot.area.width -= left;
  ThrowIf<UsageError>(plot.area.height < 20.0 || plot.area.width / IouSlots(figure) < 3.0,
                      "the figure is too small for its bars, expected a larger size");
  DrawYAxis(sheet, plot, "3D IoU");
  DrawIouBars(sheet, plot, figure, names.slanted);
  sheet.page.Line({plot.area.x, plot.area.Bottom()}, {plot.area.Right(), plot.area.Bottom()},
                  sheet.theme.Axis());
  return std::move(sheet.page);
}

namespace {

struct IouOptions {
  std::string objects = "found";
  void VisitFields(auto&& visit) {
    visit("--objects NAME", "Objects that get a bar", objects, OptionWords{"found", "scored", "all"});
  }
};

struct IouScores {
  std::string ground_truth;
  std::vector<ObjectScore> objects;  // by ground-truth number
};

IouScores ReadScores(const std::filesystem::path& path) {
  try {
    const auto eval = ReadJsonFile(path, "an eval.json");
    ThrowIf<InputError>(!eval.contains("objects"),
                        "{}: has no objects, expected an evaluation against objects_gt.json", path.string());
    return {eval.at("ground_truth").get<std::string>(), ScoresIn(eval)};
  } catch (const nlohmann::json::exception& error) {
    throw InputError("{}: expected an eval.json as sqslam eval writes it ({})", path.string(), error.what());
  }
}

std::vector<IouScores> ReadAllScores(const std::vector<std::string>& results) {
  std::vector<IouScores> all;
  for (const std::string& result : results) {
    const std::filesystem::path path = ResultFile(result, "eval.json");
    ThrowIf<InputError>(!std::filesystem::exists(path),
                        "{}: does not exist; run sqslam eval RESULT --ground-truth SEQUENCE first",
                        path.string());
    all.push_back(ReadScores(path));
    ThrowIf<InputError>(all.back().objects.size() != all.front().objects.size() ||
                            all.back().ground_truth != all.front().ground_truth,
                        "{}: evaluated against {}, expected {} as for {}", path.string(),
                        all.back().ground_truth, all.front().ground_truth, results.front());
  }
  return all;
}

// Returns the names of the objects to show by ground-truth number, which is appended to names that are not
// unique.
std::map<int, std::string> ShownObjects(const std::vector<IouScores>& all, const std::string& which) {
  std::map<int, bool> found;  // by any of the results
  for (const IouScores& scores : all) {
    for (const ObjectScore& object : scores.objects) {
      found[object.id] |= object.found;
    }
  }
  std::map<std::string, int> uses;
  for (const ObjectScore& object : all.front().objects) {
    ++uses[object.name];
  }
  std::map<int, std::string> shown;
  for (const ObjectScore& object : all.front().objects) {
    if (which == "all" || (which == "scored" ? object.scored : found[object.id])) {
      const std::string name = ReadableLabel(object.name);
      shown[object.id] = uses[object.name] > 1 ? fmt::format("{} {}", name, object.id) : name;
    }
  }
  return shown;
}

FigurePage DrawIouOf(const FigureRequest& request, const IouOptions& options) {
  const std::vector<std::string> names = ResultNames(request);
  const std::vector<IouScores> all = ReadAllScores(request.results);
  const std::map<int, std::string> shown = ShownObjects(all, options.objects);
  ThrowIf<InputError>(shown.empty(), "{}: no object to show, expected one that was found (or --objects all)",
                      fmt::join(request.results, ", "));
  IouFigure figure;
  for (const auto& [id, name] : shown) {
    figure.objects.push_back(name);
  }
  figure.not_shown = options.objects == "found" ? all.front().objects.size() - shown.size() : 0;
  const bool unnamed = all.size() == 1 && request.names.empty();
  for (std::size_t i = 0; i < all.size(); ++i) {
    IouFigure::Series series{unnamed ? "superquadrics" : names[i], {}};
    for (const auto& [id, name] : shown) {
      const auto score = std::ranges::find(all[i].objects, id, &ObjectScore::id);
      const bool found = score != all[i].objects.end() && score->found;
      series.values.push_back(found ? std::optional(score->iou) : std::nullopt);
    }
    figure.series.push_back(std::move(series));
  }
  return DrawIou(figure, request.page);
}

}  // namespace

FigureEntry IouEntry() {
  return FigureEntry{.name = "iou",
                     .help = "3D IoU of each object, and the means, of one or more results",
                     .details = R"(
A bar for each ground-truth object, from the eval.json that sqslam eval writes. Several results must be evaluated
against one ground truth. At the right: the means over all objects, also those without a bar; an object that was
not found counts 0. The legend adds the means over the objects found. --objects selects the objects with a bar:
found in at least one of the results (the default), scored (those whose ground truth fixes the shape; the means
are then over these), or all. To compare superquadrics with ellipsoids, run the sequence again with
--representation ellipsoid and give both results.

Examples:
  sqslam figure iou out/desk -o iou.pdf
  sqslam figure iou out/sq out/ellipsoid --name superquadrics --name ellipsoids -o iou.png --width-mm 180
)",
                     .results_help = "Result folders that hold eval.json, or such files",
                     .several = true}
      .DrawnBy(DrawIouOf);
}

}  // namespace sqslam
