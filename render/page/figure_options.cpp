#include "render/page/figure_options.h"

#include <algorithm>
#include <cmath>

#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;
constexpr double kUsualDpi = 300.0;
constexpr double kSheetMargin = 4.0;  // points

Eigen::Vector3d Mix(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double share_of_b) {
  return (1.0 - share_of_b) * a + share_of_b * b;
}

// Size of the page in points; the height only if the options give one.
struct FigureSize {
  double width = 0.0;
  double dpi = 300.0;
  std::optional<double> height;
};

FigureSize ResolveSize(const FigureOptions& options, double own_width) {
  CheckFigureOptions(options);
  FigureSize size;
  if (options.width_px) {
    size.dpi = options.dpi.value_or(*options.width_px * 72.0 / own_width);
    size.width = *options.width_px * 72.0 / size.dpi;
    size.height = *options.height_px * 72.0 / size.dpi;
    return size;
  }
  size.dpi = options.dpi.value_or(kUsualDpi);
  size.width = options.width_mm ? *options.width_mm * kPointsPerMm : own_width;
  if (options.height_mm) {
    size.height = *options.height_mm * kPointsPerMm;
  }
  return size;
}

}  // namespace

void CheckFigureOptions(const FigureOptions& options) {
  CheckStyle(options.style);
  ThrowIf<UsageError>(options.width_px.has_value() != options.height_px.has_value(),
                      "a figure's size in pixels: expected width and height");
  ThrowIf<UsageError>(options.width_px && (options.width_mm || options.height_mm),
                      "a figure's size: expected pixels or millimetres, not both");
  const auto outside = [](const auto& value, double low, double high) {
    return value && !(*value >= low && *value <= high);
  };
  if (outside(options.width_px, 16, 16384) || outside(options.height_px, 16, 16384)) {
    throw UsageError("a figure of {}x{} pixels: expected sides from 16 to 16384", *options.width_px,
                     *options.height_px);
  }
  ThrowIf<UsageError>(outside(options.width_mm, 10.0, 2000.0) || outside(options.height_mm, 10.0, 2000.0),
                      "a figure's size: expected 10 to 2000 mm");
  if (outside(options.dpi, 20.0, 2400.0)) {
    throw UsageError("{} dots per inch: expected 20 to 2400", *options.dpi);
  }
  ThrowIf<UsageError>(!(options.font_size >= 2.0 && options.font_size <= 72.0),
                      "a font of {} points: expected 2 to 72", options.font_size);
}

FigureTheme::FigureTheme(const FigureOptions& options)
    : background(ParseColor(options.style.background)),
      ink(ParseColor(options.style.text.color)),
      muted(Mix(ink, background, 0.35)),
      faint(Mix(ink, background, 0.87)),
      font(options.font_size),
      small(0.875 * options.font_size),
      title(1.2 * options.font_size) {}

FigureSheet MakeSheet(const FigureOptions& options, double own_width, const std::string& description,
                      const std::function<double(double, const FigureTheme&)>& own_height) {
  const FigureSize size = ResolveSize(options, own_width);
  FigureSheet sheet{{}, {}, FigureTheme(options)};
  const double top = kSheetMargin + (options.title.empty() ? 0.0 : 2.0 * sheet.theme.title);
  const double width = size.width - 2.0 * kSheetMargin;
  const double height = size.height ? *size.height : own_height(width, sheet.theme) + top + kSheetMargin;
  FigurePage& page = sheet.page;
  page.width = size.width;
  page.height = height;
  page.dpi = size.dpi;
  page.title = options.title.empty() ? description : options.title;
  if (!options.transparent) {
    page.background = sheet.theme.background;
  }
  sheet.area = {kSheetMargin, top, width, height - top - kSheetMargin};
  ThrowIf<UsageError>(sheet.area.width < 20.0 || sheet.area.height < 20.0,
                      "a figure of {:.0f}x{:.0f} mm has no room for letters of {} points: expected a larger "
                      "size, fewer dots per inch or a smaller font",
                      size.width / kPointsPerMm, height / kPointsPerMm, options.font_size);
  if (!options.title.empty()) {
    page.Text(FittingText(options.title, sheet.theme.title, sheet.area.width, true),
              {0.5 * size.width, kSheetMargin + 0.75 * sheet.theme.title}, sheet.theme.title, sheet.theme.ink,
              TextAlign::kCenter, true);
  }
  return sheet;
}

PanelGrid PanelGrid::Of(int columns, int rows, double width, double left) {
  PanelGrid grid{columns, rows};
  grid.left = left;
  grid.width = (width - left - grid.gap * (columns - 1)) / columns;
  return grid;
}

FigureRect PanelGrid::ImageAt(const FigureRect& area, int row, int column) const {
  return {area.x + left + column * (width + gap),
          area.y + top + row * (ImageWithGap() + height + texts + gap), width, image};
}

FigureRect PanelGrid::PanelAt(const FigureRect& area, int row, int column) const {
  const FigureRect above = ImageAt(area, row, column);
  return {above.x, above.y + ImageWithGap(), width, height};
}

void NameColumn(FigureSheet& sheet, const PanelGrid& grid, int column, const std::string& name) {
  const FigureRect panel = grid.PanelAt(sheet.area, 0, column);
  sheet.page.Label(name, {panel.Center().x(), sheet.area.y + 0.6 * sheet.theme.font}, sheet.theme.font,
                   sheet.theme.ink, panel.width);
}

void NameRow(FigureSheet& sheet, const PanelGrid& grid, int row, const std::string& name) {
  const FigureRect panel = grid.PanelAt(sheet.area, row, 0);
  sheet.page.Label(name, {sheet.area.x + 0.6 * sheet.theme.font, panel.Center().y()}, sheet.theme.font,
                   sheet.theme.ink, panel.height, 90.0);
}

PictureOptions PanelOptions(const FigureOptions& options, double dpi, double width, double height,
                            const std::map<std::string, Eigen::Vector3d>& colors) {
  ThrowIf<UsageError>(std::max(width, height) * dpi / 72.0 > kMaxPictureSide,
                      "a picture of {:.0f}x{:.0f} pixels in the figure: expected at most {} a side, by fewer "
                      "dots per inch or a smaller size",
                      width * dpi / 72.0, height * dpi / 72.0, kMaxPictureSide);
  PictureOptions picture;
  picture.camera = options.camera;
  picture.width = std::max(16, static_cast<int>(std::lround(width * dpi / 72.0)));
  picture.height = std::max(16, static_cast<int>(std::lround(height * dpi / 72.0)));
  picture.transparent = options.transparent;
  picture.backend = options.backend;
  picture.style = options.style;
  picture.style.text.legend = false;
  picture.style.text.scale = false;
  picture.style.objects.labels = false;
  picture.label_colors = colors;
  return picture;
}

void PlacePanel(FigurePage& page, const cv::Mat& picture, const FigureRect& area) {
  const double pixel = 72.0 / page.dpi;
  page.Image(picture, {std::round(area.x / pixel) * pixel, std::round(area.y / pixel) * pixel,
                       picture.cols * pixel, picture.rows * pixel});
}

}  // namespace sqslam
