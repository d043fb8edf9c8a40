#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "app/viewer/state/annotation_tool.h"
#include "app/viewer/state/camera_control.h"
#include "app/viewer/state/edit_actions.h"
#include "app/viewer/state/editing_session.h"
#include "slam/evaluation/ground_truth.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

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
    state_.scene_size = {800, 600};
    state_.focus = FindFocus(map);
    state_.view.camera.position = {0.0, -2.5, 1.6};
    state_.view.camera.focal_point = {0.0, 0.0, 0.1};
  }

  void Open(const std::filesystem::path& file, const MapSnapshot& map) {
    state_.document.kind = Document::Kind::kRecording;
    state_.document.file = file;
    state_.document.last = std::make_shared<const MapSnapshot>(map);
    auto shown = std::make_shared<ShownFrame>();
    shown->map = state_.document.last;
    shown->detections = map.detections;
    state_.shown = shown;
    session_.Update(state_);
  }

  std::vector<int> Ids() const {
    std::vector<int> ids;
    for (const SnapshotObject& object : state_.Map()->objects) {
      ids.push_back(object.id);
    }
    return ids;
  }

  std::vector<std::string> Errors() const {
    std::vector<std::string> errors;
    for (const Notice& notice : state_.notices) {
      if (notice.error) {
        errors.push_back(notice.text);
      }
    }
    return errors;
  }

  Eigen::Vector2d PixelOf(const Eigen::Vector3d& p) const {
    return PinholeOf(state_.view.camera, state_.scene_size).Project(PoseOf(state_.view.camera).Inverse() * p);
  }

  TemporaryFolder folder_;
  ViewerState state_;
  EditingSession session_;
};

TEST_F(Editing, WhatIsShownIsEditedAndComesBack) {
  state_.selected = 1;
  DeleteSelected(state_);
  session_.Update(state_);
  EXPECT_THAT(Ids(), ElementsAre(0, 2));
  EXPECT_EQ(state_.shown->detections[0].object_id, -1);
  EXPECT_EQ(state_.document.last->objects.size(), 2u);
  EXPECT_FALSE(state_.selected.has_value());
  EXPECT_EQ(state_.editing.raw->map->objects.size(), 3u);
  Undo(state_);
  session_.Update(state_);
  EXPECT_THAT(Ids(), ElementsAre(0, 1, 2));
  EXPECT_EQ(state_.shown->detections[0].object_id, 1);
}

TEST_F(Editing, AFrameThatComesLaterIsEditedToo) {
  HideObject(state_, 0, true);
  MergeObjects(state_, 2, 1);
  session_.Update(state_);
  EXPECT_EQ(state_.selected, 2);
  auto next = std::make_shared<ShownFrame>();
  next->map = std::make_shared<const MapSnapshot>(HandMadeMap());
  next->frame_index = 71;
  next->detections = {{{"cup", 0.9, {}}, 1}, {{"book", 0.9, {}}, 0}};
  state_.shown = next;
  session_.Update(state_);
  EXPECT_THAT(Ids(), ElementsAre(2));
  EXPECT_EQ(state_.shown->frame_index, 71);
  EXPECT_EQ(state_.shown->detections[0].object_id, 2);
  EXPECT_EQ(state_.shown->detections[1].object_id, -1);
}

TEST_F(Editing, AnUneditedFrameIsNotCopied) {
  const ShownFramePtr before = state_.shown;
  session_.Update(state_);
  EXPECT_EQ(state_.shown, before);
  EXPECT_EQ(state_.editing.raw, before);
}

TEST_F(Editing, ObjectsCanBeShownAsOtherShapes) {
  state_.editing.representation = Representation::kCuboid;
  session_.Update(state_);
  EXPECT_EQ(state_.Map()->objects[2].superquadric.shape.e1, kMinShapeExponent);
  state_.editing.representation = Representation::kSuperquadric;
  session_.Update(state_);
  EXPECT_EQ(state_.Map()->objects[2].superquadric.shape.e1, 1.0);
}

TEST_F(Editing, TheOldLabelIsNoEdit) {
  RelabelObject(state_, 1, "mug");
  EXPECT_FALSE(state_.editing.document.Current().edits.Empty());
  RelabelObject(state_, 1, "cup");
  EXPECT_TRUE(state_.editing.document.Current().edits.Empty());
}

TEST_F(Editing, EditsAreSavedBesideTheMapAndThereWhenItIsOpenedAgain) {
  RenameObject(state_, 1, "Ada's mug");
  SaveAll(state_);
  EXPECT_TRUE(std::filesystem::exists(folder_.Path() / "map.sqmap.edits.json"));
  state_ = {};
  session_ = {};
  Open(folder_.Path() / "map.sqmap", HandMadeMap());
  EXPECT_EQ(ObjectName(state_.Map()->objects[1]), "Ada's mug");
  EXPECT_FALSE(state_.editing.document.Modified());
  folder_.Write("map.sqmap.edits.json", "{");
  state_ = {};
  session_ = {};
  Open(folder_.Path() / "map.sqmap", HandMadeMap());
  EXPECT_THAT(Errors(), ElementsAre(HasSubstr("map.sqmap.edits.json:1: no valid JSON")));
}

TEST_F(Editing, UnsavedChangesPostponeWhatWouldLoseThem) {
  EXPECT_FALSE(Postpone(state_, {.quit = true, .open = {}}));
  DeleteObject(state_, 1);
  EXPECT_TRUE(Postpone(state_, {.quit = true, .open = {}}));
  EXPECT_TRUE(state_.editing.postponed->quit);
  state_.editing.discard = true;
  EXPECT_FALSE(Postpone(state_, {.quit = true, .open = {}}));
  EXPECT_TRUE(Postpone(state_, {.quit = false, .open = "other"})) << "given up once, not for ever";
}

TEST_F(Editing, TheHistoryIsReadInTheBackground) {
  for (int i = 0; i < 500 && !state_.editing.history; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    session_.Update(state_);
  }
  ASSERT_NE(state_.editing.history, nullptr);
  EXPECT_EQ(state_.editing.history->objects.All().size(), 3u);
  EXPECT_FALSE(session_.Busy());
}

TEST_F(Editing, ANewSolidStandsOnTheGroundInView) {
  PrepareAnnotation(state_);
  EXPECT_EQ(state_.editing.annotation.ground, 0.0);
  AddSolid(state_, SolidKind::kCylinder);
  const AnnotatedSolid* solid = SelectedSolid(state_);
  ASSERT_NE(solid, nullptr);
  EXPECT_NEAR(BottomOf(solid->solid), 0.0, 1e-9);
  EXPECT_EQ(SolidAt(state_, PixelOf(solid->solid.T_map_object.translation)), solid->id);
  state_.editing.annotation.active = true;
  DeleteSelected(state_);
  EXPECT_TRUE(state_.editing.document.Current().annotation.solids.empty());
  EXPECT_THAT(Ids(), ElementsAre(0, 1, 2)) << "the Delete key is the annotation's";
  Undo(state_);
  EXPECT_EQ(state_.editing.document.Current().annotation.solids.size(), 1u);
}

TEST_F(Editing, ADragOfAHandleIsOneStep) {
  PrepareAnnotation(state_);
  AddSolid(state_, SolidKind::kCuboid);
  const Solid start = SelectedSolid(state_)->solid;
  const SolidHandle side{SolidHandle::Kind::kSide, 0, 1};
  const Eigen::Vector3d at = HandlePosition(start, side);
  const Eigen::Vector2d pixel = PixelOf(at);
  ASSERT_EQ(HandleAt(state_, pixel + Eigen::Vector2d(2.0, 1.0)), side);
  EXPECT_FALSE(HandleAt(state_, pixel + Eigen::Vector2d(60.0, 60.0)).has_value());
  BeginDrag(state_, side, pixel);
  for (int i = 1; i <= 5; ++i) {
    DragTo(state_, PixelOf(at + Eigen::Vector3d(0.02 * i, 0.0, 0.0)));
  }
  EndDrag(state_);
  EXPECT_NEAR(SelectedSolid(state_)->solid.half_size.x(), start.half_size.x() + 0.05, 1e-6);
  Undo(state_);
  EXPECT_EQ(SelectedSolid(state_)->solid.half_size, start.half_size);
}

TEST_F(Editing, ALassoChoosesPointsThatASolidIsFittedTo) {
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
  PrepareAnnotation(state_);
  AnnotationTool& tool = state_.editing.annotation;
  for (const auto& [x, y] : {std::pair(-0.8, -0.4), {0.05, -0.4}, {0.05, 0.7}, {-0.8, 0.7}}) {
    tool.outline.push_back(PixelOf({x, y, 0.1}));
  }
  FinishLasso(state_, SelectMode::kReplace);
  EXPECT_EQ(tool.chosen.size(), 400u);
  EXPECT_TRUE(tool.outline.empty());
  AddSolid(state_, SolidKind::kCuboid);
  ASSERT_NE(SelectedSolid(state_), nullptr);
  Solid truth = UprightSolid(SolidKind::kCuboid, {-0.4, 0.1, 0.1}, 0.0, {0.3, 0.2, 0.1});
  EXPECT_GT(IoU(SelectedSolid(state_)->solid, truth), 0.85);
  // Pushed aside and smaller, the points around it bring it back.
  AnnotatedSolid pushed = *SelectedSolid(state_);
  pushed.solid.T_map_object.translation.x() += 0.03;
  SetYaw(pushed.solid, 0.2);
  ChangeSolid(state_, pushed);
  FitSolid(state_);
  EXPECT_GT(IoU(SelectedSolid(state_)->solid, truth), 0.8);
  EXPECT_THAT(Errors(), IsEmpty());
}

TEST_F(Editing, FitsWithoutPointsSayWhatIsMissing) {
  PrepareAnnotation(state_);
  AddSolid(state_, SolidKind::kCuboid);
  AnnotatedSolid aloft = *SelectedSolid(state_);
  aloft.solid.T_map_object.translation.z() = 40.0;
  ChangeSolid(state_, aloft);
  FitSolid(state_);
  EXPECT_THAT(Errors(), ElementsAre("0 points, expected 6 or more for a cuboid"));
}

TEST_F(Editing, TheAnnotationIsWrittenForEvaluation) {
  PrepareAnnotation(state_);
  AnnotationTool& tool = state_.editing.annotation;
  EXPECT_EQ(tool.file, (folder_.Path() / "objects_gt.json").string());
  tool.label = "can";
  AddSolid(state_, SolidKind::kCylinder);
  AddSolidOf(state_, state_.Map()->objects[0]);
  SaveAll(state_);
  EXPECT_FALSE(state_.editing.document.Modified());
  const auto truth = ReadGroundTruthObjects(tool.file);
  ASSERT_EQ(truth.size(), 2u);
  EXPECT_EQ(truth[0].label, "can");
  EXPECT_EQ(truth[1].label, "book");
  EXPECT_NEAR(truth[1].solid.half_size.x(), 0.3, 1e-9);
  EXPECT_FALSE(AlignWithWorld(state_)) << "there is no sequence with true poses";
  EXPECT_EQ(Errors().size(), 1u);
}

}  // namespace
}  // namespace sqslam::viewer
