#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"

namespace sqslam {

// Extracts line segments by EDLines (Akinlar and Topal 2011) in and around the boxes (distorted px) only.
// `gray`: 8UC1 as recorded. The endpoints of the segments are in undistorted px. A line that leaves a box is
// followed far enough for LinesInBox() to see that.
std::vector<LineSegment> ExtractLines(const cv::Mat& gray, const Camera& camera,
                                      const std::vector<Box2d>& boxes, const YawOptions& options);

// Returns the lines with both ends in the box (undistorted px) grown by options.box_margin.
std::vector<LineSegment> LinesInBox(const std::vector<LineSegment>& lines, const Box2d& box,
                                    const YawOptions& options);

// Returns the number of pixels that are searched for the lines of a box.
double LineArea(const Box2d& box, const YawOptions& options);

}  // namespace sqslam
