#include "slam/snapshot/object_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/map_scale.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"
#include "tests/snapshot/sample_snapshots.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::vector<SolidPart> kParts = {{{0.0, 0.0, 0.75}, {{1.0, 1.0, 0.25}, 0.15, 0.15}},
                                       {{-0.5, 0.25, -0.25}, {{0.1, 0.2, 0.75}, 0.15, 1.0}}};

class ObjectPartsTest : public ::testing::Test {
 protected:
  ObjectPartsTest() {
    MapSnapshot young = map_;
    young.objects[0].superquadric.shape.half_size.z() *= 2.0;
    RecordingWriter writer(path_, {"sequence", "test", "config"});
    writer.Add(young);
    writer.Add(map_);
  }

  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.Path() / "map.sqmap";
  MapSnapshot map_ = testing::MakeSnapshot(1);
};

TEST_F(ObjectPartsTest, ReturnsPartsToHullsOfTheirSize) {
  EXPECT_THAT(RecordingReader(path_).Last()->objects[0].parts, IsEmpty());
  StoreObjectParts(path_, {{4, map_.objects[0].superquadric.shape.half_size, kParts}});
  StoreMapScale(path_, MapScale{2.5, 0.05, "height"});
  const RecordingReader reader(path_);
  EXPECT_THAT(reader.Read(0)->objects[0].parts, IsEmpty()) << "its hull is twice as high";
  const SnapshotObject object = reader.Last()->objects[0];
  ASSERT_THAT(object.parts, SizeIs(2));
  EXPECT_EQ(object.parts[1].shape.e2, 1.0);
  const PosedSuperquadric part = SolidsOf(object)[1];
  EXPECT_TRUE(part.shape.half_size.isApprox(2.5 * Eigen::Vector3d(0.01, 0.04, 0.225), 1e-12));
  EXPECT_TRUE((object.superquadric.T_map_object.Inverse() * part.T_map_object.translation)
                  .isApprox(2.5 * Eigen::Vector3d(-0.05, 0.05, -0.075), 1e-9));
  StoreObjectParts(path_, {});
  EXPECT_THAT(SolidsOf(RecordingReader(path_).Last()->objects[0]), SizeIs(1));
}

TEST_F(ObjectPartsTest, DropsPartsOfAnotherClass) {
  map_.objects[0].parts = kParts;
  ObjectEdits edits;
  edits.Rename(4, "mine");
  EXPECT_THAT(Apply(edits, map_)->objects[0].parts, SizeIs(2));
  edits.SetLabel(4, "bowl");
  EXPECT_THAT(Apply(edits, map_)->objects[0].parts, IsEmpty());
}

TEST_F(ObjectPartsTest, ReportsBrokenParts) {
  for (const char* text : {"[", "7", R"([{"id": 4}])",
                           R"([{"id": 4, "half_size": [1, 1, 1], "parts": [{"center": [0.5, 0, 0],
                               "half_size": [0.6, 1, 1], "shape": [0, 0]}]}])"}) {
    DepthRecording(path_, DepthRecording::Access::kWrite).PutText("parts", text);
    try {
      const RecordingReader reader(path_);
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("map.sqmap: its parts of objects are broken")) << text;
    }
  }
}

}  // namespace
}  // namespace sqslam
