#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/terminal/terminal.h"
#include "slam/features/orb_extractor.h"
#include "slam/recognition/training_images.h"
#include "slam/recognition/vocabulary.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kVocabularyNotes = R"(
Training needs thousands of varied images; assets/README.md tells how the bundled vocabulary was trained. Memory:
about 100 bytes per feature.

Examples:
  sqslam vocabulary data/kitchen data/office --stride 5 -o mine.bin
  sqslam vocabulary photographs/ walk.mp4 --views 8 -o mine.bin
  sqslam info mine.bin
)";

struct VocabularyArguments {
  std::vector<std::string> train;
  std::string output;
  VocabularyOptions options;
  OrbOptions features;
  int stride = 1;
  int views = 0;
  bool quiet = false;
};

std::vector<Descriptor> DescriptorsOf(OrbExtractor& extractor, const cv::Mat& gray) {
  cv::Mat color;
  cv::cvtColor(gray, color, cv::COLOR_GRAY2BGR);
  Camera camera;  // irrelevant: descriptors are taken from the image as it is
  camera.width = gray.cols;
  camera.height = gray.rows;
  camera.fx = camera.fy = gray.cols;
  return extractor.Extract(gray, color, camera).descriptors;
}

std::vector<std::vector<Descriptor>> ExtractAll(const VocabularyArguments& arguments) {
  std::vector<TrainingSource> sources;
  std::int64_t total = 0;
  for (const std::string& path : arguments.train) {
    sources.push_back(ListTrainingImages(path));
    total += (sources.back().frames + arguments.stride - 1) / arguments.stride;
  }
  OrbExtractor extractor(arguments.features);
  std::vector<std::vector<Descriptor>> images;
  Progress progress(arguments.quiet);
  std::int64_t done = 0;
  for (const TrainingSource& source : sources) {
    ForEachTrainingImage(source, arguments.stride, [&](const cv::Mat& gray) {
      if (arguments.views == 0 || !IsLargePhotograph(gray)) {
        images.push_back(DescriptorsOf(extractor, gray));
      } else {
        for (int view = 0; view < arguments.views; ++view) {
          const std::uint64_t seed = arguments.options.seed * 1000003 + images.size();
          images.push_back(DescriptorsOf(extractor, RandomView(gray, seed)));
        }
      }
      progress.Update(++done, total, "features of " + source.path.string());
    });
  }
  return images;
}

void LearnVocabulary(const VocabularyArguments& arguments) {
  CheckOptions(arguments.options);
  const std::vector<std::vector<Descriptor>> images = ExtractAll(arguments);
  constexpr std::int64_t kProgressSteps = 1000;
  Progress progress(arguments.quiet, "step");
  const Vocabulary vocabulary = Vocabulary::Train(images, arguments.options, [&](double share) {
    progress.Update(std::llround(share * kProgressSteps), kProgressSteps, "clustering");
  });
  progress.Finish();
  vocabulary.Save(arguments.output);
  PrintSummary(arguments.quiet, "{}: {} words in {} levels from {} features of {} images, {:.1f} MiB\n",
               arguments.output, vocabulary.Words(), vocabulary.Depth(), vocabulary.TrainedDescriptors(),
               vocabulary.TrainedImages(),
               static_cast<double>(fs::file_size(arguments.output)) / (1024.0 * 1024.0));
}

}  // namespace

void AddVocabularyCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "vocabulary", "Train a visual vocabulary for place recognition", kVocabularyNotes, LearnVocabulary);
  command.Group("Input");
  command.Positional("TRAIN", a.train, "Sequence folders, folders of images, images, videos").Required();
  command.Option("--stride N", a.stride, "Use every N-th image").AtLeast(1);
  command
      .Option("--views N", a.views, "Random views of 640x480 from each larger image; 0: the image as it is")
      .Range(0, 1000);
  command.Option("--features N", a.features.num_features, "Features per image").Range(100, 10000);
  command.Group("Output");
  command.Option("--output,-o FILE", a.output, "Output file").Required();
  command.Option("--branching N", a.options.branching, "Children per node").Range(2, 255);
  command.Option("--depth N", a.options.depth, "Levels; at most branching^depth words").Range(1, 8);
  command.Option("--seed N", a.options.seed, "Seed of the views and the initial cluster centres");
  command.QuietFlag(a.quiet, "No progress and no summary");
}

}  // namespace sqslam::app
