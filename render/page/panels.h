#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

#include "render/page/figure_options.h"
#include "render/page/page.h"
#include "render/picture/picture.h"
#include "render/picture/picture_text.h"

namespace sqslam {

FigureText PlainText(std::string text, const Eigen::Vector2d& anchor, double size,
                     const Eigen::Vector3d& color, TextAlign align = TextAlign::kLeft, bool bold = false);

// A line that is no wider than `width`: in smaller letters where needed, and cut where these would be too
// small.
FigureText NarrowText(FigureText text, double width);

// How a picture of `width` x `height` points is drawn for a page: at its density, without texts of its own,
// labels in the given colours.
PictureOptions PanelOptions(const FigureOptions& options, double dpi, double width, double height,
                            const std::map<std::string, Eigen::Vector3d>& colors);

// The picture at its own number of pixels, its top-left corner on the pixel next to the area's.
void PlacePanel(FigurePage& page, const cv::Mat& picture, const FigureRect& area);

}  // namespace sqslam
