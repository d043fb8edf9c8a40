#include "slam/features/frame_features.h"

namespace sqslam {

KeypointGrid::KeypointGrid(const std::vector<Keypoint>& keypoints, int width, int height)
    : columns_((width + kCellSize - 1) / kCellSize), rows_((height + kCellSize - 1) / kCellSize) {
  const auto cell_of = [&](const Keypoint& keypoint) {
    return static_cast<std::size_t>(CellOf(keypoint.pixel.y(), rows_) * columns_ +
                                    CellOf(keypoint.pixel.x(), columns_));
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
    indices_[static_cast<std::size_t>(next[cell_of(keypoints[i])]++)] = static_cast<int>(i);
  }
}

}  // namespace sqslam
