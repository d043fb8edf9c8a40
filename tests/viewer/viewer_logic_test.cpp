#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "app/viewer/input/input_events.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/state/pictures.h"
#include "app/viewer/state/scene_view.h"
#include "app/viewer/state/viewer_state.h"
#include "render/video/video.h"
#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const cv::Size kWindow(800, 600);

Eigen::Vector2d Seen(const ViewCamera& camera, const Eigen::Vector3d& p) {
  return PinholeOf(camera, kWindow).Project(PoseOf(camera).Inverse() * p) + Eigen::Vector2d(0.5, 0.5);
}

TEST(SceneViewTest, AlignsCameraViewWithItsImage) {
  const Camera camera{320, 240, 290.0, 310.0, 150.0, 131.0, {}, 30.0};
  const Rigid3d T_map_camera{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, 0.5).normalized())),
      {0.3, -1.0, 2.0}};
  for (const auto& [window, photo] : {std::pair(cv::Size(800, 600), cv::Rect2d(0.0, 0.0, 800.0, 600.0)),
                                      std::pair(cv::Size(500, 700), cv::Rect2d(0.0, 162.5, 500.0, 375.0))}) {
    const ViewCamera view = LookThrough(T_map_camera, camera, window, 2.0);
    const Eigen::Vector3d p_camera(0.4, -0.3, 1.7);
    const Eigen::Vector2d pixel = camera.Project(p_camera) + Eigen::Vector2d(0.5, 0.5);
    const Eigen::Vector2d on_photo(photo.x + pixel.x() / camera.width * photo.width,
                                   photo.y + pixel.y() / camera.height * photo.height);
    const Eigen::Vector2d seen =
        PinholeOf(view, window).Project(PoseOf(view).Inverse() * (T_map_camera * p_camera)) +
        Eigen::Vector2d(0.5, 0.5);
    EXPECT_NEAR(seen.y(), on_photo.y(), 0.01);
    EXPECT_NEAR(seen.x(), on_photo.x(), 0.01);
  }
  EXPECT_FALSE(LookThrough(T_map_camera, {}, {800, 600}, 2.0).pinhole) << "no camera is known";
  EXPECT_FALSE(LookThrough(T_map_camera, camera, {}, 2.0).pinhole) << "no window is there yet";
}

TEST(CameraControlTest, KeepsFocalPointAndDistanceInOrbit) {
  const ViewCamera before;
  const ViewCamera after = Orbit(before, {100.0, -40.0}, kWindow, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(after.focal_point, before.focal_point);
  EXPECT_NEAR(after.Distance(), before.Distance(), 1e-9);
  EXPECT_GT((after.position - before.position).norm(), 0.5);
  const ViewCamera pole = Orbit(before, {0.0, 5000.0}, kWindow, Eigen::Vector3d::UnitZ());
  EXPECT_GT((pole.position.head<2>() - pole.focal_point.head<2>()).norm(), 1e-3);
  EXPECT_GT(pole.position.z(), 0.0);
}

TEST(CameraControlTest, MovesFocalPointWithMouseWhenPanning) {
  const ViewCamera before;
  const ViewCamera after = Pan(before, {30.0, 20.0}, kWindow);
  EXPECT_LT((Seen(after, before.focal_point) - Eigen::Vector2d(430.0, 320.0)).norm(), 1e-6);
}

TEST(CameraControlTest, KeepsPointUnderMouseWhenZooming) {
  const ViewCamera before;
  const Eigen::Vector2d mouse(250.0, 410.0);
  const Ray ray = RayOf(before, mouse, kWindow);
  const double depth = before.Distance() / ray.direction.dot(-AxesOf(before).back);
  const Eigen::Vector3d under = ray.origin + depth * ray.direction;
  const ViewCamera after = ZoomTo(before, 2.0, mouse, kWindow);
  EXPECT_LT((Seen(after, under) - mouse).norm(), 1e-6);
  EXPECT_NEAR(after.Distance(), 0.5 * before.Distance(), 1e-9);
}

TEST(CameraControlTest, CastsRayThroughSeenPoint) {
  ViewCamera camera;
  const Eigen::Vector3d p(0.4, -0.3, 0.7);
  const Ray ray = RayOf(camera, Seen(camera, p), kWindow);
  EXPECT_LT((ray.origin + (p - ray.origin).norm() * ray.direction - p).norm(), 1e-9);
}

TEST(PickingTest, HitsSurfaceOfSolid) {
  for (const double e1 : {0.1, 1.0, 1.9}) {
    PosedSuperquadric solid{{{0.3, 0.2, 0.5}, e1, 0.6}, {}};
    solid.T_map_object.translation = {1.0, 2.0, 3.0};
    const Eigen::Vector3d eye(4.0, -1.0, 5.0);
    const Eigen::Vector3d to = solid.T_map_object * Eigen::Vector3d(0.1, 0.05, 0.1);
    const Ray ray{eye, (to - eye).normalized()};
    const auto distance = HitDistance(ray, solid);
    ASSERT_TRUE(distance);
    const Eigen::Vector3d hit = solid.T_map_object.Inverse() * (eye + *distance * ray.direction);
    EXPECT_NEAR(solid.shape.RadialScale(hit), 1.0, 1e-6);
    EXPECT_LT(*distance, (to - eye).norm());
    EXPECT_FALSE(HitDistance({eye, -ray.direction}, solid));  // behind
    EXPECT_FALSE(HitDistance({eye + Eigen::Vector3d(0.0, 0.0, 2.0), ray.direction}, solid));
  }
}

TEST(PickingTest, PicksNearestOfTwoObjects) {
  MapSnapshot map = HandMadeMap();
  const Eigen::Vector3d a = map.objects[0].superquadric.T_map_object.translation;
  const Eigen::Vector3d b = map.objects[2].superquadric.T_map_object.translation;
  const Eigen::Vector3d way = (b - a).normalized();
  EXPECT_EQ(PickObject({a - 3.0 * way, way}, map.objects), 0);
  EXPECT_EQ(PickObject({b + 3.0 * way, -way}, map.objects), 2);
  EXPECT_EQ(PickObject({a + Eigen::Vector3d(0.0, 0.0, 3.0), way}, map.objects), std::nullopt);
}

TEST(PickingTest, IgnoresClippedParts) {
  const MapSnapshot map = HandMadeMap();
  const PosedSuperquadric& ball = map.objects[2].superquadric;
  const Eigen::Vector3d middle = ball.T_map_object.translation;
  const Ray down{middle + Eigen::Vector3d(0.0, 0.0, 2.0), -Eigen::Vector3d::UnitZ()};
  EXPECT_EQ(PickObject(down, map.objects), 2);
  // Its upper half is gone: one looks into it, onto its floor.
  const ClipPlane half{Eigen::Vector3d::UnitZ(), middle.z()};
  const auto inside = HitDistance(down, ball, half);
  ASSERT_TRUE(inside);
  EXPECT_NEAR(*inside, 2.15, 1e-6);
  EXPECT_NEAR(*HitDistance(down, ball, std::nullopt), 1.85, 1e-6);
  EXPECT_EQ(PickObject(down, map.objects, half), 2);
  // All of it is gone, and the book is what one sees behind it.
  const ClipPlane none{-Eigen::Vector3d::UnitZ(), -0.35};
  EXPECT_FALSE(none.KeepsSomeOf(ball));
  EXPECT_EQ(PickObject(down, map.objects, none), std::nullopt);
  const Eigen::Vector3d book = map.objects[0].superquadric.T_map_object.translation;
  const Eigen::Vector3d way = (book - middle).normalized();
  const Ray through{middle - 3.0 * way, way};
  EXPECT_EQ(PickObject(through, map.objects), 2);
  EXPECT_EQ(PickObject(through, map.objects, ClipPlane{Eigen::Vector3d::UnitX(), 0.1}), 0);
}

TEST(PickingTest, PicksVisiblePointsOfMapAndCloud) {
  MapSnapshot map;
  map.points = {{{0.0F, 0.0F, 0.0F}, {}, -1}, {{0.0F, -1.0F, 0.5F}, {}, -1}};
  ViewCamera camera;
  camera.position = {0.0, -4.0, 2.0};  // looks at the first point, past the second one
  const Eigen::Vector2d pixel(400.0, 300.0);
  const auto picked = [&](const std::optional<ClipPlane>& cut, const CloudLayer* cloud = nullptr) {
    return PickPoint(camera, pixel, kWindow, map, cut, cloud);
  };
  EXPECT_EQ(picked({}), Eigen::Vector3d(0.0, -1.0, 0.5));
  EXPECT_EQ(picked(ClipPlane{Eigen::Vector3d::UnitZ(), 0.2}), Eigen::Vector3d(0.0, 0.0, 0.0));
  CloudLayer cloud;
  cloud.points.resize(1);
  cloud.points[0].p_map = {0.0F, -2.0F, 1.0F};
  EXPECT_EQ(picked({}, &cloud), Eigen::Vector3d(0.0, -2.0, 1.0));
  EXPECT_EQ(picked(ClipPlane{Eigen::Vector3d::UnitZ(), 0.7}, &cloud), Eigen::Vector3d(0.0, -1.0, 0.5));
}

TEST(RenderCommandLineTest, NamesDrawnLayers) {
  ViewerState state;
  state.view.UseStyle("paper");
  state.document.file = "/data/map.sqmap";
  const auto line = [&] { return RenderCommandLine(state, {640, 360}, false, "out.png"); };
  EXPECT_THAT(line(), ::testing::Not(HasSubstr("--ground-truth")));
  state.layers.true_path = true;
  state.layers.ShowCloud("/data/a room.ply");
  state.view.SwitchCut();
  state.view.clip.offset = -0.25;
  state.view.style.covisibility.show = true;
  EXPECT_THAT(line(),
              HasSubstr("--ground-truth=auto '--dense-cloud=/data/a room.ply' --dense-cloud-frame=map"));
  EXPECT_THAT(line(), HasSubstr("--set=covisibility.show=true"));
  EXPECT_THAT(line(), HasSubstr("--set=clip.offset=-0.25"));
  EXPECT_THAT(line(), HasSubstr("clip.axis="));
  state.layers.true_path = false;
  state.layers.sequence = "/data/kitchen";
  state.layers.cloud_in_world = true;
  EXPECT_THAT(line(), HasSubstr("--ground-truth=/data/kitchen --set=ground_truth.show=false"))
      << "what the cloud is laid over by";
  state.view.UseStyle("dark");
  EXPECT_EQ(state.view.clip.axis, ClipAxis::kView) << "another look is no other section";
}

TEST(LayoutTest, FillsWindowWithoutOverlap) {
  const Layout layout = LayOut({1280, 720}, 25.0, {}, true, true, 1.0);
  EXPECT_DOUBLE_EQ(layout.scene.width + layout.side_line.width + layout.side.width, 1280.0);
  EXPECT_DOUBLE_EQ(25.0 + layout.scene.height + layout.bottom_line.height + layout.bottom.height, 720.0);
  EXPECT_EQ((layout.scene & layout.side).area(), 0.0);
  EXPECT_EQ((layout.top & layout.side).area(), 0.0);
  EXPECT_GT(LayOut({1280, 720}, 25.0, {}, false, true, 1.0).scene.height, layout.scene.height);
}

TEST(LayoutTest, HasNoNegativePartsInSmallWindows) {
  for (const cv::Size size : {cv::Size(0, 0), cv::Size(40, 30), cv::Size(300, 10)}) {
    const Layout layout = LayOut(size, 25.0, {}, true, true, 2.0);
    for (const cv::Rect2d& part : {layout.scene, layout.top, layout.side, layout.bottom}) {
      EXPECT_GE(part.width, 0.0);
      EXPECT_GE(part.height, 0.0);
    }
  }
}

TEST(InputEventsTest, ReadsBackFormattedEvents) {
  using Kind = InputEvent::Kind;
  for (const InputEvent& event :
       {InputEvent{.kind = Kind::kMove, .x = 12.5, .y = -3.0}, InputEvent{.kind = Kind::kPress, .code = 2},
        InputEvent{.kind = Kind::kWheel, .x = 0.0, .y = -1.0},
        InputEvent{.kind = Kind::kKeyDown, .code = key::kF12}, InputEvent{.kind = Kind::kKeyUp, .code = 'W'},
        InputEvent{.kind = Kind::kText, .text = "\u00e9 a"}, InputEvent{.kind = Kind::kText, .text = " "},
        InputEvent{.kind = Kind::kResize, .x = 0.0, .y = 0.0},
        InputEvent{.kind = Kind::kDrop, .text = "/a b/c"}, InputEvent{.kind = Kind::kDrop, .text = " a"},
        InputEvent{.kind = Kind::kFocus, .code = 1}, InputEvent{.kind = Kind::kClose}}) {
    const std::vector<ScriptLine> script = ParseScript(FormatEvent(event), "test");
    ASSERT_EQ(script.size(), 1U);
    EXPECT_EQ(script.front().event, event) << FormatEvent(event);
  }
}

TEST(InputEventsTest, ReportsInvalidLines) {
  const auto message = [](const std::string& text) {
    try {
      ParseScript(text, "a.txt");
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(message("# nothing\nmove 1"), HasSubstr("a.txt:2: expected two numbers"));
  EXPECT_THAT(message("key Foo"), HasSubstr("expected a key"));
  EXPECT_THAT(message("jump"), HasSubstr("expected move, press"));
  EXPECT_THAT(message("wait long"), HasSubstr("expected idle, map or end"));
  EXPECT_THAT(message("picture window.xyz"), HasSubstr("a.txt:1: expected FILE.png"));
}

TEST(InputEventsTest, RejectsNumbersOutOfRange) {
  for (const char* line : {"frames -1", "frames 1e10", "repeat -1", "repeat 1e10", "wait frame 1e10",
                           "move 1e10 0", "resize 0 -1e10"}) {
    EXPECT_THROW(ParseScript(line, "a.txt"), UsageError) << line;
  }
  EXPECT_EQ(ParseScript("frames 1000000", "a.txt").front().count, 1000000);
}

TEST(InputEventsTest, ExpandsClickToPointAndPress) {
  const std::vector<ScriptLine> script = ParseScript("click Save path\npoint -5 20 keyframes", "test");
  ASSERT_EQ(script.size(), 6U);
  EXPECT_EQ(script[0].kind, ScriptLine::Kind::kPoint);
  EXPECT_EQ(script[0].text, "Save path");
  EXPECT_EQ(script[2].event, (InputEvent{.kind = InputEvent::Kind::kPress}));
  EXPECT_EQ(script[3].event, (InputEvent{.kind = InputEvent::Kind::kRelease}));
  EXPECT_EQ(script[5].text, "keyframes");
  EXPECT_EQ(script[5].event, (InputEvent{.x = -5.0, .y = 20.0}));
}

TEST(InputEventsTest, ReadsRepeatInSeconds) {
  const std::vector<ScriptLine> script = ParseScript("key H\nrepeat 90", "test");
  EXPECT_EQ(script.back().kind, ScriptLine::Kind::kRepeat);
  EXPECT_EQ(script.back().count, 90);
}

TEST(ShortcutsTest, HaveUniqueKeys) {
  const std::vector<Shortcut>& all = Shortcuts();
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_FALSE(all[i].help.empty());
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      EXPECT_FALSE(all[i].code == all[j].code && all[i].shift == all[j].shift &&
                   all[i].control == all[j].control)
          << all[i].keys << " and " << all[j].keys;
    }
  }
}

TEST(ShortcutsTest, IgnoreReplayKeysDuringRun) {
  for (const bool shift : {false, true}) {
    for (const int code : {static_cast<int>('B'), key::kLeft, key::kRight, key::kHome, key::kEnd}) {
      ViewerState state;
      state.document.timeline = TenSeconds();
      state.document.run.active = true;
      state.playback.time = 7.0;
      RunShortcut(state, code, shift, false);
      EXPECT_FALSE(state.playback.playing) << code;
      EXPECT_EQ(state.playback.time, 7.0) << code;
    }
  }
}

TEST(RenderCommandLineTest, NamesOnlyChangesToStyle) {
  ViewerState state;
  state.view.UseStyle("dark");
  state.view.style.objects.opacity = 0.5;
  state.view.style.grid.show = false;
  EXPECT_THAT(StyleChanges(state.view.style, LoadStyle("dark")),
              ElementsAre("objects.opacity=0.5", "grid.show=false"));
  state.document.file = "/data/a map/map.sqmap";
  state.view.camera.position = {-1.5, 2.0, 0.25};
  const std::string line = RenderCommandLine(state, {640, 360}, true, "out.png");
  EXPECT_THAT(line, HasSubstr("sqslam render '/data/a map/map.sqmap' --output=out.png --resolution=640,360"));
  EXPECT_THAT(line, HasSubstr("--no-background --style=dark --set=objects.opacity=0.5 --set=grid.show=false "
                              "--camera-position=-1.5,2,0.25"));
}

TEST(RenderCommandLineTest, NamesSettingsOfAllStyles) {
  ViewerState state;
  state.view.settings = {"objects.colors.cup=#22aa55"};
  for (const char* style : {"dark", "paper"}) {  // they outlive a change of style
    state.view.UseStyle(style);
    EXPECT_EQ(FormatColor(state.view.colors("cup")), "#22aa55");
    EXPECT_EQ(state.view.style.objects.colors.at("cup"), "#22aa55");
  }
  state.document.file = "/data/map.sqmap";
  EXPECT_THAT(RenderCommandLine(state, {640, 360}, false, "out.png"),
              HasSubstr("--style=paper '--set=objects.colors.cup=#22aa55' --camera-position"));
}

TEST(RenderCommandLineTest, NamesFrameWhenThroughCamera) {
  const auto map = std::make_shared<MapSnapshot>();
  map->T_map_camera = Rigid3d();
  map->camera = {320, 240, 290.0, 310.0, 150.0, 131.0, {}, 30.0};
  const auto shown = std::make_shared<ShownFrame>();
  shown->frame_index = 7;
  shown->map = map;
  ViewerState state;
  state.view.UseStyle("dark");
  state.view.mode = CameraMode::kFirstPerson;
  state.document.file = "/data/map.sqmap";
  state.document.shown = shown;
  const auto line = [&] { return RenderCommandLine(state, {640, 360}, false, "out.png"); };
  EXPECT_THAT(line(), HasSubstr("--camera-frame=7 --at-frame=7"));
  EXPECT_THAT(line(), HasSubstr("--set=cameras.current=true")) << "they are drawn in the window too";
  EXPECT_THAT(line(), ::testing::Not(HasSubstr("--camera-position")));
  EXPECT_THAT(line(), ::testing::Not(HasSubstr("--photo")));
  shown->image = cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(0));
  EXPECT_THAT(line(), HasSubstr("--photo --camera-frame=7 --at-frame=7"));
}

TEST(CameraKeysTest, PlaySameViewsAfterSaving) {
  CameraKeys keys;
  keys.interval = 1.5;
  ViewCamera camera;
  for (int i = 0; i < 3; ++i) {
    keys.Add(camera);
    camera = Orbit(camera, {120.0, 10.0}, kWindow, Eigen::Vector3d::UnitZ());
  }
  keys.Remove(1);
  ASSERT_EQ(keys.keys.size(), 2U);
  EXPECT_DOUBLE_EQ(keys.keys[1].time, 1.5);
  const TemporaryFolder folder;
  const auto file = folder.Write("path.yaml", keys.Yaml());
  const CameraPathFile path = ReadCameraPath(file, 10.0);
  const std::vector<ViewCamera> views = ViewsAlong(path, HandMadeMap(), {}, {}, 16, 10.0);
  EXPECT_LT((views.front().position - keys.keys[0].camera.position).norm(), 1e-5);
  EXPECT_LT((views.back().position - keys.keys[1].camera.position).norm(), 1e-5);
}

}  // namespace
}  // namespace sqslam::viewer
