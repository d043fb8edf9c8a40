#include "slam/dense/stereo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"
#include "tests/dense/panel_world.h"

namespace sqslam::testing {
namespace {

class Stereo : public ::testing::Test {
 protected:
  double ErrorAt(const cv::Mat& depth, int x, int y) const {
    return std::abs(depth.at<float>(y, x) / scene_.Depth({0.0, 0.0, 0.0}, x, y) - 1.0);
  }
  // Relative errors of the pixels that have a depth.
  std::vector<double> Errors(const StereoOptions& options) const {
    const cv::Mat depth = EstimateDepth(keyframe_, views_, views_, camera_, range_, options).depth;
    std::vector<double> errors;
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        if (depth.at<float>(y, x) > 0.0F) {
          errors.push_back(ErrorAt(depth, x, y));
        }
      }
    }
    return errors;
  }

  // Returns the median over the pixels that have a depth.
  double MedianSigma(const StereoView& keyframe, const std::vector<StereoView>& views) const {
    const StereoDepth found = EstimateDepth(keyframe, views, views, camera_, range_, {});
    std::vector<double> sigmas;
    for (int i = 0; i < static_cast<int>(found.depth.total()); ++i) {
      if (found.depth.at<float>(i) > 0.0F) {
        sigmas.push_back(found.sigma.at<float>(i));
      }
    }
    return UpperMedian(std::move(sigmas));
  }

  const PaintedScene scene_;
  const Camera camera_ = scene_.camera;
  const StereoView keyframe_ = scene_.View({0.0, 0.0, 0.0});
  const std::vector<StereoView> views_ = {scene_.View({0.25, 0.0, 0.0}), scene_.View({-0.25, 0.02, 0.0}),
                                          scene_.View({0.12, 0.0, 0.03}), scene_.View({-0.12, 0.0, 0.0})};
  const DepthRange range_{1.2, 6.0};
};

TEST_F(Stereo, PatchesAgreeOnlyAtTrueDepth) {
  PatchScores scores(keyframe_, views_, camera_, 0.5);
  const auto mean_score = [&](double factor) {
    cv::Mat inverse_depth(camera_.height, camera_.width, CV_32F);
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        inverse_depth.at<float>(y, x) = static_cast<float>(factor / scene_.Depth({0.0, 0.0, 0.0}, x, y));
      }
    }
    return cv::mean(scores.At(inverse_depth))[0];
  };
  EXPECT_GT(mean_score(1.0), 0.85);
  EXPECT_LT(mean_score(1.3), 0.4);
  EXPECT_LT(mean_score(0.7), 0.4);
  EXPECT_NEAR(mean_score(100.0), -1.0, 1e-5);  // so near that no view shows it
}

TEST_F(Stereo, EstimatesDepthOfSlantedWallAndBox) {
  const std::vector<double> errors = Errors({});
  EXPECT_GT(static_cast<double>(errors.size()), 0.9 * camera_.width * camera_.height);
  EXPECT_LT(LinearQuantile(errors, 0.5), 0.002);
  EXPECT_LT(LinearQuantile(errors, 0.9), 0.02);
}

TEST_F(Stereo, PredictsLargerErrorsOfNoisyImages) {
  cv::RNG random(1);
  const auto noisy = [&](StereoView view) {
    cv::Mat noise(view.gray.size(), CV_16S), sum;
    random.fill(noise, cv::RNG::NORMAL, 0.0, 12.0);
    cv::add(view.gray, noise, sum, cv::noArray(), CV_8U);
    view.gray = sum;
    return view;
  };
  EXPECT_GT(MedianSigma(noisy(keyframe_), ToVector(views_, noisy)), 1.05 * MedianSigma(keyframe_, views_));
}

TEST_F(Stereo, PredictsLargerErrorsOfSmallParallax) {
  const std::vector<StereoView> near = {scene_.View({0.06, 0.0, 0.0}), scene_.View({-0.06, 0.0, 0.0})};
  EXPECT_GT(MedianSigma(keyframe_, near), 1.5 * MedianSigma(keyframe_, views_));
}

TEST_F(Stereo, ReducesErrorByFinerSteps) {
  StereoOptions options;
  options.planes = 32;
  options.refinements = 0;
  const double without = UpperMedian(Errors(options));
  options.refinements = 3;
  EXPECT_LT(UpperMedian(Errors(options)), 0.5 * without);
}

}  // namespace
}  // namespace sqslam::testing
