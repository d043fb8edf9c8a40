#include "render/page/panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "slam/util/error.h"

namespace sqslam {

FigureText PlainText(std::string text, const Eigen::Vector2d& anchor, double size,
                     const Eigen::Vector3d& color, TextAlign align, bool bold) {
  FigureText plain;
  plain.text = std::move(text);
  plain.anchor = anchor;
  plain.size = size;
  plain.color = color;
  plain.align = align;
  plain.bold = bold;
  return plain;
}

FigureText NarrowText(FigureText text, double width) {
  constexpr double kLeastShare = 0.6;  // of the letters' size
  const double wide = TextWidth(text.text, text.size, text.bold);
  text.size *= wide > width ? std::max(kLeastShare, 0.99 * width / wide) : 1.0;
  text.text = FittingText(text.text, text.size, width, text.bold);
  return text;
}

PictureOptions PanelOptions(const FigureOptions& options, double dpi, double width, double height,
                            const std::map<std::string, Eigen::Vector3d>& colors) {
  if (std::max(width, height) * dpi / 72.0 > kMaxPictureSide) {
    throw UsageError(
        fmt::format("a picture of {:.0f}x{:.0f} pixels in the figure: expected at most {} a "
                    "side, by fewer dots per inch or a smaller size",
                    width * dpi / 72.0, height * dpi / 72.0, kMaxPictureSide));
  }
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
