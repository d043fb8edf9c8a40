#include "slam/io/exif.h"

#include <libexif/exif-data.h>

#include <cmath>
#include <memory>

namespace sqslam {
namespace {

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

}  // namespace

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

}  // namespace sqslam
