#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "slam/snapshot/recording.h"
#include "tests/app/run_program.h"
#include "tests/scene/made_room.h"

namespace sqslam::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The commands that ask for the scene of a map: query, diff and export of a simulation.
class SceneCommands : public ::testing::Test {
 protected:
  void Write(MapSnapshot map) {
    map.metric = false;  // a recording without scale
    RecordingWriter(folder_.Path() / "map.sqmap", {}).Add(map);
  }
  std::string Map() const { return folder_.Path().string(); }
  void ExpectRefused(const std::string& command, int exit_code, const std::string& message) const {
    const ProgramRun run = RunProgram(command);
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr(message)));
  }
  TemporaryFolder folder_;
};

TEST_F(SceneCommands, QueryPrintsTableAndJson) {
  Write(MadeRoom());
  const ProgramRun table = RunProgram("query " + Map() + " 'cups on the table'");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("reliability"));
  EXPECT_THAT(table.out, HasSubstr("   2 cup"));
  EXPECT_THAT(table.out, ::testing::Not(HasSubstr("bottle")));
  const ProgramRun run = RunProgram("query " + Map() + " 'chairs under the table' --json");
  const auto answers = nlohmann::json::parse(run.out).at("answers");
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].at("id"), 9);
  EXPECT_THAT(RunProgram("query " + Map() + " laptops").out, HasSubstr("no object of the map is an answer"));
}

TEST_F(SceneCommands, QueryRefusesUnknownWordsAndEmptyMaps) {
  Write(MadeRoom());
  ExpectRefused("query " + Map() + " 'bottels on the table'", 2,
                "'bottels' is not known; did you mean 'bottle'?");
  ExpectRefused("query " + Map() + " 'cups within 1 m of the bowl'", 2, "the map has no scale");
  std::filesystem::remove(folder_.Path() / "map.sqmap");
  MapSnapshot empty = MadeRoom();
  empty.objects.clear();
  Write(empty);
  ExpectRefused("query " + Map() + " cups", 3, "the map has no objects");
}

TEST_F(SceneCommands, ExportOfSimulationNeedsScale) {
  Write(MadeRoom());
  const std::string file = (folder_.Path() / "room.xml").string();
  ExpectRefused("export " + Map() + " -o " + file, 3, "the map has no scale");
  const ProgramRun run = RunProgram("export " + Map() + " -o " + file + " --scale 1");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("free and"));
  EXPECT_THAT(Slurp(file), HasSubstr("<body name=\"2 cup\""));
  ExpectRefused("export " + Map() + " -o " + file + ".obj --scale 1", 2,
                "--scale: applies to a .xml or .urdf only");
}

TEST_F(SceneCommands, DiffRefusesRecordingsWithoutLiveMap) {
  Write(MadeRoom());
  const ProgramRun run = RunProgram("diff " + Map() + " " + Map());
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_EQ(run.ErrorLines().size(), 1U);
}

}  // namespace
}  // namespace sqslam::testing
