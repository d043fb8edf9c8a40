#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/export/map_export.h"
#include "app/report/report.h"
#include "app/run/terminal_run.h"
#include "app/terminal/terminal.h"
#include "slam/run/map_files.h"
#include "slam/run/scale_estimation.h"
#include "slam/snapshot/recording.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kScaleNotes = R"(
A monocular map has no metric scale. One known length provides it: the height of an object, the distance between two
objects or positions, or a ChArUco board in the video. The recording stores the factor with its standard deviation;
from then on pictures, report, exports, localize and --extend use metres, and the text files of the result are
rewritten (repeat the command if that is interrupted). The map itself does not change: a later call replaces the scale,
--none removes it. Without a reference the command prints the scale.

The standard deviation covers the error of the map: of the object's height, of the points at both ends, or of the
board's corners. Your measurement is taken as exact. Tall, well-observed objects give an error of 1 to 3 %; flat
objects are much worse.

Examples:
  sqslam scale out/film --object 4 --height 0.096         object 4 (see sqslam info) is 9.6 cm high
  sqslam scale out/film --distance 2 7 1.20               between the centres of objects 2 and 7
  sqslam scale out/film --distance 0.1,0.4,0 0.9,0.4,0 1  between two positions in the map
  sqslam scale out/film --board                           the board of sqslam calibrate --board charuco --print-board
  sqslam scale out/film --board --columns 9 --rows 6 --square-mm 30 --marker-mm 22
  sqslam scale out/film --none
)";

struct ScaleArguments {
  std::string result;
  std::string object;
  std::optional<double> height;
  std::vector<std::string> distance;
  bool use_board = false;
  CalibrationBoard board{.kind = BoardKind::kCharuco};
  bool none = false;
  bool no_render = false;
  bool quiet = false;
};

// Returns the reference of known size; empty if none is given.
std::optional<ScaleReference> ReferenceOf(const ScaleArguments& a) {
  if (a.object.empty() != !a.height) {
    throw UsageError(a.height ? "--height: expected --object ID with it"
                              : "--object: expected --height METRES with it");
  }
  ThrowIf<UsageError>(!a.object.empty() + !a.distance.empty() + a.use_board + a.none > 1,
                      "expected one of --object (with --height), --distance, --board and --none");
  std::optional<ScaleReference> reference;
  if (a.height) {
    reference = KnownHeight{a.object, *a.height};
  } else if (!a.distance.empty()) {
    const auto metres = a.distance.size() == 3 ? ParseNumber<double>(a.distance[2]) : std::nullopt;
    ThrowIf<UsageError>(
        !metres,
        "--distance: expected A B METRES, A and B ids of objects or positions X,Y,Z, such as 2 7 1.20");
    reference = KnownDistance{a.distance[0], a.distance[1], *metres};
  } else if (a.use_board) {
    reference = a.board;
  }
  if (reference) {
    CheckScaleReference(*reference);
  }
  return reference;
}

// Renews the outputs that show lengths, if they exist: the mesh, the pictures, the report.
void RenewPictures(const ScaleArguments& a) {
  const fs::path result = a.result;
  if (fs::exists(result / "dense.glb")) {
    Progress progress(a.quiet, "keyframe");
    WriteSurface(result, 0, std::ref(progress));
  }
  if (a.no_render) {
    return;
  }
  if (fs::exists(result / "map.png")) {
    StageTimes times;
    DrawRun(result, *RecordingReader(result / "map.sqmap").Last(), times);
  }
  if (fs::exists(result / "report.html")) {
    WriteReport({.result = result});
  }
}

void Scale(const ScaleArguments& a) {
  const fs::path result = a.result;
  const fs::path recording = result / "map.sqmap";
  const std::optional<ScaleReference> reference = ReferenceOf(a);
  if (!reference && !a.none) {
    const auto scale = RecordingReader(recording).Info().scale;
    fmt::print("{}\n", scale ? ScaleText(*scale) : "no scale: lengths are in map units");
    return;
  }
  std::optional<MapScale> scale;
  if (reference) {
    Progress progress(a.quiet, "image");
    scale = EstimateScale(recording, *reference,
                          [&](int done, int total) { progress.Update(done, total, "board"); });
  }
  ScaleResult(result, scale);
  RenewPictures(a);
  if (!a.quiet) {
    fmt::print("{}\n", scale ? ScaleText(*scale) : "scale removed: lengths are in map units");
  }
}

}  // namespace

void AddScaleCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "scale", "Set the metric scale of a finished map from a known length", kScaleNotes, Scale);
  command.Group("Input");
  command.Positional("RESULT", a.result, "Result folder of sqslam run, merge or localize").Required();
  command.Group("Reference");
  command.Option("--object ID", a.object, "Id of an object, or a label: its best observed object");
  command.Option("--height METRES", a.height, "With --object: its height");
  command
      .Option("--distance A B METRES", a.distance,
              "Distance between A and B: ids of objects (their centres) or positions X,Y,Z in the map "
              "(their nearest map points)")
      .Several();
  command.Flag("--board", a.use_board, "A ChArUco board that is visible in at least four keyframes");
  command.Option("--columns N", a.board.columns, "Squares per row of the board");
  command.Option("--rows N", a.board.rows, "Squares per column");
  command.Option("--square-mm MM", a.board.square_mm, "Side length of a square");
  command.Option("--marker-mm MM", a.board.marker_mm, "Side length of a marker");
  command.Option("--dictionary NAME", a.board.dictionary, "Marker dictionary of OpenCV");
  command.Flag("--none", a.none, "Remove the scale");
  command.Group("Output");
  command.Flag("--no-render", a.no_render, "Do not redraw pictures and the report");
  command.QuietFlag(a.quiet, "No progress and no summary");
}

}  // namespace sqslam::app
