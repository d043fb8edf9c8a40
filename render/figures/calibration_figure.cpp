#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "render/camera/scene_framing.h"
#include "render/figures/figures.h"
#include "render/page/chart.h"
#include "render/scene/color_scale.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

constexpr double kCalibrationGap = 14.0;  // points between panels
constexpr int kCells = 8;                 // of the coverage grid, along the longer side

std::vector<double> ErrorLengths(const Calibration& calibration) {
  std::vector<double> lengths;
  for (const CalibratedView& view : calibration.views) {
    std::ranges::transform(view.errors, std::back_inserter(lengths), [](const auto& e) { return e.norm(); });
  }
  return lengths;
}

void DrawPanelTitle(FigureSheet& sheet, const FigureRect& panel, const std::string& text) {
  const FigureTheme& theme = sheet.theme;
  sheet.page.Label(text, {panel.Center().x(), panel.y - theme.small}, theme.small, theme.ink, panel.width);
}

// Draws a line from each detected corner, which is a dot, towards where the model puts it; enlarged.
void DrawCornerErrors(FigureSheet& sheet, const Calibration& calibration, const FigureRect& panel) {
  auto& [page, area, theme] = sheet;
  constexpr double kReach = 0.045;  // length of a large error as drawn, of the image's width
  const double width = calibration.camera.width;
  const double points_per_pixel = panel.width / width;
  const double large = std::max(1e-3, LowerQuantile(ErrorLengths(calibration), 0.95));
  const double enlarged = std::max(1.0, RoundLength(kReach * width / large));
  page.Rect(panel, std::nullopt, theme.Axis());
  const Eigen::Vector3d blue = LookOfSeries(0).color;
  const auto at = [&](const Eigen::Vector2d& pixel) {
    return Eigen::Vector2d(std::clamp(panel.x + pixel.x() * points_per_pixel, panel.x, panel.Right()),
                           std::clamp(panel.y + pixel.y() * points_per_pixel, panel.y, panel.Bottom()));
  };
  for (const CalibratedView& view : calibration.views) {
    for (std::size_t i = 0; i < view.pixels.size(); ++i) {
      page.Line(at(view.pixels[i]), at(view.pixels[i] - enlarged * view.errors[i]), {blue, 0.5, {}});
      page.Polygon(at(view.pixels[i]), 32, 0.65, theme.ink);
    }
  }
  DrawPanelTitle(sheet, panel, fmt::format("from corner to model, {:g} times enlarged", enlarged));
  const double shown = RoundLength(0.25 * width / enlarged);  // px of error
  const double length = shown * enlarged * points_per_pixel;
  const double y = panel.Bottom() + 1.2 * theme.small;
  page.Line({panel.x, y}, {panel.x + length, y}, {blue, 1.0, {}});
  page.Text(fmt::format("{:g} px", shown), {panel.x + length + 4.0, y}, theme.small, theme.ink);
}

void DrawCoverage(FigureSheet& sheet, const Calibration& calibration, const FigureRect& panel) {
  auto& [page, area, theme] = sheet;
  const Camera& camera = calibration.camera;
  const double cell = static_cast<double>(std::max(camera.width, camera.height)) / kCells;
  const int columns = std::max(1, static_cast<int>(std::lround(camera.width / cell)));
  const int rows = std::max(1, static_cast<int>(std::lround(camera.height / cell)));
  std::vector<int> counts(static_cast<std::size_t>(columns * rows), 0);
  for (const CalibratedView& view : calibration.views) {
    for (const Eigen::Vector2d& pixel : view.pixels) {
      const int x = std::clamp(static_cast<int>(pixel.x() * columns / camera.width), 0, columns - 1);
      const int y = std::clamp(static_cast<int>(pixel.y() * rows / camera.height), 0, rows - 1);
      ++counts[static_cast<std::size_t>(y * columns + x)];
    }
  }
  const int largest = *std::ranges::max_element(counts);
  const Eigen::Vector2d size(panel.width / columns, panel.height / rows);
  for (int i = 0; i < columns * rows; ++i) {
    const int count = counts[static_cast<std::size_t>(i)];
    const FigureRect part{panel.x + i % columns * size.x(), panel.y + i / columns * size.y(), size.x(),
                          size.y()};
    const double share = static_cast<double>(count) / largest;
    page.Rect(part, count > 0 ? std::optional(Viridis(share)) : std::nullopt, theme.Grid());
    const Eigen::Vector3d ink =
        count > 0 ? Eigen::Vector3d(Eigen::Vector3d::Constant(share < 0.55 ? 1.0 : 0.0)) : theme.ink;
    page.Label(std::to_string(count), part.Center(), std::min(theme.small, 0.55 * size.y()), ink,
               0.9 * size.x());
  }
  page.Rect(panel, std::nullopt, theme.Axis());
  DrawPanelTitle(sheet, panel, "corners in each part of the image");
}

void DrawErrorHistogram(FigureSheet& sheet, const Calibration& calibration, const FigureRect& panel) {
  auto& [page, area, theme] = sheet;
  constexpr int kBins = 24;
  const std::vector<double> lengths = ErrorLengths(calibration);
  const double high = std::max(1e-3, *std::ranges::max_element(lengths));
  PlotArea plot;
  plot.x = RoundAxis(0.0, high, 4, true);
  std::vector<int> counts(kBins, 0);
  for (const double length : lengths) {
    ++counts[static_cast<std::size_t>(std::min(kBins - 1, static_cast<int>(length / plot.x.high * kBins)))];
  }
  plot.y = RoundAxis(0.0, *std::ranges::max_element(counts), 4, true);
  const double left = YAxisWidth(plot.y, theme);
  plot.area = {panel.x + left, panel.y,
               panel.width - left - 0.5 * TextWidth(plot.x.TickText(plot.x.high), theme.small), panel.height};
  DrawXAxis(sheet, plot, "error [px]");
  DrawYAxis(sheet, plot, "corners");
  const double width = plot.area.width / kBins;
  for (int i = 0; i < kBins; ++i) {
    const double top = plot.Y(counts[static_cast<std::size_t>(i)]);
    page.Rect({plot.area.x + (i + 0.06) * width, top, 0.88 * width, plot.area.Bottom() - top},
              LookOfSeries(0).color);
  }
  page.Line({plot.area.x, plot.area.Bottom()}, {plot.area.Right(), plot.area.Bottom()}, theme.Axis());
  const double x = plot.X(calibration.rms);
  page.Line({x, plot.area.y}, {x, plot.area.Bottom()}, {theme.ink, 0.9, {3.0, 2.0}});
  FigureText rms{fmt::format("RMS {:.2f} px", calibration.rms),
                 {x + 3.0, plot.area.y + theme.small},
                 theme.small,
                 theme.ink};
  rms.halo = theme.background;
  page.Text(rms);
  DrawPanelTitle(sheet, plot.area, "lengths of the errors");
}

}  // namespace

FigurePage DrawCalibration(const Calibration& calibration, const FigureOptions& options) {
  ThrowIf<UsageError>(ErrorLengths(calibration).empty(), "no corners to draw, expected at least one");
  const double aspect = static_cast<double>(calibration.camera.height) / calibration.camera.width;
  FigureSheet sheet =
      MakeSheet(options, kTextWidth, "Errors of a calibration", [&](double width, const FigureTheme& theme) {
        return (width - 2.0 * kCalibrationGap) / 3.0 * aspect + 2.0 * theme.small + XAxisHeight(theme);
      });
  const double above = 2.0 * sheet.theme.small;
  FigureRect panel{sheet.area.x, sheet.area.y + above, (sheet.area.width - 2.0 * kCalibrationGap) / 3.0, 0.0};
  panel.height = std::min(panel.width * aspect, sheet.area.height - above - XAxisHeight(sheet.theme));
  ThrowIf<UsageError>(panel.height < 30.0, "the figure is too small for its panels, expected a larger size");
  FigureRect image = panel;  // keeps the image's proportions
  image.width = panel.height / aspect;
  image.x += 0.5 * (panel.width - image.width);
  DrawCornerErrors(sheet, calibration, image);
  image.x += panel.width + kCalibrationGap;
  DrawCoverage(sheet, calibration, image);
  panel.x += 2.0 * (panel.width + kCalibrationGap);
  DrawErrorHistogram(sheet, calibration, panel);
  return std::move(sheet.page);
}

FigurePage DrawBoardSheet(const CalibrationBoard& board, double dpi) {
  constexpr double kPoint = 72.0 / 25.4;  // points per mm
  constexpr double kMargin = 8.0;         // mm; white border that printers and the detector need
  constexpr double kCaption = 7.0;        // mm
  constexpr double kShort = 210.0;        // mm, A4
  constexpr double kLong = 297.0;
  const double board_width = board.columns * board.square_mm;
  const double board_height = board.rows * board.square_mm;
  FigurePage page;
  page.width = board_width + 2.0 * kMargin;
  page.height = board_height + 2.0 * kMargin + kCaption;
  for (const auto& [width, height] : {std::pair(kShort, kLong), std::pair(kLong, kShort)}) {
    if (board_width + 2.0 * kMargin <= width && board_height + 2.0 * kMargin + kCaption <= height) {
      page.width = width;  // landscape if both fit
      page.height = height;
    }
  }
  const double x = 0.5 * (page.width - board_width);
  const double y = 0.5 * (page.height - board_height - kCaption);
  page.width *= kPoint;
  page.height *= kPoint;
  page.dpi = dpi;
  page.background = Eigen::Vector3d(1.0, 1.0, 1.0);
  page.title = BoardText(board) + ". Print at 100 %, glue it to something flat, and measure a square.";
  for (const auto& [area, black] : BoardAreas(board)) {
    page.Rect({kPoint * (x + area.x), kPoint * (y + area.y), kPoint * area.width, kPoint * area.height},
              black ? Eigen::Vector3d(0.0, 0.0, 0.0) : Eigen::Vector3d(1.0, 1.0, 1.0));
  }
  constexpr double kFont = 8.0;
  page.Label(page.title, {0.5 * page.width, kPoint * (y + board_height + kMargin)}, kFont, {0.35, 0.35, 0.35},
             page.width - 2.0 * kPoint * kMargin);
  return page;
}

}  // namespace sqslam
