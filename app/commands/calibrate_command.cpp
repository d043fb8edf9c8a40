#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/run_arguments.h"
#include "app/terminal/terminal.h"
#include "render/figures/figures.h"
#include "slam/calibration/calibration.h"
#include "slam/geometry/angles.h"
#include "slam/io/cameras.h"
#include "slam/io/frame_source.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kCalibrateNotes = R"(
INPUT is a video, a folder of photographs or a sequence of a flat board. Hold the board still or move it slowly,
show it in all parts of the image and tilted to all sides, and keep the focus and zoom of your later videos. A
chessboard must be visible as a whole; a ChArUco board may be partly hidden. --columns and --rows count squares.
In a long video about 400 frames are searched, and the most different views are used.

Examples:
  sqslam calibrate --print-board board.pdf            A4; print at 100 %, then measure a square
  sqslam calibrate board.mp4 -o camera.yaml
  sqslam calibrate photos/ --columns 9 --rows 7 --square-mm 30 -o camera.yaml
  sqslam calibrate --board charuco --print-board board.pdf
  sqslam calibrate board.mp4 --board charuco -o phone.yaml --figure residuals.pdf
)";

struct CalibrateArguments {
  SequenceArguments sequence;
  CalibrationBoard board;
  std::string output;
  std::string figure;
  std::string print_board;
  bool quiet = false;
};

// Writes a board at true scale: as vectors in PDF and SVG, at 600 dpi in PNG.
void PrintBoard(const CalibrateArguments& a) {
  constexpr double kDpi = 600.0;
  const FigurePage page = DrawBoardSheet(a.board, kDpi);
  WriteFigure(page, a.print_board);
  PrintSummary(a.quiet, "{}: {}, on a page of {:.0f} x {:.0f} mm\n", a.print_board, BoardText(a.board),
               page.width / 72.0 * 25.4, page.height / 72.0 * 25.4);
}

struct BoardSearch {
  bool interrupted = false;  // by Ctrl-C
  std::vector<BoardView> views;
  int frames = 0;  // searched
  cv::Mat last;    // image, 8UC1
};

// Finds the boards in up to 400 evenly spaced frames.
BoardSearch FindBoards(const CalibrateArguments& a, const Sequence& sequence) {
  constexpr std::int64_t kMaxFrames = 400;
  FrameRange range = a.sequence.Range();
  range.CheckHasFrames(sequence);
  const std::int64_t available = range.SizeIn(sequence);
  const std::int64_t step = (available + kMaxFrames - 1) / kMaxFrames;
  range.stride *= step;
  range.count = (available + step - 1) / step;
  const InterruptGuard interrupt;
  FrameSource source(sequence, range);
  BoardSearch search;
  Progress progress(a.quiet);
  while (const std::optional<Frame> frame = interrupt.Interrupted() ? std::nullopt : source.Next()) {
    search.last = frame->gray;
    ++search.frames;
    if (std::optional<BoardView> view = FindBoard(frame->gray, a.board)) {
      view->name = frame->image_path.empty() ? fmt::format("frame {}", frame->index)
                                             : fs::path(frame->image_path).filename().string();
      search.views.push_back(std::move(*view));
    }
    progress.Update(search.frames, range.SizeIn(sequence), fmt::format("{} boards", search.views.size()));
  }
  search.interrupted = interrupt.Interrupted();
  return search;
}

// Suggests one more column and row: users often count inner corners instead of squares.
std::string InnerCornersHint(const CalibrateArguments& a, const BoardSearch& search) {
  CalibrationBoard other = a.board;
  other.columns += 1;
  other.rows += 1;
  if (search.last.empty() || other.kind != BoardKind::kChessboard || !FindBoard(search.last, other)) {
    return "";
  }
  return fmt::format("; did you count inner corners? --columns {} --rows {} counts squares", other.columns,
                     other.rows);
}

std::string CalibrationText(const Calibration& c, const BoardSearch& search, const CalibrationBoard& board) {
  const Camera& k = c.camera;
  const auto& s = c.intrinsic_deviation;
  const auto& d = c.distortion_deviation;
  const double vertical = std::atan((k.cy + 0.5) / k.fy) + std::atan((k.height - 0.5 - k.cy) / k.fy);
  std::string text = fmt::format("{}, seen in {} of {} frames, {} of them used\n", BoardText(board),
                                 search.views.size(), search.frames, c.views.size());
  text +=
      fmt::format("fx {:.2f} +- {:.2f}  fy {:.2f} +- {:.2f}  cx {:.2f} +- {:.2f}  cy {:.2f} +- {:.2f} px\n",
                  k.fx, s[0], k.fy, s[1], k.cx, s[2], k.cy, s[3]);
  text += fmt::format("field of view {:.1f} x {:.1f} degrees\n", kDegreesPerRadian * HorizontalFieldOfView(k),
                      kDegreesPerRadian * vertical);
  constexpr std::array<const char*, 5> kNames = {"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    text += d[i] > 0.0
                ? fmt::format("{}{} {:.5f} +- {:.5f}", i > 0 ? "  " : "", kNames[i], k.distortion[i], d[i])
                : fmt::format("{}{} 0", i > 0 ? "  " : "", kNames[i]);
  }
  return text + fmt::format("\nRMS error {:.3f} px, {:.0f} % of the image covered", c.rms, 100.0 * c.covered);
}

void PrintReport(const CalibrateArguments& a, const Calibration& c, const std::string& text) {
  if (!c.dropped_views.empty() || c.dropped_corners > 0) {
    spdlog::info("left out as outliers: {} views{}{}, {} corners", c.dropped_views.size(),
                 c.dropped_views.empty() ? "" : ": ", fmt::join(c.dropped_views, ", "), c.dropped_corners);
  }
  for (const std::string& weakness : Weaknesses(c)) {
    spdlog::warn("{}", weakness);
  }
  PrintSummary(a.quiet, "{}\n{}, {}\n", text, a.output, a.figure);
}

int CalibrateCamera(const CalibrateArguments& given) {
  CalibrateArguments a = given;
  CheckBoard(a.board);
  if (!a.print_board.empty()) {
    CheckFigurePath(a.print_board);
    PrintBoard(a);
    return 0;
  }
  ThrowIf<UsageError>(a.sequence.input.empty() || a.output.empty(),
                      "calibrate: expected INPUT --output camera.yaml, or --print-board board.pdf");
  const fs::path output = a.output;
  if (a.figure.empty()) {
    a.figure = (output.parent_path() / (output.stem().string() + "-residuals.png")).string();
  }
  CheckFigurePath(a.figure);
  SequenceRequest request = a.sequence.Request();
  request.camera = kAutoCamera;
  request.resize = request.resize.empty() ? "1" : request.resize;  // corners need every pixel
  a.sequence.Range();  // throws on invalid ranges before anything is read
  const Sequence sequence = OpenSequence(request);
  const BoardSearch search = FindBoards(a, sequence);
  if (search.interrupted) {
    PrintNotice("sqslam: interrupted before all images were searched; nothing was written");
    return 130;
  }
  constexpr std::size_t kMinViews = 3;
  if (search.views.size() < kMinViews) {
    throw InputError("{}: a {} was found in {} of {} frames, expected at least {}{}", a.sequence.input,
                     BoardText(a.board), search.views.size(), search.frames, kMinViews,
                     InnerCornersHint(a, search));
  }
  Calibration c = Calibrate(search.views, a.board, {sequence.camera.width, sequence.camera.height});
  c.camera.fps = sequence.camera.fps;
  const std::string text = CalibrationText(c, search, a.board);
  WriteCamera(output, c.camera, text);
  WriteFigure(DrawCalibration(c, {}), a.figure);
  PrintReport(a, c, text);
  return 0;
}

}  // namespace

void AddCalibrateCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("calibrate", "Estimate a camera's focal length and distortion from a board",
                         kCalibrateNotes, CalibrateCamera);
  a.sequence.AddTo(command, "Video, folder of photographs, or sequence folder", false);
  command.Group("Board");
  command.Option("--board NAME", a.board.kind, "Pattern of the board");
  command.Option("--columns N", a.board.columns, "Squares per row");
  command.Option("--rows N", a.board.rows, "Squares per column");
  command.Option("--square-mm MM", a.board.square_mm, "Side length of a square");
  command.Option("--marker-mm MM", a.board.marker_mm, "ChArUco: side length of a marker");
  command.Option("--dictionary NAME", a.board.dictionary, "ChArUco: marker dictionary of OpenCV");
  command.Group("Output");
  command.Option("--output,-o FILE", a.output, "camera.yaml to write");
  command.Option("--figure FILE", a.figure,
                 "Plot of the residuals (.png, .svg, .pdf); default: NAME-residuals.png beside --output");
  command.Option("--print-board FILE", a.print_board, "Instead, write a printable board (.pdf, .svg, .png)");
  command.QuietFlag(a.quiet, "No progress and no summary");
}

}  // namespace sqslam::app
