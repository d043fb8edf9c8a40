#include "slam/features/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "slam/features/brief_pattern.h"
#include "slam/features/patch_descriptor.h"

namespace sqslam {
namespace {

constexpr int kBorder = kBriefReach;  // pixels at a level's edges without corners: the rotated patch must fit

// Converts a position on a pyramid level to pixels of the full image. Pixel centres are at integers, so that
// the image begins half a pixel before the first one; on a coarser level this half pixel is larger.
Eigen::Vector2d InFullImage(const cv::Point2f& place, const cv::Size& level, const cv::Size& full) {
  return {(place.x + 0.5) * full.width / level.width - 0.5,
          (place.y + 0.5) * full.height / level.height - 0.5};
}

// `raw_middle`: of `pixel`, in the full image.
KeypointPatch PatchAround(const cv::Mat& level, const cv::Point& pixel, const Eigen::Vector2d& raw_middle) {
  KeypointPatch patch;
  patch.raw_middle = raw_middle.cast<float>();
  auto row = patch.grays.begin();
  for (int y = -KeypointPatch::kRadius; y <= KeypointPatch::kRadius; ++y) {
    row = std::copy_n(level.ptr<std::uint8_t>(pixel.y + y) + pixel.x - KeypointPatch::kRadius,
                      KeypointPatch::kSide, row);
  }
  return patch;
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
      levels_(static_cast<std::size_t>(options.levels)),
      blurred_(static_cast<std::size_t>(options.levels)),
      detector_(options.fast_threshold, options.min_fast_threshold) {
  // Features in proportion to a level's side length.
  const double inverse = 1.0 / options.scale_factor;
  double share = (1.0 - inverse) / (1.0 - std::pow(inverse, options.levels));
  for (int i = 0; i < options.levels; ++i) {
    features_per_level_.push_back(std::max(1, static_cast<int>(std::lround(options.num_features * share))));
    share *= inverse;
  }
}

std::vector<cv::KeyPoint> OrbExtractor::DetectLevel(std::size_t octave, const cv::Mat& ignored) {
  const cv::Mat& image = levels_[octave];
  const cv::Rect inner(kBorder, kBorder, image.cols - 2 * kBorder, image.rows - 2 * kBorder);
  std::vector<cv::KeyPoint> found = detector_.Detect(image, inner);
  if (!ignored.empty()) {  // before they are distributed, so that the rest of the image gets their share
    std::erase_if(found, [&](const cv::KeyPoint& corner) {
      const Eigen::Vector2d place =
          InFullImage(corner.pt + cv::Point2f(inner.tl()), image.size(), ignored.size());
      return ignored.at<std::uint8_t>(cvRound(place.y()), cvRound(place.x())) != 0;
    });
  }
  std::erase_if(
      found, [&](const cv::KeyPoint& corner) { return IsOnEdge(image, cv::Point(corner.pt) + inner.tl()); });
  std::vector<cv::KeyPoint> corners =
      DistributeByQuadtree(std::move(found), inner.size(), features_per_level_[octave]);
  for (cv::KeyPoint& corner : corners) {
    corner.pt += cv::Point2f(inner.tl());
  }
  return corners;
}

void OrbExtractor::ExtractLevel(std::size_t octave, double scale, const cv::Mat& bgr, const Camera& camera,
                                const cv::Mat& ignored, FrameFeatures& features,
                                std::vector<KeypointPatch>& patches) {
  constexpr double kMaxLensError = 1.0;  // px, of a pixel whose ray no pinhole could see
  const std::vector<cv::KeyPoint> corners = DetectLevel(octave, ignored);
  if (corners.empty()) {
    return;
  }
  const cv::Mat& level = levels_[octave];
  BlurForDescriptors(level, blurred_[octave]);
  for (const cv::KeyPoint& corner : corners) {
    const cv::Point pixel = corner.pt;  // FAST only returns integer pixels
    const Eigen::Vector2d place =
        InFullImage(corner.pt + RefineCorner(level, pixel), level.size(), bgr.size());
    const Eigen::Vector2d undistorted = camera.Undistort(place);
    if (!IsInReach(undistorted) ||
        (camera.lens == LensModel::kFisheye &&
         (camera.ProjectDistorted(camera.Unproject(undistorted)) - place).norm() > kMaxLensError)) {
      continue;
    }
    const float angle = PatchAngle(level, pixel);
    features.keypoints.push_back({undistorted, place, angle, static_cast<int>(octave)});
    features.descriptors.push_back(DescribePatch(blurred_[octave], pixel, angle));
    patches.push_back(PatchAround(level, pixel, InFullImage(corner.pt, level.size(), bgr.size())));
    const cv::Point2f full = corner.pt * static_cast<float>(scale);
    const auto& color = bgr.at<cv::Vec3b>(cvRound(full.y), cvRound(full.x));
    features.colors.push_back({color[2], color[1], color[0]});
  }
}

FrameFeatures OrbExtractor::Extract(const cv::Mat& gray, const cv::Mat& bgr, const Camera& camera,
                                    const cv::Mat& ignored) {
  FrameFeatures features;
  const auto expected = static_cast<std::size_t>(options_.num_features) * 11 / 10;
  features.keypoints.reserve(expected);
  features.descriptors.reserve(expected);
  auto patches = std::make_shared<std::vector<KeypointPatch>>();
  patches->reserve(expected);
  features.colors.reserve(expected);
  levels_[0] = gray;
  double scale = 1.0;
  for (std::size_t octave = 0; octave < levels_.size(); ++octave) {
    if (octave > 0) {
      scale *= options_.scale_factor;
      const cv::Size size(cvRound(gray.cols / scale), cvRound(gray.rows / scale));
      if (std::min(size.width, size.height) <= 2 * kBorder) {
        break;  // no room for corners from here on, and soon no pixel
      }
      cv::resize(levels_[octave - 1], levels_[octave], size, 0, 0, cv::INTER_LINEAR);
    }
    ExtractLevel(octave, scale, bgr, camera, ignored, features, *patches);
  }
  features.patches = std::move(patches);
  levels_[0].release();  // owned by the caller
  features.grid = KeypointGrid(features.keypoints, camera.width, camera.height);
  return features;
}

}  // namespace sqslam
