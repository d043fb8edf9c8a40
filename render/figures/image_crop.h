#pragma once

#include <opencv2/core.hpp>

#include "render/page/page.h"
#include "slam/geometry/box2.h"

namespace sqslam {

// A part of an image on a page, with the place on the page of what lies on the image.
class ImageCrop {
 public:
  // The part of the image around `region` (pixels), widened to the panel's shape as far as the image goes,
  // turned by quarter turns clockwise and fitted into the panel.
  ImageCrop(const cv::Mat& image, const Box2d& region, int quarter_turns, const FigureRect& panel);

  void Draw(FigurePage& page) const { page.Image(image_, area_); }
  const FigureRect& Area() const { return area_; }
  Eigen::Vector2d ToPage(const Eigen::Vector2d& pixel) const;
  bool Contains(const Eigen::Vector2d& pixel) const;
  // The part of a line that is shown; false where none is.
  bool Clip(Eigen::Vector2d& from, Eigen::Vector2d& to) const;

 private:
  cv::Mat image_;  // cut and turned
  cv::Rect cut_;   // of the image, before the turn
  int turns_ = 0;  // 0 to 3
  FigureRect area_;
};

}  // namespace sqslam
