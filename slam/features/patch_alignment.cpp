#include "slam/features/patch_alignment.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace sqslam {
namespace {

constexpr int kHalf = 4;  // pixels of the window on each side of its middle
constexpr int kSide = 2 * kHalf + 1;
constexpr int kPixels = kSide * kSide;

using Window = Eigen::Matrix<float, kPixels, 1>;

// Grey values by bilinear interpolation.
class PatchImage {
 public:
  explicit PatchImage(const KeypointPatch& patch) : grays_(patch.grays.data()) {}

  // Returns true if all points within `reach` of a pixel can be read.
  static bool Holds(const Eigen::Vector2d& pixel, double reach) {
    return pixel.cwiseAbs().maxCoeff() + reach < KeypointPatch::kRadius;
  }

  float At(float x, float y) const {
    x += KeypointPatch::kRadius;
    y += KeypointPatch::kRadius;
    const int column = static_cast<int>(x);
    const int row = static_cast<int>(y);
    const float right = x - static_cast<float>(column);
    const float down = y - static_cast<float>(row);
    const std::uint8_t* const above = grays_ + row * KeypointPatch::kSide + column;
    const std::uint8_t* const below = above + KeypointPatch::kSide;
    return (1.0F - down) * ((1.0F - right) * above[0] + right * above[1]) +
           down * ((1.0F - right) * below[0] + right * below[1]);
  }

 private:
  const std::uint8_t* grays_;
};

// The reference as it should look in the current image, and its derivatives.
struct Template {
  Window grays;                             // minus their mean
  Eigen::Matrix<float, kPixels, 4> slopes;  // by x, y, gain and offset
};

std::optional<Template> WarpReference(const PatchPlace& reference, const Eigen::Matrix2d& A) {
  constexpr int kReach = kHalf + 1;  // derivatives are differences of neighbours
  const double reach = kReach * A.cwiseAbs().rowwise().sum().maxCoeff();
  if (!PatchImage::Holds(reference.pixel, reach)) {
    return std::nullopt;
  }
  const PatchImage image(*reference.patch);
  Eigen::Matrix<float, 2 * kReach + 1, 2 * kReach + 1, Eigen::RowMajor> warped;
  for (int y = -kReach; y <= kReach; ++y) {
    for (int x = -kReach; x <= kReach; ++x) {
      const Eigen::Vector2f pixel = (reference.pixel + A * Eigen::Vector2d(x, y)).cast<float>();
      warped(y + kReach, x + kReach) = image.At(pixel.x(), pixel.y());
    }
  }
  Template made;
  const float mean = warped.block<kSide, kSide>(1, 1).mean();
  for (int i = 0; i < kPixels; ++i) {
    const int y = i / kSide + 1;
    const int x = i % kSide + 1;
    made.grays[i] = warped(y, x) - mean;
    made.slopes.row(i) << 0.5F * (warped(y, x + 1) - warped(y, x - 1)),
        0.5F * (warped(y + 1, x) - warped(y - 1, x)), made.grays[i], 1.0F;
  }
  return made;
}

// Returns the grey values of the window around `middle`, which the patch must hold. All its pixels lie at the
// same fraction between grey values.
Window Read(const KeypointPatch& patch, const Eigen::Vector2d& middle) {
  using Grays = Eigen::Matrix<std::uint8_t, kSide + 1, kSide + 1, Eigen::RowMajor>;
  using Rows = Eigen::Matrix<float, kSide, kSide, Eigen::RowMajor>;
  const Eigen::Vector2d corner = middle.array() + (KeypointPatch::kRadius - kHalf);
  const Eigen::Vector2i first = corner.cast<int>();
  const float right = static_cast<float>(corner.x() - first.x());
  const float down = static_cast<float>(corner.y() - first.y());
  const Eigen::Map<const Grays, 0, Eigen::OuterStride<KeypointPatch::kSide>> read(
      patch.grays.data() + first.y() * KeypointPatch::kSide + first.x());
  const Eigen::Matrix<float, kSide + 1, kSide + 1, Eigen::RowMajor> grays = read.cast<float>();
  Window window;
  Eigen::Map<Rows>(window.data()) = (1.0F - down) * ((1.0F - right) * grays.topLeftCorner<kSide, kSide>() +
                                                     right * grays.topRightCorner<kSide, kSide>()) +
                                    down * ((1.0F - right) * grays.bottomLeftCorner<kSide, kSide>() +
                                            right * grays.bottomRightCorner<kSide, kSide>());
  return window;
}

// Returns the smallest sum of squared derivatives along any direction.
float LeastTexture(const Eigen::Matrix4f& information) {
  const float half_trace = 0.5F * (information(0, 0) + information(1, 1));
  const float half_difference = 0.5F * (information(0, 0) - information(1, 1));
  return half_trace - std::hypot(half_difference, information(0, 1));
}

bool LookAlike(const Window& a, const Window& b) {
  constexpr float kMinCorrelation = 0.8F;
  const Window centered = b.array() - b.mean();
  return a.dot(centered) >= kMinCorrelation * a.norm() * centered.norm();
}

}  // namespace

std::optional<Eigen::Vector2d> AlignPatches(const PatchPlace& reference, const PatchPlace& current,
                                            const Eigen::Matrix2d& A_reference_current) {
  // With noise of 3 grey levels the standard deviation is at most 0.3 px.
  constexpr float kMinTexture = 100.0F;
  constexpr int kMaxIterations = 10;
  constexpr double kMaxShift = 2.0;       // px
  constexpr float kSmallestStep = 0.01F;  // px, ends the iteration
  constexpr float kMinGain = 0.3F;
  const std::optional<Template> made = WarpReference(reference, A_reference_current);
  if (!made) {
    return std::nullopt;
  }
  const Eigen::Matrix4f information = made->slopes.transpose() * made->slopes;
  if (LeastTexture(information) < kMinTexture) {
    return std::nullopt;
  }
  const Eigen::Matrix4f covariance = information.inverse();
  Eigen::Vector2d pixel = current.pixel;
  float gain = 1.0F;
  float offset = 0.0F;
  for (int i = 0; i < kMaxIterations; ++i) {
    if (!PatchImage::Holds(pixel, kHalf) || (pixel - current.pixel).norm() > kMaxShift) {
      return std::nullopt;
    }
    const Window seen = Read(*current.patch, pixel);
    const Window error = seen - gain * made->grays - Window::Constant(offset);
    const Eigen::Vector4f step = covariance * (made->slopes.transpose() * error);
    if (step.head<2>().norm() < kSmallestStep) {
      return LookAlike(made->grays, seen) ? std::optional(pixel) : std::nullopt;
    }
    pixel -= (step.head<2>() / std::max(gain, kMinGain)).cast<double>();
    gain += step[2];
    offset += step[3];
  }
  return std::nullopt;
}

}  // namespace sqslam
