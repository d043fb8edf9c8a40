#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace sqslam {

// A figure as a value: what stands where on one page. Lengths are points (1/72 inch), the origin is the
// top-left corner, y points down; colours are red, green, blue in [0, 1]. The same page becomes a PNG, an SVG
// or a PDF.
struct FigureRect {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;

  double Right() const { return x + width; }
  double Bottom() const { return y + height; }
  Eigen::Vector2d Center() const { return {x + 0.5 * width, y + 0.5 * height}; }
  // The largest of these proportions in the middle.
  FigureRect Fitted(double across, double down) const {
    const double scale = std::min(width / across, height / down);
    return {x + 0.5 * (width - scale * across), y + 0.5 * (height - scale * down), scale * across,
            scale * down};
  }
  bool Contains(const FigureRect& other) const {
    constexpr double kSlack = 1e-6;
    return other.x >= x - kSlack && other.y >= y - kSlack && other.Right() <= Right() + kSlack &&
           other.Bottom() <= Bottom() + kSlack;
  }
};

struct FigureStroke {
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  double width = 0.75;
  std::vector<double> dash;  // lengths of dash, gap, dash, ...; empty: solid
};

struct FigurePath {
  std::vector<Eigen::Vector2d> points;
  bool closed = false;
  std::optional<Eigen::Vector3d> fill;
  double fill_opacity = 1.0;
  std::optional<FigureStroke> stroke{};
};

enum class TextAlign { kLeft, kCenter, kRight };

// One line of text in DejaVu Sans. The anchor lies at half the height of the capitals.
struct FigureText {
  std::string text;  // UTF-8
  Eigen::Vector2d anchor = Eigen::Vector2d::Zero();
  double size = 8.0;  // of the font's em square
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  TextAlign align = TextAlign::kLeft;
  bool bold = false;
  double angle = 0.0;                     // degrees, counter-clockwise about the anchor
  std::optional<Eigen::Vector3d> halo{};  // a soft edge, for text over a picture

  // Shares of the size: the baseline below the anchor (half the height of DejaVu's capitals), and the halo's
  // width on each side.
  static constexpr double kBaselineBelowAnchor = 0.3645;
  static constexpr double kHaloWidth = 0.12;
};

// 8UC3 (BGR) or 8UC4 (BGRA, straight alpha), stretched over the area.
struct FigureImage {
  cv::Mat image;
  FigureRect area;
};

using FigureElement = std::variant<FigurePath, FigureText, FigureImage>;

struct FigurePage {
  double width = 0.0;
  double height = 0.0;
  double dpi = 300.0;                         // of the PNG, and of the pictures in it
  std::optional<Eigen::Vector3d> background;  // none: transparent
  std::string title;                          // for the file's own description; not drawn
  std::vector<FigureElement> elements;        // in drawing order

  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const FigureStroke& stroke);
  void Polyline(std::vector<Eigen::Vector2d> points, const FigureStroke& stroke);
  void Rect(const FigureRect& rect, const std::optional<Eigen::Vector3d>& fill,
            const std::optional<FigureStroke>& stroke = std::nullopt);
  void Cross(const Eigen::Vector2d& center, double size, const FigureStroke& stroke);  // lying, as an x
  void Text(FigureText text) { elements.emplace_back(std::move(text)); }
  void Text(std::string text, const Eigen::Vector2d& anchor, double size, const Eigen::Vector3d& color,
            TextAlign align = TextAlign::kLeft, bool bold = false) {
    elements.emplace_back(FigureText{std::move(text), anchor, size, color, align, bold});
  }
  // Text around its anchor, no wider than `room` (NarrowText).
  void Label(std::string text, const Eigen::Vector2d& anchor, double size, const Eigen::Vector3d& color,
             double room, double angle = 0.0);
  void Image(const cv::Mat& image, const FigureRect& area) {
    elements.emplace_back(FigureImage{image, area});
  }
};

// A line that is no wider than `width`: in smaller letters where needed, and cut where these would be too
// small.
FigureText NarrowText(FigureText text, double width);

// Width of a line of text as it is drawn, points.
double TextWidth(const std::string& text, double size, bool bold = false);

// The text cut at its end, with an ellipsis, until it is no wider than `width`.
std::string FittingText(const std::string& text, double size, double width, bool bold = false);

// The text in lines that are no wider than `width`, broken at blanks; a longer word has a line of its own.
std::vector<std::string> WrappedText(const std::string& text, double size, double width);

// Throws UsageError unless the name ends in .png, .svg or .pdf: to be asked before any work is done.
void CheckFigurePath(const std::filesystem::path& path);

// The page in the format of the extension: a PNG that carries its density (dots per inch), or SVG and PDF
// with lines and texts as such. The same page gives the same bytes. Throws UsageError for another extension
// and sizes without sense, InputError where the file cannot be written.
std::string EncodeFigure(const FigurePage& page, const std::filesystem::path& path);
void WriteFigure(const FigurePage& page, const std::filesystem::path& path);

// A part of an HTML page; texts stay texts, pictures are embedded as PNG.
std::string SvgElement(const FigurePage& page);

}  // namespace sqslam
