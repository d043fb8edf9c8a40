// Videos and dense clouds in pieces, each by a task of Slurm or by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"
#include "tests/app/cluster_fixtures.h"
#include "tests/dense/true_result.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST_F(StandIn, RendersVideoInPiecesAndRepeatsTruncatedOnes) {
  const fs::path map = folder_.Path() / "map.sqmap";
  {
    RecordingWriter writer(map, {});
    writer.Add(HandMadeMap());
    writer.Close();
  }
  // Nine frames: pieces of four, where the encoder changes their order, and of one, where it does not.
  const auto render = [&](const std::string& output, const std::string& options) {
    return RunProgram("render " + map.string() +
                          " --resolution 320,240 --rendering-backend osmesa --quiet "
                          "--fps 2 --seconds 4.5 --output " +
                          (folder_.Path() / output).string() + " " + options,
                      Before());
  };
  folder_.Write("slurm.yaml", "poll: 0.2\n");
  folder_.Write("lost", "1,1\n");
  const fs::path pieces = folder_.Path() / "film.mp4.pieces";
  const std::string on_slurm = "--on slurm --shards 3 --slurm " + (folder_.Path() / "slurm.yaml").string();
  EXPECT_EQ(render("film.mp4", on_slurm + " --task 1/3").exit_code, 0);
  fs::resize_file(pieces / "film.part-1-of-3.mp4", 100);  // a disk that was full
  const ProgramRun run = render("film.mp4", on_slurm);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Jobs(), 2u);
  EXPECT_FALSE(fs::exists(pieces));
  EXPECT_EQ(render("whole.mp4", "").exit_code, 0);
  EXPECT_EQ(Slurp(folder_.Path() / "film.mp4"), Slurp(folder_.Path() / "whole.mp4"));
  EXPECT_EQ(render("film.png", on_slurm).exit_code, 2);
}

TEST_F(StandIn, DiscardsVideoPiecesWhenInputsChange) {
  const fs::path map = folder_.Path() / "map.sqmap";
  RecordingWriter writer(map, {});
  writer.Add(HandMadeMap());
  writer.Close();
  const auto hide = [&](int object) {
    ObjectEdits edits;
    edits.Hide(object);
    WriteObjectEdits(EditsFileOf(map), edits);
  };
  hide(0);
  const std::string film = (folder_.Path() / "film.mp4").string();
  const std::string command =
      "render " + map.string() + " --resolution 160,120 --rendering-backend osmesa --quiet --fps 1 --style " +
      folder_.Write("style.yaml", "background: \"#ffffff\"\n").string() + " --camera-path " +
      folder_.Write("path.yaml", "keys: [{time: 0, view: front}, {time: 4, view: left}]\n").string() +
      " --dense-cloud " + folder_.Write("cloud.txt", "0 0 0\n0 0 1\n0 1 0\n1 0 0\n").string() +
      " --edits auto --output " + film + " --on slurm --shards 2";
  folder_.Write("refuse", "");
  const auto counts_after_taking_up = [&] {
    EXPECT_THAT(RunProgram(command, Before()).err, HasSubstr("invalid partition"));
    return fs::exists(film + ".pieces/film.part-1-of-2.mp4.size");
  };
  const std::vector<std::function<void()>> changes = {
      [&] { hide(1); }, [&] { folder_.Write("style.yaml", "background: \"#eeeeee\"\n"); },
      [&] { folder_.Write("path.yaml", "keys: [{time: 0, view: front}, {time: 4, view: right}]\n"); },
      [&] { folder_.Write("cloud.txt", "0 0 0\n0 0 1\n0 1 0\n2 0 0\n"); }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const ProgramRun piece = RunProgram(command + " --task 1/2", Before());
    EXPECT_EQ(piece.exit_code, 0) << piece.err;
    EXPECT_TRUE(counts_after_taking_up()) << i;
    changes[i]();
    EXPECT_FALSE(counts_after_taking_up()) << i;
  }
  fs::remove(folder_.Path() / "refuse");
  const fs::path slurm = folder_.Write("slurm.yaml", "poll: 0.2\nsetup: [\"sed -i s/right/left/ " +
                                                         (folder_.Path() / "path.yaml").string() + "\"]\n");
  const ProgramRun mixed = RunProgram(command + " --slurm " + slurm.string(), Before());
  EXPECT_EQ(mixed.exit_code, 3);
  EXPECT_THAT(mixed.err, HasSubstr("has changed while the pieces were made"));
  EXPECT_FALSE(fs::exists(film));
}

// A result to be densified, and another that was on one computer.
struct DensifiedResults {
  static constexpr const char* kFast =
      " -q --set dense.stereo.planes=32 --set dense.views.min_overlap=0.3 --set dense.surface.min_island=50 ";

  DensifiedResults() { EXPECT_EQ(RunProgram("densify " + whole.Path().string() + kFast).exit_code, 0); }

  std::string Command(const std::string& options) const {
    return "densify " + shared.Path().string() + kFast + "--on slurm --shards 3 " + options;
  }
  void ExpectSame() const {
    for (const char* file : {"dense.ply", "dense.glb"}) {
      EXPECT_TRUE(Slurp(shared.Path() / file) == Slurp(whole.Path() / file)) << file;
      EXPECT_GT(fs::file_size(shared.Path() / file), 10000U);
    }
    EXPECT_FALSE(fs::exists(Pieces()));
  }
  fs::path Pieces() const { return shared.Path() / "dense.sqmap.pieces"; }

  TrueResult whole{Pan(13, 0.06)}, shared{Pan(13, 0.06)};
};

TEST_F(StandIn, DensifiesInPiecesAndRepeatsTruncatedOnes) {
  const DensifiedResults results;
  folder_.Write("slurm.yaml", "poll: 0.2\n");
  folder_.Write("lost", "1,1\n");
  const std::string file = "--slurm " + (folder_.Path() / "slurm.yaml").string();
  EXPECT_EQ(RunProgram(results.Command(file + " --task 1/3"), Before()).exit_code, 0);
  fs::resize_file(results.Pieces() / "dense.part-1-of-3.sqmap", 100);  // a disk that was full
  const ProgramRun run = RunProgram(results.Command(file), Before());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Jobs(), 2u);
  results.ExpectSame();
}

TEST(DensifyInPieces, WritesOnlyThePieceWithoutSlurm) {
  const DensifiedResults results;
  const fs::path map = results.shared.Path() / "map.sqmap";
  const std::string before = Slurp(map);
  const auto run = [&](const std::string& options) {
    return RunProgram(results.Command(options), "export PATH=/nonexistent").exit_code;
  };
  for (const char* task : {"--task 3/3", "--task 1/3", "--task 2/3"}) {
    EXPECT_EQ(run(task), 0) << task;
  }
  EXPECT_TRUE(Slurp(map) == before);
  const auto made = fs::last_write_time(results.Pieces() / "dense.part-2-of-3.sqmap");
  EXPECT_EQ(run("--task 2/3"), 0);
  EXPECT_EQ(fs::last_write_time(results.Pieces() / "dense.part-2-of-3.sqmap"), made);
  EXPECT_EQ(run("--task end"), 0);
  results.ExpectSame();
  EXPECT_EQ(run("--task 4/4"), 2);
  EXPECT_EQ(RunProgram("densify " + results.shared.Path().string() + " --shards 3").exit_code, 2);
}

TEST_F(RealSlurm, DensifiesInPieces) {
  const DensifiedResults results;
  const ProgramRun run = RunProgram(results.Command(""), Before());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  results.ExpectSame();
}

}  // namespace
}  // namespace sqslam::testing
