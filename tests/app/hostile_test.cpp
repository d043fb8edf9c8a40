// Inputs that once made the program fail, kept in tests/hostile: each is refused with a line that names it,
// in little memory and time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <string>

#include "slam/evaluation/ground_truth.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const fs::path kHostile = fs::path(SQSLAM_SOURCE_DIR) / "tests/hostile";

// Little more addresses than the libraries map, and a minute, within which no runaway query ends.
ProgramRun RunTightly(const std::string& arguments) {
  return RunProgram(arguments, "ulimit -v 6000000; ulimit -t 60");
}

void ExpectRefused(const std::string& arguments, int exit_code, const std::string& message) {
  const ProgramRun run = RunTightly(arguments);
  EXPECT_EQ(run.exit_code, exit_code) << arguments << "\n" << run.err;
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr(message))) << arguments;
}

std::string File(const std::string& name) { return (kHostile / name).string(); }

// A map of a moment, to draw and to edit.
fs::path WriteMap(const fs::path& folder, const RecordingInfo& info = {"a sequence", "1.0", ""}) {
  RecordingWriter writer(folder / "map.sqmap", info);
  MapSnapshot map;
  map.camera = {64, 48, 50.0, 50.0, 32.0, 24.0};
  map.points.resize(10);
  writer.Add(map);
  writer.Close();
  return folder / "map.sqmap";
}

TEST(Hostile, RefusesRecordingsBeforeTheyTakeMemoryOrTime) {
  ExpectRefused("info " + File("bomb_objects_16M.sqmap"), 3, "bomb_objects_16M.sqmap: snapshot 0");
  ExpectRefused("info " + File("bomb_objects_200M.sqmap"), 3, "bomb_objects_200M.sqmap: snapshot 0");
  ExpectRefused("info " + File("recursive_view.sqmap"), 3, "recursive_view.sqmap: holds a view");
  for (const std::string name : {"hostile_1017.sqmap", "hostile_1050.sqmap"}) {
    ExpectRefused("render " + File(name) + " --output picture.png", 3,
                  "size, shape or position out of range");
  }
}

TEST(Hostile, NamesFilesWithNumbersOutOfRange) {
  for (const std::string name : {"objects_number_out_of_range.json", "eval_objects.json"}) {
    try {
      ReadObjects(kHostile / name);
      ADD_FAILURE() << name;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(name));
    }
  }
  EXPECT_THROW(ReadStats(kHostile / "stats_number_out_of_range.json"), InputError);
  const TemporaryFolder folder;
  ExpectRefused(
      "info " + WriteMap(folder.Path()).string() + " --edits " + File("edits_number_out_of_range.json"), 3,
      "edits_number_out_of_range.json: a number is out of range");
}

TEST(Hostile, NamesBrokenLinesOfGroundTruth) {
  const WrittenSequence sequence = TinySequence();
  sequence.Write("rgb.txt", ReadFile(kHostile / "gtseq_18_rgb.txt", ""));
  EXPECT_NE(RunTightly("run " + sequence.Path().string() + " --detector none --output " +
                       (sequence.Path() / "result").string())
                .exit_code,
            1);
  const WrittenSequence other = TinySequence();
  other.Write("groundtruth.txt", ReadFile(kHostile / "gtseq_6_groundtruth.txt", ""));
  try {
    ReadGroundTruth(other.Path());
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("groundtruth.txt:"));
  }
}

TEST(Hostile, RefusesBadPathsAndKeysInYaml) {
  const TemporaryFolder folder;
  const std::string map = WriteMap(folder.Path()).string();
  const std::string video = " --output " + (folder.Path() / "a.mp4").string();
  ExpectRefused("render " + map + video + " --camera-path " + File("camera_path_bad.yaml"), 2,
                "camera_path_bad.yaml:10: unknown option");
  ExpectRefused("render " + map + video + " --camera-path " + File("campath_key.yaml"), 2,
                "campath_key.yaml:2: unknown option");
  ExpectRefused("render " + map + video + " --camera-path still --camera-position 1e160,0,0", 2,
                "camera position: expected coordinates");
  const WrittenSequence sequence = TinySequence();
  ExpectRefused("detect " + sequence.Path().string() + " --detector " + File("detector_long_path.yaml") +
                    " --output boxes.txt",
                3, "File name too long");
}

TEST(Hostile, RefusesImpossibleImages) {
  const TemporaryFolder folder;
  const std::string options = " --detector none --output " + (folder.Path() / "result").string();
  ExpectRefused("run " + File("img_1x1") + options, 3, "0.png: 1x1 pixels, expected sides from 16");
  ExpectRefused("run " + File("img_pgm.pgm") + options, 3,
                "0.pgm: is too large, expected at most 16384 pixels a side");
  const WrittenSequence sequence = TinySequence();
  ExpectRefused("run " + sequence.Path().string() + options + " --resize 0.00001", 2, "--resize");
  ExpectRefused("run " + sequence.Path().string() + options + " --camera /dev/zero", 3,
                "/dev/zero: cannot be read");
  EXPECT_FALSE(fs::exists(folder.Path() / "result"));
}

TEST(Hostile, SkipsPipeInPlaceOfImage) {
  const WrittenSequence sequence = TinySequence();
  fs::remove(sequence.Image(0));
  ASSERT_EQ(mkfifo(sequence.Image(0).c_str(), 0600), 0);
  const ProgramRun run = RunProgram("run " + sequence.Path().string() + " --detector none --output " +
                                    (sequence.Path() / "result").string());
  EXPECT_THAT(run.err,
              HasSubstr("frame 0 skipped: " + sequence.Image(0).string() + " is not a regular file"));
}

TEST(Hostile, SanitizesLabelsThatAreNotText) {
  const TemporaryFolder folder;
  SnapshotObject object;
  object.label = "caf\xe9 \x1b[31m";
  object.superquadric.shape.half_size = {1.0, 1.0, 1.0};
  WriteObjects(folder.Path() / "objects.json", {object});
  EXPECT_EQ(ReadObjects(folder.Path() / "objects.json").at(0).label, "caf\xef\xbf\xbd ?[31m");
  const WrittenSequence sequence = TinySequence();
  sequence.Write("boxes.txt", ReadFile(kHostile / "boxes_latin1.txt", ""));
  ExpectRefused("run " + sequence.Path().string() + " --output " + (folder.Path() / "result").string(), 3,
                "a label of 5000 bytes, expected 1 to 200");
}

TEST(Hostile, FailsWhenOutputCannotBeWritten) {
  const ProgramRun run = RunProgram("run --dump-config >/dev/full");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("No space left")));
}

TEST(Hostile, OmitsControlCharactersInInfo) {
  const TemporaryFolder folder;
  const std::string map =
      WriteMap(folder.Path(), {"a\x1b[31m/b", "1.0\x1b[2J", "seed: 1\n# \x1b]0;title\x07\n"}).string();
  EXPECT_EQ(RunProgram("info " + map + " --config").out, "seed: 1\n# ?]0;title?\n");
  const ProgramRun run = RunProgram("info " + map);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("sequence   a?[31m/b\nwritten by sqslam 1.0?[2J\n"));
  EXPECT_EQ(RecordingReader(map).Info().sequence_path, "a\x1b[31m/b");  // still the path
}

TEST(Hostile, OmitsControlCharactersInMessages) {
  const ProgramRun run = RunProgram("info \"$(printf 'a\\033[31mb')\"");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("a?[31mb")));
}

}  // namespace
}  // namespace sqslam::testing
