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

}  // namespace

void CheckFigureOptions(const FigureOptions& options) {
  CheckStyle(options.style);
  ThrowIf<UsageError>(options.pixels && (options.width_mm || options.height_mm),
                      "a figure's size: expected pixels or millimetres, not both");
  const auto outside = [](const std::optional<double>& value, double low, double high) {
    return value && !(*value >= low && *value <= high);
  };
  if (options.pixels) {
    const auto [width, height] = *options.pixels;
    ThrowIf<UsageError>(outside(width, 16, 16384) || outside(height, 16, 16384),
                        "a figure of {}x{} pixels: expected sides from 16 to 16384", width, height);
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
  CheckFigureOptions(options);
  FigureSheet sheet{{}, {}, FigureTheme(options)};
  FigurePage& page = sheet.page;
  page.dpi = options.dpi.value_or(options.pixels ? (*options.pixels)[0] * 72.0 / own_width : kUsualDpi);
  page.width = options.pixels     ? (*options.pixels)[0] * 72.0 / page.dpi
               : options.width_mm ? *options.width_mm * kPointsPerMm
                                  : own_width;
  const double top = kSheetMargin + (options.title.empty() ? 0.0 : 2.0 * sheet.theme.title);
  const double width = page.width - 2.0 * kSheetMargin;
  page.height = options.pixels      ? (*options.pixels)[1] * 72.0 / page.dpi
                : options.height_mm ? *options.height_mm * kPointsPerMm
                                    : own_height(width, sheet.theme) + top + kSheetMargin;
  page.title = options.title.empty() ? description : options.title;
  if (!options.transparent) {
    page.background = sheet.theme.background;
  }
  sheet.area = {kSheetMargin, top, width, page.height - top - kSheetMargin};
  ThrowIf<UsageError>(sheet.area.width < 20.0 || sheet.area.height < 20.0,
                      "a figure of {:.0f}x{:.0f} mm has no room for letters of {} points: expected a larger "
                      "size, fewer dots per inch or a smaller font",
                      page.width / kPointsPerMm, page.height / kPointsPerMm, options.font_size);
  if (!options.title.empty()) {
    page.Text(FittingText(options.title, sheet.theme.title, sheet.area.width, true),
              {0.5 * page.width, kSheetMargin + 0.75 * sheet.theme.title}, sheet.theme.title, sheet.theme.ink,
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

PanelSheet MakePanelSheet(const FigureOptions& options, double own_width, const std::string& description,
                          const std::function<PanelGrid(double, const FigureTheme&)>& lay_out) {
  PanelSheet sheet{
      MakeSheet(options, own_width, description,
                [&](double width, const FigureTheme& theme) { return lay_out(width, theme).Height(); }),
      {}};
  sheet.grid = lay_out(sheet.area.width, sheet.theme);
  PanelGrid& grid = sheet.grid;
  const double spare = (sheet.area.height - grid.Height()) / grid.rows;  // negative: missing
  const double of_images = spare > 0.0 && !grid.images_grow ? 0.0 : grid.image / (grid.image + grid.height);
  grid.image += of_images * spare;
  grid.height += (1.0 - of_images) * spare;
  ThrowIf<UsageError>(grid.height < 10.0, "the figure is too low for its panels, expected a larger height");
  return sheet;
}

FigureRect PanelSheet::ImageAt(int row, int column) const {
  return {area.x + grid.left + column * (grid.width + grid.gap),
          area.y + grid.top + row * (grid.RowHeight() + grid.gap), grid.width, grid.image};
}

FigureRect PanelSheet::PanelAt(int row, int column) const {
  const FigureRect above = ImageAt(row, column);
  return {above.x, above.y + (grid.image > 0.0 ? grid.image + grid.gap : 0.0), grid.width, grid.height};
}

void PanelSheet::NameColumn(int column, const std::string& name) {
  const FigureRect panel = PanelAt(0, column);
  page.Label(name, {panel.Center().x(), area.y + 0.6 * theme.font}, theme.font, theme.ink, panel.width);
}

void PanelSheet::NameRow(int row, const std::string& name) {
  const FigureRect panel = PanelAt(row, 0);
  FigureText text{
      name, {area.x + 0.6 * theme.font, panel.Center().y()}, theme.font, theme.ink, TextAlign::kCenter};
  text.angle = 90.0;
  page.Text(NarrowText(text, panel.height));
}

PictureOptions PanelOptions(const FigureOptions& options, const PanelSheet& sheet) {
  const double width = sheet.grid.width * sheet.page.dpi / 72.0;
  const double height = sheet.grid.height * sheet.page.dpi / 72.0;
  ThrowIf<UsageError>(std::max(width, height) > kMaxPictureSide,
                      "a picture of {:.0f}x{:.0f} pixels in the figure: expected at most {} a side, by fewer "
                      "dots per inch or a smaller size",
                      width, height, kMaxPictureSide);
  PictureOptions picture;
  picture.camera = options.camera;
  picture.width = std::max(16, static_cast<int>(std::lround(width)));
  picture.height = std::max(16, static_cast<int>(std::lround(height)));
  picture.transparent = options.transparent;
  picture.backend = options.backend;
  picture.style = options.style;
  picture.style.text.legend = false;
  picture.style.text.scale = false;
  picture.style.objects.labels = false;
  return picture;
}

void PlacePanel(FigurePage& page, const cv::Mat& picture, const FigureRect& area) {
  const double pixel = 72.0 / page.dpi;
  page.Image(picture, {std::round(area.x / pixel) * pixel, std::round(area.y / pixel) * pixel,
                       picture.cols * pixel, picture.rows * pixel});
}

}  // namespace sqslam
