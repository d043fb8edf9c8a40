#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "render/page/page_devices.h"

namespace sqslam {
namespace {

using Output = std::back_insert_iterator<std::string>;

std::string Hex(const Eigen::Vector3d& color) {
  const Eigen::Vector3i rgb = (255.0 * color).array().round().cast<int>().max(0).min(255);
  return fmt::format("#{:02x}{:02x}{:02x}", rgb.x(), rgb.y(), rgb.z());
}

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

// A thousandth of a point is finer than any printer; no "-0".
std::string Number(double value) {
  const double rounded = std::round(value * 1000.0) / 1000.0;
  return fmt::format("{:.7g}", rounded == 0.0 ? 0.0 : rounded);
}

std::string Base64(const std::vector<std::uint8_t>& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = bytes.size() - i;
    const unsigned value =
        (bytes[i] << 16u) | ((left > 1 ? bytes[i + 1] : 0u) << 8u) | (left > 2 ? bytes[i + 2] : 0u);
    out += kDigits[(value >> 18u) & 63u];
    out += kDigits[(value >> 12u) & 63u];
    out += left > 1 ? kDigits[(value >> 6u) & 63u] : '=';
    out += left > 2 ? kDigits[value & 63u] : '=';
  }
  return out;
}

void Write(Output out, const FigurePath& path) {
  fmt::format_to(out, "<path d=\"");
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    fmt::format_to(out, "{}{} {}", i == 0 ? "M" : "L", Number(path.points[i].x()),
                   Number(path.points[i].y()));
  }
  fmt::format_to(out, "{}\" fill=\"{}\"", path.closed ? "Z" : "", path.fill ? Hex(*path.fill) : "none");
  if (path.fill && path.fill_opacity < 1.0) {
    fmt::format_to(out, " fill-opacity=\"{}\"", Number(path.fill_opacity));
  }
  if (path.stroke) {
    fmt::format_to(out, " stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" stroke-linecap=\"{}\"",
                   Hex(path.stroke->color), Number(path.stroke->width),
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
                 Hex(text.color));
  if (text.bold) {
    fmt::format_to(out, " font-weight=\"bold\"");
  }
  if (text.halo) {
    fmt::format_to(out, " stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" paint-order=\"stroke\"",
                   Hex(*text.halo), Number(2.0 * kHaloWidth * text.size));
  }
  fmt::format_to(out, ">{}</text>\n", Escaped(text.text));
}

void Write(Output out, const FigureImage& element) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", element.image, png);
  const FigureRect& area = element.area;
  fmt::format_to(out,
                 "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
                 "xlink:href=\"data:image/png;base64,{}\"/>\n",
                 Number(area.x), Number(area.y), Number(area.width), Number(area.height), Base64(png));
}

}  // namespace

std::string PageToSvg(const FigurePage& page) {
  std::string svg;
  const Output out(svg);
  fmt::format_to(out,
                 "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
                 "width=\"{0}pt\" height=\"{1}pt\" viewBox=\"0 0 {0} {1}\" "
                 "font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n",
                 Number(page.width), Number(page.height));
  if (!page.title.empty()) {
    fmt::format_to(out, "<title>{}</title>\n", Escaped(page.title));
  }
  if (page.background) {
    fmt::format_to(out, "<rect width=\"{}\" height=\"{}\" fill=\"{}\"/>\n", Number(page.width),
                   Number(page.height), Hex(*page.background));
  }
  for (const FigureElement& element : page.elements) {
    std::visit([out](const auto& e) { Write(out, e); }, element);
  }
  svg += "</svg>\n";
  return svg;
}

}  // namespace sqslam
