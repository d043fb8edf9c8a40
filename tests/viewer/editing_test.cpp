#include "app/viewer/state/editing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "app/viewer/frames/replay.h"
#include "app/viewer/state/scene_view.h"
#include "app/viewer/state/viewer_state.h"
#include "slam/evaluation/ground_truth.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// The viewer's state as it is after a recording of the hand-made desk was opened, without a window.
class Editing : public testing::Test {
 protected:
  void SetUp() override {
    MapSnapshot map = HandMadeMap();
    map.detections = {{{"cup", 0.9, {10.0, 20.0, 30.0, 40.0}}, 1}};
    RecordingWriter writer(folder_.Path() / "map.sqmap", {});
    writer.Add(map);
    writer.Close();
    Open(folder_.Path() / "map.sqmap", map);
    state_.view.size = {800, 600};
    state_.view.focus = FindFocus(map);
    state_.view.camera.position = {0.0, -2.5, 1.6};
    state_.view.camera.focal_point = {0.0, 0.0, 0.1};
  }

  void Open(const std::filesystem::path& file, const MapSnapshot& map) {
    state_.document.file = file;
    state_.document.recorded_last = std::make_shared<const MapSnapshot>(map);
    auto shown = std::make_shared<ShownFrame>();
    shown->map = state_.document.recorded_last;
    shown->detections = map.detections;
    state_.document.recorded = shown;
    Update();
  }

  void Update() { session_.Update(state_.document, state_.editing, state_.messages); }

  std::vector<int> Ids() const {
    std::vector<int> ids;
    for (const SnapshotObject& object : state_.document.Map()->objects) {
      ids.push_back(object.id);
    }
    return ids;
  }

  std::vector<std::string> Errors() const {
    std::vector<std::string> errors;
    for (const Notice& notice : state_.messages.notices) {
      if (notice.error) {
        errors.push_back(notice.text);
      }
    }
    return errors;
  }

  Eigen::Vector2d PixelOf(const Eigen::Vector3d& p) const {
    return PinholeOf(state_.view.camera, state_.view.size).Project(PoseOf(state_.view.camera).Inverse() * p);
  }

  TemporaryFolder folder_;
  ViewerState state_;
  EditingSession session_;
};

TEST_F(Editing, AppliesAndUndoesEditsOnScreen) {
  state_.selection.selected = 1;
  state_.Editor().DeleteSelected();
  Update();
  EXPECT_THAT(Ids(), ElementsAre(0, 2));
  EXPECT_EQ(state_.document.shown->detections[0].object_id, -1);
  EXPECT_EQ(state_.document.last->objects.size(), 2u);
  EXPECT_FALSE(state_.selection.selected.has_value());
  EXPECT_EQ(state_.document.recorded->map->objects.size(), 3u);
  state_.editing.document.Undo();
  Update();
  EXPECT_THAT(Ids(), ElementsAre(0, 1, 2));
  EXPECT_EQ(state_.document.shown->detections[0].object_id, 1);
}

TEST_F(Editing, EditsLaterFrames) {
  state_.Editor().HideObject(0, true);
  state_.Editor().MergeObjects(2, 1);
  Update();
  EXPECT_EQ(state_.selection.selected, 2);
  auto next = std::make_shared<ShownFrame>();
  next->map = std::make_shared<const MapSnapshot>(HandMadeMap());
  next->frame_index = 71;
  next->detections = {{{"cup", 0.9, {}}, 1}, {{"book", 0.9, {}}, 0}};
  state_.document.recorded = next;
  Update();
  EXPECT_THAT(Ids(), ElementsAre(2));
  EXPECT_EQ(state_.document.shown->frame_index, 71);
  EXPECT_EQ(state_.document.shown->detections[0].object_id, 2);
  EXPECT_EQ(state_.document.shown->detections[1].object_id, -1);
}

TEST_F(Editing, DoesNotCopyUneditedFrames) {
  const ShownFramePtr before = state_.document.shown;
  Update();
  EXPECT_EQ(state_.document.shown, before);
  EXPECT_EQ(state_.document.recorded, before);
}

TEST_F(Editing, ShowsObjectsAsOtherShapes) {
  state_.editing.representation = SolidKind::kCuboid;
  Update();
  EXPECT_EQ(state_.document.Map()->objects[2].superquadric.shape.e1, kMinShapeExponent);
  state_.editing.representation = SolidKind::kSuperquadric;
  Update();
  EXPECT_EQ(state_.document.Map()->objects[2].superquadric.shape.e1, 1.0);
}

TEST_F(Editing, RemovesEditWhenOldLabelReturns) {
  state_.Editor().RelabelObject(1, "mug");
  EXPECT_FALSE(state_.editing.Edits().Empty());
  state_.Editor().RelabelObject(1, "cup");
  EXPECT_TRUE(state_.editing.Edits().Empty());
}

TEST_F(Editing, SavesAndReopensEditsBesideMap) {
  state_.Editor().RenameObject(1, "Ada's mug");
  state_.Editor().SaveAll();
  EXPECT_TRUE(std::filesystem::exists(folder_.Path() / "map.sqmap.edits.json"));
  state_ = {};
  session_ = {};
  Open(folder_.Path() / "map.sqmap", HandMadeMap());
  EXPECT_EQ(ObjectName(state_.document.Map()->objects[1]), "Ada's mug");
  EXPECT_FALSE(state_.editing.document.Modified());
  folder_.Write("map.sqmap.edits.json", "{");
  state_ = {};
  session_ = {};
  Open(folder_.Path() / "map.sqmap", HandMadeMap());
  EXPECT_THAT(Errors(), ElementsAre(HasSubstr("map.sqmap.edits.json:1: invalid JSON")));
}

TEST_F(Editing, PostponesQuitWithUnsavedChanges) {
  EXPECT_FALSE(state_.editing.Postpone(QuitRequest{}));
  state_.Editor().DeleteObject(1);
  EXPECT_TRUE(state_.editing.Postpone(QuitRequest{}));
  EXPECT_TRUE(std::holds_alternative<QuitRequest>(*state_.editing.postponed));
  state_.editing.discard = true;
  EXPECT_FALSE(state_.editing.Postpone(QuitRequest{}));
  EXPECT_TRUE(state_.editing.Postpone(OpenRequest{"other"})) << "given up once, not for ever";
}

TEST_F(Editing, ReadsHistoryInBackground) {
  Replay replay(folder_.Path() / "map.sqmap");
  std::shared_ptr<const ObjectHistories> histories;
  for (int i = 0; i < 500 && !histories; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    histories = replay.Poll().histories;
  }
  ASSERT_NE(histories, nullptr);
  EXPECT_EQ(histories->size(), 3u);
}

TEST_F(Editing, PutsNewSolidOnGroundInView) {
  state_.Editor().PrepareAnnotation();
  EXPECT_EQ(state_.editing.annotation.ground, 0.0);
  state_.Editor().AddSolid(SolidKind::kCylinder);
  const AnnotatedSolid* solid = state_.Editor().SelectedSolid();
  ASSERT_NE(solid, nullptr);
  EXPECT_NEAR(BottomOf(solid->solid), 0.0, 1e-9);
  EXPECT_EQ(state_.Editor().SolidAt(PixelOf(solid->solid.T_map_object.translation)), solid->id);
  state_.editing.annotation.active = true;
  state_.Editor().DeleteSelected();
  EXPECT_TRUE(state_.editing.Solids().solids.empty());
  EXPECT_THAT(Ids(), ElementsAre(0, 1, 2)) << "the Delete key is the annotation's";
  state_.editing.document.Undo();
  EXPECT_EQ(state_.editing.Solids().solids.size(), 1u);
}

TEST_F(Editing, MakesOneStepOfHandleDrag) {
  state_.Editor().PrepareAnnotation();
  state_.Editor().AddSolid(SolidKind::kCuboid);
  const Solid start = state_.Editor().SelectedSolid()->solid;
  const SolidHandle side{SolidHandle::Kind::kSide, 0, 1};
  const Eigen::Vector3d at = HandlePosition(start, side);
  const Eigen::Vector2d pixel = PixelOf(at);
  ASSERT_EQ(state_.Editor().HandleAt(pixel + Eigen::Vector2d(2.0, 1.0), 9.0), side);
  EXPECT_FALSE(state_.Editor().HandleAt(pixel + Eigen::Vector2d(60.0, 60.0), 9.0).has_value());
  state_.Editor().BeginDrag(side, pixel);
  for (int i = 1; i <= 5; ++i) {
    state_.Editor().DragTo(PixelOf(at + Eigen::Vector3d(0.02 * i, 0.0, 0.0)));
  }
  state_.Editor().EndDrag();
  EXPECT_NEAR(state_.Editor().SelectedSolid()->solid.half_size.x(), start.half_size.x() + 0.05, 1e-6);
  state_.editing.document.Undo();
  EXPECT_EQ(state_.Editor().SelectedSolid()->solid.half_size, start.half_size);
}

TEST_F(Editing, FitsSolidToLassoedPoints) {
  MapSnapshot map = HandMadeMap();
  map.points.clear();
  const SnapshotObject& book = map.objects[0];
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d p =
        book.superquadric.T_map_object * book.superquadric.shape.PointAt(-0.4 + 0.0045 * i, -3.1 + 0.731 * i);
    map.points.push_back({p.cast<float>(), {}, 0});
  }
  map.points.push_back({{0.9F, 0.1F, 0.3F}, {}, -1});
  Open(folder_.Path() / "other.sqmap", map);
  state_.Editor().PrepareAnnotation();
  AnnotationTool& tool = state_.editing.annotation;
  for (const auto& [x, y] : {std::pair(-0.8, -0.4), {0.05, -0.4}, {0.05, 0.7}, {-0.8, 0.7}}) {
    tool.outline.push_back(PixelOf({x, y, 0.1}));
  }
  state_.Editor().FinishLasso(SelectMode::kReplace);
  EXPECT_EQ(tool.chosen.size(), 400u);
  EXPECT_TRUE(tool.outline.empty());
  state_.Editor().AddSolid(SolidKind::kCuboid);
  ASSERT_NE(state_.Editor().SelectedSolid(), nullptr);
  Solid truth = UprightSolid(SolidKind::kCuboid, {-0.4, 0.1, 0.1}, 0.0, {0.3, 0.2, 0.1});
  EXPECT_GT(IoU(state_.Editor().SelectedSolid()->solid, truth), 0.85);
  // Pushed aside and smaller, the points around it bring it back.
  AnnotatedSolid pushed = *state_.Editor().SelectedSolid();
  pushed.solid.T_map_object.translation.x() += 0.03;
  SetYaw(pushed.solid, 0.2);
  state_.Editor().ChangeSolid(pushed);
  state_.Editor().FitSolid();
  EXPECT_GT(IoU(state_.Editor().SelectedSolid()->solid, truth), 0.8);
  EXPECT_THAT(Errors(), IsEmpty());
  EXPECT_THAT(state_.messages.notices.back().text, HasSubstr(" map units"));
  map.metric = true;
  state_.document.last = std::make_shared<const MapSnapshot>(map);
  state_.Editor().FitSolid();
  EXPECT_THAT(state_.messages.notices.back().text, Not(HasSubstr("map units")));
}

TEST_F(Editing, ReportsFitsWithoutPoints) {
  state_.Editor().PrepareAnnotation();
  state_.Editor().AddSolid(SolidKind::kCuboid);
  AnnotatedSolid aloft = *state_.Editor().SelectedSolid();
  aloft.solid.T_map_object.translation.z() = 40.0;
  state_.Editor().ChangeSolid(aloft);
  state_.Editor().FitSolid();
  EXPECT_THAT(Errors(), ElementsAre("0 points, expected 6 or more for a cuboid"));
}

TEST_F(Editing, WritesAnnotationForEvaluation) {
  state_.Editor().PrepareAnnotation();
  AnnotationTool& tool = state_.editing.annotation;
  EXPECT_EQ(tool.file, (folder_.Path() / "objects_gt.json").string());
  tool.label = "can";
  state_.Editor().AddSolid(SolidKind::kCylinder);
  state_.Editor().AddSolidOf(state_.document.Map()->objects[0]);
  state_.Editor().SaveAll();
  EXPECT_FALSE(state_.editing.document.Modified());
  const auto truth = ReadGroundTruthObjects(tool.file);
  ASSERT_EQ(truth.size(), 2u);
  EXPECT_EQ(truth[0].label, "can");
  EXPECT_EQ(truth[1].label, "book");
  EXPECT_NEAR(truth[1].solid.half_size.x(), 0.3, 1e-9);
  EXPECT_FALSE(state_.Editor().AlignWithWorld()) << "there is no sequence with true poses";
  EXPECT_EQ(Errors().size(), 1u);
}

}  // namespace
}  // namespace sqslam::viewer
