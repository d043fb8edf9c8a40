#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "slam/objects/object_mapper.h"
#include "slam/objects/object_tracker.h"
#include "synthetic_desk.h"

namespace sqslam {
namespace {

using testing::SyntheticDesk;

ObjectMapper MapDeskAs(const SyntheticDesk& desk, Representation representation,
                       ObjectMethod method = ObjectMethod::kPaper) {  // the quicker one
  ObjectOptions options;
  options.representation = representation;
  options.method = method;
  ObjectTracker tracker(options);
  ObjectMapper mapper(options, 1);
  const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
  mapper.SetUpright(true, {});
  for (int i = 0; i < SyntheticDesk::kFrames; i += 2) {
    mapper.AddObservations(tracker.Track(desk.Frame(i), *mapper.View()));
    if (i % 20 == 18) {
      mapper.Update(lookup, desk.Camera());
    }
  }
  mapper.UpdateAll(lookup, desk.Camera());
  return mapper;
}

std::set<int> Ids(const std::vector<SnapshotObject>& objects) {
  std::set<int> ids;
  for (const SnapshotObject& object : objects) {
    ids.insert(object.id);
  }
  return ids;
}

TEST(Representation, ChangesOnlyExponentsInThePaperMethod) {
  const SyntheticDesk desk(1);
  const auto superquadrics = MapDeskAs(desk, Representation::kSuperquadric).Objects();
  ASSERT_FALSE(superquadrics.empty());
  for (const auto& [representation, exponent] :
       {std::pair(Representation::kEllipsoid, 1.0), std::pair(Representation::kCuboid, kMinShapeExponent)}) {
    const ObjectMapper mapper = MapDeskAs(desk, representation);
    const auto objects = mapper.Objects();
    EXPECT_EQ(CountLeftOut(mapper.Account(), LeftOut::kNoQuadric), 0);
    ASSERT_EQ(objects.size(), superquadrics.size());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const PosedSuperquadric& a = objects[i].superquadric;
      const PosedSuperquadric& b = superquadrics[i].superquadric;
      EXPECT_EQ(objects[i].id, superquadrics[i].id);
      EXPECT_EQ(a.shape.half_size, b.shape.half_size);
      EXPECT_EQ(a.T_map_object.translation, b.T_map_object.translation);
      EXPECT_EQ(a.shape.e1, exponent);
      EXPECT_EQ(a.shape.e2, exponent);
    }
  }
}

TEST(Representation, FillsTheSpaceOfTheSuperquadric) {
  const SyntheticDesk desk(1);
  const auto superquadrics = MapDeskAs(desk, Representation::kSuperquadric, ObjectMethod::kRefined).Objects();
  ASSERT_FALSE(superquadrics.empty());
  for (const Representation representation : {Representation::kEllipsoid, Representation::kCuboid}) {
    const auto objects = MapDeskAs(desk, representation, ObjectMethod::kRefined).Objects();
    ASSERT_EQ(objects.size(), superquadrics.size());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      EXPECT_NEAR(objects[i].superquadric.shape.Volume() / superquadrics[i].superquadric.shape.Volume(), 1.0,
                  0.3)
          << superquadrics[i].label;
    }
  }
}

TEST(Representation, KeepsLandmarksButRefitsQuadrics) {
  const SyntheticDesk desk(1);
  const ObjectMapper usual = MapDeskAs(desk, Representation::kSuperquadric);
  const ObjectMapper mapper = MapDeskAs(desk, Representation::kQuadric);
  const auto quadrics = mapper.Objects();
  const std::set<int> ids = Ids(quadrics);
  const std::set<int> usual_ids = Ids(usual.Objects());
  EXPECT_GE(ids.size(), 5u);
  EXPECT_TRUE(std::includes(usual_ids.begin(), usual_ids.end(), ids.begin(), ids.end()));
  EXPECT_EQ(static_cast<int>(ids.size()) + CountLeftOut(mapper.Account(), LeftOut::kNoQuadric),
            static_cast<int>(usual_ids.size()));
  double most_tilted = 0.0;
  for (const SnapshotObject& quadric : quadrics) {
    EXPECT_EQ(quadric.superquadric.shape.e1, 1.0);
    EXPECT_EQ(quadric.superquadric.shape.e2, 1.0);
    const Eigen::Vector3d z = quadric.superquadric.T_map_object.rotation * Eigen::Vector3d::UnitZ();
    most_tilted = std::max(most_tilted, std::hypot(z.x(), z.y()));
  }
  EXPECT_GT(most_tilted, 0.02);
  for (const auto& [point, object] : mapper.PointObjects()) {
    EXPECT_TRUE(ids.contains(object));
  }
  ASSERT_EQ(mapper.View()->landmarks.size(), usual.View()->landmarks.size());
  for (std::size_t i = 0; i < usual.View()->landmarks.size(); ++i) {
    EXPECT_EQ(mapper.View()->landmarks[i].superquadric.shape.half_size,
              usual.View()->landmarks[i].superquadric.shape.half_size);
  }
}

TEST(Representation, MovesQuadricsWithTheMap) {
  const Sim3d move{
      3.0, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY())), {1.0, 2.0, 3.0}};
  ObjectMapper mapper = MapDeskAs(SyntheticDesk(1), Representation::kQuadric);
  const auto before = mapper.Objects();
  mapper.Transform(move);
  const auto after = mapper.Objects();
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const PosedSuperquadric& a = before[i].superquadric;
    const PosedSuperquadric& b = after[i].superquadric;
    const Eigen::Vector3d tip(0.0, 0.0, 1.0);
    EXPECT_TRUE(b.shape.half_size.isApprox(3.0 * a.shape.half_size));
    EXPECT_TRUE((b.T_map_object * (b.shape.half_size.cwiseProduct(tip)))
                    .isApprox(move * (a.T_map_object * (a.shape.half_size.cwiseProduct(tip))), 1e-9));
  }
}

}  // namespace
}  // namespace sqslam
