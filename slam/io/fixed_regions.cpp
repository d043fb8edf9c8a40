#include "slam/io/fixed_regions.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "slam/io/frame_source.h"

namespace sqslam {
namespace {

constexpr int kSamples = 16;
constexpr int kWidth = 640;             // px, of the images in which edges are compared
constexpr float kMinGradient = 12.0F;   // grey levels per px
constexpr float kMaxDifference = 0.5F;  // of a fixed edge's gradient from the median, as a share of it
constexpr double kFixedShare = 0.8;     // of the images in which a fixed edge shows
constexpr double kUndecidedShare = 0.5;
// A camera that hardly moves has edges of every kind. Where regions are fixed, fewer lie in between.
constexpr double kMinContrast = 1.5;
constexpr double kMaxTexture = 0.5;  // share of the edges: the camera stands still if more are fixed
constexpr int kReach = 15;           // px: a keypoint's patch reaches as far beyond an edge

std::vector<cv::Mat> Gradients(const cv::Mat& gray) {
  cv::Mat small;
  const double scale = std::min(1.0, static_cast<double>(kWidth) / std::max(gray.cols, gray.rows));
  cv::resize(gray, small, {}, scale, scale, cv::INTER_AREA);
  constexpr double kSobelSum = 8.0;
  std::vector<cv::Mat> gradients(2);
  cv::Sobel(small, gradients[0], CV_32F, 1, 0, 3, 1.0 / kSobelSum);
  cv::Sobel(small, gradients[1], CV_32F, 0, 1, 3, 1.0 / kSobelSum);
  return gradients;
}

float Median(std::vector<float>& values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

// Returns the median gradient of each pixel over the images, as CV_32FC2.
cv::Mat MedianGradient(const std::vector<std::vector<cv::Mat>>& gradients) {
  cv::Mat median(gradients.front()[0].size(), CV_32FC2);
  std::vector<float> values(gradients.size());
  for (int y = 0; y < median.rows; ++y) {
    for (int x = 0; x < median.cols; ++x) {
      for (int axis = 0; axis < 2; ++axis) {
        std::ranges::transform(gradients, values.begin(),
                               [&](const auto& image) { return image[axis].template at<float>(y, x); });
        median.at<cv::Vec2f>(y, x)[axis] = Median(values);
      }
    }
  }
  return median;
}

// Edges of the median gradient, by the share of images that have them.
struct Edges {
  cv::Mat fixed;  // 8UC1
  double undecided = 0.0;
  double fixed_of_texture = 0.0;
};

Edges FindEdges(const std::vector<std::vector<cv::Mat>>& gradients) {
  const cv::Mat median = MedianGradient(gradients);
  Edges edges{cv::Mat::zeros(median.size(), CV_8UC1)};
  double texture = 0.0;
  double fixed_texture = 0.0;
  for (int y = 0; y < median.rows; ++y) {
    for (int x = 0; x < median.cols; ++x) {
      const cv::Vec2f& usual = median.at<cv::Vec2f>(y, x);
      const double length = cv::norm(usual);
      int alike = 0;
      int textured = 0;
      for (const std::vector<cv::Mat>& image : gradients) {
        const cv::Vec2f here(image[0].at<float>(y, x), image[1].at<float>(y, x));
        alike += cv::norm(here - usual) < kMaxDifference * length ? 1 : 0;
        textured += cv::norm(here) > kMinGradient ? 1 : 0;
      }
      const double share = static_cast<double>(alike) / static_cast<double>(gradients.size());
      const bool fixed = length > kMinGradient && share >= kFixedShare;
      edges.fixed.at<std::uint8_t>(y, x) = fixed ? 255 : 0;
      edges.undecided += length > kMinGradient && share >= kUndecidedShare && !fixed ? 1.0 : 0.0;
      texture += textured;
      fixed_texture += fixed ? textured : 0;
    }
  }
  edges.fixed_of_texture = fixed_texture / std::max(1.0, texture);
  return edges;
}

}  // namespace

cv::Mat FixedRegions(const std::vector<cv::Mat>& grays) {
  if (std::ssize(grays) < kSamples) {
    return {};
  }
  std::vector<std::vector<cv::Mat>> gradients;
  std::ranges::transform(grays, std::back_inserter(gradients), Gradients);
  const Edges edges = FindEdges(gradients);
  const int fixed = cv::countNonZero(edges.fixed);
  if (fixed == 0 || fixed < kMinContrast * edges.undecided || edges.fixed_of_texture > kMaxTexture) {
    return {};
  }
  cv::Mat regions;
  cv::dilate(edges.fixed, regions, cv::Mat::ones(2 * kReach + 1, 2 * kReach + 1, CV_8UC1));
  cv::resize(regions, regions, grays.front().size(), 0.0, 0.0, cv::INTER_NEAREST);
  return regions;
}

cv::Mat FindFixedRegions(const Sequence& sequence) {
  constexpr double kMinSeconds = 2.0;
  const auto frames = std::ssize(sequence.frames);
  if (frames < kSamples || static_cast<double>(frames) < kMinSeconds * sequence.camera.fps) {
    return {};
  }
  const std::int64_t step = frames / kSamples;
  FrameSource source(sequence, {.start = step / 2, .count = kSamples, .stride = step});
  std::vector<cv::Mat> grays;
  while (const std::optional<Frame> frame = source.Next()) {
    grays.push_back(frame->gray);
  }
  return FixedRegions(grays);
}

}  // namespace sqslam
