#include "render/scene/object_look.h"

#include <gtest/gtest.h>

#include "small_picture.h"

namespace sqslam {
namespace {

SnapshotObject Table(bool with_parts) {
  SnapshotObject table;
  table.label = "table";
  table.superquadric.shape = {{0.4, 0.3, 0.2}, 0.15, 0.15};
  table.superquadric.T_map_object.translation = {0.0, 0.0, 0.2};
  if (with_parts) {
    table.parts = {{{0.0, 0.0, 0.9}, {{1.0, 1.0, 0.1}, 0.15, 0.15}},
                   {{-0.9, 0.0, -0.1}, {{0.1, 1.0, 0.9}, 0.15, 0.15}},
                   {{0.9, 0.0, -0.1}, {{0.1, 1.0, 0.9}, 0.15, 0.15}}};
  }
  return table;
}

TEST(ObjectLook, ShowsPartsUnlessHullsAreAskedFor) {
  SceneStyle::Objects style;
  for (const ObjectLook look : {ObjectLook::kAuto, ObjectLook::kParts}) {
    style.look = look;
    EXPECT_EQ(DrawnSolids(Table(true), style).size(), 3u) << NameOf(look);
    EXPECT_EQ(DrawnSolids(Table(false), style).size(), 1u) << NameOf(look);
  }
  for (const ObjectLook look : {ObjectLook::kSolid, ObjectLook::kGlass, ObjectLook::kOutline}) {
    style.look = look;
    EXPECT_EQ(DrawnSolids(Table(true), style).size(), 1u) << NameOf(look);
    EXPECT_EQ(LookOf(Table(true), style, false), look);
  }
}

TEST(ObjectLook, DrawsHollowHullsAsGlassAndPartsSolid) {
  SceneStyle::Objects style;
  EXPECT_EQ(LookOf(Table(false), style, false), ObjectLook::kGlass);
  EXPECT_EQ(LookOf(Table(true), style, false), ObjectLook::kSolid);
  EXPECT_EQ(LookOf(Table(true), style, true), ObjectLook::kGlass);
  style.look = ObjectLook::kParts;
  EXPECT_EQ(LookOf(Table(false), style, true), ObjectLook::kGlass);
  EXPECT_EQ(LookOf(Table(true), style, true), ObjectLook::kSolid);
  EXPECT_FALSE(HidesOthers(Table(true), style, false)) << "one sees under a table";
}

TEST(ObjectLook, LeavesPixelsUnderTheTableFree) {
  const auto covered = [](const std::vector<SnapshotObject>& objects, ObjectLook look) {
    MapSnapshot map = HandMadeMap();
    map.objects = objects;
    PictureOptions options = SmallPicture();
    options.style.objects.look = look;
    options.style.light.shadow = 0.0;
    const cv::Mat with = RenderPicture(map, options);
    map.objects.clear();
    const cv::Mat without = RenderPicture(map, options);
    cv::Mat difference;
    cv::absdiff(with, without, difference);
    return cv::countNonZero(difference.reshape(1) > 8);
  };
  const int hull = covered({Table(true)}, ObjectLook::kSolid);
  const int parts = covered({Table(true)}, ObjectLook::kParts);
  EXPECT_GT(parts, hull / 4);
  EXPECT_LT(parts, 0.9 * hull);
}

}  // namespace
}  // namespace sqslam
