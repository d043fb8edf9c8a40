#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "render/page/page.h"

namespace sqslam {

// Where the baseline of a text lies below its anchor, of the text's size: half the height of DejaVu's
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

}  // namespace sqslam
