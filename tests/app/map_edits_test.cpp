#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "slam/io/result_files.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"
#include "tests/app/run_program.h"
#include "tests/render/hand_made_map.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::RunProgram;
using testing::Slurp;

// The hand-made desk: the book deleted, the cup renamed, the ball hidden.
class MapEditsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    RecordingWriter writer(folder_.Path() / "map.sqmap", {});
    MapSnapshot map = HandMadeMap();
    for (int i = 0; i < 3; ++i) {
      map.frame_index = 10 * i;
      map.timestamp = i;
      writer.Add(map);
    }
    writer.Close();
    edits_.Delete(0);
    edits_.Rename(1, "Ada's mug");
    edits_.Hide(2);
    WriteObjectEdits(folder_.Path() / "map.sqmap.edits.json", edits_);
  }

  std::string Map() const { return folder_.Path().string(); }
  std::string File(const std::string& name) const { return (folder_.Path() / name).string(); }
  cv::Mat Picture(const std::string& more) const {
    const std::string file = File("picture.png");
    const auto run = RunProgram("render " + Map() + " --resolution 320,240 --output " + file + " " + more);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return cv::imread(file);
  }

  TemporaryFolder folder_;
  ObjectEdits edits_;
};

TEST_F(MapEditsTest, DrawsEditedMap) {
  const cv::Mat plain = Picture("");
  const cv::Mat edited = Picture("--edits auto");
  EXPECT_GT(cv::norm(plain, edited, cv::NORM_L1) / static_cast<double>(plain.total()), 5.0);
  EXPECT_EQ(cv::norm(edited, Picture("--edits " + File("map.sqmap.edits.json")), cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(plain, Picture(""), cv::NORM_INF), 0.0)
      << "edits beside a map change nothing by themselves";
}

TEST_F(MapEditsTest, AppliesEditsToWholeVideo) {
  const std::string plain = File("plain-{frame}.png");
  const std::string edited = File("edited-{frame}.png");
  const std::string common = "render " + Map() + " --growth --fps 1 --quiet --resolution 320,240 --output ";
  ASSERT_EQ(RunProgram(common + "'" + plain + "'").exit_code, 0);
  ASSERT_EQ(RunProgram(common + "'" + edited + "' --edits auto").exit_code, 0);
  const cv::Mat a = cv::imread(File("plain-0.png"));
  const cv::Mat b = cv::imread(File("edited-0.png"));
  ASSERT_FALSE(a.empty() || b.empty());
  EXPECT_GT(cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total()), 2.0) << "already the first frame";
}

TEST_F(MapEditsTest, ExportsHiddenButNotDeletedObjects) {
  const std::string file = File("objects.json");
  ASSERT_EQ(RunProgram("export " + Map() + " --edits auto --output " + file).exit_code, 0);
  const std::vector<SnapshotObject> objects = ReadObjects(file);
  ASSERT_EQ(objects.size(), 2u);
  EXPECT_EQ(objects[0].name, "Ada's mug");
  EXPECT_EQ(objects[0].label, "cup");
  EXPECT_EQ(objects[1].label, "sports_ball");
  EXPECT_THAT(Slurp(file), Not(HasSubstr("book")));
}

TEST_F(MapEditsTest, MentionsEditsAndAppliesThemOnRequest) {
  const auto plain = RunProgram("info " + Map());
  EXPECT_THAT(plain.out, HasSubstr("map.sqmap.edits.json, not applied (--edits auto)"));
  EXPECT_THAT(plain.out, HasSubstr("book"));
  const auto edited = RunProgram("info " + Map() + " --edits auto");
  EXPECT_THAT(edited.out, Not(HasSubstr("book")));
  EXPECT_THAT(edited.out, HasSubstr("Ada's mug"));
  EXPECT_THAT(edited.out, HasSubstr("deleted    0\n"));
  EXPECT_THAT(edited.out, HasSubstr("hidden     2\n"));
}

TEST_F(MapEditsTest, NamesBrokenAndMissingFiles) {
  folder_.Write("broken.json", R"({"format": "sqslam-edits", "version": 1, "objects": [{"id": "x"}]})");
  const auto broken = RunProgram("export " + Map() + " --output x.json --edits " + File("broken.json"));
  EXPECT_EQ(broken.exit_code, 3);
  EXPECT_THAT(broken.err, HasSubstr("broken.json: objects[0].id"));
  std::filesystem::remove(folder_.Path() / "map.sqmap.edits.json");
  const auto missing = RunProgram("render " + Map() + " --output x.png --edits auto");
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("--edits auto: "));
}

TEST_F(MapEditsTest, WarnsOfEditsOfAnotherMap) {
  edits_.Hide(42);
  WriteObjectEdits(folder_.Path() / "other.json", edits_);
  const auto run = RunProgram("info " + Map() + " --edits " + File("other.json"));
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("the map has no object 42"));
}

}  // namespace
}  // namespace sqslam
