#include "render/page/page.h"

#include <algorithm>

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

FigureText PlainText(std::string text, const Eigen::Vector2d& anchor, double size,
                     const Eigen::Vector3d& color, TextAlign align, bool bold) {
  return {std::move(text), anchor, size, color, align, bold};
}

FigureText NarrowText(FigureText text, double width) {
  constexpr double kLeastShare = 0.6;  // of the letters' size
  const double wide = TextWidth(text.text, text.size, text.bold);
  text.size *= wide > width ? std::max(kLeastShare, 0.99 * width / wide) : 1.0;
  text.text = FittingText(text.text, text.size, width, text.bold);
  return text;
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

}  // namespace sqslam
