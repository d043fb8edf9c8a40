#include "slam/io/camera_guess.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "slam/io/exif.h"

namespace sqslam {
namespace {

constexpr double kFieldOfView = 60.0;  // degrees, along the longer side

CameraGuess WithFocal(int width, int height, double fps, double focal, std::string source) {
  CameraGuess guess;
  guess.camera = {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1), {}, fps};
  guess.source = std::move(source);
  return guess;
}

}  // namespace

CameraGuess GuessCamera(int width, int height, double fps) {
  const double half_angle = 0.5 * kFieldOfView * std::numbers::pi / 180.0;
  return WithFocal(width, height, fps, 0.5 * std::max(width, height) / std::tan(half_angle),
                   fmt::format("a field of view of {:.0f} degrees", kFieldOfView));
}

std::optional<CameraGuess> GuessCamera(const std::filesystem::path& image, double fps) {
  const cv::Mat read = cv::imread(image.string(), cv::IMREAD_COLOR);  // turned as its EXIF says
  if (read.empty()) {
    return std::nullopt;
  }
  if (const std::optional<double> film = FocalLength35mm(image)) {
    // By the diagonal, as the standard has it for pictures of other proportions than the film's.
    return WithFocal(read.cols, read.rows, fps, *film / kFilmDiagonal * std::hypot(read.cols, read.rows),
                     fmt::format("the {:.4g} mm (35 mm film) of {}", *film, image.filename().string()));
  }
  return GuessCamera(read.cols, read.rows, fps);
}

}  // namespace sqslam
