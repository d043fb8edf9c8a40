#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/training_images.h"
#include "app/terminal/terminal.h"
#include "slam/features/orb_extractor.h"
#include "slam/recognition/vocabulary.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace {

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
  Camera camera;  // of no account: descriptors are taken from the image as it is
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
  Progress progress(total, arguments.quiet);
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
      progress.Update(++done, "features of " + source.path.string());
    });
  }
  progress.Finish();
  return images;
}

void LearnVocabulary(const VocabularyArguments& arguments) {
  CheckOptions(arguments.options);
  const std::vector<std::vector<Descriptor>> images = ExtractAll(arguments);
  constexpr std::int64_t kSteps = 1000;
  Progress progress(kSteps, arguments.quiet, "step");
  const Vocabulary vocabulary = Vocabulary::Train(images, arguments.options, [&](double share) {
    progress.Update(std::llround(share * kSteps), "clustering");
  });
  progress.Finish();
  vocabulary.Save(arguments.output);
  if (!arguments.quiet) {
    fmt::print("{}: {} words in {} levels from {} features of {} images, {:.1f} MiB\n", arguments.output,
               vocabulary.Words(), vocabulary.Depth(), vocabulary.TrainedDescriptors(),
               vocabulary.TrainedImages(),
               static_cast<double>(std::filesystem::file_size(arguments.output)) / (1024.0 * 1024.0));
  }
}

}  // namespace

void AddVocabularyCommand(CLI::App& app, int&) {
  const auto arguments = std::make_shared<VocabularyArguments>();
  CLI::App* vocabulary =
      app.add_subcommand("vocabulary", "Learn the visual words by which places are recognised");
  vocabulary->footer(
      "\nNeeds thousands of images of many kinds; the words that come with the program were learned like "
      "this\n"
      "(assets/README.md). Memory: about 100 bytes a feature.\n"
      "\nExamples:\n  sqslam vocabulary data/kitchen data/office --stride 5 --output mine.bin\n"
      "  sqslam vocabulary photographs/ walk.mp4 --views 8 --output mine.bin\n"
      "  sqslam info mine.bin\n");
  vocabulary->add_option("TRAIN", arguments->train, "Sequence folders, folders of images, images, videos")
      ->required();
  vocabulary->add_option("--output,-o", arguments->output, "File to write")->required();
  vocabulary->add_option("--branching", arguments->options.branching, "Children of a node")
      ->check(CLI::Range(2, 255))
      ->capture_default_str();
  vocabulary->add_option("--depth", arguments->options.depth, "Levels: at most branching^depth words")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  vocabulary->add_option("--features", arguments->features.num_features, "Features of an image")
      ->check(CLI::Range(100, 10000))
      ->capture_default_str();
  vocabulary->add_option("--stride", arguments->stride, "Use every N-th image")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  vocabulary
      ->add_option("--views", arguments->views,
                   "See each image larger than 640x480 in N random views of that size; 0: as it is")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  vocabulary->add_option("--seed", arguments->options.seed, "Of views and of first cluster centres")
      ->capture_default_str();
  vocabulary->add_flag("--quiet,-q", arguments->quiet, "No progress, no summary");
  vocabulary->callback([arguments] { LearnVocabulary(*arguments); });
}

}  // namespace sqslam::app
