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

// A figure as a value: the elements of one page, to be written as PNG, SVG or PDF. Lengths are points (1/72
// inch), the origin is the top-left corner, y points down; colours are RGB in [0, 1].
struct FigureRect {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;

  double Right() const { return x + width; }
  double Bottom() const { return y + height; }
  Eigen::Vector2d Center() const { return {x + 0.5 * width, y + 0.5 * height}; }
  // Returns the largest centred rectangle of these proportions.
  FigureRect Fitted(double across, double down) const {
    const double scale = std::min(width / across, height / down);
    return {x + 0.5 * (width - scale * across), y + 0.5 * (height - scale * down), scale * across,
            scale * down};
  }
  bool Contains(const FigureRect& other) const {
    constexpr double kRounding = 1e-6;
    return other.x >= x - kRounding && other.y >= y - kRounding && other.Right() <= Right() + kRounding &&
           other.Bottom() <= Bottom() + kRounding;
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

// One line of text in DejaVu Sans. The anchor lies at half the cap height.
struct FigureText {
  std::string text;  // UTF-8
  Eigen::Vector2d anchor = Eigen::Vector2d::Zero();
  double size = 8.0;  // of the font's em square
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  TextAlign align = TextAlign::kLeft;
  bool bold = false;
  double angle = 0.0;                     // degrees, counter-clockwise about the anchor
  std::optional<Eigen::Vector3d> halo{};  // outline, for text over a picture

  // Fractions of the size: the baseline below the anchor (half of DejaVu's cap height), and the halo's width
  // on each side.
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
  double dpi = 300.0;                         // of the PNG and of embedded pictures
  std::optional<Eigen::Vector3d> background;  // none: transparent
  std::string title;                          // for the file's metadata; not drawn
  std::vector<FigureElement> elements;        // in drawing order

  void Polyline(std::vector<Eigen::Vector2d> points, const FigureStroke& stroke) {
    elements.emplace_back(FigurePath{std::move(points), false, {}, 1.0, stroke});
  }
  void Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const FigureStroke& stroke) {
    Polyline({from, to}, stroke);
  }
  void Rect(const FigureRect& rect, const std::optional<Eigen::Vector3d>& fill,
            const std::optional<FigureStroke>& stroke = std::nullopt);
  // A regular polygon with a corner at the right; many corners make a disc.
  void Polygon(const Eigen::Vector2d& center, int corners, double radius,
               const std::optional<Eigen::Vector3d>& fill,
               const std::optional<FigureStroke>& stroke = std::nullopt);
  void Cross(const Eigen::Vector2d& center, double size, const FigureStroke& stroke);  // drawn as an x
  // Invalid UTF-8, as in file names, is shown as U+FFFD.
  void Text(FigureText text);
  void Text(std::string text, const Eigen::Vector2d& anchor, double size, const Eigen::Vector3d& color,
            TextAlign align = TextAlign::kLeft, bool bold = false) {
    Text(FigureText{std::move(text), anchor, size, color, align, bold});
  }
  // Adds text centred at its anchor, no wider than `room` (NarrowText).
  void Label(std::string text, const Eigen::Vector2d& anchor, double size, const Eigen::Vector3d& color,
             double room);
  void Image(const cv::Mat& image, const FigureRect& area) {
    elements.emplace_back(FigureImage{image, area});
  }
};

// Fits a line into `width`: reduces the font size, and cuts the text if that would become too small.
FigureText NarrowText(FigureText text, double width);

// The font of all texts on pages.
struct PageFont {
  std::string family = "DejaVu Sans";
  std::string file;  // that an SVG embeds; empty: none
};
const PageFont& FontOfPages();

// Takes a font file (.ttf, .otf) for all pages from now on; PDF and SVG embed it. Throws InputError if it is
// none.
void UseFont(const std::filesystem::path& file);

// Returns the width of a line of text, points.
double TextWidth(const std::string& text, double size, bool bold = false);

// Cuts the end of the text, with an ellipsis, until it is no wider than `width`.
std::string FittingText(const std::string& text, double size, double width, bool bold = false);

// Breaks the text at blanks into lines no wider than `width`; a longer word gets a line of its own.
std::vector<std::string> WrappedText(const std::string& text, double size, double width);

// Throws UsageError unless the name ends in .png, .svg or .pdf.
void CheckFigurePath(const std::filesystem::path& path);

// Encode the page in the format of the extension: PNG with its resolution (dpi), or vector graphics in SVG
// and PDF. The same page gives the same bytes. Throw UsageError on any other extension or a size out of
// range, InputError if the file cannot be written.
std::string EncodeFigure(const FigurePage& page, const std::filesystem::path& path);
void WriteFigure(const FigurePage& page, const std::filesystem::path& path);

// Returns the page as an SVG element for HTML; texts stay texts, pictures are embedded as PNG.
std::string SvgElement(const FigurePage& page);

}  // namespace sqslam
