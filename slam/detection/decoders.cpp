#include "slam/detection/decoders.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "slam/util/error.h"

namespace sqslam {
namespace {

void CheckShape(const cv::Mat& blob, std::initializer_list<int> expected, const char* decoder) {
  const bool fits = blob.type() == CV_32F && blob.dims == static_cast<int>(expected.size()) &&
                    std::equal(expected.begin(), expected.end(), blob.size.p);
  if (!fits) {
    throw InputError(
        "the network's output is {}, expected {} for the decoder '{}' (other decoder, other input size, or "
        "another number of classes?)",
        fmt::join(blob.size.p, blob.size.p + blob.dims, "x"), fmt::join(expected, "x"), decoder);
  }
}

// Returns index and value of the largest of `count` numbers with stride `step`.
std::pair<int, float> Largest(const float* values, int count, std::ptrdiff_t step) {
  int best = 0;
  for (int i = 1; i < count; ++i) {
    best = values[i * step] > values[best * step] ? i : best;
  }
  return {best, values[best * step]};
}

ScoredBox Centered(double x, double y, double width, double height, int class_number, double score) {
  return {{x - 0.5 * width, y - 0.5 * height, width, height}, class_number, score};
}

}  // namespace

std::vector<ScoredBox> DecodeYolox(const cv::Mat& output, cv::Size input, int classes, double threshold) {
  constexpr std::array<int, 3> kStrides = {8, 16, 32};
  int cells = 0;
  for (const int stride : kStrides) {
    cells += (input.width / stride) * (input.height / stride);
  }
  CheckShape(output, {1, cells, 5 + classes}, "yolox");
  std::vector<ScoredBox> boxes;
  const auto* cell = output.ptr<float>();
  for (const int stride : kStrides) {
    for (int y = 0; y < input.height / stride; ++y) {
      for (int x = 0; x < input.width / stride; ++x, cell += 5 + classes) {
        if (cell[4] < threshold) {  // a class score is at most 1
          continue;
        }
        const auto [number, class_score] = Largest(cell + 5, classes, 1);
        const double score = static_cast<double>(cell[4]) * class_score;
        if (score >= threshold) {
          boxes.push_back(Centered((cell[0] + x) * stride, (cell[1] + y) * stride, std::exp(cell[2]) * stride,
                                   std::exp(cell[3]) * stride, number, std::min(score, 1.0)));
        }
      }
    }
  }
  return boxes;
}

std::vector<ScoredBox> DecodeCenterNet(const cv::Mat& heatmap, const cv::Mat& sides, cv::Size input,
                                       int classes, double threshold, int count) {
  constexpr int kStride = 4;
  const int rows = input.height / kStride;
  const int columns = input.width / kStride;
  CheckShape(heatmap, {1, classes, rows, columns}, "centernet");
  CheckShape(sides, {1, 4, rows, columns}, "centernet");
  const std::ptrdiff_t plane = static_cast<std::ptrdiff_t>(rows) * columns;
  const auto* scores = heatmap.ptr<float>();
  const auto* distances = sides.ptr<float>();
  std::vector<ScoredBox> boxes;
  for (int c = 0; c < classes; ++c) {
    const float* of_class = scores + c * plane;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        const float score = of_class[y * columns + x];
        if (score < threshold) {
          continue;
        }
        bool peak = true;
        for (int v = std::max(0, y - 1); v <= std::min(rows - 1, y + 1); ++v) {
          for (int u = std::max(0, x - 1); u <= std::min(columns - 1, x + 1); ++u) {
            peak &= of_class[v * columns + u] <= score;
          }
        }
        if (peak) {
          const float* at = distances + y * columns + x;
          const double left = kStride * x - at[0];
          const double top = kStride * y - at[plane];
          boxes.push_back({{left, top, kStride * x + at[2 * plane] - left, kStride * y + at[3 * plane] - top},
                           c,
                           std::min(1.0, static_cast<double>(score))});
        }
      }
    }
  }
  std::ranges::stable_sort(boxes, std::greater{}, &ScoredBox::score);
  boxes.resize(std::min(boxes.size(), static_cast<std::size_t>(count)));
  return boxes;
}

std::vector<ScoredBox> DecodeYoloV8(const cv::Mat& output, int classes, double threshold) {
  const int columns = output.dims == 3 ? output.size[2] : 0;
  CheckShape(output, {1, 4 + classes, columns}, "yolov8");
  const auto* values = output.ptr<float>();
  const auto at = [&](int row, int i) {
    return static_cast<double>(values[static_cast<std::ptrdiff_t>(row) * columns + i]);
  };
  std::vector<ScoredBox> boxes;
  for (int i = 0; i < columns; ++i) {
    const auto [number, score] =
        Largest(values + static_cast<std::ptrdiff_t>(4) * columns + i, classes, columns);
    if (score >= threshold) {
      boxes.push_back(Centered(at(0, i), at(1, i), at(2, i), at(3, i), number,
                               std::min(1.0, static_cast<double>(score))));
    }
  }
  return boxes;
}

std::vector<ScoredBox> SuppressNonMaxima(std::vector<ScoredBox> boxes, double iou) {
  std::ranges::stable_sort(boxes, std::greater{}, &ScoredBox::score);
  std::vector<ScoredBox> kept;
  for (const ScoredBox& box : boxes) {
    const bool suppressed = std::ranges::any_of(kept, [&](const ScoredBox& stronger) {
      return stronger.class_number == box.class_number && IoU(stronger.box, box.box) > iou;
    });
    if (!suppressed) {
      kept.push_back(box);
    }
  }
  return kept;
}

Letterbox::Letterbox(cv::Size image, cv::Size input)
    : image_(image),
      input_(input),
      scale_(std::min(static_cast<double>(input.width) / image.width,
                      static_cast<double>(input.height) / image.height)) {}

cv::Mat Letterbox::Fill(const cv::Mat& bgr) const {
  if (bgr.size() == input_) {
    return bgr;
  }
  constexpr double kGrey = 114.0;
  cv::Mat filled(input_, CV_8UC3, cv::Scalar::all(kGrey));
  const cv::Size inner(std::clamp(static_cast<int>(std::lround(scale_ * image_.width)), 1, input_.width),
                       std::clamp(static_cast<int>(std::lround(scale_ * image_.height)), 1, input_.height));
  cv::resize(bgr, filled(cv::Rect({0, 0}, inner)), inner, 0.0, 0.0,
             scale_ < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
  return filled;
}

Box2d Letterbox::ToImage(const Box2d& box) const {
  const double left = std::clamp(box.x / scale_, 0.0, static_cast<double>(image_.width));
  const double top = std::clamp(box.y / scale_, 0.0, static_cast<double>(image_.height));
  const double right = std::clamp((box.x + box.width) / scale_, 0.0, static_cast<double>(image_.width));
  const double bottom = std::clamp((box.y + box.height) / scale_, 0.0, static_cast<double>(image_.height));
  return {left, top, right - left, bottom - top};
}

}  // namespace sqslam
