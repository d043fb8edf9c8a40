#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <string_view>

#include "render/page/page.h"
#include "render/scene/style.h"
#include "slam/io/image_files.h"
#include "slam/util/markup.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

using SvgOutput = std::back_insert_iterator<std::string>;

// Rounds to a thousandth of a point, finer than any printer; avoids "-0".
std::string Number(double value) {
  const double rounded = std::round(value * 1000.0) / 1000.0;
  return fmt::format("{:.7g}", rounded == 0.0 ? 0.0 : rounded);
}

void Write(SvgOutput out, const FigurePath& path) {
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

// Writes a text, or its halo: an outline below it.
void WriteText(SvgOutput out, const FigureText& text, bool halo) {
  const char* anchor = text.align == TextAlign::kLeft     ? "start"
                       : text.align == TextAlign::kCenter ? "middle"
                                                          : "end";
  fmt::format_to(out, "<text x=\"0\" y=\"{}\" transform=\"translate({} {})",
                 Number(FigureText::kBaselineBelowAnchor * text.size), Number(text.anchor.x()),
                 Number(text.anchor.y()));
  if (text.angle != 0.0) {
    fmt::format_to(out, " rotate({})", Number(-text.angle));
  }
  fmt::format_to(out, "\" font-size=\"{}\" text-anchor=\"{}\" fill=\"{}\"", Number(text.size), anchor,
                 FormatColor(halo ? *text.halo : text.color));
  if (text.bold) {
    fmt::format_to(out, " font-weight=\"bold\"");
  }
  if (halo) {
    fmt::format_to(out, " stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" aria-hidden=\"true\"",
                   FormatColor(*text.halo), Number(2.0 * FigureText::kHaloWidth * text.size));
  }
  fmt::format_to(out, ">{}</text>\n", EscapeMarkup(text.text));
}

// A text of its own for the halo: not every viewer knows paint-order, and would draw the outline over the
// letters.
void Write(SvgOutput out, const FigureText& text) {
  if (text.halo) {
    WriteText(out, text, true);
  }
  WriteText(out, text, false);
}

void Write(SvgOutput out, const FigureImage& element) {
  const FigureRect& area = element.area;
  fmt::format_to(out,
                 "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
                 "xlink:href=\"data:image/png;base64,{}\"/>\n",
                 Number(area.x), Number(area.y), Number(area.width), Number(area.height),
                 Base64(EncodedImage(".png", element.image)));
}

}  // namespace

std::string SvgElement(const FigurePage& page) {
  std::string svg;
  const SvgOutput out(svg);
  fmt::format_to(out,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
                 "width=\"{0}pt\" height=\"{1}pt\" viewBox=\"0 0 {0} {1}\" "
                 "font-family=\"'{2}', Verdana, sans-serif\">\n",
                 Number(page.width), Number(page.height), EscapeMarkup(FontOfPages().family));
  if (const std::string& file = FontOfPages().file; !file.empty()) {
    fmt::format_to(out,
                   "<style>@font-face {{ font-family: '{}'; src: url(data:font/ttf;base64,{}); }}</style>\n",
                   EscapeMarkup(FontOfPages().family), Base64(ReadFile(file, "a font")));
  }
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

}  // namespace sqslam
