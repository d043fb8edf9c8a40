#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "baseline.h"
#include "hand_made_map.h"
#include "render/picture/photo.h"
#include "render/picture/picture.h"
#include "render/picture/picture_overlay.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

// A camera whose principal point is far from the middle.
Camera Lens() { return {.width = 320, .height = 240, .fx = 300.0, .fy = 290.0, .cx = 120.0, .cy = 151.0}; }

PictureOptions BareObjects(int width, int height) {
  unsetenv("DISPLAY");
  PictureOptions options;
  options.width = width;
  options.height = height;
  options.backend = RenderBackend::kOsmesa;
  SceneStyle& style = options.style;
  style.anti_aliasing = AntiAliasing::kNone;
  style.objects.opacity = 1.0;
  style.objects.segments = 512;
  style.light.shadow = style.light.outline = style.light.ambient_occlusion = 0.0;
  style.points.show = style.grid.show = style.text.legend = style.text.scale = false;
  style.cameras.trajectory = style.cameras.keyframes = style.cameras.current = false;
  return options;
}

// Pixels that are not background.
cv::Mat MaskOf(const cv::Mat& picture) {
  cv::Mat background;
  cv::inRange(picture, cv::Scalar::all(255), cv::Scalar::all(255), background);
  return 255 - background;
}

std::vector<cv::Point2f> Polygon(const ObjectOutline& outline) {
  return {outline.polygon.begin(), outline.polygon.end()};
}

TEST(OutlineTest, MatchesEdgeOfRenderedMesh) {
  const MapSnapshot whole = HandMadeMap();
  PictureRenderer renderer(BareObjects(640, 480));
  for (const SnapshotObject& object : whole.objects) {
    MapSnapshot map = whole;
    map.objects = {object};
    renderer.SetMap(map);
    for (const std::size_t k : {0, 4}) {
      const Rigid3d& pose = map.keyframes[k].T_map_camera;
      const ImagePlacement place = PlaceImage(Lens(), {0, 0, 640, 480});
      const cv::Mat mask = MaskOf(renderer.Render(ThroughCamera(pose, place.camera)));
      const auto outlines = OutlinesOf(map.objects, place.camera, pose);
      ASSERT_EQ(outlines.size(), 1u);
      const std::vector<cv::Point2f> polygon = Polygon(outlines.front());
      double worst = 0.0;
      for (int y = 0; y < mask.rows; ++y) {
        for (int x = 0; x < mask.cols; ++x) {
          const double inside =
              cv::pointPolygonTest(polygon, cv::Point2f(static_cast<float>(x), static_cast<float>(y)), true);
          const bool drawn = mask.at<std::uint8_t>(y, x) > 0;
          worst = std::max(worst, drawn ? -inside : inside);
        }
      }
      EXPECT_GT(cv::countNonZero(mask), 1000);
      EXPECT_LT(worst, 1.0) << object.label << ", keyframe " << k;
    }
  }
}

TEST(ViewCameraTest, ProjectsLikeItsPinholeCamera) {
  const Rigid3d pose = HandMadeMap().keyframes[2].T_map_camera;
  const Camera lens = Lens();
  const ViewCamera view = ThroughCamera(pose, lens);
  const Rigid3d again = PoseOf(view);
  EXPECT_LT((again.translation - pose.translation).norm(), 1e-9);
  EXPECT_LT(again.rotation.angularDistance(pose.rotation), 1e-7);
  const Eigen::Vector3d p(0.2, 0.1, 0.3);
  const Eigen::Vector2d expected = lens.Project(pose.Inverse() * p);
  const SeenPoint seen = Project(view, {640, 480}, p);  // twice the size
  EXPECT_NEAR(seen.pixel.x, 2.0 * (expected.x() + 0.5), 1e-6);
  EXPECT_NEAR(seen.pixel.y, 2.0 * (expected.y() + 0.5), 1e-6);
}

TEST(PlaceImageTest, KeepsAspectAndCentresImage) {
  const ImagePlacement place = PlaceImage(Lens(), {10, 0, 700, 240});
  EXPECT_EQ(place.area, cv::Rect2d(200.0, 0.0, 320.0, 240.0));
  EXPECT_NEAR(place.camera.cx, 320.0, 1e-9);
  EXPECT_NEAR(place.camera.cy, 151.0, 1e-9);
}

TEST(PanelTest, LiesBehindSizeOfGridCells) {
  const MapSnapshot map = HandMadeMap();
  const SceneFocus focus = FindFocus(map);
  const ViewCamera camera = FrameScene(focus, 16.0 / 9.0);
  SceneStyle style;
  style.background = "#ffffff";
  style.objects.labels = false;
  const PictureCaptions captions(style, map, {}, focus, LabelColors(style.objects.colors), camera);
  cv::Mat image(720, 1280, CV_8UC3, cv::Scalar::all(0));  // as a dark cloud below
  DrawTexts(image, map, camera, captions, style, TextPainter());
  cv::Mat1b light;
  cv::inRange(image(cv::Rect(0, 620, 320, 100)), cv::Scalar::all(190), cv::Scalar::all(255), light);
  EXPECT_GT(cv::countNonZero(light), 1500);
}

TEST(PanelTest, DrawsOnlyPartInsideImage) {
  const Eigen::Vector3d color(0.2, 0.4, 0.6);
  cv::Mat whole(100, 120, CV_8UC3, cv::Scalar::all(255));
  DrawPanel(whole, {10, 10, 60, 40}, 12.0, color, 0.8);
  cv::Mat part(40, 45, CV_8UC3, cv::Scalar::all(255));
  DrawPanel(part, {-20, -20, 60, 40}, 12.0, color, 0.8);
  EXPECT_EQ(cv::norm(whole(cv::Rect(30, 30, 45, 40)), part, cv::NORM_INF), 0.0);
  DrawPanel(part, {-10, 0, 2'000'000'000, 40}, 0.0, color);  // once took memory for all of it
  EXPECT_LT(part.at<cv::Vec3b>(39, 44)[2], 100);
}

TEST(OutlineTest, FadesBehindNearerObject) {
  MapSnapshot map = HandMadeMap();
  map.objects.resize(2);
  map.objects[0].superquadric = {{{0.5, 0.5, 0.5}, 0.1, 0.1},
                                 {Eigen::Quaterniond::Identity(), {0.0, 0.0, 4.0}}};
  map.objects[1].superquadric = {{{0.3, 0.6, 0.1}, 0.1, 0.1},
                                 {Eigen::Quaterniond::Identity(), {0.4, 0.0, 2.5}}};
  auto outlines = OutlinesOf(map.objects, Lens(), {});
  ASSERT_EQ(outlines.size(), 2u);
  EXPECT_EQ(outlines[0].object->label, "cup");  // nearest first
  cv::Mat image(240, 320, CV_8UC3, cv::Scalar::all(255));
  OverlayStyle style;
  style.fill = 0.0;
  style.hidden = 0.0;
  DrawOutlines(image, outlines, LabelColors(), style, 1.0);
  EXPECT_LT(outlines[0].visible, outlines[0].inside + 1.0);
  EXPECT_GT(outlines[0].visible, outlines[0].inside - 1.0);
  EXPECT_LT(outlines[1].visible, 0.9 * outlines[1].inside);
  // The right edge of the far box lies behind the near one, its left edge does not.
  const auto [left, right] = std::minmax_element(outlines[1].polygon.begin(), outlines[1].polygon.end(),
                                                 [](const auto& a, const auto& b) { return a.x < b.x; });
  const auto drawn = [&](double x) {
    const int at = cvRound(x);
    cv::Mat gray;
    cv::cvtColor(image(cv::Rect(at - 2, 150, 5, 3)), gray, cv::COLOR_BGR2GRAY);
    double darkest = 0.0;
    cv::minMaxLoc(gray, &darkest);
    return darkest < 200.0;
  };
  EXPECT_TRUE(drawn(left->x));
  EXPECT_FALSE(drawn(right->x));
}

// A photograph with something to see: the map's own picture, dimmed.
cv::Mat Photo(const MapSnapshot& map) {
  PictureRenderer renderer(BareObjects(320, 240));
  renderer.SetMap(map);
  return 0.5 * renderer.Render(ThroughCamera(map.keyframes[3].T_map_camera, map.camera));
}

TEST(PhotoOverlayTest, MatchesBaseline) {
  const MapSnapshot map = HandMadeMap();
  PictureOptions options = BareObjects(480, 360);
  options.style = SceneStyle();
  options.style.overlay.points = true;
  ExpectBaseline(RenderOverPhoto(map, Photo(map), map.keyframes[3].T_map_camera, options), "overlay");
}

TEST(PhotoOverlayTest, DrawsNothingBesidePhotograph) {
  MapSnapshot map = HandMadeMap();
  map.objects[0].superquadric.shape.half_size *= 8.0;  // reaches out of the image
  map.objects[0].superquadric.T_map_object.translation.z() = 0.8;
  PictureOptions options = BareObjects(640, 240);
  options.style.overlay.points = true;
  const cv::Mat picture = RenderOverPhoto(map, Photo(HandMadeMap()), map.keyframes[3].T_map_camera, options);
  EXPECT_EQ(cv::countNonZero(MaskOf(picture(cv::Rect(0, 0, 160, 240)))), 0);
  EXPECT_EQ(cv::countNonZero(MaskOf(picture(cv::Rect(480, 0, 160, 240)))), 0);
  EXPECT_GT(cv::countNonZero(MaskOf(picture(cv::Rect(160, 0, 320, 240)))), 70000);
}

TEST(PhotoOverlayTest, RemovesDistortion) {
  MapSnapshot map = HandMadeMap();
  map.camera.distortion = {-0.35, 0.1, 0.0, 0.0, 0.0};
  // A dot where the lens shows a point of the map comes to lie where the outlines' camera projects it.
  const Eigen::Vector3d p_camera(0.45, -0.3, 1.0);
  const Eigen::Vector2d shown = map.camera.ProjectDistorted(p_camera);
  cv::Mat photo(240, 320, CV_8UC3, cv::Scalar::all(0));
  cv::circle(photo, {cvRound(shown.x()), cvRound(shown.y())}, 3, cv::Scalar::all(255), cv::FILLED);
  const cv::Mat straight = Undistorted(photo, map.camera);
  const Eigen::Vector2d expected = map.camera.Project(p_camera);
  EXPECT_GT((expected - shown).norm(), 5.0);
  EXPECT_GT(straight.at<cv::Vec3b>(cvRound(expected.y()), cvRound(expected.x()))[0], 200);
}

// A wall across the view of keyframe 3 at this y, right of the book.
CloudLayerPtr Wall(double y) {
  CloudLayerBuilder builder(0.01);
  for (double x = -0.12; x < 1.0; x += 0.01) {
    for (double z = -0.5; z < 1.5; z += 0.01) {
      builder.Add(Eigen::Vector3d(x, y, z).cast<float>(), {128, 128, 128}, 0.01F);
    }
  }
  return builder.Finish();
}

enum class PhotoKind { kOutlines, kMap };

// The picture over a grey photograph, without texts and points.
cv::Mat OverGrey(PhotoKind kind, const CloudLayerPtr& cloud) {
  const MapSnapshot map = HandMadeMap();
  PictureOptions options = BareObjects(320, 240);
  options.style.overlay = {.fill = 0.5, .hidden = 0.0, .labels = false};
  options.style.light.shadow = 0.0;
  options.layers.dense_cloud = cloud;
  const cv::Mat photo(240, 320, CV_8UC3, cv::Scalar::all(128));
  const Rigid3d pose = map.keyframes[3].T_map_camera;
  return kind == PhotoKind::kMap ? RenderOnPhoto(map, map, photo, pose, options)
                                 : RenderOverPhoto(map, photo, pose, options);
}

bool IsDrawn(const cv::Mat& picture, const SnapshotObject& object) {
  const MapSnapshot map = HandMadeMap();
  const Eigen::Vector2d pixel = map.camera.Project(map.keyframes[3].T_map_camera.Inverse() *
                                                   object.superquadric.T_map_object.translation);
  return picture.at<cv::Vec3b>(cvRound(pixel.y()), cvRound(pixel.x())) != cv::Vec3b::all(128);
}

TEST(PhotoOverlayTest, HidesObjectsBehindDenseCloud) {
  const std::vector<SnapshotObject> objects = HandMadeMap().objects;
  for (const PhotoKind kind : {PhotoKind::kOutlines, PhotoKind::kMap}) {
    const cv::Mat open = OverGrey(kind, nullptr);
    const cv::Mat behind = OverGrey(kind, Wall(-1.0));
    for (const SnapshotObject& object : objects) {
      EXPECT_TRUE(IsDrawn(open, object)) << object.label;
      EXPECT_EQ(IsDrawn(behind, object), object.label == "book") << object.label;
    }
    EXPECT_EQ(cv::norm(open, OverGrey(kind, Wall(1.5)), cv::NORM_INF), 0.0) << "a wall behind all";
  }
}

TEST(PhotoOverlayTest, DrawsPanelBehindLegendButNeitherGridNorAxes) {
  const MapSnapshot map = HandMadeMap();
  PictureOptions options = BareObjects(640, 480);
  options.style = SceneStyle();
  options.style.points.show = false;
  const cv::Mat photo(240, 320, CV_8UC3, cv::Scalar::all(60));
  const cv::Mat picture = RenderOnPhoto(map, map, photo, map.keyframes[3].T_map_camera, options);
  EXPECT_GT(picture.at<cv::Vec3b>(14, 626)[0], 200) << "the panel is white";
  cv::Mat changed;
  cv::absdiff(picture, cv::Scalar::all(60), changed);
  EXPECT_EQ(cv::countNonZero(changed(cv::Rect(0, 380, 640, 100)).reshape(1)), 0) << "axes, grid, scale";
  EXPECT_EQ(cv::countNonZero(changed(cv::Rect(0, 0, 100, 480)).reshape(1)), 0) << "grid";
}

TEST(PhotoOverlayTest, RejectsPhotographOfAnotherSize) {
  const MapSnapshot map = HandMadeMap();
  EXPECT_THROW(RenderOverPhoto(map, cv::Mat(100, 100, CV_8UC3), {}, BareObjects(320, 240)), InputError);
}

}  // namespace
}  // namespace sqslam
