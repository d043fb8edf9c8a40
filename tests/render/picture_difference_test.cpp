#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/quality/qualityssim.hpp>

#include "baseline.h"
#include "render/picture/picture.h"

namespace sqslam {
namespace {

const cv::Scalar kPaper = cv::Scalar::all(255);

// White paper with three small discs on it, or fewer.
cv::Mat Discs(int count, const cv::Scalar& paper = kPaper, int type = CV_8UC3) {
  cv::Mat picture(480, 640, type, paper);
  for (int i = 0; i < count; ++i) {
    cv::circle(picture, {160 + 160 * i, 240}, 8, cv::Scalar(60, 90, 200, 255), cv::FILLED, cv::LINE_AA);
  }
  return picture;
}

double MeanOverThePicture(const cv::Mat& a, const cv::Mat& b) {
  const cv::Scalar s = cv::quality::QualitySSIM::compute(a, b, cv::noArray());
  return 1.0 - (s[0] + s[1] + s[2]) / 3.0;
}

TEST(PictureDifference, DetectsSmallObjectMissingFromWhitePicture) {
  EXPECT_LT(MeanOverThePicture(Discs(2), Discs(3)), 0.1 * kThreshold)
      << "which the mean over the paper does not";
  EXPECT_GT(PictureDifference(Discs(2), Discs(3)), 4.0 * kThreshold);
  EXPECT_GT(PictureDifference(Discs(3), Discs(2)), 4.0 * kThreshold);
  EXPECT_GT(PictureDifference(Discs(0), Discs(1)), 0.5);
}

TEST(PictureDifference, DetectsMissingObjectWithoutBackground) {
  const cv::Scalar clear = cv::Scalar::all(0);
  EXPECT_GT(PictureDifference(Discs(2, clear, CV_8UC4), Discs(3, clear, CV_8UC4)), 4.0 * kThreshold);
}

TEST(PictureDifference, ReturnsZeroForEqualPictures) {
  EXPECT_EQ(PictureDifference(Discs(3), Discs(3)), 0.0);
  EXPECT_EQ(PictureDifference(Discs(0), Discs(0)), 0.0);
  cv::Mat rounded = Discs(3);  // by another machine
  rounded -= cv::Scalar::all(1.0);
  EXPECT_LT(PictureDifference(rounded, Discs(3)), 0.01);
}

TEST(PictureDifference, DetectsAnotherBackground) {
  EXPECT_GT(PictureDifference(Discs(3, cv::Scalar::all(30)), Discs(3)), 0.3);
  EXPECT_GT(PictureDifference(Discs(0, cv::Scalar::all(30)), Discs(0)), 0.3);
}

TEST(PictureDifference, ReturnsOneForAnotherSizeOrType) {
  EXPECT_EQ(PictureDifference(cv::Mat(480, 641, CV_8UC3, kPaper), Discs(3)), 1.0);
  EXPECT_EQ(PictureDifference(cv::Mat(480, 640, CV_8UC4, kPaper), Discs(3)), 1.0);
}

}  // namespace
}  // namespace sqslam
