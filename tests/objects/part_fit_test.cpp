#include "slam/objects/part_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "slam/objects/object_class.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::vector<PartTemplate>& TemplatesOf(const std::string& label) {
  static const ClassTable kClasses = ClassTable::Named("default");
  return kClasses.Of(label).parts;
}

PosedSuperquadric HullOf(const Eigen::Vector3d& half_size, double yaw = 0.0) {
  return {{half_size, 0.15, 0.15},
          {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {0.3, -0.2, half_size.z()}}};
}

// Distance along a ray, in lengths of its direction, to the first of some boxes along the axes; infinity:
// none.
double DistanceToBoxes(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                       const std::vector<SolidPart>& boxes, const Eigen::Vector3d& half_size) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const SolidPart& box : boxes) {
    const Eigen::Array3d a =
        (half_size.cwiseProduct(box.centre - box.shape.half_size) - origin).array() / direction.array();
    const Eigen::Array3d b =
        (half_size.cwiseProduct(box.centre + box.shape.half_size) - origin).array() / direction.array();
    if (const double enter = a.min(b).maxCoeff(); enter > 0.0 && enter < a.max(b).minCoeff()) {
      nearest = std::min(nearest, enter);
    }
  }
  return nearest;
}

// Depth maps of boxes in the hull, which stands on a floor, seen from all around.
std::vector<SightLine> LinesOf(const PosedSuperquadric& hull, const std::vector<SolidPart>& boxes) {
  constexpr int kViews = 6;
  std::vector<SightLine> lines;
  for (int view = 0; view < kViews; ++view) {
    DepthMap map;
    map.camera.width = 64, map.camera.height = 48;
    map.camera.fx = map.camera.fy = 50.0, map.camera.cx = 31.5, map.camera.cy = 23.5;
    const double angle = 2.0 * std::numbers::pi * (view + 0.3) / kViews;
    const Eigen::Vector3d at =
        hull.T_map_object.translation +
        hull.shape.half_size.norm() * Eigen::Vector3d(2.2 * std::cos(angle), 2.2 * std::sin(angle), 1.2);
    Eigen::Matrix3d axes;
    axes.col(2) = (hull.T_map_object.translation - at).normalized();
    axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    map.T_map_camera = {Eigen::Quaterniond(axes), at};
    map.depth.create(48, 64, CV_32F);
    const Rigid3d T_hull_camera = hull.T_map_object.Inverse() * map.T_map_camera;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const Eigen::Vector3d ray =
            T_hull_camera.rotation * map.camera.Unproject({static_cast<double>(x), static_cast<double>(y)});
        const double floor = -(T_hull_camera.translation.z() + hull.shape.half_size.z()) / ray.z();
        const double depth = DistanceToBoxes(T_hull_camera.translation, ray, boxes, hull.shape.half_size);
        map.depth.at<float>(y, x) = static_cast<float>(std::min(depth, floor > 0.0 ? floor : 100.0));
      }
    }
    const std::vector<SightLine> seen = SightLinesThrough(hull, map, 150);
    lines.insert(lines.end(), seen.begin(), seen.end());
  }
  return lines;
}

TEST(FitParts, RecoversTopAndLegsOfTable) {
  const PosedSuperquadric hull = HullOf({0.7, 0.4, 0.37}, 0.4);
  const PartTemplate& table = TemplatesOf("table").front();
  const std::vector<SolidPart> truth = PartsWith(table, {0.14, 0.2, 0.1}, hull.shape.half_size, 0);
  const PartFit fit = FitParts(hull, TemplatesOf("table"), LinesOf(hull, truth));
  ASSERT_THAT(fit.parts, SizeIs(5));
  for (std::size_t i = 0; i < fit.parts.size(); ++i) {
    EXPECT_LT((fit.parts[i].centre - truth[i].centre).norm(), 0.06) << i;
    EXPECT_LT((fit.parts[i].shape.half_size - truth[i].shape.half_size).norm(), 0.06) << i;
  }
}

TEST(FitParts, FindsSideOfTheBack) {
  const PosedSuperquadric hull = HullOf({0.23, 0.23, 0.45}, 0.2);
  for (int turn = 0; turn < 4; ++turn) {
    const std::vector<SolidPart> chair =
        PartsWith(TemplatesOf("chair").front(), {0.5, 0.1, 0.2, 0.16}, hull.shape.half_size, turn);
    const PartFit fit = FitParts(hull, TemplatesOf("chair"), LinesOf(hull, chair));
    ASSERT_THAT(fit.parts, SizeIs(6)) << turn;
    const Eigen::Vector3d back = fit.parts[1].centre;
    const double angle = std::numbers::pi * (1.0 + 0.5 * turn);
    EXPECT_GT(back.x() * std::cos(angle) + back.y() * std::sin(angle), 0.7) << turn;
  }
}

TEST(FitParts, FindsFootOfScreenThatMayAlsoHang) {
  const PosedSuperquadric hull = HullOf({0.4, 0.12, 0.3}, 0.3);
  const std::vector<SolidPart> screen =
      PartsWith(TemplatesOf("tv").back(), {0.2, 0.15}, hull.shape.half_size, 0);
  EXPECT_THAT(FitParts(hull, TemplatesOf("tv"), LinesOf(hull, screen)).parts, SizeIs(2));
}

TEST(FitParts, KeepsBoxWhole) {
  const PosedSuperquadric hull = HullOf({0.3, 0.4, 0.45});
  const std::vector<SightLine> lines =
      LinesOf(hull, {{Eigen::Vector3d::Zero(), {Eigen::Vector3d::Ones(), 0.1, 0.1}}});
  for (const char* label : {"chair", "table", "coffee_table", "tv"}) {
    EXPECT_THAT(FitParts(hull, TemplatesOf(label), lines).parts, IsEmpty()) << label;
  }
}

TEST(FitParts, KeepsHullOfClutterWhole) {
  const PosedSuperquadric hull = HullOf({0.23, 0.23, 0.45});
  const std::vector<SolidPart> chair =
      PartsWith(TemplatesOf("chair").front(), {0.5, 0.1, 0.2, 0.16}, hull.shape.half_size, 0);
  std::vector<SightLine> lines = LinesOf(hull, chair);
  ASSERT_THAT(FitParts(hull, TemplatesOf("chair"), lines).parts, SizeIs(6));
  double share = 0.0;  // of the way through the hull, evenly spread
  for (SightLine& line : lines) {
    share = std::fmod(share + 0.618034, 1.0);
    line.depth = line.enter + share * (line.leave - line.enter);
  }
  EXPECT_THAT(FitParts(hull, TemplatesOf("chair"), lines).parts, IsEmpty());
}

TEST(FitParts, NeedsSightLines) {
  const PosedSuperquadric hull = HullOf({0.23, 0.23, 0.45});
  EXPECT_THAT(FitParts(hull, TemplatesOf("chair"), {}).parts, IsEmpty());
}

TEST(SightLines, LeaveOutSurfacesInFrontOfTheHull) {
  const PosedSuperquadric hull = HullOf({0.2, 0.2, 0.2});
  DepthMap map;
  map.camera.width = map.camera.height = 20;
  map.camera.fx = map.camera.fy = 20.0, map.camera.cx = map.camera.cy = 9.5;
  Eigen::Matrix3d axes;  // looks along x
  axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  map.T_map_camera = {Eigen::Quaterniond(axes),
                      hull.T_map_object.translation - Eigen::Vector3d(2.0, 0.0, 0.0)};
  map.depth = cv::Mat(20, 20, CV_32F, cv::Scalar(1.0F));
  EXPECT_THAT(SightLinesThrough(hull, map, 1000), IsEmpty());
  map.depth.setTo(0.0F);  // unknown
  EXPECT_THAT(SightLinesThrough(hull, map, 1000), IsEmpty());
  map.depth.setTo(3.0F);  // behind it
  const std::vector<SightLine> lines = SightLinesThrough(hull, map, 1000);
  ASSERT_FALSE(lines.empty());
  EXPECT_NEAR(lines.front().enter, 1.8, 1e-9);
  map.T_map_camera.translation = hull.T_map_object.translation;  // within it
  EXPECT_THAT(SightLinesThrough(hull, map, 1000), IsEmpty());
}

TEST(PartTemplates, KeepLegsSquare) {
  const Eigen::Vector3d half_size(0.8, 0.4, 0.37);
  const std::vector<SolidPart> parts = PartsWith(TemplatesOf("table").front(), {0.1, 0.2, 0.0}, half_size, 0);
  ASSERT_THAT(parts, SizeIs(5));
  const Eigen::Vector3d leg = parts[1].shape.half_size.cwiseProduct(half_size);
  EXPECT_NEAR(leg.x(), 0.04, 1e-12);
  EXPECT_NEAR(leg.y(), 0.04, 1e-12);
}

TEST(PartTemplates, BoundTheNumberOfTheirParts) {
  const std::string four = "{x: [0.5, 1], y: [0.5, 1], z: [-1, 1], mirror: xy}";
  const auto table = [](const std::string& solids) {
    const TemporaryFolder folder;
    return ClassTable::Named(
        folder.Write("parts.yaml", "chair: {size: [1, 1, 1], parts: [{solids: [" + solids + "]}]}\n"));
  };
  EXPECT_THAT(table(four + ", " + four).Of("chair").parts.front().parts, SizeIs(8));
  EXPECT_ANY_THROW(table(four + ", " + four + ", " + four));
}

TEST(PartTemplates, MayHaveSizeOfTheirOwn) {
  const std::vector<PartTemplate> screen = TemplatesOf("tv");
  ASSERT_THAT(screen, SizeIs(2));
  ASSERT_TRUE(screen[0].size && screen[1].size);
  EXPECT_TRUE(screen[0].hangs);
  EXPECT_GT(screen[0].size->log_width_ratio, screen[1].size->log_width_ratio + 1.0)
      << "thinner without a foot";
  EXPECT_FALSE(TemplatesOf("table").front().size);
}

TEST(PartTemplates, ReportLineOfBadEntry) {
  const auto message = [](const std::string& parts) -> std::string {
    const TemporaryFolder folder;
    try {
      ClassTable::Named(folder.Write("parts.yaml", "chair: {size: [1, 1, 1],\n  parts: " + parts + "}\n"));
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  };
  const std::string free = "free: {a: [0.2, 0.1], b: [0.3, 0.1]}";
  const auto with_x = [&](const std::string& x) {
    return message("[{" + free + ", solids: [{x: " + x + ", y: [-1, 1], z: [-1, 1]}]}]");
  };
  EXPECT_EQ(with_x("[2*a - 1, 1 - b]"), "");
  EXPECT_THAT(message("4"), HasSubstr("parts.yaml:2: parts of chair: expected a list"));
  EXPECT_THAT(
      message("[{free: {a: [0.2, 0.1], b: [0.2, 0.1], c: [0.2, 0.1], d: [0.2, 0.1], e: [0.2, 0.1]}}]"),
      HasSubstr("expected at most four free"));
  EXPECT_THAT(message("[{" + free + ", share: 1.5}]"), HasSubstr("share is '1.5', expected"));
  EXPECT_THAT(message("[{" + free + ", size: [1, 2, 1]}]"), HasSubstr("longer side is along x"));
  const std::string most = "{share: 0.6, solids: [{x: [-1, 1], y: [-1, 1], z: [-1, 1]}]}";
  EXPECT_EQ(message("[" + most + "]"), "");
  EXPECT_THAT(message("[" + most + ", " + most + "]"),
              HasSubstr("parts.yaml:2: parts of chair: expected shares"));
  EXPECT_THAT(message("[{" + free + "}]"), HasSubstr("expected a list 'solids'"));
  EXPECT_THAT(message("[{" + free + ", solid: []}]"), HasSubstr("unknown option 'solid'"));
  EXPECT_THAT(message("[{free: {a: 0.2, b: 0.3}}]"),
              HasSubstr("a is '0.2', expected a list [..] of 2 values"));
  EXPECT_THAT(message("[{free: {a: [2, 0.1], b: [0.3, 0.1]}}]"), HasSubstr("a is '[2, 0.1]', expected"));
  EXPECT_THAT(with_x("[-1]"), HasSubstr("x, y and z: [low, high]"));
  EXPECT_THAT(with_x("[-1, c]"), HasSubstr("not 'c'"));
  EXPECT_THAT(with_x("[-1, x*a]"), HasSubstr("a number before '*'"));
  EXPECT_THAT(with_x("[1, -1]"), HasSubstr("low < high between -1 and 1, not 1 to -1"));
  EXPECT_THAT(with_x("[-1, 1 + a]"), HasSubstr("not -1 to 1.2"));
  EXPECT_THAT(with_x("[-1, 1], shape: cone"), HasSubstr("one of box, cylinder, ellipsoid"));
  EXPECT_THAT(with_x("[-1, 1], mirror: z"), HasSubstr("one of x, y, xy"));
}

}  // namespace
}  // namespace sqslam
