#include "render/picture/picture_difference.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <opencv2/quality/qualityssim.hpp>
#include <vector>

namespace sqslam {
namespace {

cv::Scalar MostFrequentColor(const cv::Mat& picture) {
  const int channels = picture.channels();
  std::vector<std::uint32_t> colors;
  colors.reserve(picture.total());
  for (int y = 0; y < picture.rows; ++y) {
    const std::uint8_t* row = picture.ptr(y);
    for (int x = 0; x < picture.cols; ++x) {
      std::uint32_t packed = 0;
      for (int c = 0; c < channels; ++c) {
        packed |= static_cast<std::uint32_t>(row[x * channels + c]) << (8 * c);
      }
      colors.push_back(packed);
    }
  }
  std::sort(colors.begin(), colors.end());
  std::uint32_t best = 0;
  std::ptrdiff_t most = 0;
  for (auto begin = colors.begin(); begin != colors.end();) {
    const auto end = std::upper_bound(begin, colors.end(), *begin);
    if (end - begin > most) {
      most = end - begin;
      best = *begin;
    }
    begin = end;
  }
  return {static_cast<double>(best & 255U), static_cast<double>(best >> 8U & 255U),
          static_cast<double>(best >> 16U & 255U), static_cast<double>(best >> 24U)};
}

// 255 where the picture is not the background.
cv::Mat Drawn(const cv::Mat& picture, const cv::Scalar& background) {
  const cv::Scalar tolerance = cv::Scalar::all(2.0);  // grey levels: rounding, not drawing
  cv::Mat empty;
  cv::inRange(picture, background - tolerance, background + tolerance, empty);
  return 255 - empty;
}

}  // namespace

double PictureDifference(const cv::Mat& picture, const cv::Mat& reference) {
  constexpr int kWindow = 11;  // px, of SSIM
  if (picture.size() != reference.size() || picture.type() != reference.type()) {
    return 1.0;
  }
  const cv::Scalar background = MostFrequentColor(reference);
  cv::Mat drawn = Drawn(picture, background) | Drawn(reference, background);
  cv::dilate(drawn, drawn, cv::Mat::ones(kWindow, kWindow, CV_8U));
  if (cv::countNonZero(drawn) == 0) {
    return 0.0;
  }
  cv::Mat similarity;
  cv::quality::QualitySSIM::compute(picture, reference, similarity);
  const cv::Scalar mean = cv::mean(similarity, drawn);
  double sum = 0.0;
  for (int c = 0; c < picture.channels(); ++c) {
    sum += mean[c];
  }
  return 1.0 - sum / picture.channels();
}

}  // namespace sqslam
