#include "slam/features/patch_descriptor.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/features/brief_pattern.h"

namespace sqslam {
namespace {

constexpr int kLanes = 8;                         // numbers of 16 bits
constexpr int kRowLength = 2 * kPatchRadius + 2;  // one pixel more than the patch, to fill the lanes

// u and v of the pixels in a row of the patch, zero outside the circle.
struct RowWeights {
  alignas(16) std::array<std::int16_t, kRowLength> u{};
  alignas(16) std::array<std::int16_t, kRowLength> v{};
};

// The rows v = 0 .. kPatchRadius; those above the centre mirror them.
constexpr std::array<RowWeights, kPatchRadius + 1> MakeWeights() {
  std::array<RowWeights, kPatchRadius + 1> rows{};
  for (int v = 0; v <= kPatchRadius; ++v) {
    RowWeights& row = rows[v];
    for (int u = -kPatchRadius; u <= kPatchRadius; ++u) {
      if (u * u + v * v <= kPatchRadius * kPatchRadius) {
        row.u[u + kPatchRadius] = static_cast<std::int16_t>(u);
        row.v[u + kPatchRadius] = static_cast<std::int16_t>(v);
      }
    }
  }
  return rows;
}

constexpr auto kWeights = MakeWeights();

// The pattern in the order of the loops below: the first pixels of all pairs, then the second ones.
constexpr std::size_t kSamples = 2 * kBriefBits;
struct Samples {
  alignas(16) std::array<float, kSamples> x{};
  alignas(16) std::array<float, kSamples> y{};
};

constexpr Samples MakeSamples() {
  Samples samples;
  for (std::size_t i = 0; i < kBriefBits; ++i) {
    samples.x[i] = kBriefPattern[i].x0;
    samples.y[i] = kBriefPattern[i].y0;
    samples.x[i + kBriefBits] = kBriefPattern[i].x1;
    samples.y[i + kBriefBits] = kBriefPattern[i].y1;
  }
  return samples;
}

constexpr Samples kBriefSamples = MakeSamples();

cv::v_int16x8 LoadPixels(const std::uint8_t* pixels) {
  return cv::v_reinterpret_as_s16(cv::v_load_expand(pixels));
}

// Computes the memory offsets from the centre to the samples rotated by `angle` degrees.
void TurnSamples(float angle, std::size_t step, std::array<int, kSamples>& offsets) {
  const float radians = angle * static_cast<float>(std::numbers::pi / 180.0);
  const cv::v_float32x4 cosine = cv::v_setall_f32(static_cast<float>(std::cos(static_cast<double>(radians))));
  const cv::v_float32x4 sine = cv::v_setall_f32(static_cast<float>(std::sin(static_cast<double>(radians))));
  const cv::v_float32x4 stride = cv::v_setall_f32(static_cast<float>(step));  // products stay exact
  for (std::size_t i = 0; i < kSamples; i += 4) {
    const cv::v_float32x4 x = cv::v_load(&kBriefSamples.x[i]);
    const cv::v_float32x4 y = cv::v_load(&kBriefSamples.y[i]);
    const cv::v_float32x4 column = cv::v_cvt_f32(cv::v_round(x * cosine - y * sine));
    const cv::v_float32x4 row = cv::v_cvt_f32(cv::v_round(x * sine + y * cosine));
    cv::v_store(&offsets[i], cv::v_round(row * stride + column));
  }
}

}  // namespace

float PatchAngle(const cv::Mat& image, const cv::Point& center) {
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  const std::uint8_t* middle = image.ptr<std::uint8_t>(center.y) + center.x - kPatchRadius;
  cv::v_int32x4 m10 = cv::v_setzero_s32();
  cv::v_int32x4 m01 = cv::v_setzero_s32();
  for (std::size_t i = 0; i < kRowLength; i += kLanes) {
    m10 += cv::v_dotprod(LoadPixels(middle + i), cv::v_load(&kWeights[0].u[i]));
  }
  for (int v = 1; v <= kPatchRadius; ++v) {
    const RowWeights& weights = kWeights[v];
    for (std::size_t i = 0; i < kRowLength; i += kLanes) {
      const cv::v_int16x8 below = LoadPixels(middle + v * step + i);
      const cv::v_int16x8 above = LoadPixels(middle - v * step + i);
      m10 += cv::v_dotprod(below + above, cv::v_load(&weights.u[i]));
      m01 += cv::v_dotprod(below - above, cv::v_load(&weights.v[i]));
    }
  }
  return cv::fastAtan2(static_cast<float>(cv::v_reduce_sum(m01)), static_cast<float>(cv::v_reduce_sum(m10)));
}

void BlurForDescriptors(const cv::Mat& image, cv::Mat& blurred) {
  // Not cv::GaussianBlur: outside of submatrices it takes a slower path that rounds differently.
  static const cv::Mat kernel = cv::getGaussianKernel(7, 2.0, CV_32F);
  cv::sepFilter2D(image, blurred, CV_8U, kernel, kernel, {-1, -1}, 0.0, cv::BORDER_REFLECT_101);
}

Descriptor DescribePatch(const cv::Mat& blurred, const cv::Point& center, float angle) {
  alignas(16) std::array<int, kSamples> offsets;
  TurnSamples(angle, blurred.step, offsets);
  const std::uint8_t* middle = blurred.ptr<std::uint8_t>(center.y) + center.x;
  alignas(16) std::array<std::uint8_t, kSamples> values;
  for (std::size_t i = 0; i < kSamples; ++i) {
    values[i] = middle[offsets[i]];
  }
  Descriptor descriptor{};
  for (std::size_t i = 0; i < kBriefBits; i += 16) {
    const int bits = cv::v_signmask(cv::v_load(&values[i]) < cv::v_load(&values[i + kBriefBits]));
    descriptor[i / 8] = static_cast<std::uint8_t>(bits & 0xff);
    descriptor[i / 8 + 1] = static_cast<std::uint8_t>(bits >> 8);
  }
  return descriptor;
}

}  // namespace sqslam
