#include "slam/snapshot/object_edits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The hand-made desk: 0 book, 1 cup, 2 sports_ball, with boxes, points and evidence.
MapSnapshot ObservedDesk() {
  MapSnapshot map = HandMadeMap();
  map.objects[0].observations = 10;
  map.objects[0].score = 0.5;
  map.objects[0].points = 45;
  map.objects[1].observations = 30;
  map.objects[1].score = 0.9;
  map.objects[1].points = 7;
  map.detections = {
      {{"book", 0.5, {1, 2, 3, 4}}, 0}, {{"cup", 0.9, {5, 6, 7, 8}}, 1}, {{"cup", 0.3, {}}, -1}};
  map.points[1].rejected_by = 1;
  map.points[2].object_id = 1;
  return map;
}

std::vector<int> IdsOf(const MapSnapshot& map) {
  std::vector<int> ids;
  for (const SnapshotObject& object : map.objects) {
    ids.push_back(object.id);
  }
  return ids;
}

int PointsOf(const MapSnapshot& map, int id) {
  return static_cast<int>(std::count_if(map.points.begin(), map.points.end(),
                                        [id](const SnapshotPoint& point) { return point.object_id == id; }));
}

TEST(ObjectEdits, RenamesAndRelabels) {
  ObjectEdits edits;
  edits.Rename(1, "  the red mug ");
  edits.SetLabel(1, "beer mug");
  const MapSnapshotPtr map = Apply(edits, ObservedDesk());
  EXPECT_EQ(map->objects[1].name, "the red mug");
  EXPECT_EQ(map->objects[1].label, "beer_mug");
  EXPECT_EQ(ShownName(map->objects[1]), "the red mug");
  EXPECT_EQ(ShownName(map->objects[0]), "book");
  edits.Rename(1, std::string(kMaxLabelBytes - 1, 'a') + "é");
  EXPECT_EQ(edits.Of(1).name, std::string(kMaxLabelBytes - 1, 'a')) << "as long as a file of edits may say";
  edits.Rename(1, "");
  edits.SetLabel(1, " ");
  EXPECT_TRUE(edits.Empty()) << "what is the map's own again is no edit";
}

TEST(ObjectEdits, FreesPointsAndBoxesOfDeletedObjects) {
  ObjectEdits edits;
  edits.Delete(1);
  const MapSnapshot desk = ObservedDesk();
  const MapSnapshotPtr map = Apply(edits, desk);
  EXPECT_THAT(IdsOf(*map), ElementsAre(0, 2));
  EXPECT_EQ(PointsOf(*map, 1), 0);
  EXPECT_EQ(PointsOf(*map, 0), PointsOf(desk, 0));
  EXPECT_EQ(map->points.size(), desk.points.size());
  EXPECT_EQ(map->points[1].rejected_by, -1);
  EXPECT_EQ(map->detections[1].object_id, -1);
  EXPECT_EQ(map->detections[0].object_id, 0);
  EXPECT_THAT(IdsOf(desk), ElementsAre(0, 1, 2)) << "the map itself stays";
}

TEST(ObjectEdits, OmitsHiddenObjectsFromPicturesOnly) {
  ObjectEdits edits;
  edits.Hide(0);
  EXPECT_THAT(IdsOf(*Apply(edits, ObservedDesk())), ElementsAre(1, 2));
  EXPECT_EQ(PointsOf(*Apply(edits, ObservedDesk()), 0), 0);
  EXPECT_THAT(IdsOf(*Apply(edits, ObservedDesk(), HiddenObjects::kKeep)), ElementsAre(0, 1, 2));
  EXPECT_GT(PointsOf(*Apply(edits, ObservedDesk(), HiddenObjects::kKeep), 0), 0);
}

TEST(ObjectEdits, JoinsMergedObjectsUnderKeptSolid) {
  ObjectEdits edits;
  edits.Merge(1, 0);
  const MapSnapshot desk = ObservedDesk();
  const MapSnapshotPtr map = Apply(edits, desk);
  ASSERT_THAT(IdsOf(*map), ElementsAre(1, 2));
  const SnapshotObject& merged = map->objects[0];
  EXPECT_EQ(merged.label, "cup");
  EXPECT_EQ(merged.observations, 40);
  EXPECT_EQ(merged.points, 52);
  EXPECT_EQ(merged.score, 0.9) << "the score is of the label that stays";
  EXPECT_EQ(merged.superquadric.shape.half_size, desk.objects[1].superquadric.shape.half_size);
  EXPECT_EQ(PointsOf(*map, 1), PointsOf(desk, 0) + PointsOf(desk, 1));
  EXPECT_EQ(map->detections[0].object_id, 1);
}

TEST(ObjectEdits, AveragesScoresOfOneLabelOverObservations) {
  MapSnapshot desk = ObservedDesk();
  desk.objects[0].label = "cup";
  ObjectEdits edits;
  edits.Merge(1, 0);
  EXPECT_NEAR(Apply(edits, desk)->objects[0].score, (10 * 0.5 + 30 * 0.9) / 40, 1e-12);
}

TEST(ObjectEdits, GivesKeptIdToAbsorbedObjectSeenFirst) {
  MapSnapshot early = ObservedDesk();
  early.objects.erase(early.objects.begin() + 1);  // the cup has not been seen yet
  ObjectEdits edits;
  edits.Merge(1, 0);
  edits.Rename(1, "mug");
  const MapSnapshotPtr map = Apply(edits, early);
  ASSERT_THAT(IdsOf(*map), ElementsAre(2, 1));
  EXPECT_EQ(map->objects[1].superquadric.shape.half_size, early.objects[0].superquadric.shape.half_size);
  EXPECT_EQ(map->objects[1].name, "mug");
  EXPECT_THAT(IdsOf(*Apply(edits, MapSnapshot{})), ElementsAre());
}

TEST(ObjectEdits, ChainsMerges) {
  ObjectEdits edits;
  edits.Merge(1, 0);
  edits.Merge(2, 0);  // with all that it is a part of
  EXPECT_EQ(edits.KeptIdOf(0), 2);
  EXPECT_EQ(edits.KeptIdOf(1), 2);
  EXPECT_THAT(edits.PartsOf(2), ElementsAre(0, 1));
  EXPECT_THAT(edits.PartsOf(1), ElementsAre());
  EXPECT_THROW(edits.Merge(0, 1), UsageError);
  edits.Delete(2);
  EXPECT_THAT(IdsOf(*Apply(edits, ObservedDesk())), ElementsAre());
  edits.Delete(2, false);
  edits.Separate(1);
  EXPECT_THAT(IdsOf(*Apply(edits, ObservedDesk())), ElementsAre(1, 2));
}

TEST(ObjectEdits, ListsIdsMissingFromMap) {
  ObjectEdits edits;
  edits.Hide(2);
  edits.Delete(17);
  EXPECT_THAT(UnknownIds(edits, ObservedDesk()), ElementsAre(17));
}

class ObjectEditsFile : public testing::Test {
 protected:
  std::string MessageOf(const std::string& objects, const std::string& head = "\"version\": 1") {
    folder_.Write("e.json", R"({"format": "sqslam-edits", )" + head + ", \"objects\": " + objects + "}");
    return InputErrorOf([&] { ReadObjectEdits(folder_.Path() / "e.json"); });
  }
  TemporaryFolder folder_;
};

TEST_F(ObjectEditsFile, ReadsBackUnchanged) {
  ObjectEdits edits;
  edits.Rename(3, "Tasse \u201egro\u00df\u201c \"1\"");
  edits.SetLabel(3, "cup");
  edits.Hide(4);
  edits.Delete(5);
  edits.Merge(3, 9);
  const auto path = EditsFileOf(folder_.Path() / "map.sqmap");
  EXPECT_EQ(path.filename(), "map.sqmap.edits.json");
  WriteObjectEdits(path, edits);
  EXPECT_EQ(ReadObjectEdits(path), edits);
}

TEST_F(ObjectEditsFile, ReportsFileAndField) {
  EXPECT_THAT(MessageOf(R"([{"id": 1}, {"id": "two"}])"),
              HasSubstr("e.json: objects[1].id: \"two\", expected the id of an object"));
  EXPECT_THAT(MessageOf(R"([{"id": 1, "hiden": true}])"),
              HasSubstr("objects[0]: unknown key 'hiden'; did you mean 'hidden'?"));
  EXPECT_THAT(MessageOf(R"([{"id": 1, "hidden": 1}])"),
              HasSubstr("objects[0].hidden: 1, expected true or false"));
  EXPECT_THAT(MessageOf(R"([{"label": "cup"}])"), HasSubstr("objects[0]: has no id"));
  EXPECT_THAT(MessageOf(R"([{"id": 1, "label": ""}])"), HasSubstr("objects[0].label"));
  for (const std::string key : {"name", "label"}) {
    const std::string letters(kMaxLabelBytes + 1, 'a');
    EXPECT_THAT(MessageOf("[{\"id\": 1, \"" + key + "\": \"" + letters + "\"}]"),
                HasSubstr("objects[0]." + key + ": \"" + letters.substr(0, 79) +
                          ", expected a text of 1 to 200 bytes"));
  }
  EXPECT_THAT(MessageOf(R"([{"id": 1}, {"id": 1}])"), HasSubstr("objects[1].id: 1 is a duplicate"));
  EXPECT_THAT(MessageOf(R"([{"id": 1, "merged_into": 2}, {"id": 2, "merged_into": 1}])"),
              HasSubstr("object 1: merged_into leads back"));
  EXPECT_THAT(MessageOf("[]", "\"version\": 7"), HasSubstr("version: 7, expected 1"));
  EXPECT_THAT(MessageOf("3"), HasSubstr("a list \"objects\""));
  folder_.Write("e.json", "{\n\"format\": \n}");
  EXPECT_THAT(InputErrorOf([&] { ReadObjectEdits(folder_.Path() / "e.json"); }),
              HasSubstr("e.json:3: invalid JSON"));
  EXPECT_THAT(InputErrorOf([&] { ReadObjectEdits(folder_.Path() / "none.json"); }), HasSubstr("none.json"));
}

}  // namespace
}  // namespace sqslam
