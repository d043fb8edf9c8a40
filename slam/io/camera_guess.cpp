#include "slam/io/camera_guess.h"

#include <fmt/format.h>
#include <libexif/exif-data.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

namespace sqslam {
namespace {

constexpr double kFieldOfView = 60.0;      // degrees, along the longer side
constexpr double kFilmDiagonal = 43.2666;  // mm, of the 36 x 24 of 35 mm film

struct Unref {
  void operator()(ExifData* data) const { exif_data_unref(data); }
};

std::optional<double> NumberOf(ExifData& data, ExifTag tag) {
  ExifEntry* const entry = exif_content_get_entry(data.ifd[EXIF_IFD_EXIF], tag);
  if (entry == nullptr || entry->data == nullptr || entry->size < exif_format_get_size(entry->format)) {
    return std::nullopt;
  }
  const ExifByteOrder order = exif_data_get_byte_order(&data);
  double number = 0.0;
  if (entry->format == EXIF_FORMAT_SHORT) {
    number = exif_get_short(entry->data, order);
  } else if (entry->format == EXIF_FORMAT_LONG) {
    number = exif_get_long(entry->data, order);
  } else if (entry->format == EXIF_FORMAT_RATIONAL) {
    const ExifRational ratio = exif_get_rational(entry->data, order);
    number = ratio.denominator == 0 ? 0.0 : static_cast<double>(ratio.numerator) / ratio.denominator;
  }
  return number > 0.0 ? std::optional(number) : std::nullopt;
}

// Length of one unit of the focal plane's resolution, mm.
double ResolutionUnit(ExifData& data) {
  constexpr int kCentimetre = 3;
  const std::optional<double> unit = NumberOf(data, EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT);
  return unit && static_cast<int>(*unit) == kCentimetre ? 10.0 : 25.4;
}

// The focal length that a photograph's EXIF gives for a 35 mm film of the same field of view, mm: the tag
// FocalLengthIn35mmFilm, else the focal length itself with the sensor's resolution (FocalPlaneXResolution).
// Empty where the file has neither (screenshots, videos, pictures sent by messengers).
std::optional<double> FocalLength35mm(const std::filesystem::path& image) {
  const std::unique_ptr<ExifData, Unref> data(exif_data_new_from_file(image.c_str()));
  if (!data) {
    return std::nullopt;
  }
  if (const auto focal = NumberOf(*data, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM)) {
    return focal;
  }
  const auto focal = NumberOf(*data, EXIF_TAG_FOCAL_LENGTH);
  const auto resolution = NumberOf(*data, EXIF_TAG_FOCAL_PLANE_X_RESOLUTION);
  const auto width = NumberOf(*data, EXIF_TAG_PIXEL_X_DIMENSION);
  const auto height = NumberOf(*data, EXIF_TAG_PIXEL_Y_DIMENSION);
  if (!focal || !resolution || !width || !height) {
    return std::nullopt;
  }
  const double sensor_diagonal = std::hypot(*width, *height) / *resolution * ResolutionUnit(*data);
  return *focal * kFilmDiagonal / sensor_diagonal;
}

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
    // The diagonal counts, as the standard has it for pictures of other proportions than the film's.
    return WithFocal(read.cols, read.rows, fps, *film / kFilmDiagonal * std::hypot(read.cols, read.rows),
                     fmt::format("the {:.4g} mm (35 mm film) of {}", *film, image.filename().string()));
  }
  return GuessCamera(read.cols, read.rows, fps);
}

}  // namespace sqslam
