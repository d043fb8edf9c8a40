#include "slam/dense/view_choice.h"

#include <algorithm>
#include <cmath>

#include "slam/geometry/angles.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

bool IsSeen(const Eigen::Vector3d& p_camera, const Camera& camera) {
  if (p_camera.z() <= 0.0) {
    return false;
  }
  const Eigen::Vector2d pixel = camera.Project(p_camera);
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= camera.width - 1 &&
         pixel.y() <= camera.height - 1;
}

// Scores an angle: 1 if it is the wanted one, less the larger the ratio between them.
double AngleScore(double angle, double wanted) {
  constexpr double kWidth = 0.5;  // standard deviation, octaves
  const double octaves = std::log2(angle / wanted) / kWidth;
  return std::exp(-0.5 * octaves * octaves);
}

}  // namespace

std::vector<Eigen::Vector3d> PointsInView(const std::vector<Eigen::Vector3d>& points, const Camera& camera,
                                          const Rigid3d& T_map_camera, std::size_t most) {
  constexpr double kOutlierShare = 0.01;  // of the points at each end
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  std::vector<std::pair<double, Eigen::Vector3d>> seen;
  for (const Eigen::Vector3d& p_map : points) {
    if (const Eigen::Vector3d p_camera = T_camera_map * p_map; IsSeen(p_camera, camera)) {
      seen.emplace_back(p_camera.z(), p_map);
    }
  }
  std::ranges::stable_sort(seen, [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto cut = static_cast<std::size_t>(std::ceil(kOutlierShare * static_cast<double>(seen.size())));
  std::vector<Eigen::Vector3d> in_view;
  if (seen.size() > 2 * cut) {
    const std::size_t left = seen.size() - 2 * cut;
    const std::size_t taken = std::min(left, most);
    for (std::size_t i = 0; i < taken; ++i) {
      in_view.push_back(seen[cut + (taken > 1 ? i * (left - 1) / (taken - 1) : 0)].second);
    }
  }
  return in_view;
}

std::optional<DepthRange> RangeOf(const std::vector<Eigen::Vector3d>& in_view, const Rigid3d& T_map_camera) {
  constexpr std::size_t kMinPoints = 10;
  constexpr double kNearMargin = 1.25;  // inverse depth of the first plane over that of the nearest points
  constexpr double kFarMargin = 0.75;   // inverse depth of the last plane over that of the farthest points
  if (in_view.size() < kMinPoints) {
    return std::nullopt;
  }
  const Rigid3d T_camera_map = T_map_camera.Inverse();  // nearest first, see PointsInView
  const double nearest = (T_camera_map * in_view.front()).z();
  const double farthest = (T_camera_map * in_view.back()).z();
  return DepthRange{nearest / kNearMargin, farthest / kFarMargin};
}

Parallax ParallaxOf(const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                    const Rigid3d& keyframe, const Rigid3d& frame) {
  const Rigid3d T_frame_map = frame.Inverse();
  std::vector<double> angles;
  for (const Eigen::Vector3d& p : in_view) {
    if (IsSeen(T_frame_map * p, camera)) {
      const Eigen::Vector3d a = (keyframe.translation - p).normalized();
      const Eigen::Vector3d b = (frame.translation - p).normalized();
      angles.push_back(2.0 * std::asin(std::min(0.5 * (a - b).norm(), 1.0)) * kDegreesPerRadian);
    }
  }
  if (angles.empty()) {
    return {};
  }
  const double overlap = static_cast<double>(angles.size()) / static_cast<double>(in_view.size());
  return {overlap, UpperMedian(std::move(angles))};
}

std::vector<std::size_t> ChooseViews(const PosedFrame& keyframe, const std::vector<PosedFrame>& frames,
                                     const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                                     const std::vector<double>& angles, const ViewOptions& options) {
  struct Candidate {
    std::size_t position;
    Parallax parallax;
    Eigen::Vector3d side;  // unit vector from the keyframe to it
    bool taken = false;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Eigen::Vector3d way = frames[i].T_map_camera.translation - keyframe.T_map_camera.translation;
    if (std::abs(frames[i].index - keyframe.index) > options.window || !(way.norm() > 0.0)) {
      continue;
    }
    const Parallax parallax = ParallaxOf(in_view, camera, keyframe.T_map_camera, frames[i].T_map_camera);
    if (parallax.overlap >= options.min_overlap && parallax.angle >= kMinViewAngle) {
      candidates.push_back({i, parallax, way.normalized()});
    }
  }
  std::vector<std::size_t> chosen;
  for (const double wanted : angles) {
    const Candidate* first = nullptr;
    for (int k = 0; k < 2; ++k) {
      Candidate* best = nullptr;
      double best_score = 0.0;
      for (Candidate& c : candidates) {
        const double opposite = first != nullptr ? 0.5 * (1.0 - first->side.dot(c.side)) : 1.0;
        const double score = c.parallax.overlap * c.parallax.overlap * AngleScore(c.parallax.angle, wanted) *
                             (0.1 + 0.9 * opposite);
        if (!c.taken && score > best_score) {
          best = &c;
          best_score = score;
        }
      }
      if (best != nullptr) {
        best->taken = true;
        chosen.push_back(best->position);
        first = best;
      }
    }
  }
  return chosen;
}

std::vector<std::size_t> ChooseNeighbours(std::size_t keyframe, const std::vector<PosedFrame>& keyframes,
                                          const std::vector<Eigen::Vector3d>& in_view, const Camera& camera,
                                          int count) {
  constexpr double kIndependentAngle = 8.0;  // degrees: errors of two maps are then nearly independent
  std::vector<std::pair<double, std::size_t>> scored;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Parallax parallax =
        ParallaxOf(in_view, camera, keyframes[keyframe].T_map_camera, keyframes[i].T_map_camera);
    if (i != keyframe && parallax.overlap > 0.0) {
      const double far = std::max(parallax.angle, kIndependentAngle);
      scored.emplace_back(-parallax.overlap * kIndependentAngle / far, i);
    }
  }
  std::ranges::sort(scored);
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < scored.size() && i < static_cast<std::size_t>(count); ++i) {
    chosen.push_back(scored[i].second);
  }
  return chosen;
}

}  // namespace sqslam
