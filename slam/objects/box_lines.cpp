#include "slam/objects/box_lines.h"

#include <opencv2/ximgproc.hpp>

namespace sqslam {
namespace {

constexpr double kRing = 10.0;  // px around boxes beyond the margin of LinesInBox()

// Returns the boxes grown by `margin` px and clipped to the image, with overlapping ones merged.
std::vector<cv::Rect> Regions(const std::vector<Box2d>& boxes, const cv::Size& image, double margin) {
  std::vector<cv::Rect> regions;
  for (const Box2d& box : boxes) {
    const cv::Point begin(static_cast<int>(box.x - margin), static_cast<int>(box.y - margin));
    const cv::Point end(static_cast<int>(box.x + box.width + margin) + 1,
                        static_cast<int>(box.y + box.height + margin) + 1);
    cv::Rect region = cv::Rect(begin, end) & cv::Rect(cv::Point(), image);
    for (bool grown = true; grown;) {
      grown = false;
      for (auto it = regions.begin(); it != regions.end(); ++it) {
        if ((*it & region).area() > 0) {
          region |= *it;
          regions.erase(it);
          grown = true;
          break;
        }
      }
    }
    if (region.area() > 0) {
      regions.push_back(region);
    }
  }
  return regions;
}

}  // namespace

double LineArea(const Box2d& box, const YawOptions& options) {
  const double grown = 2.0 * (options.box_margin + kRing);
  return (box.width + grown) * (box.height + grown);
}

std::vector<LineSegment> ExtractLines(const cv::Mat& gray, const Camera& camera,
                                      const std::vector<Box2d>& boxes, const YawOptions& options) {
  std::vector<LineSegment> lines;
  if (gray.empty() || boxes.empty()) {
    return lines;
  }
  const cv::Ptr<cv::ximgproc::EdgeDrawing> detector = cv::ximgproc::createEdgeDrawing();
  // EDLines' own thresholds: OpenCV's defaults (20 and 0) take twice the time for faint edges.
  detector->params.GradientThresholdValue = 36;
  detector->params.AnchorThresholdValue = 8;
  detector->params.MinLineLength = static_cast<int>(options.min_line_length);
  for (const cv::Rect& region : Regions(boxes, gray.size(), options.box_margin + kRing)) {
    constexpr int kLeast = 16;  // px; anything smaller is too small for the detector's filters
    if (region.width < kLeast || region.height < kLeast) {
      continue;
    }
    detector->detectEdges(gray(region).clone());
    std::vector<cv::Vec4f> segments;
    detector->detectLines(segments);
    const Eigen::Vector2d corner(region.x, region.y);
    for (const cv::Vec4f& s : segments) {
      const LineSegment line{camera.Undistort(corner + Eigen::Vector2d(s[0], s[1])),
                             camera.Undistort(corner + Eigen::Vector2d(s[2], s[3]))};
      if (line.Length() >= options.min_line_length) {
        lines.push_back(line);
      }
    }
  }
  return lines;
}

std::vector<LineSegment> LinesInBox(const std::vector<LineSegment>& lines, const Box2d& box,
                                    const YawOptions& options) {
  std::vector<LineSegment> inside;
  for (const LineSegment& line : lines) {
    if (box.Contains(line.a, options.box_margin) && box.Contains(line.b, options.box_margin)) {
      inside.push_back(line);
    }
  }
  return inside;
}

}  // namespace sqslam
