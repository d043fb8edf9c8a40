#include "slam/objects/landmark.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "slam/geometry/angles.h"
#include "slam/objects/visibility.h"
#include "slam/util/raise_keys.h"
#include "slam/util/thinned.h"

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

std::map<std::string, int> LabelVotes::Counts() const {
  std::map<std::string, int> counts;
  for (const auto& [label, tally] : tallies_) {
    counts[label] = tally.count;
  }
  return counts;
}

double LabelVotes::BestScore() const {
  const auto it = tallies_.find(best_);
  return it == tallies_.end() ? 0.0 : it->second.sum / it->second.count;
}

void Landmark::PointVotes::SeeInside(const Eigen::Vector3d& camera_centre) {
  ++inside;
  newest_inside = true;
  camera_sum += camera_centre;
  camera_outer_sum += camera_centre * camera_centre.transpose();
}

void Landmark::PointVotes::Merge(const PointVotes& other) {
  inside += other.inside;
  outside += other.outside;
  newest_inside = newest_inside || other.newest_inside;
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
  if (!observation.gray.empty() && IsWhole(observation.edge_free)) {
    Offer({{observation.frame_index, observation.T_map_camera, observation.detection.box,
            observation.edge_free},
           observation.gray});
  }
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
    votes[point].newest_inside = false;
  }
  if (observation.centroid) {
    centroids.Add(*observation.centroid);
  }
  if (observation.yaw) {
    yaw.Add(*observation.yaw);
  }
  if (!observation.lines.empty()) {
    if (lines.size() >= kMaxLineViews) {
      lines = Thinned(lines, (lines.size() + 1) / 2);
    }
    lines.emplace_back(observation.frame_index, LineView{observation.T_map_camera, observation.lines});
  }
}

void Landmark::Offer(const ClearView& other) {
  if (!clearest || other.view.box.Area() > clearest->view.box.Area()) {
    clearest = other;
  }
}

// Keeps half of all frames, a quarter, ...: the same ones for every landmark, so that it stays known which
// were seen in one image. Hashing keeps them out of step with any stride.
bool Landmark::KeepsViewOf(std::int64_t frame_index) const {
  const std::uint64_t scattered = static_cast<std::uint64_t>(frame_index) * 0x9E3779B97F4A7C15ULL;
  return halvings_ == 0 || scattered >> (64 - halvings_) == 0;
}

// Drops half of the views. Where merging two maps has renumbered the frames since the last time, hardly any
// view may be in a frame to keep: then every second one stays.
void Landmark::ThinViews() {
  constexpr std::size_t kMaxBoxViews = 2000;
  constexpr std::size_t kHardly = 8;  // an eighth: absorbing a landmark that was never thinned leaves more
  const auto keeps = [this](const BoxView& view) { return KeepsViewOf(view.frame_index); };
  while (views.size() > kMaxBoxViews) {
    ++halvings_;
    if (kHardly * static_cast<std::size_t>(std::ranges::count_if(views, keeps)) < views.size()) {
      views = Thinned(views, (views.size() + 1) / 2);
    } else {
      std::erase_if(views, std::not_fn(keeps));
    }
  }
}

double Landmark::Evidence() const {
  constexpr double kUsualStep =
      1.0;  // degrees around the object, at most from frame to frame of a hand-held film
  constexpr double kMaxWeight = 5.0;
  double sum = 0.0;
  std::optional<Eigen::Vector3d> last;  // direction to the object
  for (const BoxView& view : views) {
    const Eigen::Vector3d direction =
        (superquadric.T_map_object.translation - view.T_map_camera.translation).normalized();
    const double step =
        last ? std::acos(std::clamp(direction.dot(*last), -1.0, 1.0)) * kDegreesPerRadian : 0.0;
    sum += std::clamp(step / kUsualStep, 1.0, kMaxWeight);
    last = direction;
  }
  return std::max(sum, static_cast<double>(observations));
}

void Landmark::Absorb(Landmark&& other) {
  constexpr double kHardly = 1.0 / 6.0;
  if (other.observations > observations) {
    std::swap(*this, other);
    std::swap(id, other.id);
  }
  // Both may be wrong about the extent, so the estimate is discarded: until the next one it must not absorb
  // others. A few more boxes hardly change anything.
  if (other.observations > kHardly * observations) {
    estimated = false;
    refined = false;
    estimated_at = 0;
  }
  known = known || other.known;
  observations += other.observations;
  labels.Merge(other.labels);
  views.insert(views.end(), other.views.begin(), other.views.end());
  std::ranges::stable_sort(views,
                           [](const BoxView& a, const BoxView& b) { return a.frame_index < b.frame_index; });
  DropPartsBoxedWithTheWhole();
  halvings_ = std::max(halvings_, other.halvings_);
  ThinViews();
  for (const auto& [point, theirs] : other.votes) {
    votes[point].Merge(theirs);
  }
  if (other.clearest) {
    Offer(*other.clearest);
  }
  centroids.Merge(other.centroids);
  yaw.Merge(other.yaw);
  lines.insert(lines.end(), other.lines.begin(), other.lines.end());
}

// If a frame has boxes around the object and around a part of it, the larger one shows where it ends.
void Landmark::DropPartsBoxedWithTheWhole() {
  constexpr double kPart = 0.9;  // of the smaller box
  std::vector<BoxView> kept;
  for (const BoxView& view : views) {
    if (!kept.empty() && kept.back().frame_index == view.frame_index &&
        IntersectionOverSmaller(kept.back().box, view.box) >= kPart) {
      kept.back() = kept.back().box.Area() >= view.box.Area() ? kept.back() : view;
    } else {
      kept.push_back(view);
    }
  }
  views = std::move(kept);
}

void Landmark::Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift) {
  id += id >= 0 ? id_shift : 0;
  for (BoxView& view : views) {
    view.frame_index += frame_shift;
  }
  for (auto& [frame, view] : lines) {
    frame += frame_shift;
  }
  ShiftKeys(votes, point_shift);
  for (auto& [point, p_map] : points) {
    point += point_shift;
  }
  for (PointVerdict& verdict : verdicts) {
    verdict.point += point_shift;
  }
}

void Landmark::Transform(const Sim3d& S_new_old) {
  ForEachPose([&](std::int64_t, Rigid3d& T_map_camera) { T_map_camera = S_new_old * T_map_camera; });
  MoveSums(S_new_old);
  MoveSolid(S_new_old);
}

void Landmark::ForgetUpright() {
  yaw = YawMean();  // angles about the old axis are meaningless
  // The object was fitted along axes that are no longer upright; re-estimate it.
  estimated_at = 0;
  refined = false;
}

void Landmark::MoveWith(const MotionLookup& S_new_old) {
  if (views.empty()) {
    return;
  }
  const Eigen::Vector3d center = estimated             ? superquadric.T_map_object.translation
                                 : centroids.count > 0 ? centroids.mean
                                                       : views.back().T_map_camera.translation;
  double log_scale = 0.0;
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();  // similar: the mean of the quaternions is good enough
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  for (const BoxView& view : views) {
    const Sim3d S = S_new_old(view.frame_index);
    log_scale += std::log(S.scale);
    rotation += (rotation.dot(S.rotation.coeffs()) < 0.0 ? -1.0 : 1.0) * S.rotation.coeffs();
    moved += S * center;
  }
  ForEachPose(
      [&](std::int64_t frame, Rigid3d& T_map_camera) { T_map_camera = S_new_old(frame) * T_map_camera; });
  const auto count = static_cast<double>(views.size());
  const Eigen::Quaterniond mean = Eigen::Quaterniond(rotation).normalized();
  const double scale = std::exp(log_scale / count);
  const Sim3d S = {scale, mean, moved / count - scale * (mean * center)};
  MoveSums(S);
  MoveSolid(S);
}

void Landmark::MoveSums(const Sim3d& S_new_old) {
  for (auto& [point, vote] : votes) {
    vote.Transform(S_new_old);
  }
  for (auto& [point, p] : points) {
    p = S_new_old * p;
  }
  centroids.Transform(S_new_old);
}

void Landmark::MoveSolid(const Sim3d& motion) {
  constexpr double kDrift = 0.98;  // cosine of the largest tilt that counts as drift
  Sim3d S_new_old = motion;
  if ((motion.rotation * Eigen::Vector3d::UnitZ()).z() <= kDrift) {
    ForgetUpright();
  } else {
    const Eigen::Vector3d& center = superquadric.T_map_object.translation;
    const Eigen::Vector3d x = motion.rotation * Eigen::Vector3d::UnitX();
    S_new_old.rotation = Eigen::AngleAxisd(std::atan2(x.y(), x.x()), Eigen::Vector3d::UnitZ());
    S_new_old.translation = motion * center - motion.scale * (S_new_old.rotation * center);
  }
  const Eigen::Matrix3d R = S_new_old.rotation.toRotationMatrix();
  superquadric = S_new_old * superquadric;
  visible = S_new_old * visible;
  Eigen::Matrix<double, 9, 9> moved = Eigen::Matrix<double, 9, 9>::Identity();
  moved.topLeftCorner<3, 3>() = S_new_old.scale * R;
  moved.block<3, 3>(3, 3) *= S_new_old.scale;
  covariance = moved * covariance * moved.transpose();
  if (support) {
    *support = S_new_old.scale * *support + S_new_old.translation.z();
  }
  if (quadric) {
    quadric = S_new_old * *quadric;
  }
  yaw.Rotate(std::atan2(R(1, 0), R(0, 0)));
}

}  // namespace sqslam
