#include "app/commands/sequence_arguments.h"

namespace sqslam::app {

SequenceFormat ParseSequenceFormat(const std::string& name) {
  return *FromName<SequenceFormat>(name);  // the command line has checked the name
}

void SequenceArguments::AddTo(CLI::App& command) {
  command.add_option("INPUT", input, "A sequence folder, a folder of images, or a video")->required();
  command.add_option("--format", format, "How INPUT is laid out")
      ->check(CLI::IsMember(AllNames<SequenceFormat>()))
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
