#include "slam/dense/patch_scores.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "slam/util/wide_registers.h"

namespace sqslam {
namespace {

constexpr float kMiddle = 128.0F;  // subtracted from grey values to keep sums of squares small
constexpr int kPatch = 25;         // pixels

std::vector<std::uint32_t> Corners(const cv::Mat& gray) {
  std::vector<std::uint32_t> corners(gray.total());
  std::size_t i = 0;
  for (int y = 0; y < gray.rows; ++y) {
    const std::uint8_t* row = gray.ptr<std::uint8_t>(y);
    const std::uint8_t* below = gray.ptr<std::uint8_t>(std::min(y + 1, gray.rows - 1));
    for (int x = 0; x < gray.cols; ++x, ++i) {
      const int next = std::min(x + 1, gray.cols - 1);
      corners[i] = static_cast<std::uint32_t>(row[x]) | static_cast<std::uint32_t>(row[next]) << 8U |
                   static_cast<std::uint32_t>(below[x]) << 16U |
                   static_cast<std::uint32_t>(below[next]) << 24U;
    }
  }
  return corners;
}

// The loops below run over rows of floats and are written so that compilers can vectorise them.

// Positions of a row's samples in the view. Outside, they are clamped to its border and `inside` is 0.
SQSLAM_WIDE_REGISTERS void Project(const Eigen::Matrix3f& H, const Eigen::Vector3f& epipole, int y, int width,
                                   int height, const float* __restrict columns,
                                   const float* __restrict inverse_depth, std::int32_t* __restrict places,
                                   float* __restrict right, float* __restrict down,
                                   float* __restrict inside) {
  const Eigen::Vector3f start = H.col(1) * static_cast<float>(y) + H.col(2);
  const float x0 = start.x(), y0 = start.y(), z0 = start.z();
  const float x1 = H(0, 0), y1 = H(1, 0), z1 = H(2, 0);
  const float xe = epipole.x(), ye = epipole.y(), ze = epipole.z();
  const float last_x = static_cast<float>(width) - 1.001F;
  const float last_y = static_cast<float>(height) - 1.001F;
  for (int x = 0; x < width; ++x) {
    const float z = z0 + columns[x] * z1 + inverse_depth[x] * ze;
    const float scale = 1.0F / z;
    const float u = (x0 + columns[x] * x1 + inverse_depth[x] * xe) * scale;
    const float v = (y0 + columns[x] * y1 + inverse_depth[x] * ye) * scale;
    float uc = u > 0.0F ? u : 0.0F;
    uc = uc < last_x ? uc : last_x;
    float vc = v > 0.0F ? v : 0.0F;
    vc = vc < last_y ? vc : last_y;
    const auto column = static_cast<std::int32_t>(uc);
    const auto row = static_cast<std::int32_t>(vc);
    right[x] = uc - static_cast<float>(column);
    down[x] = vc - static_cast<float>(row);
    places[x] = row * width + column;
    const float in_front = z > 0.0F ? 1.0F : 0.0F;
    const float in_row = u == uc ? in_front : 0.0F;
    inside[x] = v == vc ? in_row : 0.0F;
  }
}

SQSLAM_WIDE_REGISTERS void Gather(int width, const std::uint32_t* __restrict corners,
                                  const std::int32_t* __restrict places, std::uint32_t* __restrict found) {
  for (int x = 0; x < width; ++x) {
    found[x] = corners[places[x]];
  }
}

// Interpolates bilinearly between the gathered corners.
SQSLAM_WIDE_REGISTERS void Interpolate(int width, const std::uint32_t* __restrict found,
                                       const float* __restrict right, const float* __restrict down,
                                       float* __restrict value) {
  for (int x = 0; x < width; ++x) {
    const auto a = static_cast<float>(static_cast<std::int32_t>(found[x] & 255U));
    const auto b = static_cast<float>(static_cast<std::int32_t>(found[x] >> 8U & 255U));
    const auto c = static_cast<float>(static_cast<std::int32_t>(found[x] >> 16U & 255U));
    const auto d = static_cast<float>(static_cast<std::int32_t>(found[x] >> 24U));
    const float upper = a + right[x] * (b - a);
    const float lower = c + right[x] * (d - c);
    value[x] = upper + down[x] * (lower - upper) - kMiddle;
  }
}

// Replaces the row that leaves the patches by a new one in the column sums.
SQSLAM_WIDE_REGISTERS void Replace(int width, const float* __restrict value, const float* __restrict keyframe,
                                   float* __restrict old_value, float* __restrict old_square,
                                   float* __restrict old_product, float* __restrict values,
                                   float* __restrict squares, float* __restrict products) {
  for (int x = 0; x < width; ++x) {
    const float v = value[x];
    const float square = v * v;
    const float product = v * keyframe[x];
    values[x] += v - old_value[x];
    squares[x] += square - old_square[x];
    products[x] += product - old_product[x];
    old_value[x] = v;
    old_square[x] = square;
    old_product[x] = product;
  }
}

float PatchSum(const float* c) { return (c[0] + c[1]) + (c[2] + c[3]) + c[4]; }

SQSLAM_WIDE_REGISTERS void Correlate(int width, float noise, const float* __restrict values,
                                     const float* __restrict squares, const float* __restrict products,
                                     const float* __restrict mean, const float* __restrict inverse_sigma,
                                     const float* __restrict inside, float* __restrict score) {
  constexpr float kShare = 1.0F / kPatch;
  for (int x = 0; x < width; ++x) {
    const float v = PatchSum(values + x);
    const float variance = PatchSum(squares + x) - v * v * kShare + noise;
    const float covariance = PatchSum(products + x) - mean[x] * v;
    const float positive = variance > noise ? variance : noise;
    const float zncc = covariance * inverse_sigma[x] / std::sqrt(positive);
    score[x] = inside[x] > 0.0F ? zncc : -1.0F;
  }
}

SQSLAM_WIDE_REGISTERS void KeepBestTwo(int width, const float* __restrict score, float* __restrict best,
                                       float* __restrict second) {
  for (int x = 0; x < width; ++x) {
    const float s = score[x];
    const float b = best[x];
    const float lower = s < b ? s : b;
    best[x] = s < b ? b : s;
    second[x] = second[x] < lower ? lower : second[x];
  }
}

}  // namespace

PatchScores::PatchScores(const StereoView& keyframe, const std::vector<StereoView>& views,
                         const Camera& camera, double noise)
    : width_(camera.width),
      height_(camera.height),
      noise_(static_cast<float>(kPatch * noise * noise)),
      columns_(static_cast<std::size_t>(camera.width)) {
  const auto width = static_cast<std::size_t>(width_);
  keyframe.gray.convertTo(keyframe_, CV_32F, 1.0, -kMiddle);
  const cv::Size patch(kRows, kRows);
  cv::Mat squares;
  cv::boxFilter(keyframe_, mean_, CV_32F, patch, {-1, -1}, true, cv::BORDER_REPLICATE);
  cv::sqrBoxFilter(keyframe_, squares, CV_32F, patch, {-1, -1}, false, cv::BORDER_REPLICATE);
  cv::Mat variance = squares - kPatch * mean_.mul(mean_);
  variance = cv::max(variance, 0.0F) + noise_;
  cv::sqrt(variance, variance);
  inverse_sigma_ = 1.0F / variance;

  for (int x = 0; x < width_; ++x) {
    columns_[static_cast<std::size_t>(x)] = static_cast<float>(x);
  }
  const Eigen::Matrix3d K = camera.K();
  for (const StereoView& other : views) {
    const Rigid3d T_view_keyframe = other.T_map_camera.Inverse() * keyframe.T_map_camera;
    View view;
    view.corners = Corners(other.gray);
    view.H_0 = (K * T_view_keyframe.RotationMatrix() * K.inverse()).cast<float>();
    view.epipole = (K * T_view_keyframe.translation).cast<float>();
    for (auto* rows : {&view.value, &view.square, &view.product, &view.inside}) {
      rows->fill(std::vector<float>(width));
    }
    view.values.resize(width + 2 * kRadius);
    view.squares.resize(width + 2 * kRadius);
    view.products.resize(width + 2 * kRadius);
    views_.push_back(std::move(view));
  }
  places_.resize(width);
  found_.resize(width);
  for (auto* row : {&right_, &down_, &best_, &second_, &score_}) {
    row->resize(width);
  }
}

void PatchScores::Restart() {
  for (View& view : views_) {
    for (auto* rows : {&view.value, &view.square, &view.product}) {
      for (std::vector<float>& row : *rows) {
        std::ranges::fill(row, 0.0F);
      }
    }
    for (auto* sums : {&view.values, &view.squares, &view.products}) {
      std::fill(sums->begin(), sums->end(), 0.0F);
    }
  }
}

void PatchScores::Sample(View& view, int y, int slot, const float* inverse_depth) {
  const auto s = static_cast<std::size_t>(slot);
  Project(view.H_0, view.epipole, y, width_, height_, columns_.data(), inverse_depth, places_.data(),
          right_.data(), down_.data(), view.inside[s].data());
  Gather(width_, view.corners.data(), places_.data(), found_.data());
  Interpolate(width_, found_.data(), right_.data(), down_.data(), score_.data());
}

void PatchScores::Take(int y, const float* inverse_depth) {
  const int slot = y % kRows;
  const auto s = static_cast<std::size_t>(slot);
  const float* keyframe = keyframe_.ptr<float>(std::min(y, height_ - 1));
  for (View& view : views_) {
    if (inverse_depth != nullptr) {
      Sample(view, y, slot, inverse_depth);
    } else {
      score_ = view.value[static_cast<std::size_t>((y + kRows - 1) % kRows)];
    }
    const auto take = [&](std::size_t into) {
      Replace(width_, score_.data(), keyframe, view.value[into].data(), view.square[into].data(),
              view.product[into].data(), view.values.data() + kRadius, view.squares.data() + kRadius,
              view.products.data() + kRadius);
    };
    take(s);
    for (int above = 1; y == 0 && above <= kRadius; ++above) {  // replicates the first row above the image
      take(static_cast<std::size_t>(kRows - above));
    }
    for (auto* sums : {&view.values, &view.squares, &view.products}) {
      std::fill_n(sums->begin(), kRadius, (*sums)[kRadius]);
      std::fill_n(sums->end() - kRadius, kRadius, *(sums->end() - kRadius - 1));
    }
  }
}

const float* PatchScores::Scores(int y) {
  std::ranges::fill(best_, -1.0F);
  std::ranges::fill(second_, -1.0F);
  for (const View& view : views_) {
    Correlate(width_, noise_, view.values.data(), view.squares.data(), view.products.data(),
              mean_.ptr<float>(y), inverse_sigma_.ptr<float>(y),
              view.inside[static_cast<std::size_t>(y % kRows)].data(), score_.data());
    KeepBestTwo(width_, score_.data(), best_.data(), second_.data());
  }
  for (std::size_t x = 0; x < best_.size(); ++x) {
    score_[x] = 0.5F * (best_[x] + second_[x]);
  }
  return score_.data();
}

}  // namespace sqslam
