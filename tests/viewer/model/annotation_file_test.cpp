#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/viewer/model/edited_document.h"
#include "slam/evaluation/ground_truth.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::viewer {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

Annotation AllKinds() {
  Annotation annotation;
  double place = 0.25;
  for (const SolidKind kind :
       {SolidKind::kCuboid, SolidKind::kCylinder, SolidKind::kEllipsoid, SolidKind::kSuperquadric}) {
    Solid solid = UprightSolid(kind, {place, -1.5, 0.125 * place}, 0.5 * place, {0.1, 0.2, 0.3 * place});
    if (kind == SolidKind::kSuperquadric) {
      solid.e1 = 0.4;
      solid.e2 = 1.3;
    }
    annotation.Add({0, std::string(NameOf(kind)), "", solid, ""});
    place += 0.5;
  }
  annotation.solids[1].name = "white mug";
  return annotation;
}

void ExpectNear(const Solid& a, const Solid& b, double tolerance) {
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_LT((a.half_size - b.half_size).norm(), tolerance);
  EXPECT_NEAR(a.e1, b.e1, tolerance);
  EXPECT_NEAR(a.e2, b.e2, tolerance);
  EXPECT_LT((a.T_map_object.translation - b.T_map_object.translation).norm(), tolerance);
  EXPECT_LT(a.T_map_object.rotation.angularDistance(b.T_map_object.rotation), 10 * tolerance);
}

json ReadJson(const std::filesystem::path& path) { return json::parse(std::ifstream(path)); }

class AnnotationFile : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.Path() / "objects_gt.json";
};

TEST_F(AnnotationFile, ReadsBackInEvaluation) {
  const Annotation annotation = AllKinds();
  WriteAnnotation(path_, annotation);
  const std::vector<GroundTruthObject> read = ReadGroundTruthObjects(path_);
  ASSERT_EQ(read.size(), annotation.solids.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].id, annotation.solids[i].id);
    EXPECT_EQ(read[i].label, annotation.solids[i].label);
    EXPECT_EQ(read[i].name, annotation.solids[i].name);
    EXPECT_TRUE(read[i].scored);
    ExpectNear(read[i].solid, annotation.solids[i].solid, 1e-8);
  }
}

TEST_F(AnnotationFile, HasDocumentedKeys) {
  WriteAnnotation(path_, AllKinds());
  const json list = ReadJson(path_);
  ASSERT_TRUE(list.is_array());
  const json& cuboid = list.at(0);
  EXPECT_EQ(cuboid.at("id"), 1);
  EXPECT_EQ(cuboid.at("primitive"), "cuboid");
  EXPECT_EQ(cuboid.at("center"), json({0.25, -1.5, 0.03125}));
  EXPECT_EQ(cuboid.at("yaw"), 0.125);
  EXPECT_EQ(cuboid.at("half_size"), json({0.1, 0.2, 0.075}));
  EXPECT_EQ(cuboid.at("shape"), json({0.1, 0.1}));
  ASSERT_EQ(cuboid.at("T_world_object").size(), 4u);
  EXPECT_NEAR(cuboid["T_world_object"][1][0].get<double>(), std::sin(0.125), 1e-8);
  EXPECT_EQ(cuboid["T_world_object"][1][3], -1.5) << "row-major";
  EXPECT_EQ(cuboid["T_world_object"][3], json({0.0, 0.0, 0.0, 1.0}));
}

TEST_F(AnnotationFile, ReadsBackOwnFiles) {
  const Annotation annotation = AllKinds();
  WriteAnnotation(path_, annotation);
  const Annotation read = ReadAnnotation(path_);
  ASSERT_EQ(read.solids.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    ExpectNear(read.solids[i].solid, annotation.solids[i].solid, 1e-8);
    EXPECT_EQ(read.solids[i].more, "");
  }
  WriteAnnotation(path_, read);
  EXPECT_EQ(ReadJson(path_), [&] {
    WriteAnnotation(path_, annotation);
    return ReadJson(path_);
  }()) << "written again it stays the same to the last digit";
}

TEST_F(AnnotationFile, KeepsUnknownKeys) {
  folder_.Write("objects_gt.json",
                R"({"up_world": [0, -1, 0], "note": "by hand }", "objects": [{"id": 7, "label": "cup",
                "primitive": "cylinder", "half_size": [1, 1, 2], "center": [1, 2, 3], "scored": true,
                "visible": {"from": [1, 2]}}], "world": {"unit": {"name": "m"}}})");
  Annotation annotation = ReadAnnotation(path_);
  ASSERT_EQ(annotation.solids.size(), 1u);
  annotation.solids[0].label = "mug";
  annotation.Add({0, "box", "", UprightSolid(SolidKind::kCuboid, {0, 0, 0}, 0, {1, 1, 1}), ""});
  WriteAnnotation(path_, annotation);
  const json root = ReadJson(path_);
  EXPECT_EQ(root.at("up_world"), json({0, -1, 0}));
  EXPECT_EQ(root.at("note"), "by hand }");
  EXPECT_EQ(root.at("world").at("unit").at("name"), "m");
  EXPECT_EQ(root.at("objects").at(0).at("label"), "mug");
  EXPECT_EQ(root.at("objects").at(0).at("scored"), true);
  EXPECT_EQ(root.at("objects").at(0).at("visible").at("from").at(1), 2);
  EXPECT_FALSE(root.at("objects").at(1).contains("scored"));
  EXPECT_EQ(ReadGroundTruthObjects(path_).at(1).id, 8);
}

TEST_F(AnnotationFile, WritesWorldFrameFromMapFrame) {
  Sim3d S_world_map;
  S_world_map.scale = 2.5;
  S_world_map.rotation =
      Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitX());
  S_world_map.translation = {1.0, 2.0, 3.0};
  const Annotation annotation = AllKinds();
  WriteAnnotation(path_, annotation, S_world_map);
  const auto world = ReadGroundTruthObjects(path_);
  const Annotation again = ReadAnnotation(path_, S_world_map);
  for (std::size_t i = 0; i < world.size(); ++i) {
    ExpectNear(world[i].solid, Transform(S_world_map, annotation.solids[i].solid), 1e-8);
    ExpectNear(again.solids[i].solid, annotation.solids[i].solid, 1e-8);
  }
}

TEST_F(AnnotationFile, ReportsFileAndObjectOfErrors) {
  folder_.Write("objects_gt.json", R"([{"id": 1, "label": "a", "primitive": "cuboid", "center": [0, 0, 0],
      "half_size": [1, 1, 1]}, {"id": 1, "label": "a", "primitive": "cuboid", "center": [0, 0, 0],
      "half_size": [1, 1, 1]}])");
  EXPECT_THAT(InputErrorOf([&] { ReadAnnotation(path_); }),
              HasSubstr("objects_gt.json: object 2 of the list: id 1 is listed twice"));
  folder_.Write("objects_gt.json", R"([{"id": 1}])");
  EXPECT_THAT(InputErrorOf([&] { ReadAnnotation(path_); }), HasSubstr("object 1 of the list"));
}

TEST_F(AnnotationFile, AlignsMapToGroundTruthByTrajectories) {
  std::string map, world, images;
  Sim3d S_world_map;
  S_world_map.scale = 3.0;
  S_world_map.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  S_world_map.translation = {5.0, -1.0, 2.0};
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d p(std::cos(0.3 * i), std::sin(0.3 * i), 0.1 * i);
    const Eigen::Vector3d q = S_world_map * p;
    const auto line = [i](const Eigen::Vector3d& v) {
      return std::to_string(0.1 * i) + " " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " +
             std::to_string(v.z()) + " 0 0 0 1\n";
    };
    map += line(p);
    world += line(q);
    images += std::to_string(0.1 * i) + " rgb/" + std::to_string(i) + ".png\n";
  }
  folder_.Write("result/trajectory.txt", map);
  folder_.Write("sequence/groundtruth.txt", world);
  folder_.Write("sequence/rgb.txt", images);
  const Sim3d found = AlignToGroundTruth(folder_.Path() / "result", folder_.Path() / "sequence");
  EXPECT_NEAR(found.scale, 3.0, 1e-4);
  EXPECT_LT(found.rotation.angularDistance(S_world_map.rotation), 1e-4);
  EXPECT_LT((found.translation - S_world_map.translation).norm(), 1e-4);
  folder_.Write("result/trajectory.txt", "0.0 0 0 0 0 0 0 1\n");
  EXPECT_THAT(
      InputErrorOf([&] { AlignToGroundTruth(folder_.Path() / "result", folder_.Path() / "sequence"); }),
      HasSubstr("three poses"));
}

}  // namespace
}  // namespace sqslam::viewer
