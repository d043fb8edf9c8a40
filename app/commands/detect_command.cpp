#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/sequence_arguments.h"
#include "app/terminal/terminal.h"
#include "slam/detection/detector.h"
#include "slam/io/detections.h"
#include "slam/io/frame_source.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace {

constexpr const char* kDetectFooter = R"(
Writes a boxes.txt that `sqslam run INPUT --detections boxes.txt` takes. A job that was stopped goes on where
it ended when it is started again. --detector is a name of configs/detectors, or a YAML file beside an .onnx
file of your own (input size, colours, decoder, classes, threshold); scripts/fetch-detector.sh obtains one.

Examples:
  sqslam detect film.mp4 --camera phone.yaml --output boxes.txt
  sqslam detect film.mp4 --camera auto --resize 960 --output boxes.txt
  sqslam detect data/kitchen --detector yolox-nano --set threshold=0.4 --output boxes.txt
  sqslam detect --check boxes.txt data/kitchen      what is missing, unknown or outside
)";

struct DetectArguments {
  SequenceArguments sequence;
  std::string detector = "centernet";
  std::vector<std::string> set;
  std::string output;
  std::string check;
  bool quiet = false;
};

// The first few of many.
template <typename Item>
void List(const char* what, const std::vector<Item>& items) {
  constexpr std::size_t kShown = 8;
  if (!items.empty()) {
    const std::vector<Item> first(
        items.begin(), items.begin() + static_cast<std::ptrdiff_t>(std::min(kShown, items.size())));
    fmt::print("{}: {} ({}{})\n", what, items.size(), fmt::join(first, ", "),
               items.size() > kShown ? ", ..." : "");
  }
}

// The sequence and the part of it that is asked for, which is not empty.
std::pair<Sequence, FrameRange> OpenPart(const SequenceArguments& a, const SequenceRequest& request) {
  Sequence sequence = OpenSequence(request);
  const FrameRange range = a.Range();
  if (range.SizeIn(sequence) <= 0) {
    throw UsageError(fmt::format("--start {}: nothing left, expected a part of the sequence's {} frames",
                                 range.start, sequence.frames.size()));
  }
  return {std::move(sequence), range};
}

// Says what is odd; 3 where a run would leave boxes out or cut them.
int Check(const DetectArguments& a) {
  SequenceRequest request = a.sequence.Request();
  request.resize.clear();  // boxes in files are in pixels of the images in files
  const auto [sequence, range] = OpenPart(a.sequence, request);
  std::vector<double> timestamps;
  for (const SequenceFrame& frame : sequence.frames) {
    timestamps.push_back(frame.timestamp);
  }
  const auto [frames, report] = CheckDetections(a.check, sequence.camera, timestamps);
  std::vector<double> without;
  for (std::int64_t i = 0; i < range.SizeIn(sequence); ++i) {
    const auto frame = static_cast<std::size_t>(range.start + i * range.stride);
    if (frames[frame].empty()) {
      without.push_back(timestamps[frame]);
    }
  }
  const std::int64_t size = range.SizeIn(sequence);
  fmt::print("{}: {} boxes; {} of {} frames have some\n", a.check, report.boxes,
             size - static_cast<std::int64_t>(without.size()), size);
  for (const auto& [label, count] : report.labels) {
    fmt::print("  {:<16} {:>6}{}\n", label, count,
               report.unknown_labels.contains(label) ? "   not a label of COCO or of the program" : "");
  }
  List("frames without a box, by time", without);
  List("boxes whose time is no frame's", report.no_frame);
  List("boxes outside the image", report.outside);
  List("boxes that reach out of the image", report.clipped);
  return report.HasErrors() ? 3 : 0;
}

// All frames that have not been done before. False after Ctrl-C.
bool DetectAll(const DetectArguments& a, const Sequence& sequence, const FrameRange& range,
               Detector& detector, DetectionWriter& writer) {
  const InterruptGuard interrupt;
  Progress progress(range.SizeIn(sequence), a.quiet);
  FrameSource source(sequence, range);
  int done = 0;
  while (const std::optional<Frame> frame = interrupt.Interrupted() ? std::nullopt : source.Next()) {
    if (!writer.IsDone(frame->timestamp)) {
      writer.Add(frame->timestamp, detector.Detect(frame->bgr));
    }
    progress.Update(++done, fmt::format("{} boxes", writer.Boxes()));
  }
  progress.Finish();
  if (source.Skipped() > 0) {
    spdlog::warn("{}: {} frames could not be read", sequence.path.string(), source.Skipped());
  }
  return !interrupt.Interrupted();
}

int Detect(const DetectArguments& a) {
  if (!a.check.empty()) {
    return Check(a);
  }
  if (a.output.empty()) {
    throw UsageError("nothing to do: expected --output FILE, or --check FILE");
  }
  const NetworkOptions network = LoadNetwork(a.detector, a.set);
  const auto [sequence, range] = OpenPart(a.sequence, a.sequence.Request());
  Detector detector(network);
  DetectionWriter writer(a.output,
                         fmt::format("boxes of {}, {}", sequence.path.string(), Fingerprint(network)),
                         FilePixels(sequence));
  if (writer.Frames() > 0 && !a.quiet) {
    fmt::print(stderr, "{} frames are done already, going on\n", writer.Frames());
  }
  if (!DetectAll(a, sequence, range, detector, writer)) {
    fmt::print(stderr, "sqslam: stopped after {} frames; the same command goes on from there\n",
               writer.Frames());
    return 130;
  }
  writer.Finish();
  if (!a.quiet) {
    fmt::print("{}: {} boxes in {} frames\n", a.output, writer.Boxes(), writer.Frames());
  }
  return 0;
}

}  // namespace

void AddDetectCommand(CLI::App& app, int& exit_code) {
  const auto a = std::make_shared<DetectArguments>();
  CLI::App* command = app.add_subcommand("detect", "Find things in images: the boxes.txt of a sequence");
  command->footer(kDetectFooter);
  a->sequence.AddTo(*command);
  command->add_option("--detector", a->detector, "A name of configs/detectors, or FILE.yaml")
      ->capture_default_str();
  command->add_option("--set", a->set, "KEY=VALUE of the detector's file, repeatable")
      ->expected(1)
      ->take_all();
  command->add_option("--output", a->output, "boxes.txt to write");
  command->add_option("--check", a->check, "A boxes.txt to look through instead");
  command->add_flag("--quiet", a->quiet, "No progress");
  command->callback([a, &exit_code] { exit_code = Detect(*a); });
}

}  // namespace sqslam::app
