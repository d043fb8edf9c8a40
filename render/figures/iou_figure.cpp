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

constexpr double kIouGap = 6.0;
constexpr double kSlant = 40.0;  // degrees; slant of names that do not fit side by side

void CheckIou(const IouFigure& figure) {
  ThrowIf<UsageError>(figure.objects.empty() || figure.series.empty(),
                      "no object to draw, expected at least one");
  for (const IouFigure::Series& series : figure.series) {
    ThrowIf<UsageError>(series.values.size() != figure.objects.size(), "{}: {} values, expected {}",
                        series.name, series.values.size(), figure.objects.size());
  }
}

std::size_t AllObjects(const IouFigure& figure) { return figure.objects.size() + figure.not_shown; }

// Means as defined by `sqslam eval`.
struct SeriesMeans {
  double all = 0.0;  // missed objects count 0
  double of_found = 0.0;
  std::size_t found = 0;
};
SeriesMeans MeansOf(const IouFigure& figure, const IouFigure::Series& series) {
  SeriesMeans means;
  double sum = 0.0;
  for (const std::optional<double>& value : series.values) {
    sum += value.value_or(0.0);
    means.found += value ? 1 : 0;
  }
  means.all = sum / static_cast<double>(AllObjects(figure));
  means.of_found = sum / static_cast<double>(std::max<std::size_t>(means.found, 1));
  return means;
}

std::string MeansText(const IouFigure& figure, const IouFigure::Series& series) {
  const SeriesMeans means = MeansOf(figure, series);
  const std::string found =
      means.found > 0 ? fmt::format("{} found: {:.2f}", means.found, means.of_found) : "none found";
  return fmt::format("{}: mean {:.2f} of {}, {}", series.name, means.all, AllObjects(figure), found);
}

bool AnyMissed(const IouFigure& figure) {
  return std::ranges::any_of(figure.series, [](const IouFigure::Series& series) {
    return std::ranges::any_of(series.values, [](const auto& v) { return !v; });
  });
}

std::vector<LegendEntry> IouLegend(const IouFigure& figure, const FigureTheme& theme) {
  std::vector<LegendEntry> entries;
  for (std::size_t i = 0; i < figure.series.size(); ++i) {
    entries.push_back(LegendEntry::Bar(MeansText(figure, figure.series[i]), LookOfSeries(i)));
  }
  if (AnyMissed(figure)) {
    entries.push_back(LegendEntry::OfMark("not found", {Mark::Shape::kCross, 5.0, theme.muted}));
  }
  return entries;
}

struct NameRoom {
  bool slanted = false;
  double height = 0.0;  // points below the plot
  double left = 0.0;    // points by which the first name extends beyond its slot
};

std::string MeanName(const IouFigure& figure) { return fmt::format("mean of {}", AllObjects(figure)); }

NameRoom MeasureNames(const IouFigure& figure, double slot, const FigureTheme& theme) {
  const double widest = Largest(figure.objects, TextWidth(MeanName(figure), theme.small, true),
                                [&](const std::string& name) { return TextWidth(name, theme.small); });
  NameRoom names;
  names.slanted = widest > slot - 3.0;
  const double angle = kSlant * kRadiansPerDegree;
  names.height = names.slanted ? 4.0 + widest * std::sin(angle) + theme.small : 4.0 + 1.3 * theme.small;
  names.left = names.slanted ? TextWidth(figure.objects.front(), theme.small) * std::cos(angle) : 0.0;
  return names;
}

// One slot per object and one for the means, after a gap.
constexpr double kMeanGap = 0.5;
double IouSlots(const IouFigure& figure) {
  return static_cast<double>(figure.objects.size()) + 1.0 + kMeanGap;
}

PlotArea UnitPlot(const FigureRect& area) {
  return {area, {0.0, 1.0, 1.0}, {0.0, 1.0, area.height > 70.0 ? 0.2 : 0.5}};
}

void DrawIouBar(FigurePage& page, const PlotArea& plot, double left, double width,
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
  FigureText number{text, {middle, top - 0.65 * size}, size, theme.ink, TextAlign::kCenter};
  number.halo = theme.background;  // over grid lines
  if (TextWidth(text, size) < width + 1.0) {
    page.Text(number);
  } else if (width > 0.75 * size) {
    const double room = TextWidth(text, size);
    const bool above = top - 2.0 - room > plot.area.y - kIouGap;  // otherwise it would overlap the legend
    number.anchor.y() = above ? top - 2.0 : top + 2.0 + room;
    number.align = TextAlign::kLeft;
    number.angle = 90.0;
    page.Text(number);
  }
}

void DrawIouName(FigurePage& page, const std::string& name, double x, double bottom, bool slanted, bool bold,
                 const FigureTheme& theme) {
  FigureText text{name, {x, bottom + 4.0 + 0.5 * theme.small}, theme.small, theme.ink, TextAlign::kCenter,
                  bold};
  if (slanted) {
    text.anchor = {x + 0.3 * theme.small, bottom + 4.0 + 0.3 * theme.small};
    text.align = TextAlign::kRight;
    text.angle = kSlant;
  }
  page.Text(text);
}

void DrawIouBars(FigurePage& page, const PlotArea& plot, const IouFigure& figure, const NameRoom& names,
                 const FigureTheme& theme) {
  const double slot = plot.area.width / IouSlots(figure);
  const auto series = static_cast<double>(figure.series.size());
  const double bar = slot * 0.8 / series;
  for (std::size_t i = 0; i <= figure.objects.size(); ++i) {
    const bool mean = i == figure.objects.size();
    const double middle = plot.area.x + (static_cast<double>(i) + 0.5 + (mean ? kMeanGap : 0.0)) * slot;
    for (std::size_t k = 0; k < figure.series.size(); ++k) {
      const double left = middle + (static_cast<double>(k) - 0.5 * series) * bar;
      const std::optional<double> value =
          mean ? MeansOf(figure, figure.series[k]).all : figure.series[k].values[i];
      DrawIouBar(page, plot, left + 0.04 * bar, 0.92 * bar, value, LookOfSeries(k), theme);
    }
    DrawIouName(page, mean ? MeanName(figure) : figure.objects[i], middle, plot.area.Bottom(), names.slanted,
                mean, theme);
  }
  const double between = plot.area.x + (static_cast<double>(figure.objects.size()) + 0.5 * kMeanGap) * slot;
  page.Line({between, plot.area.y}, {between, plot.area.Bottom()}, {theme.muted, 0.6, {2.0, 2.0}});
}

}  // namespace

FigurePage DrawIou(const IouFigure& figure, const FigureOptions& options) {
  CheckIou(figure);
  const bool many = IouSlots(figure) * static_cast<double>(figure.series.size()) > 14.0;
  const auto slot_width = [&](double width) { return (width - 30.0) / IouSlots(figure); };
  FigureSheet sheet = MakeSheet(options, many ? kTextWidth : kColumnWidth, "3D IoU of objects",
                                [&](double width, const FigureTheme& theme) {
                                  return LegendHeight(IouLegend(figure, theme), width, theme) + kIouGap +
                                         120.0 + MeasureNames(figure, slot_width(width), theme).height;
                                });
  const FigureTheme& theme = sheet.theme;
  const FigureRect& area = sheet.area;
  const std::vector<LegendEntry> entries = IouLegend(figure, theme);
  const double legend = LegendHeight(entries, area.width, theme);
  const NameRoom names = MeasureNames(figure, slot_width(area.width), theme);
  FigureRect plot_area{area.x, area.y + legend + kIouGap, area.width,
                       area.height - legend - kIouGap - names.height};
  const double left =
      std::max(YAxisWidth(UnitPlot(plot_area).y, theme) + 2.0, names.left - 0.5 * slot_width(area.width));
  plot_area.x += left;
  plot_area.width -= left;
  ThrowIf<UsageError>(plot_area.height < 20.0 || plot_area.width / IouSlots(figure) < 3.0,
                      "the figure is too small for its bars, expected a larger size");
  DrawLegend(sheet.page, entries, {area.x, area.y, area.width, legend}, theme);
  const PlotArea plot = UnitPlot(plot_area);
  DrawYAxis(sheet.page, plot, "3D IoU", theme);
  DrawIouBars(sheet.page, plot, figure, names, theme);
  sheet.page.Line({plot_area.x, plot_area.Bottom()}, {plot_area.Right(), plot_area.Bottom()}, theme.Axis());
  return std::move(sheet.page);
}

namespace {

struct IouOptions {
  std::string objects = "found";
  bool ellipsoids = false;
  void VisitFields(auto&& visit) {
    visit("--objects NAME", "Objects that get a bar", objects, {"found", "scored", "all"});
    visit("--ellipsoids", "Also as ellipsoids", ellipsoids);
  }
};

struct IouScores {
  std::string ground_truth;
  std::vector<ObjectScore> objects;  // by ground-truth number
};

IouScores ReadScores(const std::filesystem::path& path) {
  try {
    const auto eval = ReadJsonFile<nlohmann::json>(path, "an eval.json");
    ThrowIf<InputError>(!eval.contains("objects"),
                        "{}: knows no objects, expected an evaluation against objects_gt.json",
                        path.string());
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
                        "{}: missing, expected sqslam eval RESULT --ground-truth SEQUENCE first",
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
    IouFigure::Series ellipsoids{all.size() == 1 ? "as ellipsoids" : names[i] + " as ellipsoids", {}};
    for (const auto& [id, name] : shown) {
      const auto score = std::ranges::find(all[i].objects, id, &ObjectScore::id);
      const bool found = score != all[i].objects.end() && score->found;
      series.values.push_back(found ? std::optional(score->iou) : std::nullopt);
      ellipsoids.values.push_back(found ? std::optional(score->iou_ellipsoid) : std::nullopt);
    }
    figure.series.push_back(std::move(series));
    if (options.ellipsoids) {
      figure.series.push_back(std::move(ellipsoids));
    }
  }
  return DrawIou(figure, request.page);
}

}  // namespace

FigureEntry IouEntry() {
  return {.name = "iou",
          .help = "3D IoU of each object, and the means, of one or more results",
          .details = R"(
From the eval.json of results held against one ground truth (sqslam eval writes it): a bar for each ground-truth
object, and at the right the means over all objects, also those without a bar, one that was not found counting
0, as the legend says beside the means over those found: the numbers that sqslam eval prints. --objects says
which get a bar: found (in at least one of the results; the default), scored (those whose ground truth fixes the
shape; the means are theirs then), all. --ellipsoids adds each result's objects with both exponents set to 1, in the same place and size.

Examples:
  sqslam figure iou out/desk -o iou.pdf
  sqslam figure iou out/desk --ellipsoids -o shape.pdf
  sqslam figure iou out/sq out/quadric --name superquadrics --name quadrics -o iou.png --width-mm 180
)",
          .results_help = "Result folders that hold eval.json, or such files",
          .several = true,
          .names_help = kNameInLegend,
          .make = FigureEntry::Maker(DrawIouOf)};
}

}  // namespace sqslam
