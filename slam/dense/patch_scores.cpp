#include "slam/dense/patch_scores.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "slam/util/wide_registers.h"

namespace sqslam {
namespace {

constexpr float kMiddle = 128.0F;  // subtracted from grey values to keep sums of squares small
constexpr int kRadius = 2;         // pixels, of a patch
constexpr int kSide = 2 * kRadius + 1;
constexpr int kPatch = kSide * kSide;  // pixels

std::vector<std::uint32_t> Corners(const cv::Mat& gray) {
  std::vector<std::uint32_t> corners;
  for (int y = 0; y < gray.rows; ++y) {
    const std::uint8_t* row = gray.ptr<std::uint8_t>(y);
    const std::uint8_t* below = gray.ptr<std::uint8_t>(std::min(y + 1, gray.rows - 1));
    for (int x = 0; x < gray.cols; ++x) {
      const int next = std::min(x + 1, gray.cols - 1);
      corners.push_back(static_cast<std::uint32_t>(row[x]) | static_cast<std::uint32_t>(row[next]) << 8U |
                        static_cast<std::uint32_t>(below[x]) << 16U |
                        static_cast<std::uint32_t>(below[next]) << 24U);
    }
  }
  return corners;
}

// The loops below run over rows of floats and are written so that compilers can vectorise them.

// Positions of a row's samples in the view. Outside, they are clamped to its border and `inside` is 0.
SQSLAM_WIDE_REGISTERS void ProjectRow(const Eigen::Matrix3f& H, const Eigen::Vector3f& epipole, int y,
                                      int width, int height, const float* __restrict inverse_depth,
                                      std::int32_t* __restrict places, float* __restrict right,
                                      float* __restrict down, float* __restrict inside) {
  const Eigen::Vector3f start = H.col(1) * static_cast<float>(y) + H.col(2);
  const float x0 = start.x(), y0 = start.y(), z0 = start.z();
  const float x1 = H(0, 0), y1 = H(1, 0), z1 = H(2, 0);
  const float xe = epipole.x(), ye = epipole.y(), ze = epipole.z();
  const float last_x = static_cast<float>(width) - 1.001F;
  const float last_y = static_cast<float>(height) - 1.001F;
  for (int x = 0; x < width; ++x) {
    const auto column = static_cast<float>(x);
    const float z = z0 + column * z1 + inverse_depth[x] * ze;
    const float scale = 1.0F / z;
    const float u = (x0 + column * x1 + inverse_depth[x] * xe) * scale;
    const float v = (y0 + column * y1 + inverse_depth[x] * ye) * scale;
    float uc = u > 0.0F ? u : 0.0F;
    uc = uc < last_x ? uc : last_x;
    float vc = v > 0.0F ? v : 0.0F;
    vc = vc < last_y ? vc : last_y;
    const auto left = static_cast<std::int32_t>(uc);
    const auto top = static_cast<std::int32_t>(vc);
    right[x] = uc - static_cast<float>(left);
    down[x] = vc - static_cast<float>(top);
    places[x] = top * width + left;
    const float in_front = z > 0.0F ? 1.0F : 0.0F;
    const float in_row = u == uc ? in_front : 0.0F;
    inside[x] = v == vc ? in_row : 0.0F;
  }
}

// Interpolates bilinearly between the corners at these places.
SQSLAM_WIDE_REGISTERS void InterpolateRow(int width, const std::uint32_t* __restrict corners,
                                          const std::int32_t* __restrict places,
                                          const float* __restrict right, const float* __restrict down,
                                          float* __restrict value) {
  for (int x = 0; x < width; ++x) {
    const std::uint32_t found = corners[places[x]];
    const auto a = static_cast<float>(static_cast<std::int32_t>(found & 255U));
    const auto b = static_cast<float>(static_cast<std::int32_t>(found >> 8U & 255U));
    const auto c = static_cast<float>(static_cast<std::int32_t>(found >> 16U & 255U));
    const auto d = static_cast<float>(static_cast<std::int32_t>(found >> 24U));
    const float upper = a + right[x] * (b - a);
    const float lower = c + right[x] * (d - c);
    value[x] = upper + down[x] * (lower - upper) - kMiddle;
  }
}

// Moves the patches of the column sums down by a row: adds one and removes another.
SQSLAM_WIDE_REGISTERS void MoveDown(int width, const float* __restrict value,
                                    const float* __restrict keyframe, const float* __restrict old_value,
                                    const float* __restrict old_keyframe, float* __restrict values,
                                    float* __restrict squares, float* __restrict products) {
  for (int x = 0; x < width; ++x) {
    values[x] += value[x] - old_value[x];
    squares[x] += value[x] * value[x] - old_value[x] * old_value[x];
    products[x] += value[x] * keyframe[x] - old_value[x] * old_keyframe[x];
  }
}

float PatchSum(const float* c) { return (c[0] + c[1]) + (c[2] + c[3]) + c[4]; }

// Correlates a row of patches and keeps the best two scores of each pixel.
SQSLAM_WIDE_REGISTERS void CorrelateRow(int width, float noise, const float* __restrict values,
                                        const float* __restrict squares, const float* __restrict products,
                                        const float* __restrict mean, const float* __restrict inverse_sigma,
                                        const float* __restrict inside, float* __restrict best,
                                        float* __restrict second) {
  constexpr float kShare = 1.0F / kPatch;
  for (int x = 0; x < width; ++x) {
    const float v = PatchSum(values + x);
    const float variance = PatchSum(squares + x) - v * v * kShare + noise;
    const float covariance = PatchSum(products + x) - mean[x] * v;
    const float positive = variance > noise ? variance : noise;
    const float zncc = covariance * inverse_sigma[x] / std::sqrt(positive);
    const float score = inside[x] > 0.0F ? zncc : -1.0F;
    const float b = best[x];
    const float lower = score < b ? score : b;
    best[x] = score < b ? b : score;
    second[x] = second[x] < lower ? lower : second[x];
  }
}

}  // namespace

PatchScores::PatchScores(const StereoView& keyframe, const std::vector<StereoView>& views,
                         const Camera& camera, double noise)
    : noise_(static_cast<float>(kPatch * noise * noise)),
      value_(camera.height, camera.width, CV_32F),
      inside_(value_.size(), CV_32F) {
  keyframe.gray.convertTo(keyframe_, CV_32F, 1.0, -kMiddle);
  const cv::Size patch(kSide, kSide);
  cv::Mat squares;
  cv::boxFilter(keyframe_, mean_, CV_32F, patch, {-1, -1}, true, cv::BORDER_REPLICATE);
  cv::sqrBoxFilter(keyframe_, squares, CV_32F, patch, {-1, -1}, false, cv::BORDER_REPLICATE);
  cv::Mat variance = squares - kPatch * mean_.mul(mean_);
  variance = cv::max(variance, 0.0F) + noise_;
  cv::sqrt(variance, variance);
  inverse_sigma_ = 1.0F / variance;
  const Eigen::Matrix3d K = camera.K();
  for (const StereoView& other : views) {
    const Rigid3d T_view_keyframe = other.T_map_camera.Inverse() * keyframe.T_map_camera;
    views_.push_back({Corners(other.gray), (K * T_view_keyframe.RotationMatrix() * K.inverse()).cast<float>(),
                      (K * T_view_keyframe.translation).cast<float>()});
  }
}

void PatchScores::ScoreView(const View& view, const cv::Mat& inverse_depth, cv::Mat& best, cv::Mat& second) {
  const int width = value_.cols;
  const int height = value_.rows;
  std::vector<std::int32_t> places(static_cast<std::size_t>(width));
  std::vector<float> right(places.size()), down(places.size());
  for (int y = 0; y < height; ++y) {
    ProjectRow(view.H_0, view.epipole, y, width, height, inverse_depth.ptr<float>(y), places.data(),
               right.data(), down.data(), inside_.ptr<float>(y));
    InterpolateRow(width, view.corners.data(), places.data(), right.data(), down.data(),
                   value_.ptr<float>(y));
  }
  // Column sums of the patches around a row, padded by kRadius on each side.
  std::array<std::vector<float>, 3> sums;
  sums.fill(std::vector<float>(places.size() + 2 * kRadius));
  auto& [values, squares, products] = sums;
  const cv::Mat none = cv::Mat::zeros(1, width, CV_32F);
  for (int y = -kRadius; y < height + kRadius; ++y) {  // replicates the rows at the borders
    const int added = std::clamp(y, 0, height - 1);
    const int removed = std::clamp(y - kSide, 0, height - 1);
    const bool full = y > kRadius;
    MoveDown(width, value_.ptr<float>(added), keyframe_.ptr<float>(added),
             full ? value_.ptr<float>(removed) : none.ptr<float>(),
             full ? keyframe_.ptr<float>(removed) : none.ptr<float>(), values.data() + kRadius,
             squares.data() + kRadius, products.data() + kRadius);
    if (const int row = y - kRadius; row >= 0) {
      for (std::vector<float>& sum : sums) {  // replicates the columns at the borders
        std::fill_n(sum.begin(), kRadius, sum[kRadius]);
        std::fill_n(sum.end() - kRadius, kRadius, *(sum.end() - kRadius - 1));
      }
      CorrelateRow(width, noise_, values.data(), squares.data(), products.data(), mean_.ptr<float>(row),
                   inverse_sigma_.ptr<float>(row), inside_.ptr<float>(row), best.ptr<float>(row),
                   second.ptr<float>(row));
    }
  }
}

cv::Mat PatchScores::At(const cv::Mat& inverse_depth) {
  cv::Mat best(value_.size(), CV_32F, cv::Scalar(-1.0));
  cv::Mat second = best.clone();
  for (const View& view : views_) {
    ScoreView(view, inverse_depth, best, second);
  }
  return 0.5 * (best + second);
}

}  // namespace sqslam
