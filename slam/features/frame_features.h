#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

namespace sqslam {

using Descriptor = std::array<std::uint8_t, 32>;

struct Keypoint {
  Eigen::Vector2d pixel;      // undistorted, pixels of the full image
  Eigen::Vector2d raw_pixel;  // distorted, as in the image
  float angle = 0.0F;         // orientation of the patch, degrees in [0, 360)
  int octave = 0;             // pyramid level, 0 = full resolution
  float sigma = 1.0F;         // standard deviation, px of its level: 1 as detected, less once it is aligned

  bool IsAligned() const { return sigma < 1.0F; }  // see AlignObservations()
};

// Grey values around a keypoint at its pyramid level, by which its position is aligned with other images.
struct KeypointPatch {
  static constexpr int kRadius = 9;
  static constexpr int kSide = 2 * kRadius + 1;

  Eigen::Vector2f raw_middle;                     // raw pixel of the middle
  std::array<std::uint8_t, kSide * kSide> grays;  // row by row
};

// Largest coordinate of a keypoint in a saved map, undistorted px: twice the side of the largest image.
inline constexpr double kMaxKeypoint = 32768.0;

// Returns true if an undistorted pixel can be a keypoint. Near the rim of a fisheye lens, or where a lens
// model folds over, pixels may lie anywhere.
inline bool IsInReach(const Eigen::Vector2d& pixel) {
  return std::abs(pixel.x()) <= kMaxKeypoint && std::abs(pixel.y()) <= kMaxKeypoint;
}

// Keypoints by image cell, for searches around a pixel.
class KeypointGrid {
 public:
  KeypointGrid() = default;
  KeypointGrid(const std::vector<Keypoint>& keypoints, int width, int height)
      : columns_((width + kCellSize - 1) / kCellSize), rows_((height + kCellSize - 1) / kCellSize) {
    const auto cell_of = [&](const Keypoint& keypoint) {
      return CellOf(keypoint.pixel.y(), rows_) * columns_ + CellOf(keypoint.pixel.x(), columns_);
    };
    starts_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
    for (const Keypoint& keypoint : keypoints) {
      ++starts_[cell_of(keypoint) + 1];
    }
    for (std::size_t i = 1; i < starts_.size(); ++i) {
      starts_[i] += starts_[i - 1];
    }
    indices_.resize(keypoints.size());
    std::vector<int> next(starts_.begin(), starts_.end() - 1);
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      indices_[next[cell_of(keypoints[i])]++] = static_cast<int>(i);
    }
  }

  // Calls visit(index) for the keypoints of the cells that the square around `pixel` touches.
  void ForEachNear(const Eigen::Vector2d& pixel, double radius, auto&& visit) const {
    const int x0 = CellOf(pixel.x() - radius, columns_);
    const int x1 = CellOf(pixel.x() + radius, columns_);
    const int y0 = CellOf(pixel.y() - radius, rows_);
    const int y1 = CellOf(pixel.y() + radius, rows_);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const int cell = y * columns_ + x;
        for (int i = starts_[cell]; i < starts_[cell + 1]; ++i) {
          visit(indices_[i]);
        }
      }
    }
  }

 private:
  static constexpr int kCellSize = 16;  // pixels

  static int CellOf(double coordinate, int cells) {
    const int cell = static_cast<int>(coordinate) / kCellSize;
    return cell < 0 ? 0 : (cell >= cells ? cells - 1 : cell);
  }

  int columns_ = 0;
  int rows_ = 0;
  std::vector<int> starts_;   // first entry of each cell in indices_, plus the end
  std::vector<int> indices_;  // keypoint indices sorted by cell
};

// Everything that later stages need of an image. Immutable once extracted; shared between threads.
// Descriptors of different kinds cannot be compared.
enum class FeatureKind : std::uint8_t { kOrb, kSift };

struct FrameFeatures {
  FeatureKind kind = FeatureKind::kOrb;
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;                        // one per keypoint
  std::vector<std::array<std::uint8_t, 3>> colors;            // RGB, one per keypoint
  std::shared_ptr<const std::vector<KeypointPatch>> patches;  // one per keypoint; null: none
  KeypointGrid grid;

  std::size_t Size() const { return keypoints.size(); }
};

using FrameFeaturesPtr = std::shared_ptr<const FrameFeatures>;

}  // namespace sqslam
