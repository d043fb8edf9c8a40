#include "render/picture/picture.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>

#include "baseline.h"
#include "render/picture/picture_overlay.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "small_picture.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

SceneStyle StyleNamed(const std::string& name) {
  return LoadStyle(fmt::format("{}/configs/styles/{}.yaml", SQSLAM_SOURCE_DIR, name));
}

TEST(PictureTest, MatchesBaseline) {
  ExpectBaseline(RenderPicture(HandMadeMap(), SmallPicture()), "map_paper");
}

TEST(PictureTest, MatchesBaselineWhenTranslucentDarkAndLabelled) {
  PictureOptions options = SmallPicture();
  options.style = StyleNamed("dark");
  options.style.objects.opacity = 0.4;
  options.style.objects.labels = true;
  ExpectBaseline(RenderPicture(HandMadeMap(), options), "map_dark");
}

TEST(PictureTest, MatchesBaselineInBlueprintStyle) {
  PictureOptions options = SmallPicture();
  options.style = StyleNamed("blueprint");
  ExpectBaseline(RenderPicture(HandMadeMap(), options), "map_blueprint");
}

TEST(PictureTest, MatchesBaselineInMinimalStyleWithoutBackground) {
  PictureOptions options = SmallPicture();
  options.style = StyleNamed("minimal");
  options.transparent = true;
  ExpectBaseline(RenderPicture(HandMadeMap(), options), "map_minimal");
}

TEST(PictureTest, FramesWholeFrustumOfCurrentCamera) {
  MapSnapshot map = HandMadeMap();
  map.T_map_camera->translation += 1.5 * Eigen::Vector3d::UnitX();  // beside the keyframes
  PictureOptions options = SmallPicture();
  options.camera = {};
  PictureRenderer renderer(options);
  renderer.SetMap(map);
  const ViewCamera view = renderer.DefaultCamera();
  for (const Eigen::Vector3d& p_map : FrustumCorners(*map.T_map_camera, map.camera, 0.3)) {
    EXPECT_TRUE(cv::Rect(0, 0, 320, 240).contains(Project(view, {320, 240}, p_map).pixel));
  }
}

// Two equal red boxes, one 1.5 map units behind and above the other, from the front without any text but the
// axes; their widths in pixels, the upper first.
struct TwoBoxes {
  explicit TwoBoxes(Projection projection) {
    MapSnapshot map = HandMadeMap();
    map.objects.resize(2);
    for (int i = 0; i < 2; ++i) {
      SnapshotObject& object = map.objects[static_cast<std::size_t>(i)];
      object.label = "box";
      object.superquadric.shape = {{0.3, 0.2, 0.1}, 0.1, 0.1};
      object.superquadric.T_map_object.translation = {0.0, -0.75 + 1.5 * i, 0.6 * i};
    }
    map.points.clear();
    map.keyframes.clear();
    map.T_map_camera.reset();
    PictureOptions options = SmallPicture();
    options.camera = {.view = "front", .projection = projection};
    options.style.grid.show = options.style.text.legend = false;
    options.style.light.shadow = 0.0;
    options.style.objects.colors["box"] = "#ff0000";
    picture = RenderPicture(map, options);
    const int half = BottomOf(0, picture.rows);
    widths = {WidthIn({0, half}), WidthIn({half, picture.rows})};
  }

  cv::Mat1b Red() const {
    cv::Mat hsv;
    cv::cvtColor(picture, hsv, cv::COLOR_BGR2HSV);
    cv::Mat1b red;
    cv::extractChannel(hsv, red, 1);
    red(cv::Rect(0, picture.rows * 3 / 4, picture.cols / 3, picture.rows / 4)).setTo(0);  // axes
    return red > 90;
  }
  // Returns the first row without red below the first one with it.
  int BottomOf(int row, int end) const {
    const cv::Mat1b red = Red();
    while (row < end && cv::countNonZero(red.row(row)) == 0) {
      ++row;
    }
    while (row < end && cv::countNonZero(red.row(row)) > 0) {
      ++row;
    }
    return row;
  }
  int WidthIn(cv::Range rows) const {
    cv::Mat columns;
    cv::reduce(Red().rowRange(rows), columns, 0, cv::REDUCE_MAX);
    return cv::countNonZero(columns);
  }

  cv::Mat picture;
  std::array<int, 2> widths{};
};

TEST(OrthographicPictureTest, DrawsEqualObjectsEquallyLargeAtAnyDepth) {
  const TwoBoxes flat(Projection::kOrthographic);
  EXPECT_GT(flat.widths[0], 30);
  EXPECT_NEAR(flat.widths[0], flat.widths[1], 1);
  const TwoBoxes deep(Projection::kPerspective);
  EXPECT_LT(deep.widths[0], deep.widths[1] - 5);
}

TEST(OrthographicPictureTest, ScaleBarAgreesWithSizeOfObject) {
  const TwoBoxes boxes(Projection::kOrthographic);
  cv::Mat1b grey;
  cv::cvtColor(boxes.picture, grey, cv::COLOR_BGR2GRAY);
  int bar = 0;
  for (int y = boxes.picture.rows * 3 / 4; y < boxes.picture.rows; ++y) {
    int run = 0;
    for (int x = 0; x < boxes.picture.cols; ++x) {
      run = grey(y, x) < 140 ? run + 1 : 0;
      bar = std::max(bar, run);
    }
  }
  const double pixels_per_unit = boxes.widths[0] / 0.6;
  const double length = RoundLength(0.25 * boxes.picture.cols / pixels_per_unit);
  EXPECT_NEAR(bar / pixels_per_unit, length, 0.04 * length);
}

TEST(OrthographicPictureTest, KeepsParallelLinesParallel) {
  PictureOptions options = SmallPicture();
  options.camera.projection = Projection::kOrthographic;
  PictureRenderer renderer(options);
  renderer.SetMap(HandMadeMap());
  const ViewCamera view = renderer.DefaultCamera();
  const Eigen::Vector3d line(0.4, 0.3, 0.2);
  const auto seen = [&](const Eigen::Vector3d& from) {
    return Project(view, {320, 240}, from + line).pixel - Project(view, {320, 240}, from).pixel;
  };
  const cv::Point2d near = seen({0.0, -0.5, 0.0}), far = seen({-0.5, 1.5, 0.3});
  EXPECT_LT(cv::norm(near - far), 0.02);
  EXPECT_GT(cv::norm(near), 10.0);
}

TEST(PictureTest, OutlinesOrOmitsUncertainObjects) {
  MapSnapshot map = HandMadeMap();
  for (SnapshotObject& object : map.objects) {
    object.fit.reliability = 0.1;
  }
  PictureOptions options = SmallPicture();
  const auto colour = [&](UncertainObjects uncertain, const MapSnapshot& shown) {
    options.style.objects.uncertain = uncertain;
    cv::Mat hsv;
    cv::cvtColor(RenderPicture(shown, options), hsv, cv::COLOR_BGR2HSV);
    return cv::countNonZero(hsv.reshape(1, hsv.rows * hsv.cols).col(1) > 60);
  };
  const int solid = colour(UncertainObjects::kSolid, map);
  const int outline = colour(UncertainObjects::kOutline, map);
  const int hidden = colour(UncertainObjects::kHide, map);
  EXPECT_LT(outline, 0.5 * solid);
  EXPECT_LT(hidden, outline);
  EXPECT_EQ(colour(UncertainObjects::kOutline, HandMadeMap()), solid);
}

TEST(PictureTest, DetectsChangedObjectAgainstBaseline) {
  MapSnapshot changed = HandMadeMap();
  changed.objects[0].superquadric.shape.half_size *= 1.3;
  EXPECT_GT(
      PictureDifference(RenderPicture(changed, SmallPicture()), RenderPicture(HandMadeMap(), SmallPicture())),
      kThreshold);
}

TEST(PictureTest, LeavesOnlyBackgroundTransparent) {
  PictureOptions options = SmallPicture();
  options.transparent = true;
  options.style.objects.opacity = 1.0;
  options.style.text.legend = false;
  const cv::Mat image = RenderPicture(HandMadeMap(), options);
  ASSERT_EQ(image.type(), CV_8UC4);
  for (const cv::Point corner : {cv::Point(0, 0), cv::Point(319, 0)}) {
    EXPECT_EQ(image.at<cv::Vec4b>(corner)[3], 0);
  }
  cv::Mat alpha;
  cv::extractChannel(image, alpha, 3);
  EXPECT_GT(cv::countNonZero(alpha == 255), 1500);
}

TEST(PictureTest, MatchesOpaquePictureWhenBlendedOverWhite) {
  PictureOptions options = SmallPicture();
  options.style.text.legend = options.style.text.scale = false;  // opaque pictures have panels behind them
  const cv::Mat opaque = RenderPicture(HandMadeMap(), options);
  options.transparent = true;
  const cv::Mat image = RenderPicture(HandMadeMap(), options);
  double worst = 0.0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const cv::Vec4b& p = image.at<cv::Vec4b>(y, x);
      for (int c = 0; c < 3; ++c) {
        const double over_white = p[c] * (p[3] / 255.0) + 255.0 - p[3];
        worst = std::max(worst, std::abs(over_white - opaque.at<cv::Vec3b>(y, x)[c]));
      }
    }
  }
  EXPECT_LE(worst, 6.0);
}

TEST(PictureTest, GivesSameBytesForSameMap) {
  EXPECT_TRUE(
      SameBytes(RenderPicture(HandMadeMap(), SmallPicture()), RenderPicture(HandMadeMap(), SmallPicture())));
}

TEST(PictureTest, GivesSameBytesWithBothBackEnds) {
  PictureOptions egl = SmallPicture();
  egl.backend = RenderBackend::kEgl;
  EXPECT_TRUE(SameBytes(RenderPicture(HandMadeMap(), SmallPicture()), RenderPicture(HandMadeMap(), egl)));
}

// The mean lightness of a part of the picture.
double Lightness(const cv::Mat& image, const cv::Rect& part) {
  const cv::Scalar mean = cv::mean(image(part));
  return (mean[0] + mean[1] + mean[2]) / 3.0;
}

TEST(PictureTest, ChangesIntendedPartWithEachEffect) {
  PictureOptions plain = SmallPicture();
  plain.style.light = {.shadow = 0.0, .ambient_occlusion = 0.0, .outline = 0.0, .eye_dome = 0.0};
  plain.style.points.show = false;
  const cv::Mat without = RenderPicture(HandMadeMap(), plain);
  const cv::Rect cup(178, 68, 48, 82);
  PictureOptions shadow = plain;
  shadow.style.light.shadow = 0.5;
  EXPECT_LT(Lightness(RenderPicture(HandMadeMap(), shadow), cup), Lightness(without, cup) - 1.0);
  PictureOptions outline = plain;
  outline.style.light.outline = 1.0;
  cv::Mat changed;
  cv::absdiff(RenderPicture(HandMadeMap(), outline), without, changed);
  cv::cvtColor(changed, changed, cv::COLOR_BGR2GRAY);
  const double share = cv::countNonZero(changed > 30) / static_cast<double>(changed.total());
  EXPECT_GT(share, 0.004);  // lines, not areas
  EXPECT_LT(share, 0.03);
  PictureOptions occlusion = shadow;
  occlusion.style.light.ambient_occlusion = 1.0;
  const cv::Rect foot(186, 128, 30, 10);  // of the cup, where it meets the ground
  const cv::Rect top(186, 75, 30, 8);
  const cv::Mat occluded = RenderPicture(HandMadeMap(), occlusion);
  const cv::Mat open = RenderPicture(HandMadeMap(), shadow);
  EXPECT_LT(Lightness(occluded, foot), Lightness(open, foot) - 3.0);
  EXPECT_NEAR(Lightness(occluded, top), Lightness(open, top), 1.0);
}

TEST(PictureTest, BlursBackgroundButNotFocalPointThroughLens) {
  PictureOptions sharp = SmallPicture();
  sharp.style.text.legend = false;
  sharp.style.text.scale = false;
  sharp.camera.focal_point = Eigen::Vector3d(0.3, -0.2, 0.2);  // the cup
  PictureOptions blurred = sharp;
  blurred.style.lens.aperture = 0.06;
  blurred.style.lens.samples = 16;
  const cv::Mat before = RenderPicture(HandMadeMap(), sharp);
  const cv::Mat after = RenderPicture(HandMadeMap(), blurred);
  const auto edges = [](const cv::Mat& image, const cv::Rect& part) {
    cv::Mat gray;
    cv::Mat second;
    cv::cvtColor(image(part), gray, cv::COLOR_BGR2GRAY);
    cv::Laplacian(gray, second, CV_32F);
    return cv::norm(second, cv::NORM_L1);
  };
  const cv::Rect middle(140, 80, 40, 80);  // what the camera looks at
  const cv::Rect front(0, 200, 320, 40);   // cameras and grid near the viewer
  EXPECT_GT(edges(after, middle), 0.6 * edges(before, middle));
  EXPECT_LT(edges(after, front), 0.5 * edges(before, front));
}

TEST(PictureTest, GivesSameBytesAfterOtherFrames) {
  PictureRenderer renderer(SmallPicture());
  MapSnapshot smaller = HandMadeMap();
  smaller.objects.pop_back();
  renderer.SetMap(HandMadeMap());
  const cv::Mat first = renderer.Render();
  renderer.SetMapKeepingFrame(smaller);
  renderer.Render(Azimuth(renderer.DefaultCamera(), 120.0));
  renderer.SetMapKeepingFrame(HandMadeMap());
  EXPECT_TRUE(SameBytes(renderer.Render(), first));
}

TEST(PictureTest, BlendsTranslucentObjectsIndependentlyOfMapOrder) {
  PictureOptions options = SmallPicture();
  options.style.objects.opacity = 0.4;
  MapSnapshot map = HandMadeMap();
  for (SnapshotObject& object : map.objects) {  // in a row behind one another
    object.superquadric.T_map_object.translation.head<2>() = Eigen::Vector2d(0.0, 0.45 * object.id);
  }
  MapSnapshot reversed = map;
  std::reverse(reversed.objects.begin(), reversed.objects.end());
  for (const double azimuth : {0.0, 90.0, 180.0, 270.0}) {
    options.camera.azimuth = azimuth;
    EXPECT_TRUE(SameBytes(RenderPicture(map, options), RenderPicture(reversed, options))) << azimuth;
  }
}

TEST(PictureTest, RejectsInvalidSizesAndStyles) {
  PictureOptions options = SmallPicture();
  options.width = 0;
  EXPECT_THROW(RenderPicture(HandMadeMap(), options), UsageError);
  options = SmallPicture();
  options.style.background = "white";
  EXPECT_THROW(RenderPicture(HandMadeMap(), options), UsageError);
  EXPECT_THROW(LoadStyle("no-such-style"), std::exception);
}

TEST(PictureTest, NamesInvalidCameraValue) {
  const auto error_of = [](const std::function<void(CameraOverrides&)>& change) -> std::string {
    PictureOptions options = SmallPicture();
    change(options.camera);
    try {
      RenderPicture(HandMadeMap(), options);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "(no UsageError)";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_of([](auto& camera) { camera.position->x() = 1e160; }), HasSubstr("position"));
  EXPECT_THAT(error_of([&](auto& camera) { camera.focal_point->z() = nan; }), HasSubstr("focal point"));
  EXPECT_THAT(error_of([](auto& camera) { camera.view_up = Eigen::Vector3d::Zero(); }), HasSubstr("view up"));
  EXPECT_THAT(error_of([](auto& camera) { camera.view_angle = 180.0; }), HasSubstr("view angle 180"));
  EXPECT_THAT(error_of([&](auto& camera) { camera.azimuth = nan; }), HasSubstr("azimuth nan"));
  EXPECT_THAT(error_of([](auto& camera) { camera.zoom = 0.0; }), HasSubstr("zoom 0"));
  EXPECT_EQ(error_of([](auto& camera) { camera.zoom = 2.0; }), "(no UsageError)");
}

TEST(PictureTest, DrawsEmptyMap) { EXPECT_FALSE(RenderPicture(MapSnapshot(), SmallPicture()).empty()); }

}  // namespace
}  // namespace sqslam
