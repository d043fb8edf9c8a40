// Panels of editing in the whole window, drawn without one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/viewer/input/input_events.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/state/scene_view.h"
#include "tests/render/baseline.h"
#include "tests/viewer/ui_stage.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;

class EditingWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path map = WriteGrowingMap(folder_.Path());
    edits_ = EditsFileOf(map);
    stage_.viewer->Open(map);
    stage_.Settle();
    ASSERT_NE(stage_.State().document.Map(), nullptr);
    state().editing.annotation.file = "objects_gt.json";  // not the temporary folder's
    state().window.settings.show_image = false;           // the recording has none
    stage_.MoveTo(5.0, 700.0);
    state().messages.notices.clear();
    stage_.Settle();
  }
  ViewerState& state() { return stage_.viewer->State(); }
  void Show(const std::string& title) {
    state().window.to_front = title;
    stage_.Frames(3);
    stage_.Settle();
  }
  void Control(int code) {
    stage_.Handle({.kind = InputEvent::Kind::kKeyDown, .code = key::kLeftControl});
    stage_.Key(code);
    stage_.Handle({.kind = InputEvent::Kind::kKeyUp, .code = key::kLeftControl});
    stage_.Frames(2);
  }
  std::vector<int> Ids() {
    std::vector<int> ids;
    for (const SnapshotObject& object : state().document.Map()->objects) {
      ids.push_back(object.id);
    }
    return ids;
  }

  TemporaryFolder folder_;
  std::filesystem::path edits_;
  UiStage stage_{{1100, 760}};
};

TEST_F(EditingWindow, MatchesBaselineOfTable) {
  state().Editor().RenameObject(1, "Ada's mug");
  state().Editor().HideObject(2, true);
  state().selection.selected = 0;
  stage_.Settle();
  ExpectBaseline(stage_.Picture(), "viewer_table");
}

TEST_F(EditingWindow, MatchesBaselineOfInspector) {
  state().selection.selected = 0;
  state().editing.point_colors = PointColors::kResidual;
  Show("Inspector");
  ExpectBaseline(stage_.Picture(), "viewer_inspector");
}

TEST_F(EditingWindow, MatchesBaselineOfAnnotation) {
  Show("Annotate");
  state().Editor().AddSolidOf(state().document.Map()->objects[1]);
  state().Editor().AddSolid(SolidKind::kCuboid);
  state().messages.notices.clear();
  stage_.Settle();
  ExpectBaseline(stage_.Picture(), "viewer_annotation");
}

TEST_F(EditingWindow, MatchesBaselineOfSettings) {
  SwitchTheme(state());
  state().window.show_settings = true;
  stage_.Settle();
  ExpectBaseline(stage_.Picture(), "viewer_settings");
}

TEST_F(EditingWindow, DeletesUndoesAndRedoesByKeys) {
  state().selection.selected = 1;
  stage_.Key(key::kDelete);
  stage_.Frames(2);
  EXPECT_THAT(Ids(), ElementsAre(0, 2));
  Control('Z');
  EXPECT_THAT(Ids(), ElementsAre(0, 1, 2));
  Control('Y');
  EXPECT_THAT(Ids(), ElementsAre(0, 2));
  Control('S');
  EXPECT_TRUE(std::filesystem::exists(edits_));
  EXPECT_FALSE(state().editing.document.Modified());
}

TEST_F(EditingWindow, EditsEveryFrameOfReplay) {
  state().Editor().DeleteObject(0);
  stage_.Key(key::kLeft);  // to the state before
  stage_.Settle();
  EXPECT_LT(state().document.shown->frame_index, 70);
  EXPECT_THAT(Ids(), ElementsAre(1));
}

TEST_F(EditingWindow, AsksBeforeClosingWithUnsavedEdits) {
  state().Editor().DeleteObject(0);
  stage_.Handle({.kind = InputEvent::Kind::kClose});
  stage_.Frames(3);
  EXPECT_FALSE(stage_.viewer->WantsToClose());
  EXPECT_TRUE(state().editing.postponed.has_value());
  stage_.Key(key::kEscape);
  stage_.Frames(2);
  EXPECT_FALSE(state().editing.postponed.has_value()) << "cancelled";
  state().Editor().SaveAll();
  stage_.Handle({.kind = InputEvent::Kind::kClose});
  stage_.Frames(3);
  EXPECT_TRUE(stage_.viewer->WantsToClose());
}

TEST_F(EditingWindow, DragsHandleInScene) {
  Show("Annotate");
  state().Editor().AddSolid(SolidKind::kCuboid);
  stage_.Frames(2);
  const Solid start = state().Editor().SelectedSolid()->solid;
  const Eigen::Vector3d eye = state().view.camera.position;
  const Eigen::Vector3d at = HandlePosition(start, {SolidHandle::Kind::kSide, 2, 1});
  const Camera camera = PinholeOf(state().view.camera, state().view.size);
  constexpr double kMenu = 25.0;
  const Eigen::Vector2d pixel =
      camera.Project(PoseOf(state().view.camera).Inverse() * at) + Eigen::Vector2d(0.5, 0.5 + kMenu);
  stage_.Drag(pixel.x(), pixel.y(), pixel.x(), pixel.y() - 30.0);
  EXPECT_GT(state().Editor().SelectedSolid()->solid.half_size.z(), 1.1 * start.half_size.z());
  EXPECT_NEAR(BottomOf(state().Editor().SelectedSolid()->solid), BottomOf(start), 1e-9);
  EXPECT_EQ(state().view.camera.position, eye) << "the view stays";
  Control('Z');
  EXPECT_EQ(state().Editor().SelectedSolid()->solid.half_size, start.half_size);
}

TEST_F(EditingWindow, SelectsPointsByLassoInScene) {
  Show("Annotate");
  state().editing.annotation.lasso = true;
  const Eigen::Vector3d eye = state().view.camera.position;
  stage_.MoveTo(60.0, 60.0);
  stage_.Handle({.kind = InputEvent::Kind::kPress, .code = 0});
  const cv::Size size = state().view.size;
  for (const auto& [x, y] : {std::pair(size.width - 60.0, 60.0),
                             {size.width - 60.0, size.height - 20.0},
                             {60.0, size.height - 20.0}}) {
    stage_.Handle({.kind = InputEvent::Kind::kMove, .x = x, .y = y});
    stage_.Frames(2);
  }
  stage_.Handle({.kind = InputEvent::Kind::kRelease, .code = 0});
  stage_.Frames(2);
  EXPECT_GT(state().editing.annotation.chosen.size(), 50U);
  EXPECT_EQ(state().view.camera.position, eye);
}

}  // namespace
}  // namespace sqslam::viewer
