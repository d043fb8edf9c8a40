#include "slam/recognition/training_images.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/io/dataset_layouts.h"
#include "slam/io/image_files.h"
#include "slam/io/video_index.h"
#include "slam/io/video_reader.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr int kViewWidth = 640;  // pixels
constexpr int kViewHeight = 480;

// By its own name, or by a dataset's folder for depth images.
bool IsDepth(const fs::path& path) { return IsDepthImage(path) || path.parent_path().filename() == "depth"; }

std::vector<fs::path> ListSequence(const fs::path& folder) {
  return ToVector(ListDataset(SequenceFormat::kTum, folder, 0.0), &SequenceFrame::image_path);
}

std::vector<fs::path> ListFolder(const fs::path& folder) {
  std::vector<fs::path> images;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && !IsHidden(entry.path()) && IsImage(entry.path()) &&
        !IsDepth(entry.path())) {
      images.push_back(entry.path());
    }
  }
  std::ranges::sort(images);
  return images;
}

std::int64_t VisitVideo(const fs::path& path, int stride, const std::function<void(const cv::Mat&)>& visit) {
  const VideoIndex index = IndexVideo(path);
  VideoReader video(path, index.times);
  std::int64_t used = 0;
  cv::Mat gray;
  for (std::int64_t i = 0; i < std::ssize(index.timestamps) && !video.Ended(); i += stride) {
    if (const std::optional<cv::Mat> frame = video.Read(i)) {
      cv::cvtColor(*frame, gray, cv::COLOR_BGR2GRAY);
      visit(gray);
      ++used;
    }
  }
  return used;
}

}  // namespace

TrainingSource ListTrainingImages(const fs::path& path) {
  constexpr const char* kExpected = "a sequence folder, a folder of images, an image or a video";
  ThrowIf<InputError>(!fs::exists(path), "{}: does not exist, expected {}", path.string(), kExpected);
  TrainingSource source{path, {}, 0};
  if (fs::is_directory(path)) {
    source.images = fs::exists(path / "rgb.txt") ? ListSequence(path) : ListFolder(path);
    ThrowIf<InputError>(source.images.empty(), "{}: holds no image, expected {}", path.string(), kExpected);
  } else if (IsImage(path)) {
    source.images = {path};
  } else {
    source.frames = std::ssize(IndexVideo(path).timestamps);
    return source;
  }
  source.frames = static_cast<std::int64_t>(source.images.size());
  return source;
}

void ForEachTrainingImage(const TrainingSource& source, int stride,
                          const std::function<void(const cv::Mat&)>& visit) {
  std::int64_t used = 0;
  if (source.images.empty()) {
    used = VisitVideo(source.path, stride, visit);
  }
  for (std::size_t i = 0; i < source.images.size(); i += static_cast<std::size_t>(stride)) {
    const cv::Mat image = ReadImage(source.images[i], cv::IMREAD_GRAYSCALE);
    if (image.empty()) {
      spdlog::warn("{}: cannot be read as an image, skipped", source.images[i].string());
      continue;
    }
    visit(image);
    ++used;
  }
  ThrowIf<InputError>(used == 0, "{}: none of {} images can be read", source.path.string(), source.frames);
}

bool IsLargePhotograph(const cv::Mat& image) { return image.cols > kViewWidth && image.rows > kViewHeight; }

cv::Mat RandomView(const cv::Mat& photograph, std::uint64_t seed) {
  cv::RNG random(seed * 0x9E3779B97F4A7C15U + 1U);
  const double widest =
      std::min<double>(photograph.cols, photograph.rows * double{kViewWidth} / double{kViewHeight});
  // Pixels of the photograph that the view spans, uniform in the logarithm: scenes are near or far.
  const double narrowest = std::min<double>(widest, kViewWidth);
  const double span = narrowest * std::pow(widest / narrowest, random.uniform(0.0, 1.0));
  const double shrink = std::min(1.0, kViewWidth / span);
  cv::Mat source;
  cv::resize(photograph, source, {}, shrink, shrink, cv::INTER_AREA);

  const auto width = static_cast<float>(span * shrink);
  const float height = width * kViewHeight / kViewWidth;
  const auto x = static_cast<float>(random.uniform(0.0, std::max(0.0, double{source.cols - width}) + 1e-6));
  const auto y = static_cast<float>(random.uniform(0.0, std::max(0.0, double{source.rows - height}) + 1e-6));
  constexpr float kTilt = 0.12F;  // largest shift of each corner, share of the view's size
  const auto moved = [&](float u, float v) {
    return cv::Point2f(x + width * (u + random.uniform(-kTilt, kTilt)),
                       y + height * (v + random.uniform(-kTilt, kTilt)));
  };
  const std::array<cv::Point2f, 4> from = {moved(0, 0), moved(1, 0), moved(1, 1), moved(0, 1)};
  const std::array<cv::Point2f, 4> to = {cv::Point2f(0, 0), cv::Point2f(kViewWidth, 0),
                                         cv::Point2f(kViewWidth, kViewHeight), cv::Point2f(0, kViewHeight)};
  cv::Mat view;
  cv::warpPerspective(source, view, cv::getPerspectiveTransform(from.data(), to.data()),
                      {kViewWidth, kViewHeight}, cv::INTER_LINEAR, cv::BORDER_REFLECT_101);

  view.convertTo(view, CV_32F, random.uniform(0.5, 1.1), random.uniform(-10.0, 25.0));
  if (random.uniform(0.0, 1.0) < 0.5) {
    cv::GaussianBlur(view, view, {}, random.uniform(0.4, 1.0));
  }
  cv::Mat noise(view.size(), CV_32F);
  random.fill(noise, cv::RNG::NORMAL, 0.0, random.uniform(0.5, 4.0));
  view += noise;
  view.convertTo(view, CV_8U);
  return view;
}

}  // namespace sqslam
