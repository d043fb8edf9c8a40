#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// Images to learn words from: no camera, no timestamps, nothing but pixels.
struct TrainingSource {
  std::filesystem::path path;                 // as the user named it
  std::vector<std::filesystem::path> images;  // empty for a video
  std::int64_t frames = 0;                    // of a video as its header tells, or images
};

// Lists what a sequence folder's rgb.txt names, or else all images in a folder and below (by path, depth
// images left out), one image file, or a video. Throws InputError that names the path where there is none of
// these.
TrainingSource ListTrainingImages(const std::filesystem::path& path);

// Calls `visit` with every `stride`-th image (8-bit grey). Images that cannot be read are skipped with a
// warning; InputError where none can.
void ForEachTrainingImage(const TrainingSource& source, int stride,
                          const std::function<void(const cv::Mat&)>& visit);

// A photograph that is large enough for views that differ.
bool IsLargePhotograph(const cv::Mat& image);

// A photograph as a hand-held camera of 640x480 pixels might see it: part of it, nearer or farther, tilted,
// brighter or darker, a little noisy. Decided by `seed` alone.
cv::Mat RandomView(const cv::Mat& photograph, std::uint64_t seed);

}  // namespace sqslam
