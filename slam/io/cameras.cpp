#include "slam/io/cameras.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libexif/exif-data.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>

#include "slam/io/foreign_cameras.h"
#include "slam/io/image_files.h"
#include "slam/io/image_header.h"
#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// ---- camera.yaml

constexpr double kMaxReadout = 100.0;  // ms

class CameraReader {
 public:
  explicit CameraReader(const std::filesystem::path& path) : path_(path) {
    try {
      root_ = ReadCameraInOwnNames(path);
      ThrowIf<InputError>(!root_.IsMap(),
                          "{}:1: expected lines 'name: value' (width, height, fx, fy, cx, cy)",
                          path.string());
    } catch (const YAML::Exception& e) {
      throw InputError("{}:{}: invalid YAML: {}", path.string(), std::max(e.mark.line, 0) + 1,
                       VisibleText(e.msg));
    }
  }

  // `otherwise`: the value if the entry is missing; without it, the entry is required.
  double Number(const std::string& key, double min, double max,
                std::optional<double> otherwise = std::nullopt) const {
    const YAML::Node node = root_[key];
    if (!node && otherwise) {
      return *otherwise;
    }
    if (!node) {
      throw InputError("{}: {} is missing, expected {}", path_.string(), key, Range(min, max));
    }
    return Checked(node, key, min, max);
  }

  double Checked(const YAML::Node& node, const std::string& key, double min, double max) const {
    double value = NAN;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !(value >= min && value <= max)) {
      throw InputError("{}: {} is {}, expected {}", Place(node), key,
                       node.IsScalar() ? node.Scalar() : "not a number", Range(min, max));
    }
    return value;
  }

  YAML::Node Optional(const std::string& key) const { return root_[key]; }

  [[noreturn]] void Fail(const YAML::Node& node, const std::string& what) const {
    throw InputError("{}: {}", Place(node), what);
  }

 private:
  // Values that were converted from another format have no line.
  std::string Place(const YAML::Node& node) const {
    const int line = node.Mark().line + 1;
    return line > 0 ? fmt::format("{}:{}", path_.string(), line) : path_.string();
  }
  static std::string Range(double min, double max) { return fmt::format("a number from {} to {}", min, max); }

  std::filesystem::path path_;
  YAML::Node root_;
};

// ---- Guessed cameras

constexpr double kFieldOfView = 60.0;  // degrees, along the longer side
// Standard deviation of the log focal length of common cameras around that of kFieldOfView, 0.87 widths: 95 %
// lie between 0.48 and 1.56 widths. Action cameras and drones have 0.5 to 0.6, phones 0.7 to 0.9, webcams and
// depth cameras 0.8 to 1.0, a phone's second lens up to 1.5.
constexpr double kCommonDeviation = 0.3;
constexpr double kExifDeviation = 0.1;  // whole millimetres of film, and pictures that were cropped a little
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

// Returns the length of the unit of the focal plane's resolution, mm.
double ResolutionUnit(ExifData& data) {
  constexpr int kCentimetre = 3;
  const std::optional<double> unit = NumberOf(data, EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT);
  return unit && static_cast<int>(*unit) == kCentimetre ? 10.0 : 25.4;
}

// Returns a photograph's focal length in mm for a 35 mm film with the same field of view, from the EXIF tag
// FocalLengthIn35mmFilm, or else from focal length and sensor resolution (FocalPlaneXResolution). Returns
// nothing if the file has neither (screenshots, videos, pictures sent by messengers).
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

CameraGuess WithFocal(int width, int height, double fps, double focal, std::string source, double deviation) {
  CameraGuess guess;
  guess.deviation = deviation;
  guess.camera = {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1), {}, fps};
  guess.source = std::move(source);
  return guess;
}

}  // namespace

Camera ReadCamera(const std::filesystem::path& path, const std::function<cv::Size()>& images) {
  const CameraReader reader(path);
  const bool states_size = reader.Optional("width") || reader.Optional("height");
  const cv::Size size = images && !states_size ? images() : cv::Size();
  const auto side = [&](const std::string& key) {
    const double value = reader.Number(key, kMinImageSide, kMaxImageSide);
    if (value != std::floor(value)) {
      reader.Fail(reader.Optional(key),
                  fmt::format("{} is {}, expected a whole number of pixels", key, value));
    }
    return static_cast<int>(value);
  };
  Camera camera;
  camera.width = size.empty() ? side("width") : size.width;
  camera.height = size.empty() ? side("height") : size.height;
  // Fields of view from 0.6 to 179 degrees: anything beyond is a mistake, not a lens.
  const double max_focal = 100.0 * std::max(camera.width, camera.height);
  camera.fx = reader.Number("fx", 0.005 * camera.width, max_focal);
  camera.fy = reader.Number("fy", 0.005 * camera.height, max_focal);
  camera.cx = reader.Number("cx", -camera.width, 2.0 * camera.width);
  camera.cy = reader.Number("cy", -camera.height, 2.0 * camera.height);
  if (const YAML::Node node = reader.Optional("distortion_model"); node) {
    if (!node.IsScalar() || (node.Scalar() != "radial-tangential" && node.Scalar() != "fisheye")) {
      reader.Fail(node, fmt::format("distortion_model is {}, expected fisheye or radial-tangential",
                                    node.IsScalar() ? node.Scalar() : "not a word"));
    }
    camera.lens = node.Scalar() == "fisheye" ? LensModel::kFisheye : LensModel::kRadialTangential;
  }
  if (const YAML::Node node = reader.Optional("distortion"); node) {
    const bool fisheye = camera.lens == LensModel::kFisheye;
    if (!node.IsSequence() || node.size() > (fisheye ? 4 : camera.distortion.size())) {
      reader.Fail(
          node, fisheye ? "distortion of a fisheye lens is not a list of at most four numbers, expected "
                          "[k1, k2, k3, k4]"
                        : "distortion is not a list of at most five numbers, expected [k1, k2, p1, p2, k3]");
    }
    for (std::size_t i = 0; i < node.size(); ++i) {
      camera.distortion[i] = reader.Checked(node[i], fmt::format("distortion[{}]", i), -1e3, 1e3);
    }
  }
  camera.fps = reader.Number("fps", 0.01, 10000.0, camera.fps);
  camera.readout_ms = reader.Number("readout_ms", -kMaxReadout, kMaxReadout, camera.readout_ms);
  return camera;
}

void WriteCamera(const std::filesystem::path& path, const Camera& camera, const std::string& comment) {
  std::string above;
  std::istringstream lines(comment);
  for (std::string line; std::getline(lines, line);) {
    above += "# " + line + "\n";
  }
  const std::string readout =
      camera.readout_ms != 0.0 ? fmt::format("readout_ms: {}\n", camera.readout_ms) : "";
  const std::array<double, 5>& d = camera.distortion;
  const std::string distortion =
      camera.lens == LensModel::kFisheye
          ? fmt::format("distortion_model: fisheye\ndistortion: [{}, {}, {}, {}]  # k1 k2 k3 k4", d[0], d[1],
                        d[2], d[3])
          : fmt::format("distortion: [{}]  # k1 k2 p1 p2 k3", fmt::join(d, ", "));
  WriteFileAtomically(path, fmt::format("{}width: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\n"
                                        "{}\nfps: {}\n{}",
                                        above, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
                                        camera.cy, distortion, camera.fps, readout));
}

std::vector<std::string> CameraPresetNames() { return ConfigNames("configs/cameras"); }

std::filesystem::path CameraFile(const std::string& file_or_preset) {
  const std::filesystem::path path = file_or_preset;
  if (path.has_parent_path() || path.has_extension() || std::filesystem::exists(path)) {
    return path;
  }
  return ConfigFile("configs/cameras", "--camera", file_or_preset);
}

CameraGuess GuessCamera(int width, int height, double fps) {
  const double half_angle = 0.5 * kFieldOfView * std::numbers::pi / 180.0;
  return WithFocal(width, height, fps, 0.5 * std::max(width, height) / std::tan(half_angle),
                   fmt::format("a field of view of {:.0f} degrees", kFieldOfView), kCommonDeviation);
}

std::optional<CameraGuess> GuessCamera(const std::filesystem::path& image, double fps) {
  const std::optional<ImageHeader> header = ReadImageHeader(image);
  if (!header) {
    return std::nullopt;
  }
  const auto [width, height] = std::pair(header->size.width, header->size.height);
  CheckImageSides(image, header->size);
  if (const std::optional<double> film = FocalLength35mm(image)) {
    // By the diagonal, as the standard defines it for aspect ratios other than the film's.
    return WithFocal(width, height, fps, *film / kFilmDiagonal * std::hypot(width, height),
                     fmt::format("the {:.4g} mm (35 mm film) of {}", *film, image.filename().string()),
                     kExifDeviation);
  }
  return GuessCamera(width, height, fps);
}

}  // namespace sqslam
