#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/export/surface_file.h"
#include "app/report/report.h"
#include "app/run/terminal_run.h"
#include "app/terminal/terminal.h"
#include "slam/run/scale_estimation.h"
#include "slam/run/scaled_result.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kScaleNotes = R"(
A map of one camera has no scale. One known thing gives it: the height of an object, the distance between two objects
or places, or a ChArUco board that the film shows. The factor is kept in the recording with its standard deviation, and
everything that is read from it is in metres from then on: pictures, report, exports, localize, --extend, and the text
files of the result, which are written anew. The map itself stays as it is: a later call takes the place of an earlier
one, --none takes it away. Without a reference the command says what the scale is.

The deviation is what the map itself knows of the error: of the object's height, of the points at both ends, or of the
board's corners. What you measured is taken to be exact. Tall things that are seen well give one to three percent, flat
ones much less.

Examples:
  sqslam scale out/film --object 4 --height 0.096         object 4 is 9.6 cm high (sqslam info says which is 4)
  sqslam scale out/film --distance 2 7 1.20               from the centre of object 2 to that of 7
  sqslam scale out/film --distance 0.1,0.4,0 0.9,0.4,0 1  between two map points, where they are now
  sqslam scale out/film --board                           a board of sqslam calibrate --board charuco --print-board
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
  if (!a.object.empty() + !a.distance.empty() + a.use_board + a.none > 1) {
    throw UsageError("expected one of --object with --height, --distance, --board, --none");
  }
  std::optional<ScaleReference> reference;
  if (a.height) {
    reference = KnownHeight{a.object, *a.height};
  } else if (!a.distance.empty()) {
    const auto metres = a.distance.size() == 3 ? ParseNumber<double>(a.distance[2]) : std::nullopt;
    if (!metres) {
      throw UsageError(
          "--distance: expected A B METRES, A and B ids of objects or places as X,Y,Z, such as 2 7 1.20");
    }
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
    StepProgress steps(a.quiet, "keyframe");
    WriteSurface(result, 0, [&](int done, int total, const std::string& state) {
      steps.Update(done, total, state);
      return true;
    });
  }
  if (a.no_render) {
    return;
  }
  if (fs::exists(result / "map.png")) {
    FinishedRun run;
    run.output = result;
    run.result.map.snapshot = RecordingReader(result / "map.sqmap").Last();
    StageTimes times;
    DrawRun(run, times);
  }
  if (fs::exists(result / "report.html")) {
    ReportInputs inputs;
    inputs.result = result;
    WriteReport(inputs);
  }
}

void Scale(const ScaleArguments& a) {
  const fs::path result = a.result;
  const fs::path recording = result / "map.sqmap";
  const std::optional<ScaleReference> reference = ReferenceOf(a);
  if (!reference && !a.none) {
    const auto scale = RecordingReader(recording).Info().scale;
    fmt::print("{}\n", scale ? ScaleText(*scale) : "no scale: lengths are map units");
    return;
  }
  std::optional<MapScale> scale;
  if (reference) {
    StepProgress steps(a.quiet, "image");
    scale = EstimateScale(recording, *reference,
                          [&](int done, int total) { steps.Update(done, total, "board"); });
  }
  ScaleResult(result, scale);
  RenewPictures(a);
  if (!a.quiet) {
    fmt::print("{}\n", scale ? ScaleText(*scale) : "the scale is taken away: lengths are map units");
  }
}

}  // namespace

void AddScaleCommand(Command& program) {
  const auto a = std::make_shared<ScaleArguments>();
  Command& command = program.AddCommand("scale", "Bring a finished map to metres by a thing of known size");
  command.Group("Input");
  command.Positional("RESULT", a->result, "Result folder of sqslam run, merge or localize").Required();
  command.Group("Reference");
  command.Option("--object ID", a->object, "An object of the map; a label means the one that is seen best");
  command.Option("--height METRES", a->height, "With --object: its height");
  command
      .Option("--distance A B METRES", a->distance,
              "A distance: A and B are ids of objects, whose centres count, or places X,Y,Z in the map, "
              "whose nearest "
              "map points count")
      .Several();
  command.Flag("--board", a->use_board, "A ChArUco board that four or more keyframes show");
  command.Option("--columns N", a->board.columns, "Its squares in a row");
  command.Option("--rows N", a->board.rows, "Its squares in a column");
  command.Option("--square-mm MM", a->board.square_mm, "Side of a square");
  command.Option("--marker-mm MM", a->board.marker_mm, "Side of a marker");
  command.Option("--dictionary NAME", a->board.dictionary, "The markers, by OpenCV's name");
  command.Flag("--none", a->none, "Take the scale away");
  command.Group("Output");
  command.Flag("--no-render", a->no_render, "Leave pictures and report as they are");
  command.Group("General");
  command.Flag("--quiet,-q", a->quiet, "No progress and no summary; warnings and errors stay");
  command.Notes(kScaleNotes);
  command.OnRun([a] { Scale(*a); });
}

}  // namespace sqslam::app
