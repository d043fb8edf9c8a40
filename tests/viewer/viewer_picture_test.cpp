// The whole window, drawn without one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <imgui_internal.h>

#include <string_view>

#include "app/viewer/input/input_events.h"
#include "app/viewer/state/pictures.h"
#include "app/viewer/state/scene_view.h"
#include "tests/render/baseline.h"
#include "tests/viewer/ui_stage.h"

namespace sqslam::viewer {
namespace {

using ::testing::HasSubstr;

// Returns the place in the window at which a point of the map is seen. The scene begins below the menu, at
// the left edge.
Eigen::Vector2d InWindow(const UiStage& stage, const Eigen::Vector3d& p_map) {
  const ViewerState& state = stage.State();
  const Camera camera = PinholeOf(state.view.camera, state.view.size);
  constexpr double kMenu = 25.0;
  return camera.Project(PoseOf(state.view.camera).Inverse() * p_map) + Eigen::Vector2d(0.5, 0.5 + kMenu);
}

class ViewerWindow : public ::testing::Test {
 protected:
  void Open() {
    stage_.viewer->Open(WriteGrowingMap(folder_.Path()));
    stage_.Settle();
    ASSERT_NE(stage_.State().document.Map(), nullptr);
  }
  Eigen::Vector3d CenterOf(int id) const {
    return stage_.State().document.Object(id)->superquadric.T_map_object.translation;
  }

  TemporaryFolder folder_;
  UiStage stage_;
};

TEST_F(ViewerWindow, MatchesBaseline) {
  Open();
  ExpectBaseline(stage_.Picture(), "viewer_dark");
}

TEST_F(ViewerWindow, MatchesLightBaselineWithSelection) {
  Open();
  stage_.Key('T');
  const Eigen::Vector2d cup = InWindow(stage_, CenterOf(1));
  stage_.Click(cup.x(), cup.y());
  stage_.MoveTo(5.0, 5.0);
  stage_.Settle();
  EXPECT_EQ(stage_.State().selection.selected, 1);
  ExpectBaseline(stage_.Picture(), "viewer_light_selected");
}

TEST_F(ViewerWindow, ReportsFailedRequests) {
  Open();
  stage_.viewer->State().view.style_name = (folder_.Path() / "gone.yaml").string();
  stage_.viewer->State().requests.emplace_back(CopyCommandRequest{});
  stage_.Frames();
  ASSERT_FALSE(stage_.State().messages.notices.empty());
  EXPECT_THAT(stage_.State().messages.notices.back().text, HasSubstr("gone.yaml"));
  EXPECT_EQ(stage_.viewer->TakeClipboard(), std::nullopt);
}

TEST_F(ViewerWindow, MatchesBaselineOfHelp) {
  stage_.Key('H');
  stage_.Settle();
  ExpectBaseline(stage_.Picture(), "viewer_help");
}

TEST_F(ViewerWindow, UnselectsOnClickBesideObjects) {
  Open();
  const Eigen::Vector2d book = InWindow(stage_, CenterOf(0));
  stage_.Click(book.x(), book.y());
  EXPECT_EQ(stage_.State().selection.selected, 0);
  stage_.Click(20.0, 60.0);
  EXPECT_EQ(stage_.State().selection.selected, std::nullopt);
}

TEST_F(ViewerWindow, RotatesViewOnDragWithoutSelecting) {
  Open();
  const Eigen::Vector3d before = stage_.State().view.camera.position;
  const Eigen::Vector2d book = InWindow(stage_, CenterOf(0));
  stage_.Drag(book.x(), book.y(), book.x() + 80.0, book.y());
  EXPECT_GT((stage_.State().view.camera.position - before).norm(), 0.1);
  EXPECT_EQ(stage_.State().selection.selected, std::nullopt);
}

TEST_F(ViewerWindow, MovesLabelsWithViewAngle) {
  Open();
  SceneView& view = stage_.viewer->State().view;
  view.style.objects.labels = true;
  stage_.Settle();
  view.camera.view_angle *= 0.6;
  stage_.Settle();
  const cv::Mat closer = stage_.Picture();
  for (int i = 0; i < 2; ++i) {  // draws all anew
    stage_.Key('X');
    stage_.Settle();
  }
  EXPECT_LT(PictureDifference(stage_.Picture(), closer), 1e-6);
}

TEST_F(ViewerWindow, ShowsFirstAndFinishedMapOnHomeAndEnd) {
  Open();
  stage_.Key(key::kHome);
  stage_.Settle();
  EXPECT_EQ(stage_.State().document.shown->frame_index, 10);
  EXPECT_TRUE(stage_.State().document.Map()->objects.empty());
  stage_.Key(key::kEnd);
  stage_.Settle();
  EXPECT_EQ(stage_.State().document.Map()->objects.size(), 3U);
}

TEST_F(ViewerWindow, StopsPlayingAtEnd) {
  Open();
  stage_.Key(key::kSpace);  // at the end it begins again
  stage_.Frames(3);
  EXPECT_TRUE(stage_.State().playback.playing);
  stage_.Frames(60 * 3);
  EXPECT_FALSE(stage_.State().playback.playing);
  stage_.Settle();
  EXPECT_EQ(stage_.State().document.shown->frame_index, 70);
}

TEST_F(ViewerWindow, ShowsStateUnderTimelineClick) {
  Open();
  stage_.Click(560.0, 560.0);
  stage_.Settle();
  EXPECT_GT(stage_.State().document.shown->frame_index, 10);
  EXPECT_LT(stage_.State().document.shown->frame_index, 70);
}

TEST_F(ViewerWindow, KeepsClickWithinOneFrame) {
  Open();
  using Kind = InputEvent::Kind;
  for (const InputEvent& event :
       {InputEvent{.kind = Kind::kMove, .x = 560.0, .y = 560.0}, InputEvent{.kind = Kind::kPress},
        InputEvent{.kind = Kind::kRelease}, InputEvent{.kind = Kind::kMove, .x = 10.0, .y = 300.0}}) {
    stage_.viewer->Handle(event);
  }
  EXPECT_FALSE(stage_.viewer->Idle()) << "another frame is needed";
  stage_.Settle();
  EXPECT_LT(stage_.State().document.shown->frame_index, 70);
}

TEST_F(ViewerWindow, OpensResultFromFolderBrowser) {
  stage_.viewer->State().window.show_open = true;  // with nothing open: the working folder
  stage_.Frames(2);
  stage_.Key(key::kEscape);
  EXPECT_FALSE(stage_.State().window.show_open);
  Open();
  WriteGrowingMap(folder_.Path() / "other");
  stage_.Handle({.kind = InputEvent::Kind::kKeyDown, .code = key::kLeftControl});
  stage_.Key('O');
  stage_.Handle({.kind = InputEvent::Kind::kKeyUp, .code = key::kLeftControl});
  stage_.Frames(3);
  ASSERT_TRUE(stage_.State().window.show_open);
  const auto click = [&](int row) {  // 0: the folder above
    for (const ImGuiWindow* window : ImGui::GetCurrentContext()->Windows) {
      if (std::string_view(window->Name).find("/entries_") != std::string_view::npos) {
        stage_.Click(window->Pos.x + 40.0, window->Pos.y + window->WindowPadding.y +
                                               (row + 0.5) * ImGui::GetTextLineHeightWithSpacing());
      }
    }
    stage_.Settle();
  };
  click(2);  // after the result that is open
  EXPECT_TRUE(stage_.State().window.show_open);
  click(1);
  EXPECT_FALSE(stage_.State().window.show_open);
  EXPECT_EQ(stage_.State().document.file, folder_.Path() / "other" / "desk" / "map.sqmap");
}

TEST_F(ViewerWindow, DrawsAgainAfterBeingMinimised) {
  Open();
  const cv::Mat before = stage_.Picture();
  stage_.Handle({.kind = InputEvent::Kind::kResize, .x = 0.0, .y = 0.0});
  stage_.Frames(5);
  stage_.Handle({.kind = InputEvent::Kind::kResize, .x = 960.0, .y = 600.0});
  stage_.Settle();
  EXPECT_LT(PictureDifference(stage_.Picture(), before), 1e-6);
}

TEST_F(ViewerWindow, ShowsErrorAndContinues) {
  stage_.viewer->Open(folder_.Path() / "nothing.sqmap");
  stage_.Frames(5);
  stage_.Settle();
  ASSERT_FALSE(stage_.State().messages.notices.empty());
  EXPECT_TRUE(stage_.State().messages.notices.front().error);
  EXPECT_THAT(stage_.State().messages.notices.front().text, HasSubstr("nothing.sqmap"));
  Open();
}

TEST_F(ViewerWindow, KeepsErrorsUntilTheyAreClosed) {
  for (int i = 0; i < 2; ++i) {
    stage_.viewer->Open(folder_.Path() / "nothing.sqmap");
    stage_.Settle();
  }
  const std::vector<Notice>& notices = stage_.State().messages.notices;
  stage_.viewer->Frame(60.0);  // seconds
  ASSERT_EQ(notices.size(), 1U) << "the same error twice";
  EXPECT_FALSE(stage_.viewer->Busy()) << "an error alone must not keep the window drawing";
  stage_.Key(key::kEscape);
  EXPECT_TRUE(notices.empty());
}

TEST_F(ViewerWindow, OpensDroppedFolder) {
  WriteGrowingMap(folder_.Path());
  stage_.Handle({.kind = InputEvent::Kind::kDrop, .text = (folder_.Path() / "desk").string()});
  stage_.Settle();
  ASSERT_NE(stage_.State().document.Map(), nullptr);
  EXPECT_EQ(stage_.State().document.Map()->objects.size(), 3U);
}

TEST_F(ViewerWindow, WritesScreenshotOfSceneInAnySize) {
  Open();
  const std::filesystem::path file = folder_.Path() / "shot.png";
  const cv::Size size = stage_.State().view.size;
  WriteScreenshot(stage_.State(), size, false, file);
  const cv::Mat shot = cv::imread(file.string());
  const cv::Mat scene = stage_.Picture()(cv::Rect(cv::Point(0, 25), size));
  EXPECT_LT(PictureDifference(shot, scene), 0.02);
  stage_.Key('C');
  stage_.Settle();
  ASSERT_TRUE(stage_.State().view.camera.pinhole.has_value());
  WriteScreenshot(stage_.State(), size, false, file);
  EXPECT_LT(PictureDifference(cv::imread(file.string()), stage_.Picture()(cv::Rect(cv::Point(0, 25), size))),
            0.02)
      << "through the camera";
  WriteScreenshot(stage_.State(), {1600, 900}, true, file);
  const cv::Mat large = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(large.size(), cv::Size(1600, 900));
  EXPECT_EQ(large.channels(), 4);
}

}  // namespace
}  // namespace sqslam::viewer
