#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "render/page/page.h"

namespace sqslam {

// Throws UsageError unless the name ends in .png, .svg or .pdf: to be asked before any work is done.
void CheckFigurePath(const std::filesystem::path& path);

// The page in the format of the extension: a PNG that carries its density (dots per inch), or SVG and PDF
// with lines and texts as such. The same page gives the same bytes. Throws UsageError for another extension
// and sizes without sense, InputError where the file cannot be written.
std::string EncodeFigure(const FigurePage& page, const std::filesystem::path& path);
void WriteFigure(const FigurePage& page, const std::filesystem::path& path);

// ---- The devices

// Distance of a text's baseline below its anchor, of the text's size: half the height of DejaVu's
// capitals.
inline constexpr double kBaselineBelowAnchor = 0.3645;

// Width of a text's halo on each side, of the text's size.
inline constexpr double kHaloWidth = 0.12;

// 8UC3, or 8UC4 (straight alpha) where the page has no background.
cv::Mat PageToPixels(const FigurePage& page);

// Fonts are embedded; there is no date in it, so that the same page gives the same bytes.
std::string PageToPdf(const FigurePage& page);

// Texts stay texts; pictures are embedded as PNG.
std::string PageToSvg(const FigurePage& page);

// The same as a part of an HTML page.
std::string SvgElement(const FigurePage& page);

}  // namespace sqslam
