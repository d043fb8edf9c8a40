#include "slam/objects/known_landmark.h"

#include <algorithm>

namespace sqslam {

double KnownLandmark::Radius() const {
  return IsEstimated() ? view->superquadric.shape.half_size.maxCoeff() : 0.0;
}

Box2d KnownLandmark::PredictedBox(std::int64_t frame_index) const {
  const auto frames = static_cast<double>(frame_index - last_frame);
  return {last_box.x + frames * box_velocity.x, last_box.y + frames * box_velocity.y,
          std::max(1.0, last_box.width + frames * box_velocity.width),
          std::max(1.0, last_box.height + frames * box_velocity.height)};
}

void KnownLandmark::SeeBox(const Box2d& box, std::int64_t frame_index) {
  const std::int64_t frames = frame_index - last_frame;
  constexpr std::int64_t kMaxGap = 3;
  if (last_frame >= 0 && frames <= kMaxGap && frames > 0) {
    // Half the measured motion: boxes of a detector jitter, and a full step would amplify that.
    const double f = 0.5 / static_cast<double>(frames);
    box_velocity = {f * (box.Center().x() - last_box.Center().x()),
                    f * (box.Center().y() - last_box.Center().y()), 0.0, 0.0};
  } else {
    box_velocity = {};
  }
  last_box = box;
  last_frame = frame_index;
}

void KnownLandmark::Absorb(KnownLandmark&& other) {
  labels.Merge(other.labels);
  centroids.Merge(other.centroids);
  point_ids.merge(other.point_ids);
  cloud.insert(cloud.end(), other.cloud.begin(), other.cloud.end());
  if (other.last_frame > last_frame) {
    last_frame = other.last_frame;
    last_box = other.last_box;
    box_velocity = other.box_velocity;
  }
}

}  // namespace sqslam
