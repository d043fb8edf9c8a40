#include "slam/features/sift_extractor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace sqslam {
namespace {

constexpr int kBins = 128;  // of a SIFT descriptor

// Returns two bits per bin: above the median of all bins, above their upper quartile.
Descriptor Binarize(const float* bins) {
  std::array<float, kBins> sorted;
  std::copy_n(bins, kBins, sorted.begin());
  std::ranges::nth_element(sorted, sorted.begin() + kBins / 2);
  const float median = sorted[kBins / 2];
  std::ranges::nth_element(sorted, sorted.begin() + 3 * kBins / 4);
  const float quartile = sorted[3 * kBins / 4];
  Descriptor descriptor{};
  for (int i = 0; i < kBins; ++i) {
    descriptor[i / 8] |= static_cast<std::uint8_t>((bins[i] > median ? 1 : 0) << (i % 8));
    descriptor[(kBins + i) / 8] |= static_cast<std::uint8_t>((bins[i] > quartile ? 1 : 0) << (i % 8));
  }
  return descriptor;
}

}  // namespace

FrameFeatures SiftExtractor::Extract(const cv::Mat& bgr, const Camera& camera, const ScaleLevels& levels,
                                     const cv::Mat& ignored) const {
  return Undistorted(ExtractRaw(bgr, levels, ignored), camera);
}

FrameFeatures SiftExtractor::ExtractRaw(const cv::Mat& bgr, const ScaleLevels& levels,
                                        const cv::Mat& ignored) const {
  constexpr double kContrast = 0.02;     // half of OpenCV's: COLMAP's threshold
  constexpr float kSmallestSize = 2.0F;  // px, diameter of a keypoint of level 0
  cv::Mat gray;
  cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
  const auto sift = cv::SIFT::create(0, 3, kContrast);
  cv::Mat mask;
  if (!ignored.empty()) {
    cv::resize(ignored, mask, gray.size(), 0, 0, cv::INTER_NEAREST);
    mask = mask == 0;
  }
  std::vector<cv::KeyPoint> found;
  sift->detect(gray, found, mask);
  std::ranges::stable_sort(found, std::greater<>(), &cv::KeyPoint::size);
  found.resize(std::min(found.size(), static_cast<std::size_t>(options_.num_features)));
  cv::Mat bins;
  sift->compute(gray, found, bins);
  FrameFeatures features;
  features.kind = FeatureKind::kSift;
  for (int i = 0; i < static_cast<int>(found.size()); ++i) {
    const Eigen::Vector2d place(found[i].pt.x, found[i].pt.y);
    const int octave = levels.PredictOctave(kSmallestSize, found[i].size);
    features.keypoints.push_back({place, place, found[i].angle, octave});
    features.descriptors.push_back(Binarize(bins.ptr<float>(i)));
    const auto& color = bgr.at<cv::Vec3b>(std::clamp(cvRound(place.y()), 0, bgr.rows - 1),
                                          std::clamp(cvRound(place.x()), 0, bgr.cols - 1));
    features.colors.push_back({color[2], color[1], color[0]});
  }
  return features;
}

FrameFeatures Undistorted(const FrameFeatures& raw, const Camera& camera) {
  FrameFeatures features;
  features.kind = raw.kind;
  for (std::size_t i = 0; i < raw.Size(); ++i) {
    Keypoint keypoint = raw.keypoints[i];
    keypoint.pixel = camera.Undistort(keypoint.raw_pixel);
    if (IsInReach(keypoint.pixel)) {
      features.keypoints.push_back(keypoint);
      features.descriptors.push_back(raw.descriptors[i]);
      features.colors.push_back(raw.colors[i]);
    }
  }
  features.grid = KeypointGrid(features.keypoints, camera.width, camera.height);
  return features;
}

}  // namespace sqslam
