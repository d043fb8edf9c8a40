#include "render/page/page.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "render/scene/style.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/markup.h"

namespace sqslam {
namespace {

using Output = std::back_insert_iterator<std::string>;

// A thousandth of a point is finer than any printer; no "-0".
std::string Number(double value) {
  const double rounded = std::round(value * 1000.0) / 1000.0;
  return fmt::format("{:.7g}", rounded == 0.0 ? 0.0 : rounded);
}

void Write(Output out, const FigurePath& path) {
  fmt::format_to(out, "<path d=\"");
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    fmt::format_to(out, "{}{} {}", i == 0 ? "M" : "L", Number(path.points[i].x()),
                   Number(path.points[i].y()));
  }
  fmt::format_to(out, "{}\" fill=\"{}\"", path.closed ? "Z" : "",
                 path.fill ? FormatColor(*path.fill) : "none");
  if (path.fill && path.fill_opacity < 1.0) {
    fmt::format_to(out, " fill-opacity=\"{}\"", Number(path.fill_opacity));
  }
  if (path.stroke) {
    fmt::format_to(out, " stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" stroke-linecap=\"{}\"",
                   FormatColor(path.stroke->color), Number(path.stroke->width),
                   path.stroke->dash.empty() ? "square" : "butt");
    for (std::size_t i = 0; i < path.stroke->dash.size(); ++i) {
      fmt::format_to(out, "{}{}", i == 0 ? " stroke-dasharray=\"" : ",", Number(path.stroke->dash[i]));
    }
    fmt::format_to(out, "{}", path.stroke->dash.empty() ? "" : "\"");
  }
  fmt::format_to(out, "/>\n");
}

void Write(Output out, const FigureText& text) {
  const char* anchor = text.align == TextAlign::kLeft     ? "start"
                       : text.align == TextAlign::kCenter ? "middle"
                                                          : "end";
  fmt::format_to(out, "<text x=\"0\" y=\"{}\" transform=\"translate({} {})",
                 Number(kBaselineBelowAnchor * text.size), Number(text.anchor.x()), Number(text.anchor.y()));
  if (text.angle != 0.0) {
    fmt::format_to(out, " rotate({})", Number(-text.angle));
  }
  fmt::format_to(out, "\" font-size=\"{}\" text-anchor=\"{}\" fill=\"{}\"", Number(text.size), anchor,
                 FormatColor(text.color));
  if (text.bold) {
    fmt::format_to(out, " font-weight=\"bold\"");
  }
  if (text.halo) {
    fmt::format_to(out, " stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" paint-order=\"stroke\"",
                   FormatColor(*text.halo), Number(2.0 * kHaloWidth * text.size));
  }
  fmt::format_to(out, ">{}</text>\n", EscapeMarkup(text.text));
}

void Write(Output out, const FigureImage& element) {
  std::vector<unsigned char> png;
  cv::imencode(".png", element.image, png);
  const std::string_view bytes(reinterpret_cast<const char*>(png.data()), png.size());
  const FigureRect& area = element.area;
  fmt::format_to(out,
                 "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
                 "xlink:href=\"data:image/png;base64,{}\"/>\n",
                 Number(area.x), Number(area.y), Number(area.width), Number(area.height), Base64(bytes));
}

void AppendBigEndian(std::string& bytes, std::uint32_t value) {
  for (const unsigned shift : {24u, 16u, 8u, 0u}) {
    bytes += static_cast<char>((value >> shift) & 255u);
  }
}

// Adds a pHYs chunk (pixels a metre), which OpenCV cannot write, behind the header chunk.
std::string WithDensity(const std::vector<std::uint8_t>& png, double dpi) {
  constexpr std::size_t kHeaderEnd = 8 + 25;  // signature and IHDR
  constexpr double kInchesPerMetre = 1.0 / 0.0254;
  const auto per_metre = static_cast<std::uint32_t>(std::lround(dpi * kInchesPerMetre));
  std::string body = "pHYs";
  AppendBigEndian(body, per_metre);
  AppendBigEndian(body, per_metre);
  body += '\1';  // the unit is the metre
  std::string out(png.begin(), png.begin() + kHeaderEnd);
  AppendBigEndian(out, static_cast<std::uint32_t>(body.size() - 4));
  out += body;
  AppendBigEndian(out, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(body.data()),
                                                        static_cast<uInt>(body.size()))));
  out.append(png.begin() + kHeaderEnd, png.end());
  return out;
}

}  // namespace

void FigurePage::Line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const FigureStroke& stroke) {
  Polyline({from, to}, stroke);
}

void FigurePage::Polyline(std::vector<Eigen::Vector2d> points, const FigureStroke& stroke) {
  elements.emplace_back(FigurePath{std::move(points), false, {}, 1.0, stroke});
}

void FigurePage::Rect(const FigureRect& rect, const std::optional<Eigen::Vector3d>& fill,
                      const std::optional<FigureStroke>& stroke) {
  const std::vector<Eigen::Vector2d> corners = {
      {rect.x, rect.y}, {rect.Right(), rect.y}, {rect.Right(), rect.Bottom()}, {rect.x, rect.Bottom()}};
  elements.emplace_back(FigurePath{corners, true, fill, 1.0, stroke});
}

void FigurePage::Cross(const Eigen::Vector2d& center, double size, const FigureStroke& stroke) {
  const double r = 0.5 * size;
  Line(center + Eigen::Vector2d(-r, -r), center + Eigen::Vector2d(r, r), stroke);
  Line(center + Eigen::Vector2d(-r, r), center + Eigen::Vector2d(r, -r), stroke);
}

void FigurePage::Label(std::string text, const Eigen::Vector2d& anchor, double size,
                       const Eigen::Vector3d& color, double room, double angle) {
  Text(NarrowText({std::move(text), anchor, size, color, TextAlign::kCenter}, room));
  std::get<FigureText>(elements.back()).angle = angle;
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

std::string SvgElement(const FigurePage& page) {
  std::string svg;
  const Output out(svg);
  fmt::format_to(out,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
                 "width=\"{0}pt\" height=\"{1}pt\" viewBox=\"0 0 {0} {1}\" "
                 "font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n",
                 Number(page.width), Number(page.height));
  if (!page.title.empty()) {
    fmt::format_to(out, "<title>{}</title>\n", EscapeMarkup(page.title));
  }
  if (page.background) {
    fmt::format_to(out, "<rect width=\"{}\" height=\"{}\" fill=\"{}\"/>\n", Number(page.width),
                   Number(page.height), FormatColor(*page.background));
  }
  for (const FigureElement& element : page.elements) {
    std::visit([out](const auto& e) { Write(out, e); }, element);
  }
  svg += "</svg>\n";
  return svg;
}

void CheckFigurePath(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".png" && extension != ".svg" && extension != ".pdf") {
    throw UsageError(
        fmt::format("--output {}: expected a name that ends in .png, .svg or .pdf", path.string()));
  }
}

std::string EncodeFigure(const FigurePage& page, const std::filesystem::path& path) {
  CheckFigurePath(path);
  if (path.extension() == ".svg") {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + SvgElement(page);
  }
  if (path.extension() == ".pdf") {
    return PageToPdf(page);
  }
  std::vector<std::uint8_t> png;
  cv::imencode(".png", PageToPixels(page), png, {cv::IMWRITE_PNG_COMPRESSION, 9});
  return WithDensity(png, page.dpi);
}

void WriteFigure(const FigurePage& page, const std::filesystem::path& path) {
  WriteFileAtomically(path, EncodeFigure(page, path));
}

}  // namespace sqslam
