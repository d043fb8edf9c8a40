#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/viewer/model/map_objects.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

MapSnapshot Desk() {
  MapSnapshot map = HandMadeMap();
  map.objects[0].observations = 100;
  map.objects[1].observations = 20;
  map.objects[2].observations = 20;
  map.objects[0].yaw = -1.0;
  map.objects[1].points = 12;
  map.objects[1].fit.point_rms = 0.0042;
  map.objects[2].points = 9;
  map.objects[2].fit.point_rms = 0.0012;
  map.objects[1].fit.box_agreement = 0.75;
  return map;
}

std::vector<int> Shown(const std::string& filter, const ObjectEdits& edits = {}) {
  std::vector<int> ids;
  for (const ObjectRow& row : ObjectRows(*Apply(edits, Desk(), HiddenObjects::kKeep), edits)) {
    if (RowFilter(filter).Shows(row)) {
      ids.push_back(row.object.id);
    }
  }
  return ids;
}

std::vector<int> Sorted(ObjectColumn column, bool ascending) {
  std::vector<ObjectRow> rows = ObjectRows(Desk());
  SortRows(rows, column, ascending);
  std::vector<int> ids;
  for (const ObjectRow& row : rows) {
    ids.push_back(row.object.id);
  }
  return ids;
}

TEST(ObjectTable, SortsByAnyColumnWithUnknownValuesLast) {
  EXPECT_THAT(Sorted(ObjectColumn::kLabel, true), ElementsAre(0, 1, 2));
  EXPECT_THAT(Sorted(ObjectColumn::kLabel, false), ElementsAre(2, 1, 0));
  EXPECT_THAT(Sorted(ObjectColumn::kObservations, true), ElementsAre(1, 2, 0)) << "equals keep their order";
  EXPECT_THAT(Sorted(ObjectColumn::kObservations, false), ElementsAre(0, 1, 2));
  EXPECT_THAT(Sorted(ObjectColumn::kResidual, true), ElementsAre(2, 1, 0)) << "the book has no points";
  EXPECT_THAT(Sorted(ObjectColumn::kResidual, false), ElementsAre(1, 2, 0));
  EXPECT_THAT(Sorted(ObjectColumn::kSizeZ, false), ElementsAre(1, 2, 0));
}

TEST(ObjectTable, ShowsDashForUnknownValues) {
  const std::vector<ObjectRow> rows = ObjectRows(Desk());
  EXPECT_EQ(CellText(rows[0], ObjectColumn::kId), "0");
  EXPECT_EQ(CellText(rows[0], ObjectColumn::kName), "book");
  EXPECT_EQ(CellText(rows[0], ObjectColumn::kYaw), "-57\u00b0");
  EXPECT_EQ(CellText(rows[1], ObjectColumn::kYaw), "0\u00b0");
  EXPECT_EQ(CellText(rows[0], ObjectColumn::kResidual), "\u2013");
  EXPECT_EQ(CellText(rows[1], ObjectColumn::kResidual), "0.0042");
  EXPECT_EQ(CellText(rows[1], ObjectColumn::kAgreement), "0.75");
  EXPECT_EQ(CellText(rows[1], ObjectColumn::kE2), "1.00");
  EXPECT_EQ(CellText(rows[1], ObjectColumn::kSizeX), "0.12");
}

TEST(ObjectTable, HasUniqueColumnKeys) {
  std::set<std::string> keys;
  for (const ColumnInfo& info : ObjectColumns()) {
    EXPECT_TRUE(keys.insert(info.key).second) << info.key;
    EXPECT_EQ(info.key.find(' '), std::string::npos);
  }
}

TEST(ObjectTable, FiltersByWords) {
  EXPECT_THAT(Shown(""), ElementsAre(0, 1, 2));
  EXPECT_THAT(Shown("CUP"), ElementsAre(1));
  EXPECT_THAT(Shown("o"), ElementsAre(0, 2));
  EXPECT_THAT(Shown("ball sports"), ElementsAre(2));
  EXPECT_THAT(Shown("2"), ElementsAre(2));
  ObjectEdits edits;
  edits.Rename(1, "Red mug");
  EXPECT_THAT(Shown("red", edits), ElementsAre(1));
  EXPECT_THAT(Shown("cup", edits), ElementsAre(1)) << "its label stays";
}

TEST(ObjectTable, FiltersByComparisons) {
  EXPECT_THAT(Shown("observations>50"), ElementsAre(0));
  EXPECT_THAT(Shown("observations<=20 e2>=1"), ElementsAre(1, 2));
  EXPECT_THAT(Shown("seen > 50"), ElementsAre(0)) << "as the header names it, and with blanks";
  EXPECT_THAT(Shown("sports  e1 >= 0.5 ball"), ElementsAre(2));
  EXPECT_THAT(Shown("label=cup"), ElementsAre(1));
  EXPECT_THAT(Shown("label!=cup az<0.15"), ElementsAre(0));
  EXPECT_THAT(Shown("yaw<-50"), ElementsAre(0)) << "degrees";
  EXPECT_THAT(Shown("residual<1"), ElementsAre(1, 2)) << "what is not known is not small";
}

TEST(ObjectTable, ReportsInvalidFilters) {
  EXPECT_THAT(RowFilter("observation>3").Problem(), HasSubstr("did you mean 'observations'?"));
  EXPECT_THAT(RowFilter("e1>x").Problem(), HasSubstr("expected a number"));
  EXPECT_THAT(RowFilter("e1=<3").Problem(), HasSubstr("'=<'"));
  EXPECT_THAT(RowFilter("e1>").Problem(), HasSubstr("expected a number")) << "still being typed";
  EXPECT_EQ(RowFilter("e1>=0.5 cup").Problem(), "");
  EXPECT_THAT(Shown("e1>x"), ElementsAre());
}

TEST(ObjectTable, MarksHiddenObjects) {
  ObjectEdits edits;
  edits.Hide(1);
  edits.Merge(2, 0);
  const auto rows = ObjectRows(*Apply(edits, Desk(), HiddenObjects::kKeep), edits);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_TRUE(rows[0].hidden);
  EXPECT_FALSE(rows[1].hidden);
}

}  // namespace
}  // namespace sqslam::viewer
