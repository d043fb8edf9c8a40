#include <gtest/gtest.h>

#include "slam/io/sequence.h"
#include "slam/run/map_to_extend.h"
#include "slam/util/text_lines.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;

const Camera kJoinedCamera{640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0};

// Images NAME0.jpg, NAME1.jpg, ... a tenth of a second apart.
fs::path WriteList(const TemporaryFolder& folder, const std::string& name, int frames) {
  std::string list;
  for (int i = 0; i < frames; ++i) {
    list += std::to_string(0.1 * i) + " " + name + std::to_string(i) + ".jpg\n";
  }
  folder.Write(name + "/rgb.txt", list);
  return folder.Path() / name;
}

TEST(JoinedSequence, NumbersAndTimesFramesLikeTheMap) {
  const TemporaryFolder folder;
  const fs::path a = WriteList(folder, "a", 10);
  const fs::path b = WriteList(folder, "b", 8);
  // Frames 0 to 5 of a were mapped, then b from its frame 2 on, as frame 6.
  const fs::path joined = WriteJoinedSequence(
      folder.Path() / "result", a, b, {.first = 6, .index_shift = 4, .time_shift = 7.0}, kJoinedCamera);
  ASSERT_EQ(joined, fs::absolute(folder.Path() / "result" / "sequence"));
  const Sequence sequence = OpenSequence({.path = joined});
  ASSERT_EQ(sequence.frames.size(), 12U);
  EXPECT_EQ(sequence.frames[5].image_path, fs::absolute(a / "a5.jpg"));
  EXPECT_EQ(sequence.frames[6].image_path, fs::absolute(b / "b2.jpg"));
  EXPECT_EQ(sequence.frames[11].image_path, fs::absolute(b / "b7.jpg"));
  EXPECT_NEAR(sequence.frames[5].timestamp, 0.5, 1e-9);
  EXPECT_NEAR(sequence.frames[6].timestamp, 7.2, 1e-9);
  EXPECT_EQ(sequence.camera.fx, kJoinedCamera.fx);
}

TEST(JoinedSequence, CountsFrameNumbersMissingInBoth) {
  const TemporaryFolder folder;
  const fs::path joined =
      WriteJoinedSequence(folder.Path() / "result", WriteList(folder, "a", 3), WriteList(folder, "b", 9),
                          {.first = 6, .index_shift = 0, .time_shift = 0.0}, kJoinedCamera);
  const Sequence sequence = OpenSequence({.path = joined});
  ASSERT_EQ(sequence.frames.size(), 9U);
  EXPECT_EQ(sequence.frames[2].image_path.filename(), "a2.jpg");
  EXPECT_EQ(sequence.frames[6].image_path.filename(), "b6.jpg");
}

TEST(JoinedSequence, KeepsSingleSequence) {
  const TemporaryFolder folder;
  const fs::path a = WriteList(folder, "a", 10);
  EXPECT_EQ(WriteJoinedSequence(folder.Path() / "result", a, a / "", {.first = 5}, kJoinedCamera), a);
  EXPECT_FALSE(fs::exists(folder.Path() / "result"));
}

TEST(JoinedSequence, OmitsImagesWhenFramesDisagree) {
  const TemporaryFolder folder;
  const fs::path a = WriteList(folder, "a", 10);
  EXPECT_TRUE(
      WriteJoinedSequence(folder.Path() / "result", a, folder.Path() / "gone", {.first = 10}, kJoinedCamera)
          .empty());
  EXPECT_FALSE(fs::exists(folder.Path() / "result"));
}

TEST(JoinedBoxes, HaveTimesOfTheMap) {
  const TemporaryFolder folder;
  folder.Write("a/boxes.txt", "# boxes\n0.5 cup 0.9 1 2 3 4\n");
  folder.Write("b/boxes.txt", "0.25 cup 0.9 5 6 7 8\n");
  WriteJoinedBoxes(folder.Path(), folder.Path() / "a", folder.Path() / "b", {.first = 10, .time_shift = 2.0});
  EXPECT_TRUE(ReadFile(folder.Path() / "boxes.txt", "boxes")
                  .ends_with("\n0.500000 cup 0.9 1 2 3 4\n2.250000 cup 0.9 5 6 7 8\n"));
  WriteJoinedBoxes(folder.Path() / "a", folder.Path() / "none", folder.Path() / "nothing", {});
  EXPECT_TRUE(ReadFile(folder.Path() / "a/boxes.txt", "boxes").starts_with("# boxes\n"));
}

}  // namespace
}  // namespace sqslam
