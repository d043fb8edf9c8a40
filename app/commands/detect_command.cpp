#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <optional>
#include <ranges>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/run_arguments.h"
#include "app/terminal/terminal.h"
#include "slam/detection/detector.h"
#include "slam/io/box_formats.h"
#include "slam/io/detections.h"
#include "slam/io/frame_source.h"
#include "slam/util/data_path.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDetectNotes = R"(
Writes a boxes.txt for `sqslam run INPUT --detections boxes.txt`. Run the same command to resume after an
interruption. --detector is a name in configs/detectors, or a YAML file beside your own .onnx file (input size,
colours, decoder, classes, threshold); scripts/fetch-detector.sh downloads a network.

Examples:
  sqslam detect film.mp4 --camera phone.yaml -o boxes.txt
  sqslam detect film.mp4 -o boxes.txt
  sqslam detect data/kitchen --detector yolox-nano --set threshold=0.4 -o boxes.txt
  sqslam detect film.mp4 --camera auto --output-format coco -o boxes.json
  sqslam detect --check boxes.txt data/kitchen      find missing frames and unknown labels
)";

struct DetectArguments {
  SequenceArguments sequence;
  std::string detector = "auto";
  std::vector<std::string> set;
  std::string output;
  BoxFormat format = BoxFormat::kBoxes;
  std::string check;
  bool quiet = false;
};

// Returns the size of each frame's image, px.
std::vector<cv::Size> ImageSizes(const Sequence& sequence) {
  return ToVector(ImageHeaders(sequence), &ImageHeader::size);
}

// Prints how many items there are, and the first few.
template <typename Item>
void PrintList(const char* what, const std::vector<Item>& items) {
  constexpr std::size_t kMaxListed = 8;
  if (!items.empty()) {
    fmt::print("{}: {} ({}{})\n", what, items.size(), fmt::join(items | std::views::take(kMaxListed), ", "),
               items.size() > kMaxListed ? ", ..." : "");
  }
}

// Reports suspicious boxes; returns 3 if a run would drop or clip any.
int CheckBoxes(const DetectArguments& a) {
  const Sequence sequence = OpenSequence(a.sequence.Request());
  const FrameRange range = a.sequence.Range();
  range.CheckHasFrames(sequence);
  const std::vector<double> timestamps = Timestamps(sequence);
  const auto [frames, report] =
      CheckDetections(a.check, ImageSizes(sequence), timestamps, ImageNames(sequence));
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
               report.unknown_labels.contains(label) ? "   unknown label" : "");
  }
  PrintList("frames without a box (times)", without);
  PrintList("boxes of missing frames", report.no_frame);
  PrintList("boxes outside the image", report.outside);
  PrintList("boxes that extend beyond the image", report.clipped);
  return report.HasErrors() ? 3 : 0;
}

// Detects in all frames that `writer` does not have yet; returns false after Ctrl-C.
bool DetectAll(const DetectArguments& a, const Sequence& sequence, const FrameRange& range,
               Detector& detector, DetectionWriter& writer) {
  const InterruptGuard interrupt;
  Progress progress(a.quiet);
  FrameSource source(sequence, range);
  int done = 0;
  while (const std::optional<Frame> frame = interrupt.Interrupted() ? std::nullopt : source.Next()) {
    if (!writer.IsDone(frame->timestamp)) {
      writer.Add(frame->timestamp, InFilePixels(DetectIn(*frame, detector), frame->bgr.size(),
                                                FileSize(sequence), frame->quarter_turns));
    }
    progress.Update(++done, range.SizeIn(sequence), fmt::format("{} boxes", writer.Boxes()));
  }
  progress.Finish();
  if (source.Skipped() > 0) {
    spdlog::warn("{}: {} frames could not be read", sequence.path.string(), source.Skipped());
  }
  return !interrupt.Interrupted();
}

// Converts a boxes.txt to another format.
void ConvertBoxes(const fs::path& boxes, const fs::path& output, BoxFormat format, const Sequence& sequence) {
  const std::vector<cv::Size> sizes = ImageSizes(sequence);
  const CheckedDetections checked = CheckDetections(boxes, sizes, Timestamps(sequence), ImageNames(sequence));
  const bool video = !sequence.video_path.empty();
  const std::vector<std::string> names = ImageNames(sequence);
  std::vector<ImageBoxes> frames;
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    const SequenceFrame& frame = sequence.frames[i];
    frames.push_back({frame.timestamp, static_cast<std::int64_t>(i),
                      video ? sequence.video_path.filename().string() : names[i], sizes[i],
                      checked.frames[i]});
  }
  WriteBoxFile(output, format, video, frames);
}

int Detect(const DetectArguments& a) {
  if (!a.check.empty()) {
    return CheckBoxes(a);
  }
  ThrowIf<UsageError>(a.output.empty(), "detect: nothing to do, expected --output FILE or --check FILE");
  ThrowIf<UsageError>(a.format == BoxFormat::kCsv,
                      "--output-format csv: can only be read, expected boxes, yolo, coco or mot");
  const std::optional<NetworkOptions> network = ChooseNetwork(a.detector, a.set);
  ThrowIf<InputError>(!network, "no detector is installed; scripts/fetch-detector.sh downloads one");
  const Sequence sequence = OpenSequence(a.sequence.Request());
  const FrameRange range = a.sequence.Range();
  range.CheckHasFrames(sequence);
  Detector detector(*network);
  const bool plain = a.format == BoxFormat::kBoxes;
  const fs::path boxes = plain ? a.output : a.output + ".boxes.txt";
  ThrowIf<UsageError>(!plain && fs::exists(a.output), "--output {}: exists already, expected a new name",
                      a.output);
  DetectionWriter writer(boxes, fmt::format("boxes of {}, {}", sequence.path.string(), detector.Settings()));
  if (writer.Frames() > 0 && !a.quiet) {
    PrintNotice(fmt::format("{} frames are done already, resuming", writer.Frames()));
  }
  if (!DetectAll(a, sequence, range, detector, writer)) {
    PrintNotice(
        fmt::format("sqslam: stopped after {} frames; run the same command to resume", writer.Frames()));
    return 130;
  }
  writer.Finish();
  if (!plain) {
    ConvertBoxes(boxes, a.output, a.format, sequence);
    fs::remove(boxes);
  }
  PrintSummary(a.quiet, "{}: {} boxes in {} frames\n", a.output, writer.Boxes(), writer.Frames());
  return 0;
}

}  // namespace

void AddDetectCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("detect", "Detect objects in images and write their boxes", kDetectNotes, Detect);
  a.sequence.AddTo(command, "Sequence folder, folder of images, or video").Required();
  command.Group("Detector");
  command.Option("--detector NAME", a.detector,
                 "One of configs/detectors (" + ConfigNameList("configs/detectors") +
                     "), FILE.yaml, or auto: the first of yolox-nano and centernet whose weights are "
                     "installed");
  command.Option("--set KEY=VALUE", a.set, "Override one value of the detector file; may be repeated");
  command.Group("Output");
  command.Option("--output,-o FILE", a.output, "Output file (yolo: folder)");
  command.Option("--output-format NAME", a.format,
                 "boxes: a boxes.txt; yolo: a folder, one file per image; coco: JSON; mot: MOTChallenge");
  command.Option("--check FILE", a.check, "Instead, check boxes in any supported format");
  command.QuietFlag(a.quiet, "No progress");
}

}  // namespace sqslam::app
