#include "render/figures/image_crop.h"

#include <algorithm>
#include <cmath>

namespace sqslam {
namespace {

// [begin, begin + length) within [0, limit), `length` long where that has room.
std::pair<int, int> Within(double center, double length, int limit) {
  const int size = std::clamp(static_cast<int>(std::ceil(length)), 2, limit);
  const int begin = std::clamp(static_cast<int>(std::floor(center - 0.5 * size)), 0, limit - size);
  return {begin, size};
}

}  // namespace

ImageCrop::ImageCrop(const cv::Mat& image, const Box2d& region, int quarter_turns, const FigureRect& panel)
    : turns_(((quarter_turns % 4) + 4) % 4) {
  const bool across = turns_ % 2 == 1;
  const double aspect = across ? panel.height / panel.width : panel.width / panel.height;
  const double width = std::max(region.width, region.height * aspect);
  const auto [x, columns] = Within(region.Center().x(), width, image.cols);
  const auto [y, rows] = Within(region.Center().y(), width / aspect, image.rows);
  cut_ = {x, y, columns, rows};
  image_ = image(cut_).clone();
  for (int i = 0; i < turns_; ++i) {
    cv::rotate(image_.clone(), image_, cv::ROTATE_90_CLOCKWISE);
  }
  const double scale = std::min(panel.width / image_.cols, panel.height / image_.rows);
  area_ = {0.0, 0.0, scale * image_.cols, scale * image_.rows};
  area_.x = panel.Center().x() - 0.5 * area_.width;
  area_.y = panel.Center().y() - 0.5 * area_.height;
}

Eigen::Vector2d ImageCrop::ToPage(const Eigen::Vector2d& pixel) const {
  // Pixel centres lie at whole numbers; shares of the cut from its corner.
  Eigen::Vector2d at((pixel.x() + 0.5 - cut_.x) / cut_.width, (pixel.y() + 0.5 - cut_.y) / cut_.height);
  for (int i = 0; i < turns_; ++i) {
    at = Eigen::Vector2d(1.0 - at.y(), at.x());
  }
  return {area_.x + at.x() * area_.width, area_.y + at.y() * area_.height};
}

bool ImageCrop::Contains(const Eigen::Vector2d& pixel) const {
  return pixel.x() >= cut_.x - 0.5 && pixel.y() >= cut_.y - 0.5 && pixel.x() <= cut_.x + cut_.width - 0.5 &&
         pixel.y() <= cut_.y + cut_.height - 0.5;
}

bool ImageCrop::Clip(Eigen::Vector2d& from, Eigen::Vector2d& to) const {
  const Eigen::Vector2d low(cut_.x - 0.5, cut_.y - 0.5);
  const Eigen::Vector2d high = low + Eigen::Vector2d(cut_.width, cut_.height);
  double begin = 0.0;
  double end = 1.0;
  const Eigen::Vector2d d = to - from;
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(d[axis]) < 1e-12) {
      if (from[axis] < low[axis] || from[axis] > high[axis]) {
        return false;
      }
      continue;
    }
    const double a = (low[axis] - from[axis]) / d[axis];
    const double b = (high[axis] - from[axis]) / d[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  to = from + end * d;
  from += begin * d;
  return begin < end;
}

}  // namespace sqslam
