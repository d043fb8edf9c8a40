#include "render/page/write_figure.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

void AppendBigEndian(std::string& bytes, std::uint32_t value) {
  for (const unsigned shift : {24u, 16u, 8u, 0u}) {
    bytes += static_cast<char>((value >> shift) & 255u);
  }
}

// Adds a pHYs chunk (pixels a metre), which OpenCV cannot write, behind the header chunk.
std::string WithDensity(const std::vector<std::uint8_t>& png, double dpi) {
  constexpr std::size_t kHeaderEnd = 8 + 25;  // signature and IHDR
  constexpr double kInchesPerMetre = 1.0 / 0.0254;
  const auto per_metre = static_cast<std::uint32_t>(std::lround(dpi * kInchesPerMetre));
  std::string body = "pHYs";
  AppendBigEndian(body, per_metre);
  AppendBigEndian(body, per_metre);
  body += '\1';  // the unit is the metre
  std::string out(png.begin(), png.begin() + kHeaderEnd);
  AppendBigEndian(out, static_cast<std::uint32_t>(body.size() - 4));
  out += body;
  AppendBigEndian(out, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(body.data()),
                                                        static_cast<uInt>(body.size()))));
  out.append(png.begin() + kHeaderEnd, png.end());
  return out;
}

}  // namespace

void CheckFigurePath(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".png" && extension != ".svg" && extension != ".pdf") {
    throw UsageError(
        fmt::format("--output {}: expected a name that ends in .png, .svg or .pdf", path.string()));
  }
}

std::string EncodeFigure(const FigurePage& page, const std::filesystem::path& path) {
  CheckFigurePath(path);
  if (path.extension() == ".svg") {
    return PageToSvg(page);
  }
  if (path.extension() == ".pdf") {
    return PageToPdf(page);
  }
  std::vector<std::uint8_t> png;
  cv::imencode(".png", PageToPixels(page), png, {cv::IMWRITE_PNG_COMPRESSION, 9});
  return WithDensity(png, page.dpi);
}

void WriteFigure(const FigurePage& page, const std::filesystem::path& path) {
  WriteFileAtomically(path, EncodeFigure(page, path));
}

}  // namespace sqslam
