#include "render/picture/picture_text.h"

#include <vtkFreeTypeTools.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

cv::Point Fixed(cv::Point2d p) {
  return {static_cast<int>(std::lround(p.x * (1 << kFractionalBits))),
          static_cast<int>(std::lround(p.y * (1 << kFractionalBits)))};
}

// Blends a shape into the image. `draw` draws it into a mask of the area around it, relative to an origin.
void BlendShape(cv::Mat& image, cv::Point2d low, cv::Point2d high, double margin,
                const Eigen::Vector3d& color, double opacity, const auto& draw) {
  const cv::Rect area =
      (PixelsAround(low, high, margin) + cv::Size(1, 1)) & cv::Rect(0, 0, image.cols, image.rows);
  if (!area.empty()) {
    cv::Mat coverage = cv::Mat::zeros(area.size(), CV_8UC1);
    draw(coverage, cv::Point2d(area.tl()));
    Blend(image, coverage, area.tl(), color, opacity);
  }
}

int WholePixels(double width) { return std::max(1, static_cast<int>(std::lround(width))); }

// Returns the coverage of one line of text. All lines of one size have the same height, so that baselines
// agree.
cv::Mat Rasterize(const std::string& text, int pixels) {
  // All threads share VTK's fonts; pictures and pages of a video are drawn on different threads.
  static std::mutex fonts;
  const std::lock_guard lock(fonts);
  const vtkNew<vtkTextProperty> property;
  constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
  if (std::filesystem::exists(kFont)) {
    property->SetFontFamily(VTK_FONT_FILE);
    property->SetFontFile(kFont);
  } else {  // VTK carries a sans-serif font of its own
    property->SetFontFamilyToArial();
  }
  property->SetFontSize(pixels);
  property->SetColor(1.0, 1.0, 1.0);
  property->SetUseTightBoundingBox(0);
  const vtkNew<vtkImageData> rendered;
  int size[2] = {0, 0};
  constexpr int kDotsPerInch = 72;  // one point is one pixel
  vtkFreeTypeTools* tools = vtkFreeTypeTools::GetInstance();
  tools->ScaleToPowerTwoOff();
  if (text.empty() || !tools->RenderString(property, vtkStdString(text), kDotsPerInch, rendered, size)) {
    return cv::Mat::zeros(pixels, 1, CV_8UC1);
  }
  const int* dimensions = rendered->GetDimensions();
  const cv::Mat rgba(dimensions[1], dimensions[0], CV_8UC4, rendered->GetScalarPointer());
  cv::Mat coverage;
  cv::extractChannel(rgba, coverage, 3);
  cv::flip(coverage, coverage, 0);
  return coverage;
}

}  // namespace

cv::Scalar ToBgr(const Eigen::Vector3d& color) {
  return {255.0 * color.z(), 255.0 * color.y(), 255.0 * color.x()};
}

cv::Rect PixelsAround(cv::Point2d low, cv::Point2d high, double margin) {
  return {
      cv::Point(static_cast<int>(std::floor(low.x - margin)), static_cast<int>(std::floor(low.y - margin))),
      cv::Point(static_cast<int>(std::ceil(high.x + margin)), static_cast<int>(std::ceil(high.y + margin)))};
}

void Blend(cv::Mat& image, const cv::Mat& coverage, cv::Point origin, const Eigen::Vector3d& color,
           double opacity) {
  const cv::Rect area = cv::Rect(origin, coverage.size()) & cv::Rect(0, 0, image.cols, image.rows);
  const int channels = image.channels();
  const cv::Scalar bgr = ToBgr(color);
  for (int y = area.y; y < area.y + area.height; ++y) {
    const auto* mask = coverage.ptr<std::uint8_t>(y - origin.y) + (area.x - origin.x);
    auto* pixel = image.ptr<std::uint8_t>(y) + channels * area.x;
    for (int x = 0; x < area.width; ++x, pixel += channels) {
      const double over = opacity * mask[x] / 255.0;
      if (over <= 0.0) {
        continue;
      }
      const double under = (channels == 4 ? pixel[3] / 255.0 : 1.0) * (1.0 - over);
      const double total = over + under;
      for (int c = 0; c < 3; ++c) {
        pixel[c] = cv::saturate_cast<std::uint8_t>((over * bgr[c] + under * pixel[c]) / total);
      }
      if (channels == 4) {
        pixel[3] = cv::saturate_cast<std::uint8_t>(255.0 * total);
      }
    }
  }
}

void DrawLine(cv::Mat& image, cv::Point2d from, cv::Point2d to, double width, const Eigen::Vector3d& color,
              double opacity) {
  const cv::Point2d low(std::min(from.x, to.x), std::min(from.y, to.y));
  const cv::Point2d high(std::max(from.x, to.x), std::max(from.y, to.y));
  BlendShape(image, low, high, width + 2.0, color, opacity, [&](cv::Mat& mask, const cv::Point2d& origin) {
    cv::line(mask, Fixed(from - origin), Fixed(to - origin), cv::Scalar(255), WholePixels(width), cv::LINE_AA,
             kFractionalBits);
  });
}

void DrawPanel(cv::Mat& image, const cv::Rect& area, double radius, const Eigen::Vector3d& color,
               double opacity) {
  const cv::Rect shown = area & cv::Rect(0, 0, image.cols, image.rows);
  if (shown.empty()) {
    return;
  }
  cv::Mat coverage(shown.size(), CV_8UC1);
  const double r = std::min(radius, 0.5 * std::min(area.width, area.height));
  for (int row = 0; row < shown.height; ++row) {
    const int y = shown.y - area.y + row;
    for (int column = 0; column < shown.width; ++column) {
      const int x = shown.x - area.x + column;
      const double dx = std::max({r - (x + 0.5), x + 0.5 - (area.width - r), 0.0});
      const double dy = std::max({r - (y + 0.5), y + 0.5 - (area.height - r), 0.0});
      const double inside = std::clamp(r - std::hypot(dx, dy) + 0.5, 0.0, 1.0);
      coverage.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(std::lround(255.0 * (r > 0.0 ? inside : 1.0)));
    }
  }
  Blend(image, coverage, shown.tl(), color, opacity);
}

void DrawFrame(cv::Mat& image, const cv::Rect& area, double width, const Eigen::Vector3d& color,
               double opacity) {
  BlendShape(image, area.tl(), area.br(), width + 2.0, color, opacity,
             [&](cv::Mat& mask, const cv::Point& origin) {
               cv::rectangle(mask, cv::Rect(area.tl() - origin, area.size()), cv::Scalar(255),
                             WholePixels(width), cv::LINE_AA);
             });
}

const cv::Mat& TextPainter::Coverage(const std::string& text, double size) const {
  const int pixels = std::max(4, static_cast<int>(std::lround(size)));
  const auto key = std::make_pair(text, pixels);
  const auto found = lines_.find(key);
  if (found != lines_.end()) {
    return found->second;
  }
  if (lines_.size() > 2000) {
    lines_.clear();
  }
  return lines_[key] = Rasterize(text, pixels);
}

void TextPainter::Draw(cv::Mat& image, const std::string& text, cv::Point anchor, double size,
                       const Eigen::Vector3d& color, Align align,
                       const std::optional<Eigen::Vector3d>& halo) const {
  const cv::Mat& coverage = Coverage(text, size);
  const int left = align == Align::kLeft ? 0 : align == Align::kCenter ? coverage.cols / 2 : coverage.cols;
  const cv::Point origin(anchor.x - left, anchor.y - coverage.rows / 2);
  if (halo) {
    const int border = std::max(2, static_cast<int>(std::lround(0.2 * size)));
    cv::Mat soft;
    cv::copyMakeBorder(coverage, soft, border, border, border, border, cv::BORDER_CONSTANT, cv::Scalar(0));
    cv::dilate(soft, soft, cv::getStructuringElement(cv::MORPH_ELLIPSE, {border + 1, border + 1}));
    cv::GaussianBlur(soft, soft, {}, 0.3 * border);
    Blend(image, soft, origin - cv::Point(border, border), *halo, 0.85);
  }
  Blend(image, coverage, origin, color);
}

}  // namespace sqslam
