#include <algorithm>
#include <cstdint>
#include <map>
#include <opencv2/imgproc.hpp>
#include <opencv2/quality/qualityssim.hpp>
#include <utility>
#include <vector>

#include "render/picture/picture.h"

namespace sqslam {
namespace {

cv::Scalar MostFrequentColor(const cv::Mat& picture) {
  const int channels = picture.channels();
  std::map<std::uint32_t, int> counts;
  for (int y = 0; y < picture.rows; ++y) {
    const std::uint8_t* pixel = picture.ptr(y);
    for (int x = 0; x < picture.cols; ++x, pixel += channels) {
      std::uint32_t packed = 0;
      for (int c = 0; c < channels; ++c) {
        packed |= static_cast<std::uint32_t>(pixel[c]) << (8 * c);
      }
      ++counts[packed];
    }
  }
  const std::uint32_t best =
      std::ranges::max_element(counts, {}, &std::pair<const std::uint32_t, int>::second)->first;
  return {static_cast<double>(best & 255U), static_cast<double>(best >> 8U & 255U),
          static_cast<double>(best >> 16U & 255U), static_cast<double>(best >> 24U)};
}

// Returns the largest difference to the background over the channels (grey levels, 32F).
cv::Mat Contrast(const cv::Mat& picture, const cv::Scalar& background) {
  cv::Mat apart;
  cv::absdiff(picture, background, apart);
  std::vector<cv::Mat> channels;
  cv::split(apart, channels);
  cv::Mat contrast = channels.front();
  for (const cv::Mat& channel : channels) {
    contrast = cv::max(contrast, channel);
  }
  contrast.convertTo(contrast, CV_32F);
  return contrast;
}

}  // namespace

double PictureDifference(const cv::Mat& picture, const cv::Mat& reference) {
  if (picture.size() != reference.size() || picture.type() != reference.type()) {
    return 1.0;
  }
  const cv::Scalar background = MostFrequentColor(reference);
  cv::Mat weight = cv::max(Contrast(picture, background), Contrast(reference, background));
  cv::GaussianBlur(weight, weight, {11, 11}, 1.5);  // the window of SSIM
  const double total = cv::sum(weight)[0];
  if (total == 0.0) {
    return 0.0;
  }
  cv::Mat similarity;
  cv::quality::QualitySSIM::compute(picture, reference, similarity);
  std::vector<cv::Mat> channels;
  cv::split(similarity, channels);
  double sum = 0.0;
  for (const cv::Mat& channel : channels) {
    sum += channel.dot(weight);
  }
  return std::max(0.0, 1.0 - sum / (total * static_cast<double>(channels.size())));  // rounding may go below
}

}  // namespace sqslam
