#include "slam/evaluation/dense_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using testing::HasSubstr;

constexpr double kTop = 0.7;       // of the table, metres
constexpr double kHeight = 1.7;    // of the cameras, which look straight down at it
constexpr double kMapScale = 0.5;  // map units in a metre

const Eigen::Quaterniond kDown(0.0, 1.0, 0.0, 0.0);

// Three keyframes of a table that fills their images, in a map half as large as the world.
class TableResult {
 public:
  // Depths in metres by keyframe, over the true ones; `views` of all pixels.
  explicit TableResult(const std::vector<double>& errors, std::uint8_t views = 3) {
    sequence_.Write("camera.yaml", "width: 32\nheight: 24\nfx: 40\nfy: 40\ncx: 16\ncy: 12\nfps: 10\n");
    sequence_.Write("objects_gt.json",
                    R"([{"id": 1, "label": "dining_table", "primitive": "cuboid", "center": [0, 0, 0.35],
                         "yaw": 0, "half_size": [2, 2, 0.35]}])");
    MapSnapshot map;
    map.camera = {32, 24, 40.0, 40.0, 16.0, 12.0, {}, 10.0};
    Trajectory truth, estimated;
    std::string images;
    for (int i = 0; i < 3; ++i) {
      const Rigid3d T_world_camera{kDown, {0.2 * i, 0.1 * i * i, kHeight}};
      const Rigid3d T_map_camera{kDown, kMapScale * T_world_camera.translation};
      truth.push_back({0.1 * i, T_world_camera});
      estimated.push_back({0.1 * i, T_map_camera});
      map.keyframes.push_back({i, i, 0.1 * i, T_map_camera});
      images += std::to_string(0.1 * i) + " " + std::to_string(i) + ".jpg\n";
      sequence_.Write(std::to_string(i) + ".jpg", "");
    }
    sequence_.Write("rgb.txt", images);
    WriteTrajectory(sequence_.Path() / "groundtruth.txt", truth);
    WriteTrajectory(result_.Path() / "trajectory.txt", estimated);
    RecordingWriter(result_.Path() / "map.sqmap", {"", "test", ""}).Add(map);
    DepthRecording depths(result_.Path() / "map.sqmap", DepthRecording::Access::kWrite);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const SnapshotKeyframe& keyframe = map.keyframes[i];
      DepthMap depth{keyframe.id, keyframe.frame_index, map.camera, keyframe.T_map_camera, {}, {}, {}};
      depth.depth = cv::Mat(24, 32, CV_32F, cv::Scalar(kMapScale * (kHeight - kTop + errors[i])));
      depth.depth.rowRange(0, 12).setTo(0.0F);
      depth.views = cv::Mat(24, 32, CV_8U, cv::Scalar(views));
      depth.bgr = cv::Mat(24, 32, CV_8UC3, cv::Scalar(90, 90, 90));
      depths.PutEstimate(depth, "");
      depths.PutKept(depth);
    }
  }

  // A cloud of the table's top, its points so far above and below in turn (metres).
  void WriteCloud(double distance) const {
    std::ofstream file(result_.Path() / "dense.ply");
    file
        << "ply\nformat ascii 1.0\nelement vertex 900\nproperty float x\nproperty float y\nproperty float z\n"
           "end_header\n";
    for (int i = 0; i < 900; ++i) {
      const double z = kTop + (i % 2 == 0 ? distance : -distance);
      file << kMapScale * 0.03 * (i % 30) << ' ' << kMapScale * 0.03 * (i / 30) << ' ' << kMapScale * z
           << '\n';
    }
  }

  DenseEvaluation Evaluate() const { return EvaluateDense(result_.Path(), sequence_.Path()); }

 private:
  TemporaryFolder sequence_, result_;
};

TEST(DenseEvaluation, ErrorsAreDistancesFromTheSurfaceInMetres) {
  const DenseEvaluation e = TableResult({-0.02, -0.02, -0.04}).Evaluate();
  EXPECT_EQ(e.keyframes, 3);
  EXPECT_NEAR(e.complete, 0.5, 1e-9);
  EXPECT_NEAR(e.tested, 0.5, 1e-9);
  EXPECT_NEAR(e.measured.median, 0.02, 1e-4);
  EXPECT_NEAR(e.measured.p90, 0.04, 1e-4);
  EXPECT_EQ(e.filled, 0.0);
}

TEST(DenseEvaluation, ASolidWithMostOfItsPointsFarInsideIsHollow) {
  const DenseEvaluation hollow = TableResult({-0.02, 0.15, 0.2}).Evaluate();
  EXPECT_EQ(hollow.measured.count, 0);
  EXPECT_EQ(hollow.in_hollow.count, 3 * 96);
  EXPECT_NEAR(hollow.in_hollow.median, 0.15, 1e-4);
  EXPECT_THAT(FormatDense(hollow),
              HasSubstr("left out as hollow, most of their points inside: dining_table"));
  const DenseEvaluation solid = TableResult({-0.02, 0.02, 0.2}).Evaluate();  // errors count on both sides
  EXPECT_EQ(solid.measured.count, 3 * 96);
  EXPECT_NEAR(solid.measured.p90, 0.2, 1e-4);
  EXPECT_TRUE(solid.hollow.empty());
}

TEST(DenseEvaluation, FilledPixelsAndKeyframesWithoutDepthCountApart) {
  const DenseEvaluation e = TableResult({-0.01, -0.01}, kFilledByPlane).Evaluate();
  EXPECT_EQ(e.complete, 0.0);
  EXPECT_NEAR(e.filled, 1.0 / 3.0, 1e-9);  // the third has no depth map
  EXPECT_EQ(e.measured.count, 0);
  EXPECT_NEAR(e.by_plane.median, 0.01, 1e-4);
}

TEST(DenseEvaluation, TheTableTopIsAsFlatAsItsPoints) {
  const TableResult result({0.0, 0.0, 0.0});
  EXPECT_FALSE(result.Evaluate().top.has_value());
  result.WriteCloud(0.006);
  EXPECT_NEAR(result.Evaluate().top.value(), 0.006, 5e-4);
}

TEST(DenseEvaluation, AResultWithoutDepthMapsIsRefused) {
  const TableResult result({});
  EXPECT_THAT(InputErrorOf([&] { result.Evaluate(); }), HasSubstr("expected those of sqslam densify"));
}

}  // namespace
}  // namespace sqslam
