#include "slam/objects/landmark.h"

#include <algorithm>
#include <cmath>

namespace sqslam {

void LabelVotes::Add(const std::string& label, double score) {
  Tally& tally = tallies_[label];
  tally.sum += score;
  ++tally.count;
  if (best_.empty() || tally.sum > tallies_[best_].sum) {
    best_ = label;
  }
}

void LabelVotes::Merge(const LabelVotes& other) {
  for (const auto& [label, theirs] : other.tallies_) {
    Tally& tally = tallies_[label];
    tally.sum += theirs.sum;
    tally.count += theirs.count;
  }
  for (const auto& [label, tally] : tallies_) {
    if (best_.empty() || tally.sum > tallies_[best_].sum) {
      best_ = label;
    }
  }
}

const std::string& LabelVotes::Best() const { return best_; }

double LabelVotes::BestScore() const {
  const auto it = tallies_.find(best_);
  return it == tallies_.end() ? 0.0 : it->second.sum / it->second.count;
}

void Landmark::PointVotes::SeeInside(const Eigen::Vector3d& camera_centre) {
  ++inside;
  camera_sum += camera_centre;
  camera_outer_sum += camera_centre * camera_centre.transpose();
}

void Landmark::PointVotes::Merge(const PointVotes& other) {
  inside += other.inside;
  outside += other.outside;
  camera_sum += other.camera_sum;
  camera_outer_sum += other.camera_outer_sum;
}

void Landmark::PointVotes::Transform(const Sim3d& S_new_old) {
  const Eigen::Matrix3d sR = S_new_old.scale * S_new_old.rotation.toRotationMatrix();
  const Eigen::Vector3d turned = sR * camera_sum;
  const Eigen::Vector3d& t = S_new_old.translation;
  camera_outer_sum = sR * camera_outer_sum * sR.transpose() + turned * t.transpose() +
                     t * turned.transpose() + inside * t * t.transpose();
  camera_sum = turned + inside * t;
}

Eigen::Vector3d Landmark::PointVotes::MeanCamera() const { return camera_sum / std::max(1, inside); }

double Landmark::PointVotes::CameraSpread(const Eigen::Vector3d& p_map) const {
  const Eigen::Vector3d mean = MeanCamera();
  const Eigen::Vector3d line = (p_map - mean).normalized();
  const Eigen::Matrix3d covariance = camera_outer_sum / std::max(1, inside) - mean * mean.transpose();
  return std::sqrt(std::max(0.0, covariance.trace() - line.dot(covariance * line)));
}

void Landmark::Add(const ObjectObservation& observation) {
  constexpr std::size_t kMaxLineViews = 60;
  ++observations;
  labels.Add(observation.detection.label, observation.detection.score);
  if (KeepsViewOf(observation.frame_index)) {
    views.push_back({observation.frame_index, observation.T_map_camera, observation.detection.box,
                     observation.edge_free});
    ThinViews();
  }
  for (const std::int64_t point : observation.point_ids) {
    votes[point].SeeInside(observation.T_map_camera.translation);
  }
  for (const std::int64_t point : observation.reprojected_outside) {
    ++votes[point].outside;
  }
  if (observation.centroid) {
    centroids.Add(*observation.centroid);
  }
  if (observation.yaw) {
    yaw.Add(*observation.yaw);
  }
  if (!observation.lines.empty()) {
    if (lines.size() >= kMaxLineViews) {
      // Thin out evenly: every second one goes.
      for (std::size_t i = 0; 2 * i < lines.size(); ++i) {
        lines[i] = lines[2 * i];
      }
      lines.resize((lines.size() + 1) / 2);
    }
    lines.emplace_back(observation.frame_index, LineView{observation.T_map_camera, observation.lines});
  }
}

// Half of all frames, a quarter, ...: the same ones for every landmark, so that it stays known which were
// seen in one image; and none in step with a stride.
bool Landmark::KeepsViewOf(std::int64_t frame_index) const {
  const std::uint64_t scattered = static_cast<std::uint64_t>(frame_index) * 0x9E3779B97F4A7C15ULL;
  return halvings_ == 0 || scattered >> (64 - halvings_) == 0;
}

void Landmark::ThinViews() {
  constexpr std::size_t kMaxBoxViews = 2000;
  while (views.size() > kMaxBoxViews) {
    ++halvings_;
    std::erase_if(views, [this](const BoxView& view) { return !KeepsViewOf(view.frame_index); });
  }
}

void Landmark::Absorb(Landmark&& other) {
  observations += other.observations;
  labels.Merge(other.labels);
  views.insert(views.end(), other.views.begin(), other.views.end());
  std::stable_sort(views.begin(), views.end(),
                   [](const BoxView& a, const BoxView& b) { return a.frame_index < b.frame_index; });
  DropPartsBoxedWithTheWhole();
  halvings_ = std::max(halvings_, other.halvings_);
  ThinViews();
  for (const auto& [point, theirs] : other.votes) {
    votes[point].Merge(theirs);
  }
  centroids.Merge(other.centroids);
  yaw.Merge(other.yaw);
  lines.insert(lines.end(), other.lines.begin(), other.lines.end());
  estimated_at = 0;
}

// A frame that has a box around the thing and another around a part of it shows by the larger where it ends.
void Landmark::DropPartsBoxedWithTheWhole() {
  constexpr double kPart = 0.9;  // of the smaller box
  std::vector<BoxView> kept;
  for (const BoxView& view : views) {
    if (!kept.empty() && kept.back().frame_index == view.frame_index &&
        ShareOfSmaller(kept.back().box, view.box) >= kPart) {
      kept.back() = kept.back().box.Area() >= view.box.Area() ? kept.back() : view;
    } else {
      kept.push_back(view);
    }
  }
  views = std::move(kept);
}

void Landmark::Transform(const Sim3d& S_new_old) {
  const Eigen::Matrix3d R = S_new_old.rotation.toRotationMatrix();
  for (BoxView& view : views) {
    view.T_map_camera = S_new_old * view.T_map_camera;
  }
  for (auto& [frame, view] : lines) {
    view.T_map_camera = S_new_old * view.T_map_camera;
  }
  for (auto& [point, vote] : votes) {
    vote.Transform(S_new_old);
  }
  for (auto& [point, p] : points) {
    p = S_new_old * p;
  }
  centroids.Transform(S_new_old);
  superquadric = S_new_old * superquadric;
  Eigen::Matrix<double, 9, 9> moved = Eigen::Matrix<double, 9, 9>::Identity();
  moved.topLeftCorner<3, 3>() = S_new_old.scale * R;
  moved.block<3, 3>(3, 3) *= S_new_old.scale;
  covariance = moved * covariance * moved.transpose();
  visible = S_new_old * visible;
  if (support) {
    *support = S_new_old.scale * *support + S_new_old.translation.z();
  }
  if (quadric) {
    quadric = S_new_old * *quadric;
  }
  const Eigen::Vector3d up = R.col(2);
  if (up.z() > 0.9999) {
    yaw.Rotate(std::atan2(R(1, 0), R(0, 0)));
  } else {
    yaw = YawMean();  // angles about another axis mean nothing now
    // The object was boxed along axes that are no longer upright; estimate it anew.
    estimated_at = 0;
    refined = false;
  }
}

}  // namespace sqslam
