#include "slam/objects/line_segments.h"

#include <opencv2/ximgproc.hpp>

namespace sqslam {

std::vector<LineSegment> ExtractLines(const cv::Mat& gray, const Camera& camera, const YawOptions& options) {
  std::vector<LineSegment> lines;
  if (gray.empty()) {
    return lines;
  }
  const cv::Ptr<cv::ximgproc::EdgeDrawing> detector = cv::ximgproc::createEdgeDrawing();
  detector->params.MinLineLength = static_cast<int>(options.min_line_length);
  detector->detectEdges(gray);
  std::vector<cv::Vec4f> segments;
  detector->detectLines(segments);
  for (const cv::Vec4f& s : segments) {
    const LineSegment line{camera.Undistort({s[0], s[1]}), camera.Undistort({s[2], s[3]})};
    if (line.Length() >= options.min_line_length) {
      lines.push_back(line);
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
