#include "slam/io/image_files.h"

#include <algorithm>
#include <array>
#include <boost/algorithm/string/case_conv.hpp>
#include <cmath>
#include <exception>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "slam/io/image_header.h"
#include "slam/util/limits.h"
#include "slam/util/statistics.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDigits = "0123456789";

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// Removes the digits at the start of `text` and returns them without leading zeros.
std::string_view TakeNumber(std::string_view& text) {
  const std::size_t length = std::min(text.find_first_not_of(kDigits), text.size());
  std::string_view digits = text.substr(0, length);
  text.remove_prefix(length);
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  return digits;
}

std::vector<fs::path> FilesWhere(const fs::path& folder, const auto& choose) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!IsHidden(entry.path()) && entry.is_regular_file() && choose(entry.path())) {
      files.push_back(entry.path());
    }
  }
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    return NumericLess(a.filename().string(), b.filename().string());
  });
  return files;
}

bool IsSide(double number) {
  return number == std::floor(number) && number >= kMinImageSide && number <= kMaxImageSide;
}

}  // namespace

bool IsHidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

bool IsImage(const fs::path& path) {
  constexpr std::array<std::string_view, 9> kExtensions = {".png", ".jpg", ".jpeg", ".bmp", ".pgm",
                                                           ".ppm", ".tif", ".tiff", ".webp"};
  const std::string extension = boost::algorithm::to_lower_copy(path.extension().string());
  return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

bool IsDepthImage(const fs::path& path) {
  const std::string stem = boost::algorithm::to_lower_copy(path.stem().string());
  return stem.ends_with("-depth") || stem.ends_with(".depth") || stem.ends_with("_depth");
}

bool NumericLess(std::string_view a, std::string_view b) {
  std::string_view left = a;
  std::string_view right = b;
  while (!left.empty() && !right.empty()) {
    if (IsDigit(left[0]) && IsDigit(right[0])) {
      const std::string_view m = TakeNumber(left);
      const std::string_view n = TakeNumber(right);
      if (m != n) {
        return m.size() != n.size() ? m.size() < n.size() : m < n;
      }
    } else if (left[0] != right[0]) {
      return static_cast<unsigned char>(left[0]) < static_cast<unsigned char>(right[0]);
    } else {
      left.remove_prefix(1);
      right.remove_prefix(1);
    }
  }
  return left.empty() != right.empty() ? left.empty() : a < b;
}

std::optional<std::int64_t> LastNumber(std::string_view name) {
  const std::size_t last = name.find_last_of(kDigits);
  if (last == std::string_view::npos) {
    return std::nullopt;
  }
  const std::size_t before = name.find_last_not_of(kDigits, last);
  const std::size_t first = before == std::string_view::npos ? 0 : before + 1;
  return ParseNumber<std::int64_t>(name.substr(first, last + 1 - first));
}

std::vector<fs::path> FilesLike(const fs::path& folder, const std::regex& name) {
  return FilesWhere(folder,
                    [&](const fs::path& file) { return std::regex_match(file.filename().string(), name); });
}

std::string NamePattern(const fs::path& path) {
  const std::string name = boost::algorithm::to_lower_copy(path.filename().string());
  std::string pattern;
  for (const char c : name) {
    if (!IsDigit(c) || !pattern.ends_with('#')) {
      pattern += IsDigit(c) ? '#' : c;
    }
  }
  return pattern;
}

std::vector<fs::path> ListColorImages(const fs::path& folder) {
  return FilesWhere(folder, [](const fs::path& file) { return IsImage(file) && !IsDepthImage(file); });
}

cv::Size ImageResize::Of(cv::Size image) const {
  const auto rounded = [](double side) { return static_cast<int>(std::lround(std::min(side, 1e9))); };
  const double share = width > 0 ? static_cast<double>(width) / image.width : scale;
  const cv::Size size(width > 0 ? width : rounded(share * image.width),
                      height > 0 ? height : rounded(share * image.height));
  ThrowIf<UsageError>(!IsSide(size.width) || !IsSide(size.height),
                      "--resize makes images of {}x{} pixels into {}x{}, expected sides from {} to {}",
                      image.width, image.height, size.width, size.height, kMinImageSide, kMaxImageSide);
  return size;
}

ImageResize ParseImageResize(const std::string& text) {
  const std::size_t comma = text.find(',');
  const std::optional<double> first = ParseNumber<double>(std::string_view(text).substr(0, comma));
  if (comma != std::string::npos) {
    const std::optional<double> second = ParseNumber<double>(std::string_view(text).substr(comma + 1));
    if (first && second && IsSide(*first) && IsSide(*second)) {
      return {static_cast<int>(*first), static_cast<int>(*second), 1.0};
    }
  } else if (first && *first > 0.0 && *first <= 1.0) {
    return {0, 0, *first};
  } else if (first && IsSide(*first)) {
    return {static_cast<int>(*first), 0, 1.0};
  }
  throw UsageError(
      "--resize {}: expected WIDTH or WIDTH,HEIGHT in pixels (from {} to {}), or a factor of at most 1", text,
      kMinImageSide, kMaxImageSide);
}

cv::Mat Resized(const cv::Mat& image, cv::Size size) {
  if (image.empty() || size.empty() || image.size() == size) {
    return image;
  }
  cv::Mat resized;
  cv::resize(image, resized, size, 0.0, 0.0, size.width < image.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
  return resized;
}

ImageFile ReadImageFile(const fs::path& path) {
  std::error_code none;
  const fs::file_status status = fs::status(path, none);
  if (!fs::is_regular_file(status)) {
    return {"", fs::exists(status) ? "is not a regular file" : "cannot be opened"};
  }
  try {
    ImageFile file{ReadFile(path, "an image"), ""};
    file.problem = file.bytes.empty() ? "is empty" : "";
    return file;
  } catch (const std::exception&) {  // too large, no permission, or a failing medium
    return {"", "cannot be read"};
  }
}

void CheckImageSides(const fs::path& path, const cv::Size& size) {
  ThrowIf<InputError>(std::min(size.width, size.height) < kMinImageSide || IsTooLarge(size),
                      "{}: {}x{} pixels, expected sides from {} to {} and at most {} in all", path.string(),
                      size.width, size.height, kMinImageSide, kMaxImageSide, kMaxImagePixels);
}

cv::Mat ReadImage(const fs::path& path, int flags) {
  return DecodeImage(ReadImageFile(path).bytes, flags).pixels;
}

std::string EncodedImage(const std::string& extension, const cv::Mat& image,
                         const std::vector<int>& parameters) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, image, bytes, parameters);
  return {bytes.begin(), bytes.end()};
}

namespace {

// Returns true for the formats that may have more than 8 bits; a PNG tells.
bool MayBeDeep(const std::string& bytes) {
  constexpr std::size_t kBitsOfPng = 24;  // byte of the header
  if (bytes.starts_with("\x89PNG")) {
    return bytes.size() > kBitsOfPng && bytes[kBitsOfPng] == 16;
  }
  return bytes.starts_with("P5") || bytes.starts_with("P6") || bytes.starts_with("II*") ||
         bytes.starts_with("MM");
}

// Ignores one value in a thousand at both ends: dead pixels and reflections.
ValueRange RangeOf(const cv::Mat& pixels) {
  constexpr double kOutliers = 0.001;
  constexpr std::size_t kMaxValues = 100000;
  cv::Mat numbers;
  pixels.reshape(1, pixels.rows).convertTo(numbers, CV_64F);
  const std::size_t step = numbers.total() / kMaxValues + 1;
  std::vector<double> values;
  for (std::size_t i = 0; i < numbers.total(); i += step) {
    const double value = numbers.ptr<double>()[i];
    if (std::isfinite(value)) {
      values.push_back(value);
    }
  }
  if (values.empty()) {
    return {};
  }
  return {LowerQuantile(values, kOutliers), LowerQuantile(values, 1.0 - kOutliers)};
}

cv::Mat InEightBits(const cv::Mat& pixels, const ValueRange& range) {
  const double scale = 255.0 / std::max(1e-9, range.white - range.black);
  cv::Mat shown;
  pixels.convertTo(shown, CV_8U, scale, -range.black * scale);
  return shown;
}

// Decodes to 8 bits.
DecodedImage DecodeInRange(const std::string& bytes, int flag, const std::optional<ValueRange>& range) {
  if (MayBeDeep(bytes)) {
    DecodedImage deep = DecodeImage(bytes, flag | cv::IMREAD_ANYDEPTH);
    if (!deep.pixels.empty() && deep.pixels.depth() != CV_8U) {
      const ValueRange used = range ? *range : RangeOf(deep.pixels);
      if (!used.IsWide() || deep.pixels.depth() != CV_16U) {
        deep.pixels = InEightBits(deep.pixels, used);
        return deep;
      }
    }
  }
  return DecodeImage(bytes, flag);
}

}  // namespace

std::optional<ValueRange> FindValueRange(const std::vector<fs::path>& images) {
  constexpr std::size_t kMaxSamples = 8;
  const std::size_t count = std::min(kMaxSamples, images.size());
  std::optional<ValueRange> range;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string bytes = ReadImageFile(images[i * images.size() / count]).bytes;
    if (bytes.empty()) {
      continue;
    }
    const cv::Mat pixels =
        MayBeDeep(bytes) ? DecodeImage(bytes, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH).pixels : cv::Mat();
    if (pixels.empty() || pixels.depth() == CV_8U) {
      return range;
    }
    const ValueRange own = RangeOf(pixels);
    range = range ? ValueRange{std::min(range->black, own.black), std::max(range->white, own.white)} : own;
  }
  return range;
}

ShownImage DecodeForFrame(const std::string& bytes, cv::Size frame, cv::ImreadModes flag,
                          const std::optional<ValueRange>& range) {
  const std::optional<ImageHeader> jpeg = JpegHeader(bytes);
  const int turns = jpeg ? QuarterTurnsTo(frame, *jpeg) : 0;
  const cv::Size turned = jpeg ? Turned(jpeg->size, turns) : cv::Size();
  if (!frame.empty() && turned.width >= 2 * frame.width && turned.height >= 2 * frame.height) {
    const int half = flag == cv::IMREAD_COLOR ? cv::IMREAD_REDUCED_COLOR_2 : cv::IMREAD_REDUCED_GRAYSCALE_2;
    return {DecodeImage(bytes, half), jpeg->size, turns};
  }
  ShownImage image{DecodeInRange(bytes, flag, range)};
  image.size = image.decoded.pixels.size();
  image.quarter_turns = QuarterTurnsTo(frame, {image.size, jpeg ? jpeg->quarter_turns : 0});
  return image;
}

cv::Mat ReadImageInSize(const std::string& path, cv::Size size, cv::ImreadModes flag,
                        const std::optional<ValueRange>& range) {
  const ShownImage image = DecodeForFrame(ReadImageFile(path).bytes, size, flag, range);
  return Resized(Turned(image.decoded.pixels, image.quarter_turns), size);
}

}  // namespace sqslam
