#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "app/sequence_arguments.h"
#include "slam/detection/detection_check.h"
#include "slam/detection/detection_writer.h"
#include "slam/detection/detector.h"
#include "slam/io/frame_source.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace {

constexpr const char* kFooter = R"(
Writes a boxes.txt that `sqslam run INPUT --detections boxes.txt` takes. A job that was stopped goes on where
it ended when it is started again. --detector is a name of configs/detectors, or a YAML file beside an .onnx
file of your own (input size, colours, decoder, classes, threshold); scripts/fetch-detector.sh obtains one.

Examples:
  sqslam detect film.mp4 --camera phone.yaml --output boxes.txt
  sqslam detect film.mp4 --camera auto --resize 960 --output boxes.txt
  sqslam detect data/kitchen --detector yolox-nano --set threshold=0.4 --output boxes.txt
  sqslam detect --check boxes.txt data/kitchen      what is missing, unknown or outside
)";

struct Arguments {
  SequenceArguments sequence;
  std::string detector = "centernet";
  std::vector<std::string> set;
  std::string output;
  std::string check;
  bool quiet = false;
};

// Says what is odd; 3 where a run would leave boxes out or cut them.
int Check(const Arguments& a) {
  SequenceRequest request = a.sequence.Request();
  request.resize.clear();
  const Sequence sequence = OpenSequence(request);
  std::vector<double> timestamps;
  for (const SequenceFrame& frame : sequence.frames) {
    timestamps.push_back(frame.timestamp);
  }
  const DetectionReport report = CheckDetections(a.check, sequence.camera, timestamps);
  fmt::print("{}: {} boxes in {} of {} frames\n", a.check, report.boxes, report.frames_with_boxes,
             timestamps.size());
  for (const auto& [label, count] : report.labels) {
    fmt::print("  {:<16} {:>6}{}\n", label, count,
               report.unknown_labels.contains(label) ? "   not a label of COCO or of the program" : "");
  }
  const auto list = [](const char* what, const auto& items) {
    constexpr std::size_t kShown = 8;
    if (!items.empty()) {
      const std::vector first(items.begin(),
                              items.begin() + static_cast<std::ptrdiff_t>(std::min(kShown, items.size())));
      fmt::print("{}: {} ({}{})\n", what, items.size(), fmt::join(first, ", "),
                 items.size() > kShown ? ", ..." : "");
    }
  };
  list("frames without a box, by time", report.frames_without);
  list("lines whose time is no frame's", report.no_frame);
  list("lines whose box reaches out of the image", report.outside);
  return report.HasErrors() ? 3 : 0;
}

// Boxes of resized images in pixels of the images as they lie in the files.
std::vector<Detection> InFiles(std::vector<Detection> detections, const Sequence& sequence) {
  const double x = static_cast<double>(sequence.image_width) / sequence.camera.width;
  const double y = static_cast<double>(sequence.image_height) / sequence.camera.height;
  for (Detection& detection : detections) {
    Box2d& box = detection.box;
    box = {box.x * x, box.y * y, box.width * x, box.height * y};
  }
  return detections;
}

int Detect(const Arguments& a) {
  if (!a.check.empty()) {
    return Check(a);
  }
  if (a.output.empty()) {
    throw UsageError("nothing to do: expected --output FILE, or --check FILE");
  }
  NetworkOptions network = LoadNetwork(a.detector);
  for (const std::string& assignment : a.set) {
    SetOption(assignment, network);
  }
  CheckOptions(network);
  const Sequence sequence = OpenSequence(a.sequence.Request());
  const FrameRange range = a.sequence.Range();
  if (range.SizeIn(sequence) <= 0) {
    throw UsageError(fmt::format("--start {}: nothing left, expected a part of the sequence's {} frames",
                                 range.start, sequence.frames.size()));
  }
  Detector detector(network);
  DetectionWriter writer(a.output,
                         fmt::format("boxes of {} by {} ({}x{}, {}), score from {}, suppression {}",
                                     sequence.path.string(), network.file, network.width, network.height,
                                     network.color, network.threshold, network.suppression_iou));
  const InterruptGuard interrupt;
  const int before = writer.FramesDone();
  if (before > 0 && !a.quiet) {
    fmt::print(stderr, "{} frames are done already, going on\n", before);
  }
  Progress progress(range.SizeIn(sequence), a.quiet);
  FrameSource source(sequence, range);
  int done = 0;
  std::size_t boxes = 0;
  while (const std::optional<Frame> frame = interrupt.Interrupted() ? std::nullopt : source.Next()) {
    if (!writer.IsDone(frame->timestamp)) {
      const std::vector<Detection> found = InFiles(detector.Detect(frame->bgr), sequence);
      boxes += found.size();
      writer.Add(frame->timestamp, found);
    }
    progress.Update(++done, fmt::format("{} boxes", boxes));
  }
  progress.Finish();
  if (interrupt.Interrupted()) {
    fmt::print(stderr, "sqslam: stopped after {} frames; the same command goes on from there\n",
               writer.FramesDone());
    return 130;
  }
  writer.Finish();
  if (!a.quiet) {
    fmt::print("{}: {} boxes in {} frames{}\n", a.output, boxes, done - before,
               source.Skipped() > 0 ? fmt::format(", {} frames could not be read", source.Skipped()) : "");
  }
  return 0;
}

}  // namespace

void AddDetectCommand(CLI::App& app, int& exit_code) {
  const auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("detect", "Find things in images: the boxes.txt of a sequence");
  command->footer(kFooter);
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
