#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "slam/objects/landmark_geometry.h"
#include "slam/objects/object_mapper.h"
#include "slam/objects/object_tracker.h"
#include "solid_overlap.h"

namespace sqslam {
namespace {

using testing::SolidIoU;

struct Thing {
  std::string label;
  PosedSuperquadric first;                         // where it is in the first frame
  Eigen::Vector3d step = Eigen::Vector3d::Zero();  // from frame to frame
  bool has_points = false;

  PosedSuperquadric At(int frame) const {
    PosedSuperquadric moved = first;
    moved.T_map_object.translation += frame * step;
    return moved;
  }
};

Thing Car(double x, double y) {
  return {"car", {{{0.9, 2.2, 0.75}, 0.3, 0.3}, {{1, 0, 0, 0}, {x, y, 0.75}}}};
}
Thing Person(double x, double y) {
  return {"person", {{{0.25, 0.2, 0.85}, 0.5, 1.0}, {{1, 0, 0, 0}, {x, y, 0.85}}}};
}

// A camera drives along a road, in metres: y forward, z up, the road at z = 0. Map points lie on the road and
// on things at rest that have any.
class Road {
 public:
  static constexpr int kFrames = 60;
  static constexpr double kStep = 0.2;  // from frame to frame

  explicit Road(std::vector<Thing> things) : things_(std::move(things)) {
    std::mt19937 generator(1);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < 1500; ++i) {
      points_.emplace_back(12.0 * unit(generator), 30.0 + 28.0 * unit(generator), 0.0);
    }
    for (const Thing& thing : things_) {
      for (int i = 0; thing.has_points && i < 150; ++i) {
        points_.push_back(thing.first.T_map_object *
                          thing.first.shape.PointAt(1.5 * unit(generator), 3.1 * unit(generator)));
      }
    }
  }

  static Camera TestCamera() { return {1280, 720, 1100.0, 1100.0, 640.0, 360.0}; }

  ObjectFrame Frame(int index) const {
    std::mt19937 generator(100 + index);
    std::normal_distribution<double> noise;
    ObjectFrame frame;
    frame.frame_index = index;
    frame.camera = TestCamera();
    Eigen::Matrix3d R;  // looks along y
    R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    frame.T_map_camera = {Eigen::Quaterniond(R), {0.0, kStep * index, 1.4}};
    for (const Thing& thing : things_) {
      const auto exact = ProjectToBox(thing.At(index), frame.T_map_camera, frame.camera);
      if (exact) {
        const Box2d box{exact->x + 0.01 * exact->width * noise(generator),
                        exact->y + 0.01 * exact->height * noise(generator),
                        exact->width * (1.0 + 0.01 * noise(generator)),
                        exact->height * (1.0 + 0.01 * noise(generator))};
        const Box2d shown = ClipToImage(box, frame.camera);
        if (shown.Area() > 0.3 * box.Area()) {
          frame.detections.push_back({thing.label, 0.8, shown});
        }
      }
    }
    const Rigid3d T_camera_map = frame.T_map_camera.Inverse();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d p = T_camera_map * points_[i];
      const Eigen::Vector2d pixel = p.z() > 0.5 ? frame.camera.Project(p) : Eigen::Vector2d(-1.0, -1.0);
      if (frame.camera.InImage(pixel) && !IsHidden(index, frame, points_[i], pixel)) {
        frame.points.push_back({static_cast<std::int64_t>(i), pixel, points_[i]});
      }
    }
    return frame;
  }

  ObjectMapper Map() const {
    ObjectOptions options;
    options.detections.ignored_labels.clear();
    ObjectTracker tracker(options);
    ObjectMapper mapper(options, 1);
    mapper.SetUpright(true, SupportSurfaces::Find(points_, GravityOptions()));
    const PointLookup lookup = [&](std::int64_t& id) { return std::optional(points_[id]); };
    for (int i = 0; i < kFrames; ++i) {
      mapper.AddObservations(tracker.Track(Frame(i), *mapper.View()));
      if (i % 10 == 9) {
        mapper.Update(lookup, TestCamera());
      }
    }
    mapper.UpdateAll(lookup, TestCamera());
    return mapper;
  }

 private:
  // True if another thing than the point's own is in front.
  bool IsHidden(int index, const ObjectFrame& frame, const Eigen::Vector3d& p,
                const Eigen::Vector2d& pixel) const {
    return std::ranges::any_of(things_, [&](const Thing& thing) {
      const PosedSuperquadric solid = thing.At(index);
      const auto box = ProjectToBox(solid, frame.T_map_camera, frame.camera);
      const bool is_its_own = solid.shape.RadialScale(solid.T_map_object.Inverse() * p) < 1.05;
      return box && box->Contains(pixel) && !(thing.has_points && is_its_own) &&
             p.y() > solid.T_map_object.translation.y();
    });
  }

  std::vector<Thing> things_;
  std::vector<Eigen::Vector3d> points_;
};

bool IsMapped(const std::vector<SnapshotObject>& objects, const Thing& thing) {
  return std::ranges::any_of(objects, [&](const SnapshotObject& object) {
    return SolidIoU(object.superquadric, thing.first, 32) > 0.3;
  });
}

TEST(MovingObjects, LeaveParkedCarsInTheMap) {
  Thing textured = Car(-4.0, 16.0);
  textured.has_points = true;
  const Thing bare = Car(4.5, 22.0);
  Thing ahead = Car(1.5, 14.0);
  ahead.step = {0.0, Road::kStep, 0.0};
  const ObjectMapper mapper = Road({textured, bare, ahead}).Map();
  const std::vector<SnapshotObject> objects = mapper.Objects();
  EXPECT_TRUE(IsMapped(objects, textured));
  EXPECT_TRUE(IsMapped(objects, bare));
  EXPECT_EQ(objects.size(), 2U);
  EXPECT_EQ(LeftOutText(mapper.Account().at("car")), "1 moving");
}

TEST(MovingObjects, ReportPersonWhoCrossesTheRoad) {
  Thing textured = Car(-4.0, 16.0);
  textured.has_points = true;
  Thing person = Person(-5.0, 30.0);
  person.step = {0.1, 0.0, 0.0};
  const ObjectMapper mapper = Road({textured, person}).Map();
  const std::vector<SnapshotObject> objects = mapper.Objects();
  EXPECT_TRUE(IsMapped(objects, textured));
  EXPECT_EQ(objects.size(), 1U);
  EXPECT_EQ(LeftOutText(mapper.Account().at("person")), "1 moving");
}

TEST(MovingObjects, StayInTheMapWhileTheyStandStill) {
  Thing standing = Person(-2.0, 18.0);
  standing.has_points = true;
  const ObjectMapper mapper = Road({standing}).Map();
  EXPECT_TRUE(IsMapped(mapper.Objects(), standing));
  EXPECT_EQ(LeftOutText(mapper.Account().at("person")), "");
}

}  // namespace
}  // namespace sqslam
