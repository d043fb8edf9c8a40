#include "app/viewer/model/edited_document.h"

#include <gtest/gtest.h>

#include "slam/util/error.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::viewer {
namespace {

TEST(EditHistory, NamesStepsOfUndoAndRedo) {
  EditHistory<int> history(1);
  EXPECT_FALSE(history.CanUndo());
  history.Push(2, "two");
  history.Push(3, "three");
  EXPECT_EQ(history.UndoName(), "three");
  history.Undo();
  EXPECT_EQ(history.Current(), 2);
  EXPECT_EQ(history.RedoName(), "three");
  EXPECT_EQ(history.UndoName(), "two");
  history.Undo();
  history.Undo();  // there is nothing before
  EXPECT_EQ(history.Current(), 1);
  history.Redo();
  EXPECT_EQ(history.Current(), 2);
  history.Push(5, "five");
  EXPECT_FALSE(history.CanRedo()) << "a new step takes the place of what was undone";
  EXPECT_EQ(history.Current(), 5);
}

TEST(EditHistory, IgnoresEqualStates) {
  EditHistory<int> history(1);
  history.Push(1, "nothing");
  EXPECT_FALSE(history.CanUndo());
}

TEST(EditHistory, MergesStepsOfOneDrag) {
  EditHistory<int> history(0);
  history.Push(1, "move", "drag");
  history.Push(2, "move", "drag");
  history.Push(3, "move", "drag");
  history.Undo();
  EXPECT_EQ(history.Current(), 0);
  history.Redo();
  history.Push(4, "move", "drag");
  history.Undo();
  EXPECT_EQ(history.Current(), 3) << "after a redo a new drag begins";
  history.Seal();
  history.Push(7, "move", "drag");
  history.Seal();
  history.Push(8, "move", "drag");
  history.Undo();
  EXPECT_EQ(history.Current(), 7) << "the button was released between the two";
}

TEST(EditHistory, DropsOldestSteps) {
  EditHistory<int> history(0);
  const int most = static_cast<int>(EditHistory<int>::kMaxSteps);
  for (int i = 1; i <= most + 10; ++i) {
    history.Push(i, "step");
  }
  int undone = 0;
  for (; history.CanUndo(); history.Undo()) {
    ++undone;
  }
  EXPECT_EQ(undone, most - 1);
  EXPECT_EQ(history.Current(), 11);
}

class EditedDocumentTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path recording_ = folder_.Path() / "map.sqmap";
};

TEST_F(EditedDocumentTest, SharesHistoryAndTracksUnsavedChanges) {
  EditedDocument document;
  document.OpenRecording(recording_);
  EXPECT_FALSE(document.Modified());
  document.Do("Delete 3", [](EditedState& state) { state.edits.Delete(3); });
  document.Do("Add cup", [](EditedState& state) {
    state.annotation.Add({0, "cup", "", UprightSolid(SolidKind::kCylinder, {0, 0, 0}, 0, {1, 1, 1}), ""});
  });
  EXPECT_TRUE(document.EditsModified());
  EXPECT_TRUE(document.AnnotationModified());
  document.Undo();
  EXPECT_FALSE(document.AnnotationModified());
  EXPECT_EQ(document.History().UndoName(), "Delete 3");
  document.SaveEdits();
  EXPECT_FALSE(document.Modified());
  document.Undo();
  EXPECT_TRUE(document.EditsModified()) << "what is on the disk is one step ahead";
  document.Redo();
  EXPECT_FALSE(document.EditsModified());
}

TEST_F(EditedDocumentTest, RemovesEditsFileWithLastEdit) {
  EditedDocument document;
  document.OpenRecording(recording_);
  document.Do("Hide", [](EditedState& state) { state.edits.Hide(2); });
  document.SaveEdits();
  EXPECT_TRUE(std::filesystem::exists(folder_.Path() / "map.sqmap.edits.json"));
  EditedDocument again;
  again.OpenRecording(recording_);
  EXPECT_TRUE(again.Current().edits.Of(2).hidden);
  EXPECT_FALSE(again.Modified());
  EXPECT_FALSE(again.History().CanUndo());
  again.Do("Show", [](EditedState& state) { state.edits.Hide(2, false); });
  again.SaveEdits();
  EXPECT_FALSE(std::filesystem::exists(folder_.Path() / "map.sqmap.edits.json"));
}

TEST_F(EditedDocumentTest, KeepsBrokenEditsAsBackup) {
  const auto file = folder_.Write("map.sqmap.edits.json", "{half");
  const std::filesystem::path kept = file.string() + ".bak";
  EditedDocument document;
  EXPECT_THROW(document.OpenRecording(recording_), InputError);
  std::filesystem::create_directory(kept);
  EXPECT_THROW(document.SaveEdits(), InputError);
  EXPECT_THROW(document.SaveEdits(), InputError) << "it is as unread as before";
  EXPECT_TRUE(std::filesystem::exists(file));
  std::filesystem::remove(kept);
  document.SaveEdits();
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_TRUE(std::filesystem::is_regular_file(kept));
}

TEST_F(EditedDocumentTest, ChangesNothingWhenStepFails) {
  EditedDocument document;
  const auto merge_with_itself = [](EditedState& state) {
    state.edits.Rename(1, "x");
    state.edits.Merge(4, 4);
  };
  EXPECT_THROW(document.Do("Merge", merge_with_itself), UsageError);
  EXPECT_TRUE(document.Current().edits.Empty());
  EXPECT_FALSE(document.History().CanUndo());
}

TEST_F(EditedDocumentTest, SavesAnnotationWhereItWasOpened) {
  const auto file = folder_.Path() / "objects_gt.json";
  EditedDocument document;
  document.Do("Add", [](EditedState& state) {
    state.annotation.Add({0, "cup", "", UprightSolid(SolidKind::kCuboid, {1, 2, 3}, 0.5, {1, 1, 1}), ""});
  });
  document.SaveAnnotation(file);
  EXPECT_FALSE(document.AnnotationModified());
  EditedDocument again;
  again.OpenAnnotation(file);
  EXPECT_FALSE(again.AnnotationModified());
  again.SaveAnnotation(file);
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".bak")) << "it was read";
  again.Undo();
  EXPECT_TRUE(again.Current().annotation.solids.empty());
}

}  // namespace
}  // namespace sqslam::viewer
