#include "slam/features/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "slam/features/corner_refinement.h"
#include "slam/features/corner_spread.h"

namespace sqslam {
namespace {

constexpr int kPatchRadius = 15;  // of orientation and descriptor, pixels of the level
constexpr int kBorder = 19;       // no corner nearer to a level's edge: the rotated patch must fit
constexpr int kCellSize = 32;     // of the adaptive FAST threshold, pixels of the level

// Direction from the patch centre to its intensity centroid (Rosin's moments), degrees in [0, 360).
float PatchAngle(const cv::Mat& image, const cv::Point2f& center) {
  const int cx = cvRound(center.x);
  const int cy = cvRound(center.y);
  int m01 = 0;
  int m10 = 0;
  for (int v = -kPatchRadius; v <= kPatchRadius; ++v) {
    const int half = static_cast<int>(std::sqrt(static_cast<double>(kPatchRadius * kPatchRadius - v * v)));
    const auto* row = image.ptr<std::uint8_t>(cy + v) + cx;
    int row_sum = 0;
    for (int u = -half; u <= half; ++u) {
      row_sum += row[u];
      m10 += u * row[u];
    }
    m01 += v * row_sum;
  }
  return cv::fastAtan2(static_cast<float>(m01), static_cast<float>(m10));
}

// A place on a pyramid level in pixels of the full image. Pixel centres lie at whole numbers, so that the
// image begins half a pixel before the first one: this half pixel is larger on a coarser level.
Eigen::Vector2d InFullImage(const cv::Point2f& place, const cv::Size& level, const cv::Size& full) {
  return {(place.x + 0.5) * full.width / level.width - 0.5,
          (place.y + 0.5) * full.height / level.height - 0.5};
}

cv::Mat MakeThumbnail(const cv::Mat& gray) {
  cv::Mat small;
  cv::resize(gray, small, {40, 30}, 0, 0, cv::INTER_AREA);
  cv::Mat thumbnail;
  small.convertTo(thumbnail, CV_32F);
  cv::GaussianBlur(thumbnail, thumbnail, {}, 1.5);
  thumbnail -= cv::mean(thumbnail)[0];
  return thumbnail;
}

}  // namespace

ScaleLevels::ScaleLevels(const OrbOptions& options)
    : factor_(options.scale_factor), log_factor_(std::log(options.scale_factor)) {
  double scale = 1.0;
  for (int i = 0; i < options.levels; ++i) {
    scales_.push_back(scale);
    scale *= factor_;
  }
}

int ScaleLevels::PredictOctave(double distance, double level_zero_distance) const {
  const int octave = static_cast<int>(std::lround(std::log(level_zero_distance / distance) / log_factor_));
  return std::clamp(octave, 0, Count() - 1);
}

OrbExtractor::OrbExtractor(const OrbOptions& options)
    : options_(options),
      describer_(cv::ORB::create(options.num_features, static_cast<float>(options.scale_factor),
                                 options.levels, kPatchRadius + 1)) {
  // Features in proportion to a level's side length.
  const double inverse = 1.0 / options.scale_factor;
  double share = (1.0 - inverse) / (1.0 - std::pow(inverse, options.levels));
  for (int i = 0; i < options.levels; ++i) {
    features_per_level_.push_back(std::max(1, static_cast<int>(std::lround(options.num_features * share))));
    share *= inverse;
  }
}

std::vector<cv::KeyPoint> OrbExtractor::DetectLevel(const cv::Mat& image, int octave) const {
  constexpr int kFastRadius = 3;
  const cv::Rect inner(kBorder, kBorder, image.cols - 2 * kBorder, image.rows - 2 * kBorder);
  if (inner.width < kCellSize || inner.height < kCellSize) {
    return {};
  }
  const int columns = inner.width / kCellSize;
  const int rows = inner.height / kCellSize;
  std::vector<cv::KeyPoint> corners;
  std::vector<cv::KeyPoint> cell_corners;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int x0 = inner.x + inner.width * column / columns;
      const int x1 = inner.x + inner.width * (column + 1) / columns;
      const int y0 = inner.y + inner.height * row / rows;
      const int y1 = inner.y + inner.height * (row + 1) / rows;
      const cv::Rect cell(x0 - kFastRadius, y0 - kFastRadius, x1 - x0 + 2 * kFastRadius,
                          y1 - y0 + 2 * kFastRadius);
      cv::FAST(image(cell), cell_corners, options_.fast_threshold, true);
      if (cell_corners.empty()) {
        cv::FAST(image(cell), cell_corners, options_.min_fast_threshold, true);
      }
      for (cv::KeyPoint& corner : cell_corners) {
        corner.pt += cv::Point2f(static_cast<float>(cell.x - inner.x), static_cast<float>(cell.y - inner.y));
        corners.push_back(corner);
      }
    }
  }
  corners = SpreadCorners(corners, inner.size(), features_per_level_[static_cast<std::size_t>(octave)]);
  for (cv::KeyPoint& corner : corners) {
    corner.pt += cv::Point2f(static_cast<float>(inner.x), static_cast<float>(inner.y));
    corner.angle = PatchAngle(image, corner.pt);
    corner.octave = octave;
    corner.size = static_cast<float>(2 * kPatchRadius + 1);
  }
  return corners;
}

FrameFeatures OrbExtractor::Extract(const cv::Mat& gray, const cv::Mat& bgr, const Camera& camera) {
  std::vector<cv::KeyPoint> corners;    // at whole pixels of their levels, as the descriptor wants them
  std::vector<Eigen::Vector2d> places;  // refined
  cv::Mat level = gray;
  double scale = 1.0;
  for (int octave = 0; octave < options_.levels; ++octave) {
    if (octave > 0) {
      scale *= options_.scale_factor;
      cv::Mat next;
      cv::resize(level, next, {cvRound(gray.cols / scale), cvRound(gray.rows / scale)}, 0, 0,
                 cv::INTER_LINEAR);
      level = next;
    }
    for (cv::KeyPoint& corner : DetectLevel(level, octave)) {
      places.push_back(InFullImage(corner.pt + RefineCorner(level, corner.pt), level.size(), gray.size()));
      corner.pt *= static_cast<float>(scale);
      corner.size *= static_cast<float>(scale);
      corners.push_back(corner);
    }
  }
  cv::Mat descriptors;
  describer_->compute(gray, corners, descriptors);

  FrameFeatures features;
  features.keypoints.reserve(corners.size());
  features.descriptors.resize(corners.size());
  features.colors.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const cv::KeyPoint& corner = corners[i];
    features.keypoints.push_back({camera.Undistort(places[i]), places[i], corner.angle, corner.octave});
    std::memcpy(features.descriptors[i].data(), descriptors.ptr(static_cast<int>(i)), sizeof(Descriptor));
    const auto& color = bgr.at<cv::Vec3b>(cvRound(corner.pt.y), cvRound(corner.pt.x));
    features.colors[i] = {color[2], color[1], color[0]};
  }
  features.grid = KeypointGrid(features.keypoints, camera.width, camera.height);
  features.thumbnail = MakeThumbnail(gray);
  return features;
}

}  // namespace sqslam
