#include "render/picture/label_layout.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include "render/camera/scene_framing.h"
#include "render/figures/figures.h"
#include "render/page/page.h"
#include "render/picture/picture_overlay.h"
#include "render/synthetic/scene_description.h"
#include "slam/geometry/ray.h"
#include "slam/geometry/span_in_box.h"
#include "slam/snapshot/recording.h"
#include "slam/util/data_path.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// An image of numbers with a rectangle for each object, later ones on top, and a request for each.
struct Rectangles {
  Rectangles(cv::Size picture, const std::vector<cv::Rect>& areas, cv::Size text) : number(picture, -1) {
    for (std::size_t i = 0; i < areas.size(); ++i) {
      number(areas[i]) = static_cast<int>(i);
    }
    for (std::size_t i = 0; i < areas.size(); ++i) {
      const int own = static_cast<int>(i);
      requests.push_back({VisiblePartOf(number == own), text, static_cast<double>(areas.size() - i), own});
    }
  }

  cv::Mat1i number;
  std::vector<LabelRequest> requests;
};

TEST(LabelLayoutTest, PlacesSingleNameAboveItsObject) {
  const Rectangles one({300, 200}, {{100, 100, 40, 30}}, {60, 12});
  const LabelPlace place = PlaceLabels(one.requests, one.number, {})[0];
  EXPECT_EQ(place.area.br().y, 97);
  EXPECT_EQ(place.area.x + place.area.width / 2, 120);
  EXPECT_FALSE(place.leader);
  EXPECT_EQ(one.number(place.anchor), 0);
}

TEST(LabelLayoutTest, LeadsToObjectFromPlaceOnAnother) {
  // A small object in the middle of a large one that fills the picture: wherever its name is, it is on the
  // other.
  const Rectangles two({300, 200}, {{0, 0, 300, 200}, {140, 90, 20, 20}}, {60, 12});
  const LabelPlace place = PlaceLabels(two.requests, two.number, {})[1];
  EXPECT_TRUE(place.leader);
  EXPECT_EQ(two.number(place.anchor), 1);
}

TEST(LabelLayoutTest, OmitsNameOfHiddenObject) {
  const Rectangles two({300, 200}, {{140, 90, 20, 20}, {100, 60, 100, 80}}, {60, 12});
  EXPECT_TRUE(PlaceLabels(two.requests, two.number, {})[0].area.empty());
}

TEST(LabelLayoutTest, KeepsCrowdedNamesApart) {
  std::vector<cv::Rect> areas;
  for (int i = 0; i < 12; ++i) {
    areas.push_back({130 + 5 * i, 150 - 3 * i, 30, 40});
  }
  const Rectangles crowd({320, 300}, areas, {70, 12});
  const std::vector<cv::Rect> taken = {{200, 0, 120, 100}};
  const std::vector<LabelPlace> places = PlaceLabels(crowd.requests, crowd.number, taken);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const cv::Rect& area = places[i].area;
    EXPECT_FALSE(area.empty());
    EXPECT_EQ(area & cv::Rect(0, 0, 320, 300), area);
    EXPECT_TRUE((area & taken[0]).empty());
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_TRUE((area & places[j].area).empty());
    }
  }
}

TEST(LabelLayoutTest, GivesNearestObjectTheBestPlace) {
  const Rectangles two({300, 200}, {{102, 101, 40, 30}, {100, 130, 44, 30}}, {60, 12});
  std::vector<LabelRequest> requests = two.requests;
  EXPECT_EQ(PlaceLabels(requests, two.number, {})[1].area.y, 163) << "below: the other one is above";
  EXPECT_EQ(PlaceLabels(requests, two.number, {})[0].area.br().y, 98);
}

TEST(LabelLayoutTest, OmitsNameWithoutRoom) {
  const Rectangles one({50, 20}, {{0, 0, 50, 20}}, {60, 12});
  EXPECT_TRUE(PlaceLabels(one.requests, one.number, {})[0].area.empty());
}

// Returns the solid that a ray meets first, found without any picture; -1: nothing.
int FirstHit(const Ray& ray, const std::vector<SnapshotObject>& objects) {
  int first = -1;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const PosedSuperquadric& solid = objects[i].superquadric;
    const Rigid3d T_object_map = solid.T_map_object.Inverse();
    const Eigen::Vector3d eye = T_object_map * ray.origin;
    const Eigen::Vector3d way = T_object_map.rotation * ray.direction;
    const Eigen::Vector3d& half = solid.shape.half_size;
    if (!SpanInBox(eye, way, Eigen::Vector3d(-half), half, 1e9)) {  // spares most of the intersections
      continue;
    }
    const auto hit = Intersect(ray, solid);
    if (hit && hit->first < nearest) {
      nearest = hit->first;
      first = static_cast<int>(i);
    }
  }
  return first;
}

// The labels of one view, compared with rays.
struct LabelErrors {
  int labels = 0;
  int foreign_anchors = 0;  // names that lead to another object, or stand on one without a leader
  int dropped = 0;          // visible objects without a name
  int overlaps = 0;

  void Add(const std::vector<SnapshotObject>& objects, const ViewCamera& view, cv::Size picture) {
    const Camera camera = PinholeOf(view, picture);
    const Rigid3d T_map_camera = PoseOf(view);
    const auto ray_at = [&](const Eigen::Vector2d& pixel) {
      return Ray{T_map_camera.translation, (T_map_camera.rotation * camera.Unproject(pixel)).normalized()};
    };
    const auto hit_at = [&](const cv::Point& p) { return FirstHit(ray_at({p.x, p.y}), objects); };
    const SeenSolids seen = SeeSolids(
        ToVector(objects, [](const SnapshotObject& object) { return NamedSolid{object.superquadric}; }),
        false, camera, T_map_camera);
    const TextPainter text;
    std::vector<LabelRequest> requests;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      requests.push_back({seen.parts[i],
                          {text.Width(objects[i].label, 13.5) + 6, 16},
                          (objects[i].superquadric.T_map_object.translation - view.position).norm(),
                          static_cast<int>(i)});
    }
    const std::vector<LabelPlace> places = PlaceLabels(requests, seen.number, {});
    for (std::size_t i = 0; i < places.size(); ++i) {
      const LabelPlace& place = places[i];
      const int own = static_cast<int>(i);
      if (place.area.empty()) {
        dropped += IsVisible(objects, i, camera, T_map_camera) ? 1 : 0;
        continue;
      }
      ++labels;
      bool foreign = hit_at(place.anchor) != own;
      const cv::Rect& area = place.area;
      for (const cv::Point& p : {area.tl(), area.br(), (area.tl() + area.br()) / 2}) {
        const int there = place.leader ? -1 : hit_at(p);
        foreign = foreign || (there >= 0 && there != own);
      }
      foreign_anchors += foreign ? 1 : 0;
      for (std::size_t k = 0; k < i; ++k) {
        overlaps += (area & places[k].area).empty() ? 0 : 1;
      }
    }
  }

 private:
  // Returns true if any of some points of the surface is seen in the middle of its pixel.
  static bool IsVisible(const std::vector<SnapshotObject>& objects, std::size_t i, const Camera& camera,
                        const Rigid3d& T_map_camera) {
    const PosedSuperquadric& solid = objects[i].superquadric;
    for (int k = 0; k < 40; ++k) {
      const double latitude = std::numbers::pi * (0.1 + 0.8 * (k % 5) / 4.0 - 0.5);
      const double longitude = 2.0 * std::numbers::pi * (k / 5) / 8.0 - std::numbers::pi;
      const Eigen::Vector3d p_map = solid.T_map_object * solid.shape.PointAt(latitude, longitude);
      const Eigen::Vector3d p = T_map_camera.Inverse() * p_map;
      if (p.z() <= 0.0) {
        continue;
      }
      const Eigen::Vector2d pixel = camera.Project(p);
      const Eigen::Vector2d whole = pixel.array().round();
      const Ray ray{T_map_camera.translation, (T_map_camera.rotation * camera.Unproject(whole)).normalized()};
      if (pixel.x() > 2.0 && pixel.y() > 2.0 && pixel.x() < camera.width - 3.0 &&
          pixel.y() < camera.height - 3.0 && FirstHit(ray, objects) == static_cast<int>(i)) {
        return true;
      }
    }
    return false;
  }
};

LabelErrors ErrorsInRandomViews(const MapSnapshot& map, int views) {
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  const cv::Size picture(960, 540);
  const SceneFocus focus = FindFocus(map);
  LabelErrors errors;
  for (int i = 0; i < views; ++i) {
    ViewCamera view = FrameScene(focus, 16.0 / 9.0);
    view = Zoom(Elevation(Azimuth(view, uniform(0.0, 360.0)), uniform(-30.0, 40.0)), uniform(0.8, 3.0));
    errors.Add(map.objects, view, picture);
  }
  return errors;
}

void ExpectNoErrors(const LabelErrors& errors) {
  EXPECT_EQ(errors.foreign_anchors, 0) << "of " << errors.labels;
  EXPECT_EQ(errors.dropped, 0) << "of " << errors.labels;
  EXPECT_EQ(errors.overlaps, 0) << "of " << errors.labels;
}

TEST(LabelLayoutTest, NamesTheRightObjectInRandomViewsOfTheDesk) {
  MapSnapshot map;
  for (const SceneBody& body : ReadScene(DataPath("assets/scenes/desk.yaml")).bodies) {
    if (body.id > 0) {
      SnapshotObject& object = map.objects.emplace_back();
      object.id = body.id;
      object.label = body.label;
      object.superquadric = body.superquadric;
    }
  }
  const LabelErrors errors = ErrorsInRandomViews(map, 200);
  EXPECT_GT(errors.labels, 1500);
  ExpectNoErrors(errors);
}

TEST(RealMapLabelsTest, NameTheRightObjectInRandomViews) {
  const char* maps = std::getenv("SQSLAM_TEST_MAPS");
  if (maps == nullptr) {
    GTEST_SKIP() << "SQSLAM_TEST_MAPS is not set, expected map.sqmap files with colons between them";
  }
  std::istringstream list(maps);
  for (std::string file; std::getline(list, file, ':');) {
    SCOPED_TRACE(file);
    ExpectNoErrors(ErrorsInRandomViews(*RecordingReader(file).Last(), 200));
  }
}

TEST(LabelLayoutTest, NamesOneOfAThousandObjectsInOnePlace) {
  TrajectoryFigure figure;
  const TrajectoryFigure::Footprint cup{"cup", {1, 0, 0}, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, false};
  figure.objects.assign(1000, cup);  // once took hours
  int names = 0;
  for (const FigureElement& element : DrawTrajectories(figure, {}).elements) {
    const auto* text = std::get_if<FigureText>(&element);
    names += text != nullptr && text->text == "cup" ? 1 : 0;
  }
  EXPECT_EQ(names, 1);
}

TEST(LabelLayoutTest, NamesSmallObjectsBesideThemOverAnyOrder) {
  TrajectoryFigure figure;
  const auto square = [](const char* name, double x, double half) {
    return TrajectoryFigure::Footprint{
        name,
        {1, 0, 0},
        {{x - half, -half, 0}, {x + half, -half, 0}, {x + half, half, 0}, {x - half, half, 0}},
        false};
  };
  figure.objects = {square("cup", 0.3, 0.03), square("table", 0.0, 1.0)};  // the table is drawn over the cup
  std::map<std::string, Eigen::Vector2d> names;
  int leaders = 0;
  for (const FigureElement& element : DrawTrajectories(figure, {}).elements) {
    if (const auto* text = std::get_if<FigureText>(&element)) {
      names[text->text] = text->anchor;
    } else if (const auto* path = std::get_if<FigurePath>(&element)) {
      leaders += path->points.size() == 16 && path->fill ? 1 : 0;  // their dots, with an edge
    }
  }
  EXPECT_TRUE(names.contains("cup"));
  EXPECT_TRUE(names.contains("table"));
  EXPECT_EQ(leaders, 2);
}

}  // namespace
}  // namespace sqslam
