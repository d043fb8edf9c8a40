#include "slam/evaluation/error_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"
#include "tests/objects/dense_box_scene.h"

namespace sqslam {
namespace {

using sqslam::testing::DenseBoxScene;

// The result folder of a run that took the box for `seen`, as its boxes show it, and the ground truth in the
// map's frame. `grown`: what the detector adds at the boxes' right sides, share of their width.
class ErrorBudgetTest : public ::testing::Test {
 protected:
  void Write(const PosedSuperquadric& seen, double grown) {
    SnapshotObject object;
    object.id = 3;
    object.label = "box";
    object.observations = static_cast<int>(scene_.poses.size());
    object.superquadric = seen;
    object.fit.covariance.setIdentity();
    std::string images = "# timestamp path\n";
    Trajectory trajectory;
    RecordingWriter recording(Result() / "map.sqmap", {Sequence().string(), "test", ""});
    for (std::size_t i = 0; i < scene_.poses.size(); ++i) {
      MapSnapshot map;
      map.sequence_number = map.frame_index = static_cast<std::int64_t>(i);
      map.timestamp = static_cast<double>(i);
      map.camera = scene_.camera;
      map.gravity_known = true;
      map.objects = {object};
      Box2d box = *ProjectToBox(seen, scene_.poses[i], scene_.camera);
      box.width *= 1.0 + grown;
      map.detections = {{{"box", 0.9, box}, 3}};
      for (std::size_t k = 0; k < scene_.faces.size(); k += 20) {
        map.points.push_back({scene_.faces[k].p_map.cast<float>(), {}, 3});
      }
      for (std::size_t k = 0; k < scene_.elsewhere.size(); k += 20) {
        map.points.push_back({scene_.elsewhere[k].p_map.cast<float>(), {}, -1});
      }
      trajectory.push_back({map.timestamp, scene_.poses[i]});
      recording.Add(map);
      images += std::to_string(i) + ".0 " + std::to_string(i) + ".png\n";
      cv::imwrite((Sequence() / (std::to_string(i) + ".png")).string(),
                  cv::Mat(48, 64, CV_8UC3, cv::Scalar(90)));
    }
    WriteTrajectory(Result() / "trajectory.txt", trajectory);
    WriteTrajectory(Sequence() / "groundtruth.txt", trajectory);
    WriteObjects(Result() / "objects.json", {object});
    std::ofstream(Sequence() / "rgb.txt") << images;
    std::ofstream(Sequence() / "camera.yaml") << "width: 640\nheight: 480\nfx: 520\nfy: 520\ncx: 320\ncy: "
                                                 "240\ndistortion: [0, 0, 0, 0, 0]\nfps: 1\n";
    std::ofstream(Sequence() / "objects_gt.json")
        << R"([{"id": 1, "label": "box", "primitive": "superquadric", "center": [0, 0, 0.16], "yaw": 0,
                "half_size": [0.12, 0.2, 0.16], "shape": [0.1, 0.1]}])";
  }

  ErrorBudgetTest() {
    std::filesystem::create_directories(Result());
    std::filesystem::create_directories(Sequence());
  }
  std::filesystem::path Result() const { return folder_.Path() / "result"; }
  std::filesystem::path Sequence() const { return folder_.Path() / "sequence"; }
  double Gain(const ErrorBudget& budget, TruePart part) const {
    return budget.objects.front().Gain(static_cast<std::size_t>(part)).value_or(-1.0);
  }

  const DenseBoxScene scene_;
  const TemporaryFolder folder_;
};

TEST_F(ErrorBudgetTest, WrongBoxesAreMadeGoodByTrueOnesAndNotByOtherParts) {
  Write(scene_.truth, 0.25);
  const ErrorBudget budget = ComputeErrorBudget(Result(), Sequence(), {});
  ASSERT_EQ(budget.objects.size(), 1u);
  EXPECT_GT(Gain(budget, TruePart::kBoxes), 0.03);
  EXPECT_NEAR(Gain(budget, TruePart::kPoses), 0.0, 0.01);  // they are true
  EXPECT_GT(Gain(budget, TruePart::kBoxes), Gain(budget, TruePart::kSupport) + 0.02);
  EXPECT_GT(budget.objects.front().iou + Gain(budget, TruePart::kAll), 0.9);
}

TEST_F(ErrorBudgetTest, AnObjectWithTrueEvidenceGainsNothing) {
  Write(scene_.truth, 0.0);
  const ErrorBudget budget = ComputeErrorBudget(Result(), Sequence(), {});
  ASSERT_EQ(budget.objects.size(), 1u);
  EXPECT_GT(budget.objects.front().iou, 0.9);
  for (std::size_t part = 0; part < kTrueParts; ++part) {
    EXPECT_NEAR(budget.objects.front().Gain(part).value_or(-1.0), 0.0, 0.06) << part;
  }
}

TEST_F(ErrorBudgetTest, ItsTableAndFileNameEveryPart) {
  Write(scene_.truth, 0.0);
  const ErrorBudget budget = ComputeErrorBudget(Result(), Sequence(), {});
  const std::string table = FormatBudget(budget);
  WriteBudget(Result() / "budget.json", budget);
  std::ifstream file(Result() / "budget.json");
  const std::string json((std::istreambuf_iterator<char>(file)), {});
  for (const char* name : EnumNames(TruePart())) {
    EXPECT_THAT(table, ::testing::HasSubstr(name));
    EXPECT_THAT(json, ::testing::HasSubstr(name));
  }
  EXPECT_THAT(table, ::testing::HasSubstr("1 box"));
}

TEST_F(ErrorBudgetTest, WithoutTheImagesItSaysWhichAreMissing) {
  Write(scene_.truth, 0.0);
  std::filesystem::remove(Sequence() / "3.png");
  EXPECT_THAT(InputErrorOf([&] { ComputeErrorBudget(Result(), Sequence(), {}); }),
              ::testing::HasSubstr("frame 3: its image is not there"));
}

TEST_F(ErrorBudgetTest, WithoutTrueObjectsThereIsNone) {
  Write(scene_.truth, 0.0);
  std::filesystem::remove(Sequence() / "objects_gt.json");
  try {
    ComputeErrorBudget(Result(), Sequence(), {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("objects_gt.json, expected"));
  }
}

}  // namespace
}  // namespace sqslam
