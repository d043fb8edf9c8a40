#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// Images to train a vocabulary from: only pixels, no camera and no timestamps.
struct TrainingSource {
  std::filesystem::path path;                 // as the user named it
  std::vector<std::filesystem::path> images;  // empty for a video
  std::int64_t frames = 0;                    // number of images, or of a video's frames by its header
};

// Lists the images in a sequence folder's rgb.txt, or else all images in and below a folder (by path, without
// depth images), one image file, or a video. Throws InputError that names the path if it is none of these.
TrainingSource ListTrainingImages(const std::filesystem::path& path);

// Calls `visit` with every `stride`-th image (8-bit grey). Skips unreadable images with a warning; throws
// InputError if none is readable.
void ForEachTrainingImage(const TrainingSource& source, int stride,
                          const std::function<void(const cv::Mat&)>& visit);

// Returns true if a photograph is large enough for several different views.
bool IsLargePhotograph(const cv::Mat& image);

// Returns a photograph as a hand-held camera of 640x480 pixels might see it: part of it, nearer or farther,
// tilted, brighter or darker, slightly noisy. Determined by `seed` alone.
cv::Mat RandomView(const cv::Mat& photograph, std::uint64_t seed);

}  // namespace sqslam
