#include <gtest/gtest.h>

#include "slam/dense/depth_estimation.h"
#include "tests/dense/panel_world.h"

namespace sqslam::testing {
namespace {

constexpr double kInterval = 1.0 / 30.0;  // seconds between frames
constexpr double kReadout = 0.03;         // seconds from the first to the last row

// A camera that moves to the right past the painted scene, 0.9 m/s, and reads its rows one after the other.
class MovingCamera {
 public:
  Eigen::Vector3d Place(double seconds) const { return {0.9 * seconds, 0.15 * seconds, 0.0}; }

  cv::Mat Recorded(int frame) const {
    cv::Mat image(scene.camera.height, scene.camera.width, CV_8U);
    for (int y = 0; y < image.rows; ++y) {
      const double delay = ((y + 0.5) / image.rows - 0.5) * kReadout;
      scene.PaintRow(Place(frame * kInterval + delay), y, image);
    }
    return image;
  }

  ShutterCorrection Correction(double readout) const {
    Sequence sequence;
    PosesByFrame poses;
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 3; ++i) {
      sequence.frames.push_back({i * kInterval, ""});
      poses[i] = {Eigen::Quaterniond::Identity(), Place(i * kInterval)};
    }
    for (int v = 8; v < 240; v += 16) {
      for (int u = 8; u < 320; u += 16) {
        const Eigen::Vector3d place = Place(kInterval);
        points.push_back(place + scene.Depth(place, u, v) * scene.camera.Unproject({double(u), double(v)}));
      }
    }
    return {scene.camera, readout, sequence, poses, points};
  }

  const PaintedScene scene;
};

double MeanDifference(const cv::Mat& a, const cv::Mat& b) {
  const cv::Rect inner(16, 16, a.cols - 32, a.rows - 32);  // what came in from outside the image is not known
  return cv::norm(a(inner), b(inner), cv::NORM_L1) / inner.area();
}

TEST(ShutterCorrection, CorrectsRowsToOneInstant) {
  const MovingCamera camera;
  const cv::Mat recorded = camera.Recorded(1);
  const cv::Mat at_once = camera.scene.View(camera.Place(kInterval)).gray;
  const cv::Mat corrected = camera.Correction(kReadout).Apply(1, recorded);
  EXPECT_GT(MeanDifference(recorded, at_once), 5.0);
  EXPECT_LT(MeanDifference(corrected, at_once), 0.4 * MeanDifference(recorded, at_once));
}

TEST(ShutterCorrection, KeepsImagesWithoutReadoutOrMotion) {
  const MovingCamera camera;
  const cv::Mat recorded = camera.Recorded(1);
  EXPECT_EQ(MeanDifference(camera.Correction(0.0).Apply(1, recorded), recorded), 0.0);
  EXPECT_EQ(MeanDifference(camera.Correction(kReadout).Apply(7, recorded), recorded), 0.0);
}

}  // namespace
}  // namespace sqslam::testing
