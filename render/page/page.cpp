#include "render/page/page.h"

#include <cmath>

namespace sqslam {

void FigurePage::Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const FigureStroke& stroke) {
  Polyline({from, to}, stroke);
}

void FigurePage::Polyline(std::vector<Eigen::Vector2d> points, const FigureStroke& stroke) {
  FigurePath path;
  path.points = std::move(points);
  path.stroke = stroke;
  elements.emplace_back(std::move(path));
}

void FigurePage::Rect(const FigureRect& rect, const std::optional<Eigen::Vector3d>& fill,
                      const std::optional<FigureStroke>& stroke) {
  FigurePath path;
  path.points = {
      {rect.x, rect.y}, {rect.Right(), rect.y}, {rect.Right(), rect.Bottom()}, {rect.x, rect.Bottom()}};
  path.closed = true;
  path.fill = fill;
  path.stroke = stroke;
  elements.emplace_back(std::move(path));
}

std::string FittingText(const std::string& text, double size, double width, bool bold) {
  std::string fitting = text;
  std::string shown = text;
  while (!fitting.empty() && TextWidth(shown, size, bold) > width) {
    do {  // a whole character of UTF-8
      const bool continuation = (static_cast<unsigned char>(fitting.back()) & 0xc0u) == 0x80u;
      fitting.pop_back();
      if (!continuation) {
        break;
      }
    } while (!fitting.empty());
    shown = fitting + "…";
  }
  return shown;
}

FigureRect OnPixels(const FigureRect& rect, double dpi) {
  const double pixel = 72.0 / dpi;
  const auto whole = [pixel](double length) { return std::round(length / pixel) * pixel; };
  const double x = whole(rect.x);
  const double y = whole(rect.y);
  return {x, y, std::max(whole(rect.Right()) - x, pixel), std::max(whole(rect.Bottom()) - y, pixel)};
}

}  // namespace sqslam
