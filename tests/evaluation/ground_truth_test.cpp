#include "slam/evaluation/ground_truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class GroundTruthTest : public testing::Test {
 protected:
  fs::path Write(const std::string& name, const std::string& text) { return folder_.Write(name, text); }

  std::string MessageOf(const std::string& objects) {
    return InputErrorOf([&] { ReadGroundTruthObjects(Write("objects_gt.json", objects)); });
  }

  TemporaryFolder folder_;
};

constexpr const char* kRows = R"([[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]])";
constexpr const char* kFlat = R"([0,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1])";

std::string Entry(const std::string& pose, const std::string& more = "") {
  return R"({"id": 4, "label": "cup", "primitive": "cylinder", "center": [1,2,3], "half_size": [0.1,0.2,0.3],)" +
         more + R"("T_world_object": )" + pose + "}";
}

TEST_F(GroundTruthTest, TruncatesLongLabels) {
  const auto objects = ReadGroundTruthObjects(
      Write("objects_gt.json", R"([{"id": 1, "label": ")" + std::string(kMaxLabelBytes + 100, 'a') +
                                   R"(", "primitive": "cuboid", "center": [0,0,0], "half_size": [1,1,1]}])"));
  EXPECT_EQ(objects.at(0).label, std::string(kMaxLabelBytes, 'a'));
}

TEST_F(GroundTruthTest, ReadsBothFormsOfListAndPose) {
  for (const std::string& text : {"[" + Entry(kRows) + "]", "[" + Entry(kFlat) + "]",
                                  R"({"up_world": [0,0,1], "objects": [)" + Entry(kRows) + "]}"}) {
    const auto objects = ReadGroundTruthObjects(Write("objects_gt.json", text));
    ASSERT_EQ(objects.size(), 1u);
    EXPECT_EQ(objects[0].id, 4);
    EXPECT_EQ(objects[0].solid.kind, SolidKind::kCylinder);
    EXPECT_TRUE(objects[0].scored);
    const Eigen::Vector3d p = objects[0].solid.T_map_object * Eigen::Vector3d(1, 0, 0);
    EXPECT_TRUE(p.isApprox(Eigen::Vector3d(1, 3, 3))) << p.transpose();
  }
}

TEST_F(GroundTruthTest, ReadsOtherShapesAsSuperquadrics) {
  const auto kind_of = [&](const std::string& more) {
    return ReadGroundTruthObjects(Write("objects_gt.json", "[" + Entry(kRows, more) + "]"))[0].solid.kind;
  };
  EXPECT_EQ(kind_of(R"("shape": [0.1, 1.0],)"), SolidKind::kCylinder);
  EXPECT_EQ(kind_of(R"("shape": [0.3, 0.8],)"), SolidKind::kSuperquadric);
}

TEST_F(GroundTruthTest, NamesBrokenObject) {
  EXPECT_THAT(MessageOf("[1"), HasSubstr("objects_gt.json:1: invalid JSON"));
  EXPECT_THAT(MessageOf("3"), HasSubstr("expected a list"));
  EXPECT_THAT(MessageOf("[" + Entry(kRows) + ",{\"id\": 5}]"), HasSubstr("object 2 of the list"));
  EXPECT_THAT(MessageOf("[" + Entry("[1,2,3]") + "]"), HasSubstr("16 numbers"));
  EXPECT_THAT(MessageOf(R"([{"id":1,"label":"a","primitive":"cone","center":[0,0,0],"half_size":[1,1,1]}])"),
              HasSubstr("'cone'"));
  EXPECT_THAT(
      MessageOf(R"([{"id":1,"label":"a","primitive":"cuboid","center":[0,0,0],"half_size":[1,0,1]}])"),
      HasSubstr("half sizes above 0"));
}

TEST_F(GroundTruthTest, CountsBoxesByTheirObjectId) {
  Write("rgb.txt", "# comment\n0.0 a.png\n0.1 b.png\n");
  Write("groundtruth.txt", "0.0 0 0 0 0 0 0 1\n");
  Write("objects_gt.json", "[" + Entry(kRows) + "]");
  Write("boxes.txt",
        "0.0 cup 0.9 1 2 3 4 4\n0.0 cup 0.9 1 2 3 4 7\n0.1 cup 0.9 1 2 3 4 4 0.5\n0.1 cup 0.9 1 2 3 4\n");
  const GroundTruth truth = ReadGroundTruth(folder_.Path());
  EXPECT_EQ(truth.frames, 2);
  EXPECT_TRUE(truth.has_detection_counts);
  EXPECT_EQ(truth.objects.at(0).detections, 2);
}

TEST_F(GroundTruthTest, NamesMissingFiles) {
  EXPECT_THROW(ReadGroundTruth(folder_.Path() / "nowhere"), InputError);
  Write("rgb.txt", "0.0 a.png\n");
  try {
    ReadGroundTruth(folder_.Path());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("groundtruth.txt"));
  }
}

TEST(GroundTruthOfSequences, ReadsRedkitchenAndDesk) {
  const fs::path data = fs::path(SQSLAM_SOURCE_DIR) / "../shared/data";
  if (!fs::exists(data / "redkitchen")) {
    GTEST_SKIP() << "no sequences at " << data;
  }
  const GroundTruth kitchen = ReadGroundTruth(data / "redkitchen");
  EXPECT_EQ(kitchen.frames, 1000);
  EXPECT_EQ(kitchen.objects.size(), 31u);
  EXPECT_TRUE(kitchen.has_scored);
  const auto& objects = kitchen.objects;
  EXPECT_EQ(std::count_if(objects.begin(), objects.end(), [](const auto& object) { return object.scored; }),
            6);
  EXPECT_EQ(std::count_if(objects.begin(), objects.end(), [](const auto& o) { return o.detections >= 60; }),
            14);
  const GroundTruth desk = ReadGroundTruth(data / "blender_desk_a");
  EXPECT_EQ(desk.objects.size(), 11u);
  EXPECT_GT(desk.objects[0].detections, 20);
}

}  // namespace
}  // namespace sqslam
