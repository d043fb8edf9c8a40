#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "render/picture/picture.h"

namespace sqslam {

inline constexpr double kThreshold = 0.04;  // PictureDifference(), as `sqslam render --reference-threshold`

// SQSLAM_UPDATE_BASELINES=1 writes the picture as the new baseline (scripts/update-baselines.sh).
inline void ExpectBaseline(const cv::Mat& image, const std::string& name, double threshold = kThreshold) {
  const std::string path = std::string(SQSLAM_SOURCE_DIR) + "/tests/baselines/" + name + ".png";
  if (std::getenv("SQSLAM_UPDATE_BASELINES") != nullptr) {
    cv::imwrite(path, image);
  }
  const cv::Mat baseline = cv::imread(path, cv::IMREAD_UNCHANGED);
  ASSERT_FALSE(baseline.empty()) << path
                                 << ": missing; look at the picture, then scripts/update-baselines.sh";
  ASSERT_EQ(image.size(), baseline.size());
  ASSERT_EQ(image.type(), baseline.type());
  const double difference = PictureDifference(image, baseline);
  if (difference > threshold) {
    const auto written = std::filesystem::temp_directory_path() / ("sqslam-" + name + ".png");
    cv::Mat apart;
    cv::absdiff(image, baseline, apart);
    cv::Mat side_by_side;
    cv::hconcat(std::vector<cv::Mat>{image, baseline, apart}, side_by_side);
    cv::imwrite(written.string(), side_by_side);
    ADD_FAILURE() << "1 - SSIM where something is drawn is " << difference << ", at most " << threshold
                  << " expected; picture, baseline and difference side by side: " << written;
  }
}

}  // namespace sqslam
