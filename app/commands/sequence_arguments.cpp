#include "app/commands/sequence_arguments.h"

#include <map>

namespace sqslam::app {

SequenceFormat ParseSequenceFormat(const std::string& name) {
  static const std::map<std::string, SequenceFormat> kFormats = {
      {"auto", SequenceFormat::kAuto},        {"tum", SequenceFormat::kTum},
      {"icl-nuim", SequenceFormat::kIclNuim}, {"scenes-v2", SequenceFormat::kScenesV2},
      {"7-scenes", SequenceFormat::k7Scenes}, {"images", SequenceFormat::kImages},
      {"video", SequenceFormat::kVideo}};
  return kFormats.at(name);  // the command line has checked the name
}

void SequenceArguments::AddTo(CLI::App& command) {
  command.add_option("INPUT", input, "A sequence folder, a folder of images, or a video")->required();
  command.add_option("--format", format, "How INPUT is laid out")
      ->check(CLI::IsMember({"auto", "tum", "icl-nuim", "scenes-v2", "7-scenes", "images", "video"}))
      ->capture_default_str();
  command.add_option("--camera", camera,
                     "Calibration FILE.yaml, the name of one in configs/cameras, or auto");
  command.add_option(
      "--resize", resize,
      "Make the images smaller first: WIDTH, WIDTH,HEIGHT or a factor; boxes stay those of the "
      "images as they are");
  command.add_option("--start", start, "First frame")->check(CLI::NonNegativeNumber)->capture_default_str();
  command.add_option("--frames", frames, "At most this many frames")->check(CLI::PositiveNumber);
  command.add_option("--stride", stride, "Take every N-th frame")->check(CLI::PositiveNumber);
}

SequenceRequest SequenceArguments::Request() const {
  return {input, ParseSequenceFormat(format), camera, {}, resize};
}

}  // namespace sqslam::app
