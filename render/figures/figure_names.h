#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "render/page/figure_options.h"
#include "render/picture/label_layout.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Names of things in a part of a page, which they are placed in by pixel (PlaceLabels).
class FigureNames {
 public:
  static constexpr double kPixelsPerPoint = 4.0;  // of a part that is no picture

  // `pixels`: size of the picture in which the things are; it covers `area` of the page.
  FigureNames(FigureSheet& sheet, const FigureRect& area, const cv::Size& pixels, double letters)
      : sheet_(sheet), area_(area), scale_(pixels.width / area.width), letters_(letters) {}

  cv::Size SizeOf(const std::string& name) const;

  // Draws the names that have a place, with leaders where one is needed. Returns the indices of the others,
  // and of those with a leader longer than 2.5 lines.
  std::vector<std::size_t> Draw(const std::vector<std::string>& names,
                                const std::vector<Eigen::Vector3d>& inks,
                                const std::vector<LabelRequest>& requests, const cv::Mat1i& number);

  // Keeps names out of a part of the page.
  void KeepFree(const FigureRect& taken);

 private:
  Eigen::Vector2d OnPage(double x, double y) const { return {area_.x + x / scale_, area_.y + y / scale_}; }
  void DrawLeader(const LabelPlace& place);

  FigureSheet& sheet_;
  FigureRect area_;
  double scale_;    // pixels per point
  double letters_;  // points
  std::vector<cv::Rect> taken_;
};

// Draws names at the visible parts of the objects. An object that others hide gets none; its class is in the
// legend. `see_through`: solids hide nothing. `pixels`: size of the picture of the map that covers `area`.
// `taken`: a part of the page without names; may be empty.
void DrawObjectNames(FigureSheet& sheet, const std::vector<SnapshotObject>& objects, const SceneStyle& style,
                     bool see_through, const ViewCamera& camera, const cv::Size& pixels,
                     const FigureRect& area, const FigureRect& taken = {});

}  // namespace sqslam
