#include "render/page/page.h"

#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/format.h>
#include <fontconfig/fontconfig.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>

#include "render/picture/png_density.h"
#include "slam/io/image_files.h"
#include "slam/util/atomic_file.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;
constexpr double kPointsPerInch = 72.0;
constexpr int kMaxPageSide = 16384;  // pixels

Surface Own(cairo_surface_t* surface) { return {surface, cairo_surface_destroy}; }
Context MakeContext(cairo_surface_t* surface) { return {cairo_create(surface), cairo_destroy}; }

void Check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(fmt::format("drawing failed: {}", cairo_status_to_string(status)));
  }
}

// Disables hinting, so that text has the same layout at every size and on every machine.
void SelectFont(cairo_t* cairo, double size, bool bold) {
  cairo_select_font_face(cairo, FontOfPages().family.c_str(), CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo, size);
  const std::unique_ptr<cairo_font_options_t, decltype(&cairo_font_options_destroy)> options(
      cairo_font_options_create(), cairo_font_options_destroy);
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(cairo, options.get());
}

double Advance(cairo_t* cairo, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(cairo, text.c_str(), &extents);
  return extents.x_advance;
}

void SetColor(cairo_t* cairo, const Eigen::Vector3d& color, double opacity = 1.0) {
  cairo_set_source_rgba(cairo, color.x(), color.y(), color.z(), opacity);
}

void Draw(cairo_t* cairo, const FigurePath& path) {
  cairo_new_path(cairo);
  for (const Eigen::Vector2d& p : path.points) {
    cairo_line_to(cairo, p.x(), p.y());
  }
  if (path.closed) {
    cairo_close_path(cairo);
  }
  if (path.fill) {
    SetColor(cairo, *path.fill, path.fill_opacity);
    cairo_fill_preserve(cairo);
  }
  if (path.stroke) {
    SetColor(cairo, path.stroke->color);
    cairo_set_line_width(cairo, path.stroke->width);
    cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(cairo, path.stroke->dash.empty() ? CAIRO_LINE_CAP_SQUARE : CAIRO_LINE_CAP_BUTT);
    cairo_set_dash(cairo, path.stroke->dash.data(), static_cast<int>(path.stroke->dash.size()), 0.0);
    cairo_stroke_preserve(cairo);
  }
  cairo_new_path(cairo);
}

void Draw(cairo_t* cairo, const FigureText& text) {
  cairo_save(cairo);
  SelectFont(cairo, text.size, text.bold);
  const double width = Advance(cairo, text.text);
  cairo_translate(cairo, text.anchor.x(), text.anchor.y());
  cairo_rotate(cairo, -text.angle * std::numbers::pi / 180.0);
  const double left = text.align == TextAlign::kLeft ? 0.0 : text.align == TextAlign::kCenter ? 0.5 : 1.0;
  cairo_move_to(cairo, -left * width, FigureText::kBaselineBelowAnchor * text.size);
  if (text.halo) {
    cairo_text_path(cairo, text.text.c_str());
    SetColor(cairo, *text.halo);
    cairo_set_dash(cairo, nullptr, 0, 0.0);
    cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(cairo, 2.0 * FigureText::kHaloWidth * text.size);
    cairo_stroke(cairo);
    cairo_move_to(cairo, -left * width, FigureText::kBaselineBelowAnchor * text.size);
  }
  SetColor(cairo, text.color);
  cairo_show_text(cairo, text.text.c_str());
  cairo_restore(cairo);
}

void Draw(cairo_t* cairo, const FigureImage& element) {
  const bool opaque = element.image.channels() == 3;
  cv::Mat pixels;  // 32 bits each, with premultiplied alpha
  cv::cvtColor(element.image, pixels, opaque ? cv::COLOR_BGR2BGRA : cv::COLOR_RGBA2mRGBA);
  const Surface source =
      Own(cairo_image_surface_create_for_data(pixels.data, opaque ? CAIRO_FORMAT_RGB24 : CAIRO_FORMAT_ARGB32,
                                              pixels.cols, pixels.rows, static_cast<int>(pixels.step)));
  cairo_save(cairo);
  cairo_translate(cairo, element.area.x, element.area.y);
  cairo_scale(cairo, element.area.width / pixels.cols, element.area.height / pixels.rows);
  cairo_set_source_surface(cairo, source.get(), 0.0, 0.0);
  cairo_pattern_set_filter(cairo_get_source(cairo), CAIRO_FILTER_GOOD);
  cairo_pattern_set_extend(cairo_get_source(cairo), CAIRO_EXTEND_PAD);  // avoids a soft border
  cairo_rectangle(cairo, 0.0, 0.0, pixels.cols, pixels.rows);
  cairo_fill(cairo);
  cairo_restore(cairo);
  cairo_surface_finish(source.get());  // before the pixels are freed
}

void DrawPage(cairo_t* cairo, const FigurePage& page) {
  if (page.background) {
    SetColor(cairo, *page.background);
    cairo_paint(cairo);
  }
  for (const FigureElement& element : page.elements) {
    std::visit([cairo](const auto& e) { Draw(cairo, e); }, element);
  }
  Check(cairo_status(cairo));
}

cairo_status_t Append(void* target, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

// Returns 8UC3, or 8UC4 (straight alpha) if the page has no background.
cv::Mat PageToPixels(const FigurePage& page) {
  const int width = static_cast<int>(std::lround(page.width * page.dpi / kPointsPerInch));
  const int height = static_cast<int>(std::lround(page.height * page.dpi / kPointsPerInch));
  ThrowIf<UsageError>(width < 16 || height < 16 || width > kMaxPageSide || height > kMaxPageSide,
                      "a figure of {}x{} pixels: expected sides from 16 to {}", width, height, kMaxPageSide);
  cv::Mat pixels = cv::Mat::zeros(height, width, CV_8UC4);
  {
    const Surface surface = Own(cairo_image_surface_create_for_data(pixels.data, CAIRO_FORMAT_ARGB32, width,
                                                                    height, static_cast<int>(pixels.step)));
    const Context cairo = MakeContext(surface.get());
    cairo_scale(cairo.get(), page.dpi / kPointsPerInch, page.dpi / kPointsPerInch);
    DrawPage(cairo.get(), page);
    cairo_surface_flush(surface.get());
  }
  cv::Mat image;
  cv::cvtColor(pixels, image, page.background ? cv::COLOR_BGRA2BGR : cv::COLOR_mRGBA2RGBA);
  return image;
}

// Embeds fonts and writes no date, so that the same page gives the same bytes.
std::string PageToPdf(const FigurePage& page) {
  std::string pdf;
  {
    const Surface surface = Own(cairo_pdf_surface_create_for_stream(Append, &pdf, page.width, page.height));
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, nullptr);
    if (!page.title.empty()) {
      cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, ValidText(page.title).c_str());
    }
    const Context cairo = MakeContext(surface.get());
    DrawPage(cairo.get(), page);
    cairo_show_page(cairo.get());
    cairo_surface_finish(surface.get());
    Check(cairo_surface_status(surface.get()));
  }
  return pdf;
}

}  // namespace

namespace {

PageFont& ChosenFont() {
  static PageFont font;
  return font;
}

}  // namespace

const PageFont& FontOfPages() { return ChosenFont(); }

void UseFont(const std::filesystem::path& file) {
  const std::string path = file.string();
  const auto* bytes = reinterpret_cast<const FcChar8*>(path.c_str());
  int count = 0;
  const std::unique_ptr<FcPattern, decltype(&FcPatternDestroy)> pattern(
      FcFreeTypeQuery(bytes, 0, nullptr, &count), FcPatternDestroy);
  FcChar8* family = nullptr;
  ThrowIf<InputError>(!pattern || FcPatternGetString(pattern.get(), FC_FAMILY, 0, &family) != FcResultMatch ||
                          FcConfigAppFontAddFile(FcConfigGetCurrent(), bytes) == FcFalse,
                      "{}: is not a font that can be read, expected a .ttf or .otf", path);
  ChosenFont() = {reinterpret_cast<const char*>(family), path};
}

double TextWidth(const std::string& text, double size, bool bold) {
  const Surface surface = Own(cairo_recording_surface_create(CAIRO_CONTENT_ALPHA, nullptr));
  const Context cairo = MakeContext(surface.get());
  SelectFont(cairo.get(), size, bold);
  return Advance(cairo.get(), ValidText(text));
}

void FigurePage::Text(FigureText text) {
  text.text = ValidText(text.text);
  elements.emplace_back(std::move(text));
}

void FigurePage::Rect(const FigureRect& rect, const std::optional<Eigen::Vector3d>& fill,
                      const std::optional<FigureStroke>& stroke) {
  const std::vector<Eigen::Vector2d> corners = {
      {rect.x, rect.y}, {rect.Right(), rect.y}, {rect.Right(), rect.Bottom()}, {rect.x, rect.Bottom()}};
  elements.emplace_back(FigurePath{corners, true, fill, 1.0, stroke});
}

void FigurePage::Polygon(const Eigen::Vector2d& center, int corners, double radius,
                         const std::optional<Eigen::Vector3d>& fill,
                         const std::optional<FigureStroke>& stroke) {
  FigurePath path{{}, true, fill, 1.0, stroke};
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / corners;
    path.points.emplace_back(center + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  elements.emplace_back(std::move(path));
}

void FigurePage::Cross(const Eigen::Vector2d& center, double size, const FigureStroke& stroke) {
  const double r = 0.5 * size;
  Line(center + Eigen::Vector2d(-r, -r), center + Eigen::Vector2d(r, r), stroke);
  Line(center + Eigen::Vector2d(-r, r), center + Eigen::Vector2d(r, -r), stroke);
}

void FigurePage::Label(std::string text, const Eigen::Vector2d& anchor, double size,
                       const Eigen::Vector3d& color, double room) {
  Text(NarrowText({std::move(text), anchor, size, color, TextAlign::kCenter}, room));
}

FigureText NarrowText(FigureText text, double width) {
  constexpr double kMinShare = 0.6;  // of the font size
  const double wide = TextWidth(text.text, text.size, text.bold);
  text.size *= wide > width ? std::max(kMinShare, 0.99 * width / wide) : 1.0;
  text.text = FittingText(text.text, text.size, width, text.bold);
  return text;
}

std::string FittingText(const std::string& text, double size, double width, bool bold) {
  std::string shown = text;
  for (std::size_t end = text.size(); end > 0 && TextWidth(shown, size, bold) > width;) {
    do {  // remove a whole UTF-8 character
      --end;
    } while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0u) == 0x80u);
    shown = text.substr(0, end) + "…";
  }
  return shown;
}

std::vector<std::string> WrappedText(const std::string& text, double size, double width) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::string longer = lines.empty() ? word : lines.back() + " " + word;
    if (!lines.empty() && TextWidth(longer, size) <= width) {
      lines.back() = longer;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

void CheckFigurePath(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  ThrowIf<UsageError>(extension != ".png" && extension != ".svg" && extension != ".pdf",
                      "--output {}: expected a name that ends in .png, .svg or .pdf", path.string());
}

std::string EncodeFigure(const FigurePage& page, const std::filesystem::path& path) {
  CheckFigurePath(path);
  if (path.extension() == ".svg") {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + SvgElement(page);
  }
  if (path.extension() == ".pdf") {
    return PageToPdf(page);
  }
  return WithDensity(EncodedImage(".png", PageToPixels(page), {cv::IMWRITE_PNG_COMPRESSION, 9}), page.dpi);
}

void WriteFigure(const FigurePage& page, const std::filesystem::path& path) {
  WriteFileAtomically(path, EncodeFigure(page, path));
}

}  // namespace sqslam
