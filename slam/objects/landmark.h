#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/object_types.h"
#include "slam/objects/statistical_tests.h"
#include "slam/objects/yaw.h"

namespace sqslam {

// Detector labels of one object with the sums of their scores; the best label has the largest sum.
class LabelVotes {
 public:
  void Add(const std::string& label, double score);
  void Merge(const LabelVotes& other);
  const std::string& Best() const;  // empty if nothing was added
  std::map<std::string, int> Counts() const;
  double BestScore() const;  // mean score of the observations with the best label

  static void VisitState(auto& self, auto&& visit) { visit(self.tallies_, self.best_); }

 private:
  struct Tally {
    double sum = 0.0;
    int count = 0;

    static void VisitState(auto& self, auto&& visit) { visit(self.sum, self.count); }
  };
  std::map<std::string, Tally> tallies_;
  std::string best_;
};

// One box of a landmark.
struct BoxView {
  std::int64_t frame_index = 0;
  Rigid3d T_map_camera;
  Box2d box;                        // distorted px
  std::array<bool, 4> edge_free{};  // left, top, right, bottom: neither cut off by the image nor hidden

  static void VisitState(auto& self, auto&& visit) {
    visit(self.frame_index, self.T_map_camera, self.box, self.edge_free);
  }
};

// Outcome of outlier removal for a map point that was seen in a landmark's boxes.
struct PointVerdict {
  std::int64_t point = 0;
  int sightings = 0;     // in the landmark's boxes
  double anomaly = 0.0;  // score in the isolation forest, in (0, 1); 0 if it was not scored
  bool kept = false;

  static void VisitState(auto& self, auto&& visit) {
    visit(self.point, self.sightings, self.anomaly, self.kept);
  }
};

// An object of the mapping thread. Plain data; the steps that work on it are in landmark_estimation.h and
// merging.h.
struct Landmark {
  // Counts of how often a map point was seen in the object's box, and how often it fell outside.
  struct PointVotes {
    int inside = 0;
    int outside = 0;
    bool newest_inside = false;                            // in the newest frame with a vote
    Eigen::Vector3d camera_sum = Eigen::Vector3d::Zero();  // centres at the `inside` sightings, map frame
    Eigen::Matrix3d camera_outer_sum = Eigen::Matrix3d::Zero();  // their outer products

    void SeeInside(const Eigen::Vector3d& camera_centre);
    void Merge(const PointVotes& other);
    void Transform(const Sim3d& S_new_old);
    Eigen::Vector3d MeanCamera() const;  // of the `inside` sightings; zero if there are none
    // Root mean square distance of the cameras from the line through MeanCamera() and `p_map`: motion along
    // the line of sight does not constrain the depth.
    double CameraSpread(const Eigen::Vector3d& p_map) const;

    static void VisitState(auto& self, auto&& visit) {
      visit(self.inside, self.outside, self.newest_inside, self.camera_sum, self.camera_outer_sum);
    }
  };

  int id = 0;
  bool known = false;  // shown by an earlier run: keeps its id, to which users may refer
  LabelVotes labels;
  int observations = 0;        // number of boxes, including those no longer in `views`
  std::vector<BoxView> views;  // by frame; thinned out for an object with very many
  std::map<std::int64_t, PointVotes> votes;
  PointStatistics centroids;
  YawMean yaw;                                           // of single frames (the paper's running mean)
  std::vector<std::pair<std::int64_t, LineView>> lines;  // frame index and lines

  // The largest box that was seen whole, with its image; only for quadrics from a single view.
  struct ClearView {
    BoxView view;
    cv::Mat gray;
  };
  std::optional<ClearView> clearest;

  // Results of the last estimation.
  bool estimated = false;
  bool moving = false;                 // no solid at rest explains its boxes: it is not estimated
  bool refined = false;                // by the joint refinement
  int thorough_at = 0;                 // observations at the last refinement from scratch
  int estimated_at = 0;                // observations at the last estimation
  NamedPoints points;                  // inliers
  std::vector<PointVerdict> verdicts;  // of all points with a vote, by id
  PosedSuperquadric superquadric;
  PosedSuperquadric visible;                 // its visible part: differs if the lower part is hidden
  std::vector<SolidPart> parts;              // of which `visible` consists; empty: one solid
  std::optional<double> support;             // height of the surface that it was found to stand on
  std::optional<PosedSuperquadric> quadric;  // from the boxes alone; only for representation "quadric"
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();  // see ObjectFit
  double reliability = 0.0;    // see reliability.h, in [0, 1]
  double box_agreement = 0.0;  // mean IoU of the projected superquadric and the boxes, in [0, 1]

  void Add(const ObjectObservation& observation);
  void Absorb(Landmark&& other);  // merges a duplicate; keeps the estimate if it is much better known
  // Upright objects stay upright: a small tilt is drift.
  void Transform(const Sim3d& S_new_old);

  // Shifts its id (unless it has none, -1), those of its map points, and the indices of its frames.
  void Renumber(int id_shift, std::int64_t point_shift, std::int64_t frame_shift);

  // Returns the evidence of the boxes in frames of a film: a box counts as several if the camera has moved
  // farther around the object since the last one than from one frame to the next. At least `observations`.
  double Evidence() const;

  // Calls `change` with the frame index and the pose (T_map_camera) of each view.
  void ForEachPose(const auto& change) {
    for (BoxView& view : views) {
      change(view.frame_index, view.T_map_camera);
    }
    for (auto& [frame_index, view] : lines) {
      change(frame_index, view.T_map_camera);
    }
    if (clearest) {
      change(clearest->view.frame_index, clearest->view.T_map_camera);
    }
  }

  // Moves each view with its own frame, and sums over frames with the mean motion of the frames.
  void MoveWith(const MotionLookup& S_new_old);

  // All but `clearest`, whose image is large and only for quadrics from a single view, `known`, and `parts`,
  // which the next estimation finds again.
  static void VisitState(auto& self, auto&& visit) {
    visit(self.id, self.labels, self.observations, self.views, self.votes, self.centroids, self.yaw,
          self.lines, self.estimated, self.refined, self.thorough_at, self.estimated_at, self.points,
          self.verdicts, self.superquadric, self.visible, self.support, self.quadric, self.covariance,
          self.reliability, self.box_agreement, self.halvings_);
  }

 private:
  void ForgetUpright();
  void MoveSums(const Sim3d& S_new_old);
  void MoveSolid(const Sim3d& S_new_old);  // and the yaw
  void Offer(const ClearView& other);
  bool KeepsViewOf(std::int64_t frame_index) const;
  void ThinViews();
  void DropPartsBoxedWithTheWhole();

  int halvings_ = 0;  // number of times that half of all frames was dropped
};

}  // namespace sqslam
