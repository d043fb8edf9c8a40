#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>

#include "app/commands/commands.h"
#include "app/commands/run_arguments.h"
#include "app/terminal/terminal.h"
#include "slam/detection/detector.h"
#include "slam/inspection/film_inspection.h"
#include "slam/io/fixed_regions.h"
#include "slam/run/trial_run.h"
#include "slam/util/json_file.h"
#include "slam/util/options.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace {

constexpr const char* kDoctorNotes = R"(
Maps the video for trial, thinned out to about ten frames a second, and lists, with times, what makes mapping
hard: the camera stands still, only turns or moves too fast; the images are blurred, too dark, too bright or lack
texture. A video is suitable if the trial maps at least half of the frames. Exits with 0 if it is, otherwise with 3.

Examples:
  sqslam doctor film.mp4
  sqslam doctor data/kitchen --frames 500: -o kitchen.json
  sqslam doctor film.mp4 --set max_blur=0.7
)";

struct DoctorArguments {
  SequenceArguments sequence;
  std::string detector = "auto";
  std::vector<std::string> set;
  std::string output;
  bool quiet = false;
};

std::string LimitNames() {
  InspectionOptions options;
  return fmt::format("{}", fmt::join(ToVector(OptionFields(options), &OptionField::key), ", "));
}

Sequence OpenSmall(const SequenceArguments& arguments) {
  constexpr int kWidth = 640;  // px; a larger image only costs time
  SequenceRequest request = arguments.Request();
  Sequence sequence = OpenSequence(request);
  if (sequence.camera.width > kWidth && request.resize.empty()) {
    request.resize = std::to_string(kWidth);
    sequence = OpenSequence(request);
  }
  sequence.fixed_regions = FindFixedRegions(sequence);
  return sequence;
}

// Prints the median of the samples, and the bound of their worst tenth.
void PrintValue(const std::vector<FilmMoment>& moments, double FilmMoment::*value, const char* name,
                double factor, const char* unit, bool high_is_bad) {
  const auto values = ToVector(moments, [&](const FilmMoment& moment) { return factor * (moment.*value); });
  fmt::print("  {:<34} {:>7.2f} {:>9.2f}  {}\n", name, MeanMedian(values),
             LinearQuantile(values, high_is_bad ? 0.9 : 0.1), unit);
}

void PrintInspection(const Sequence& sequence, const FilmInspection& inspection) {
  const std::vector<FilmMoment>& moments = inspection.moments;
  fmt::print("{}: {:.1f} s, {} frames, {} checked\n", sequence.path.string(), inspection.seconds,
             sequence.frames.size(), moments.size());
  if (!sequence.guessed_by.empty()) {
    fmt::print("focal length {:.2f} of the width, from {}; a calibration improves the map\n",
               sequence.camera.fx / sequence.camera.width, sequence.guessed_by);
  }
  fmt::print("\n  {:<34} {:>7} {:>9}\n", "", "median", "worst 10%");
  PrintValue(moments, &FilmMoment::blur, "blur", 1.0, "0 sharp to 1", true);
  PrintValue(moments, &FilmMoment::clipped, "black or white", 100.0, "% of the image", true);
  PrintValue(moments, &FilmMoment::coverage, "image with keypoints", 100.0, "%", false);
  PrintValue(moments, &FilmMoment::shared, "shared with the next frame", 100.0, "% of the keypoints", false);
  PrintValue(moments, &FilmMoment::flow, "motion", 100.0, "% of the width per second", true);
  PrintValue(moments, &FilmMoment::sideways, "motion other than rotation", 100.0, "%", false);
  int looked = 0;
  int things = 0;
  int with_some = 0;
  for (const FilmMoment& moment : moments) {
    looked += moment.things >= 0 ? 1 : 0;
    with_some += moment.things > 0 ? 1 : 0;
    things += std::max(0, moment.things);
  }
  if (sequence.has_detections) {
    const auto boxes =
        ToVector(sequence.frames, [](const SequenceFrame& frame) { return frame.detections.size(); });
    fmt::print("  the sequence has {} boxes in {} of {} frames\n",
               std::accumulate(boxes.begin(), boxes.end(), 0UL),
               boxes.size() - static_cast<std::size_t>(std::ranges::count(boxes, 0UL)), boxes.size());
  } else if (looked > 0) {
    fmt::print("  the detector found {} objects in {} of {} frames\n", things, with_some, looked);
  } else {
    fmt::print("  no detector: scripts/fetch-detector.sh downloads one, or provide your own boxes\n");
  }
  constexpr double kMaxSkew = 0.005;  // of the width
  if (inspection.skew > kMaxSkew) {
    fmt::print("  fast motion: a rolling shutter of 20 ms shears the image by up to {:.1f} % of its width\n",
               100.0 * inspection.skew);
  }
  fmt::print("\n");
  for (const FilmFinding& finding : inspection.findings) {
    fmt::print("{}\n", InWords(finding));
  }
}

std::string Verdict(const FilmInspection& inspection, const TrialRun& trial) {
  if (trial.mapped == 0) {
    return fmt::format("not suitable for mapping: {}", trial.no_map_reason);
  }
  return fmt::format("{} for mapping: a trial run mapped {} of {} frames, {:.0f} %{}",
                     inspection.IsFit() ? "suitable" : "not suitable", trial.mapped, trial.frames,
                     100.0 * trial.Share(),
                     trial.losses > 0 ? fmt::format(", and lost its place {} times", trial.losses) : "");
}

void WriteInspection(const std::string& path, const FilmInspection& inspection) {
  nlohmann::ordered_json findings = nlohmann::ordered_json::array();
  for (const FilmFinding& finding : inspection.findings) {
    findings.push_back({{"trouble", EnumNames(FilmTrouble())[static_cast<std::size_t>(finding.trouble)]},
                        {"begin", finding.begin},
                        {"breaks", finding.breaks},
                        {"end", finding.end}});
  }
  nlohmann::ordered_json moments = nlohmann::ordered_json::array();
  for (const FilmMoment& m : inspection.moments) {
    moments.push_back(
        {{"frame", m.frame},
         {"seconds", m.seconds},
         {"clipped", m.clipped},
         {"blur", m.blur},
         {"coverage", m.coverage},
         {"shared", m.shared},
         {"kept", m.kept},
         {"flow", m.flow},
         {"sideways", m.sideways},
         {"things", m.things < 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(m.things)}});
  }
  WriteJsonFile(path, nlohmann::ordered_json{{"format", "sqslam-inspection"},
                                             {"version", 1},
                                             {"fit", inspection.IsFit()},
                                             {"mapped", inspection.mapped.value_or(0.0)},
                                             {"seconds", inspection.seconds},
                                             {"moving", inspection.moving},
                                             {"longest", inspection.longest},
                                             {"findings", findings},
                                             {"samples", moments}});
}

int Examine(const DoctorArguments& a) {
  InspectionOptions options;
  SetOptions(a.set, options);
  const Sequence sequence = OpenSmall(a.sequence);
  const FrameRange range = a.sequence.Range();
  range.CheckHasFrames(sequence);
  std::optional<Detector> detector;
  if (a.detector != "none" && !sequence.has_detections) {
    if (const std::optional<NetworkOptions> network = ChooseNetwork(a.detector)) {
      detector.emplace(*network);
    }
  }
  ThingCounter count;
  if (detector) {
    count = [&](const cv::Mat& bgr) { return static_cast<int>(detector->Detect(bgr).size()); };
  }
  StoppableProgress progress(a.quiet);
  FilmInspection inspection =
      InspectFilm(sequence, range, options, count,
                  [&](std::int64_t done, std::int64_t total) { return progress(done, total, "checking"); });
  progress.Finish();
  const TrialRun trial = MapForTrial(sequence, range, [&](std::int64_t done, std::int64_t total) {
    return progress(done, total, "mapping for trial");
  });
  progress.Finish();
  if (progress.interrupt.Interrupted()) {
    return 130;
  }
  inspection.mapped = trial.Share();
  if (!a.output.empty()) {
    WriteInspection(a.output, inspection);
  }
  if (!a.quiet) {
    PrintInspection(sequence, inspection);
  }
  fmt::print("{}: {}\n", sequence.path.string(), Verdict(inspection, trial));
  return inspection.IsFit() ? 0 : 3;
}

}  // namespace

void AddDoctorCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "doctor", "Check whether a video can be mapped, and if not, why", kDoctorNotes, Examine);
  a.sequence.AddTo(command, "Sequence folder, folder of images, or video").Required();
  command.Group("Inspection");
  command.Option(
      "--detector NAME", a.detector,
      "Count objects in a few frames without boxes with this detector (see `sqslam detect`), or none");
  command.Option("--set KEY=VALUE", a.set, "Override one limit: " + LimitNames() + "; may be repeated");
  command.Group("Output");
  command.Option("--output,-o FILE", a.output, "Write all samples and findings to this JSON file");
  command.QuietFlag(a.quiet, "Print only the verdict");
}

}  // namespace sqslam::app
