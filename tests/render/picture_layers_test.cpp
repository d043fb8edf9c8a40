#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "baseline.h"
#include "render/scene/color_scale.h"
#include "small_picture.h"

namespace sqslam {
namespace {

// The desk as stereo would see it: its top with holes, and red stripes on book and cup.
CloudLayerPtr CloudOfTheDesk() {
  CloudLayerBuilder cloud(0.012);
  for (int i = 0; i < 16000; ++i) {
    const double angle = 2.399963 * i;
    const double radius = 0.0085 * std::sqrt(i);
    if (i % 4000 > 3600) {
      continue;
    }
    const auto level = static_cast<std::uint8_t>(120 + 60 * std::sin(40.0 * radius));
    cloud.Add(Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0.0).cast<float>(),
              {level, 130, 90}, 0.012F);
  }
  for (const SnapshotObject& object : HandMadeMap().objects) {
    for (int i = 0; i < (object.label == "sports_ball" ? 0 : 3000); ++i) {
      const double latitude = std::asin(2.0 * (i + 0.5) / 3000.0 - 1.0);
      const double longitude = std::remainder(2.399963 * i, 2.0 * std::numbers::pi);
      const PosedSuperquadric& solid = object.superquadric;
      const auto level = static_cast<std::uint8_t>(60 + 40 * (i / 200 % 4));
      cloud.Add((solid.T_map_object * solid.shape.PointAt(latitude, longitude)).cast<float>(),
                {200, level, level}, 0.012F, 1.0F, 20 * object.id);
    }
  }
  return cloud.Finish();
}

PictureOptions DensePicture(ObjectLook look) {
  PictureOptions options = SmallPicture();
  options.layers.dense_cloud = CloudOfTheDesk();
  options.style.objects.look = look;
  options.style.dense_cloud.detail = 1.25;
  return options;
}

TEST(PictureLayersTest, DrawsGlassSolidsInDenseCloudLikeBaseline) {
  ExpectBaseline(RenderPicture(HandMadeMap(), DensePicture(ObjectLook::kAuto)), "map_dense");
}

TEST(PictureLayersTest, DrawsOutlinesInDenseCloudLikeBaseline) {
  PictureOptions options = DensePicture(ObjectLook::kOutline);
  options.style = LoadStyle("dark");
  options.style.objects.look = ObjectLook::kOutline;
  options.style.dense_cloud.detail = 1.25;
  ExpectBaseline(RenderPicture(HandMadeMap(), options), "map_outline");
}

TEST(PictureLayersTest, DrawsGlassSolidsWithoutCloudLikeBaseline) {
  PictureOptions options = SmallPicture();
  options.style.objects.look = ObjectLook::kGlass;
  ExpectBaseline(RenderPicture(HandMadeMap(), options), "map_glass");
}

TEST(PictureLayersTest, DrawsHollowClassesAsGlassAmongSolids) {
  MapSnapshot map = HandMadeMap();
  SnapshotObject ball = map.objects[2];
  map.objects.resize(1);  // a box, and a ball inside it
  map.objects[0].superquadric.T_map_object.translation = {0.0, 0.0, 0.2};
  map.objects[0].superquadric.shape.half_size = {0.4, 0.3, 0.2};
  ball.superquadric.T_map_object.translation = {0.0, 0.0, 0.15};
  map.objects.push_back(ball);
  PictureOptions options = SmallPicture();
  options.style.text.legend = options.style.points.show = false;
  const cv::Vec3d ball_color = [&] {
    const Eigen::Vector3d c = LabelColors()(ball.label);
    return 255.0 * cv::Vec3d(c.z(), c.y(), c.x());
  }();
  const auto like_ball = [&](const std::string& label) {
    map.objects[0].label = label;
    int count = 0;
    const cv::Mat picture = RenderPicture(map, options);
    for (auto pixel = picture.begin<cv::Vec3b>(); pixel != picture.end<cv::Vec3b>(); ++pixel) {
      count += cv::norm(cv::Vec3d(*pixel) - ball_color) < 60.0 ? 1 : 0;
    }
    return count;
  };
  EXPECT_LT(like_ball("book"), 50);
  EXPECT_GT(like_ball("dining_table"), 300);
}

TEST(PictureLayersTest, ColoursMapByItsErrors) {
  const MapSnapshot map = HandMadeMap();
  auto truth = std::make_shared<MapTruth>();
  truth->solids = {map.objects[0].superquadric};
  truth->solids[0].T_map_object.translation.z() += 0.3;
  truth->iou = {{0, 1.0}, {1, 0.0}, {2, 0.5}};
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    truth->camera_error[keyframe.id] = 0.001 * static_cast<double>(keyframe.id);
  }
  PictureOptions options = SmallPicture();
  options.style.light = {.shadow = 0.0, .ambient_occlusion = 0.0, .outline = 0.0, .eye_dome = 0.0};
  options.style.objects.opacity = 1.0;
  options.style.ground_truth.width = 8.0;
  const auto like = [](const cv::Mat& picture, const Eigen::Vector3d& rgb) {
    const cv::Vec3d color = 255.0 * cv::Vec3d(rgb.z(), rgb.y(), rgb.x());
    int count = 0;
    for (auto pixel = picture.begin<cv::Vec3b>(); pixel != picture.end<cv::Vec3b>(); ++pixel) {
      count += cv::norm(cv::Vec3d(*pixel) - color) < 50.0 ? 1 : 0;
    }
    return count;
  };
  const cv::Mat plain = RenderPicture(map, options);
  options.layers.truth = truth;
  const cv::Mat judged = RenderPicture(map, options);
  const Eigen::Vector3d dashes = ParseColor(options.style.ground_truth.color);
  EXPECT_GT(like(judged, Viridis(1.0)), like(plain, Viridis(1.0)) + 500);  // the book
  EXPECT_GT(like(judged, Viridis(0.0)), like(plain, Viridis(0.0)) + 300);  // the cup
  EXPECT_GT(like(judged, dashes), 100);
  const cv::Rect bars(200, 195, 115, 40);
  EXPECT_GT(like(judged(bars), Viridis(0.5)), 20);
  options.style.ground_truth.show = false;
  EXPECT_TRUE(SameBytes(RenderPicture(map, options), plain));
}

TEST(PictureLayersTest, HidesMapPointsBehindDenseCloudUnlessRequested) {
  PictureOptions options = DensePicture(ObjectLook::kAuto);
  MapSnapshot bare = HandMadeMap();
  bare.points.clear();
  const cv::Mat dense = RenderPicture(HandMadeMap(), options);
  EXPECT_TRUE(SameBytes(dense, RenderPicture(bare, options)) ||
              PictureDifference(dense, RenderPicture(bare, options)) < kThreshold);
  options.style.dense_cloud.points = true;
  EXPECT_FALSE(SameBytes(dense, RenderPicture(HandMadeMap(), options)));
  options.style.dense_cloud.show = false;
  PictureOptions without = options;
  without.layers.dense_cloud.reset();
  EXPECT_TRUE(SameBytes(RenderPicture(HandMadeMap(), options), RenderPicture(HandMadeMap(), without)));
}

TEST(PictureLayersTest, GrowsCloudWithFrames) {
  PictureRenderer renderer(DensePicture(ObjectLook::kAuto));
  MapSnapshot map = HandMadeMap();
  renderer.SetMap(map);
  const cv::Mat all = renderer.Render();
  map.frame_index = 19;  // the cup is seen from frame 20 on
  renderer.SetMapKeepingFrame(map);
  const cv::Mat early = renderer.Render();
  EXPECT_GT(cv::norm(all, early, cv::NORM_L1), 0.0);
  map.frame_index = 40;
  renderer.SetMapKeepingFrame(map);
  EXPECT_TRUE(SameBytes(renderer.Render(), all));
}

// The desk as a mesh: a waved sheet with a hole, striped, and its upper side to the cameras.
SurfaceMeshPtr MeshOfTheDesk() {
  constexpr std::uint32_t kAcross = 61;
  auto mesh = std::make_shared<SurfaceMesh>();
  for (std::uint32_t i = 0; i < kAcross * kAcross; ++i) {
    const auto column = i % kAcross, row = i / kAcross;
    const float x = 0.04F * static_cast<float>(column) - 1.2F, y = 0.04F * static_cast<float>(row) - 1.2F;
    mesh->vertices.emplace_back(x, y, 0.05F * std::sin(6.0F * x) - 0.1F);
    mesh->rgb.push_back({static_cast<std::uint8_t>(row / 10 % 2 == 0 ? 200 : 90), 140, 90});
    const bool hole = column > 40 && column < 50 && row > 40 && row < 50;
    if (column + 1 < kAcross && row + 1 < kAcross && !hole) {
      mesh->triangles.push_back({i, i + 1, i + 1 + kAcross});
      mesh->triangles.push_back({i, i + 1 + kAcross, i + kAcross});
    }
  }
  return mesh;
}

PictureOptions MeshPicture() {
  PictureOptions options = DensePicture(ObjectLook::kAuto);
  options.layers.dense_mesh = MeshOfTheDesk();
  options.style.dense_cloud.look = DenseLook::kMesh;
  return options;
}

TEST(PictureLayersTest, DrawsDenseMeshLikeBaseline) {
  ExpectBaseline(RenderPicture(HandMadeMap(), MeshPicture()), "map_mesh");
}

TEST(PictureLayersTest, DrawsMeshInsteadOfCloudWhenRequested) {
  PictureOptions mesh = MeshPicture(), cloud = MeshPicture(), without_cloud = MeshPicture();
  without_cloud.layers.dense_cloud.reset();
  const cv::Mat meshed = RenderPicture(HandMadeMap(), mesh);
  EXPECT_TRUE(SameBytes(meshed, RenderPicture(HandMadeMap(), without_cloud)));
  cloud.style.dense_cloud.look = DenseLook::kPoints;
  EXPECT_TRUE(SameBytes(RenderPicture(HandMadeMap(), cloud),
                        RenderPicture(HandMadeMap(), DensePicture(ObjectLook::kAuto))));
  mesh.style.dense_cloud.show = false;
  EXPECT_GT(PictureDifference(RenderPicture(HandMadeMap(), mesh), meshed), kThreshold);
}

TEST(PictureLayersTest, GrowsMeshWithFrames) {
  auto mesh = std::make_shared<SurfaceMesh>(*MeshOfTheDesk());
  for (const Eigen::Vector3f& p : mesh->vertices) {
    mesh->frames.push_back(p.x() < 0.0F ? 10 : 30);
  }
  PictureOptions options = MeshPicture();
  options.layers.dense_mesh = mesh;
  PictureRenderer renderer(options);
  MapSnapshot map = HandMadeMap();
  renderer.SetMap(map);
  EXPECT_TRUE(SameBytes(renderer.Render(), RenderPicture(HandMadeMap(), MeshPicture()))) << "the whole of it";
  const auto striped = [&](std::int64_t frame) {
    map.frame_index = frame;
    renderer.SetMapKeepingFrame(map);
    cv::Mat stripes;
    cv::inRange(renderer.Render(), cv::Scalar(40, 80, 120), cv::Scalar(110, 160, 255), stripes);
    return cv::countNonZero(stripes);
  };
  const int half = striped(29), all = striped(30);
  EXPECT_GT(all, 2000);
  EXPECT_LT(half, 3 * all / 4);
  EXPECT_GT(half, all / 4);
  EXPECT_LT(striped(9), all / 20);
}

TEST(PictureLayersTest, LightsMeshAndCullsItsBack) {
  PictureOptions options = MeshPicture();
  options.style.objects.show = options.style.cameras.keyframes = options.style.grid.show = false;
  options.style.cameras.trajectory = options.style.cameras.current = options.style.text.legend = false;
  options.style.text.scale = options.style.points.show = false;
  const auto hues = [&] {  // stripes have two colours; light makes more of them
    cv::Mat red;
    cv::extractChannel(RenderPicture(HandMadeMap(), options), red, 2);
    cv::Mat histogram;
    const int bins = 256;
    const float range[] = {0.0F, 256.0F};
    const float* ranges = range;
    const int channel = 0;
    cv::calcHist(&red, 1, &channel, cv::Mat(), histogram, 1, &bins, &ranges);
    return cv::countNonZero(histogram > 20);
  };
  EXPECT_GT(hues(), 12);
  options.camera.position->z() = -options.camera.position->z();
  EXPECT_EQ(hues(), 1) << "paper alone";
}

// A section through book and ball, the keyframes' graph, and a true path beside the estimated one.
PictureOptions SectionWithLayers() {
  PictureOptions options = SmallPicture();
  options.style.clip = {.axis = ClipAxis::kY, .offset = 0.1, .flip = true};
  options.style.covisibility.show = true;
  options.style.covisibility.width = 2.0;
  options.style.covisibility.min_points = 40;
  options.style.ground_truth.width = 3.0;
  options.style.cameras.keyframes = false;
  options.style.objects.labels = true;
  options.layers.true_path.emplace_back();
  for (const SnapshotKeyframe& keyframe : HandMadeMap().keyframes) {
    options.layers.true_path.back().push_back(1.06 * keyframe.T_map_camera.translation);
  }
  CloudLayerBuilder cloud(0.02);
  for (int i = 0; i < 900; ++i) {  // a wall behind the desk
    cloud.Add({-0.9F + 0.06F * static_cast<float>(i % 30), 0.9F, 0.02F * static_cast<float>(i / 30)},
              {static_cast<std::uint8_t>(8 * (i % 30)), 90, 200}, 0.02F);
  }
  options.layers.dense_cloud = cloud.Finish();
  options.style.dense_cloud.detail = 1.25;
  options.camera.position = Eigen::Vector3d(2.6, -3.9, 3.0);
  options.camera.focal_point = Eigen::Vector3d(0.1, -0.8, 0.35);
  options.camera.view_angle = 31.0;
  return options;
}

TEST(PictureLayersTest, DrawsSectionWithLayersLikeBaseline) {
  ExpectBaseline(RenderPicture(HandMadeMap(), SectionWithLayers()), "map_section");
}

TEST(PictureLayersTest, CombinesLayersAndSections) {
  PictureRenderer renderer(SectionWithLayers());
  renderer.SetMap(HandMadeMap());
  const cv::Mat all = renderer.Render();
  const auto without = [&](auto change) {
    PictureOptions options = SectionWithLayers();
    MapSnapshot map = HandMadeMap();
    change(options, map);
    return cv::norm(RenderPicture(map, options), all, cv::NORM_L1) / static_cast<double>(all.total());
  };
  EXPECT_EQ(without([](auto&, auto&) {}), 0.0);
  EXPECT_GT(without([](PictureOptions& o, auto&) { o.layers.true_path.clear(); }), 0.5);
  EXPECT_GT(without([](PictureOptions& o, auto&) { o.layers.dense_cloud.reset(); }), 0.3);
  EXPECT_GT(without([](PictureOptions& o, auto&) { o.style.covisibility.show = false; }), 0.5);
  EXPECT_GT(without([](PictureOptions& o, auto&) { o.style.covisibility.min_points = 150; }), 0.2)
      << "only neighbours share so many points";
  EXPECT_GT(without([](auto&, MapSnapshot& map) { map.covisibility.clear(); }), 0.5);
  EXPECT_GT(without([](PictureOptions& o, auto&) { o.style.clip.axis = ClipAxis::kNone; }), 2.0);
  EXPECT_GT(without([](PictureOptions& o, auto&) { o.style.clip.flip = false; }), 2.0);
}

TEST(PictureLayersTest, LeavesNothingOfClippedParts) {
  PictureOptions options = SmallPicture();
  options.style.clip = {.axis = ClipAxis::kX, .offset = 10.0, .flip = true};  // all of it
  options.style.cameras = {.trajectory = false, .keyframes = false, .current = false};
  options.style.objects.labels = true;
  MapSnapshot bare = HandMadeMap();
  PictureRenderer renderer(options);
  renderer.SetMap(HandMadeMap());
  const cv::Mat cut = renderer.Render();
  bare.points.clear();
  bare.objects.clear();
  renderer.SetMapKeepingFrame(bare);
  EXPECT_TRUE(SameBytes(renderer.Render(), cut)) << "no shadow, name or line of the legend either";
  options.style.clip.flip = false;
  EXPECT_GT(PictureDifference(RenderPicture(HandMadeMap(), options), cut), kThreshold);
}

// A solid whose near side is cut off shows its inside, also where it is opaque.
TEST(PictureLayersTest, ShowsInsideOfClippedSolid) {
  PictureOptions options = SmallPicture();
  options.style.light = {.shadow = 0.0, .ambient_occlusion = 0.0, .outline = 0.0, .eye_dome = 0.0};
  options.style.points.show = options.style.grid.show = options.style.text.legend = false;
  options.style.objects.opacity = 1.0;
  options.style.clip.axis = ClipAxis::kZ;
  MapSnapshot map = HandMadeMap();
  map.objects.resize(1);  // the book, from above
  options.camera = {.view = "top"};
  map.keyframes.clear();
  map.T_map_camera.reset();
  const cv::Mat image = RenderPicture(map, options);
  const cv::Vec3b middle = image.at<cv::Vec3b>(image.rows / 2, image.cols / 2);
  EXPECT_LT(*std::min_element(middle.val, middle.val + 3), 200) << "not the white background";
}

}  // namespace
}  // namespace sqslam
