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
#include "slam/geometry/superquadric.h"
#include "slam/objects/object_types.h"
#include "slam/objects/statistical_tests.h"
#include "slam/objects/yaw.h"

namespace sqslam {

// Labels that the detector gave one thing, with the sums of their scores: the best is the one with the
// largest sum.
class LabelVotes {
 public:
  void Add(const std::string& label, double score);
  void Merge(const LabelVotes& other);
  const std::string& Best() const;  // empty where nothing was added
  double BestScore() const;         // mean score of the observations that carry the best label

  template <typename Self, typename Visit>
  static void VisitState(Self& self, Visit&& visit) {
    visit(self.tallies_, self.best_);
  }

 private:
  struct Tally {
    double sum = 0.0;
    int count = 0;

    template <typename Self, typename Visit>
    static void VisitState(Self& self, Visit&& visit) {
      visit(self.sum, self.count);
    }
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

  template <typename Self, typename Visit>
  static void VisitState(Self& self, Visit&& visit) {
    visit(self.frame_index, self.T_map_camera, self.box, self.edge_free);
  }
};

// Outcome of outlier removal for a map point that was seen in a landmark's boxes.
struct PointVerdict {
  std::int64_t point = 0;
  int sightings = 0;     // in the landmark's boxes
  double anomaly = 0.0;  // score in the isolation forest, in (0, 1); 0 where the point did not get so far
  bool kept = false;

  template <typename Self, typename Visit>
  static void VisitState(Self& self, Visit&& visit) {
    visit(self.point, self.sightings, self.anomaly, self.kept);
  }
};

// An object as the mapping thread keeps it. Plain data; the steps that work on it are in
// landmark_estimation.h and merging.h.
struct Landmark {
  // Counts of how often a map point was seen in the object's box, and how often it fell outside.
  struct PointVotes {
    int inside = 0;
    int outside = 0;
    bool newest_inside = false;                            // in the newest frame that tells
    Eigen::Vector3d camera_sum = Eigen::Vector3d::Zero();  // centres at the `inside` sightings, map frame
    Eigen::Matrix3d camera_outer_sum = Eigen::Matrix3d::Zero();  // their outer products

    void SeeInside(const Eigen::Vector3d& camera_centre);
    void Merge(const PointVotes& other);
    void Transform(const Sim3d& S_new_old);
    Eigen::Vector3d MeanCamera() const;  // of the `inside` sightings; zero where there are none
    // Root mean square distance of the cameras from the line through that and `p`: what they moved towards a
    // point tells nothing of its depth.
    double CameraSpread(const Eigen::Vector3d& p_map) const;

    template <typename Self, typename Visit>
    static void VisitState(Self& self, Visit&& visit) {
      visit(self.inside, self.outside, self.newest_inside, self.camera_sum, self.camera_outer_sum);
    }
  };

  int id = 0;
  LabelVotes labels;
  int observations = 0;        // boxes, also of the frames that are no longer among the views
  std::vector<BoxView> views;  // by frame; of an object that is seen very long, from an even share of them
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
  bool refined = false;  // by the joint refinement
  int thorough_at = 0;   // observations at the last refinement from scratch
  int estimated_at = 0;  // number of observations at that time
  std::vector<std::pair<std::int64_t, Eigen::Vector3d>> points;  // inliers
  std::vector<PointVerdict> verdicts;                            // of all points with a vote, by id
  PosedSuperquadric superquadric;
  PosedSuperquadric visible;      // the part of it that views show: differs where its lower part is hidden
  std::optional<double> support;  // height of the surface that it was found to stand on
  std::optional<PosedSuperquadric> quadric;  // of the boxes alone; only for the representation of that name
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();  // see ObjectFit
  double reliability = 0.0;    // see reliability.h, in [0, 1]
  double box_agreement = 0.0;  // mean IoU of the projected superquadric and the boxes, in [0, 1]

  void Add(const ObjectObservation& observation);
  void Absorb(Landmark&& other);  // the two are one object; the estimate of a much better known one stays
  // An upright object stays upright: a small tilt is drift.
  void Transform(const Sim3d& S_new_old);

  // Carries the landmark along with the frames that saw it: each view with its own frame, what was summed up
  // over frames with their mean motion.
  void MoveWith(const MotionLookup& S_new_old);

  // All but the clearest view, whose image is large and only for quadrics from a single view.
  template <typename Self, typename Visit>
  static void VisitState(Self& self, Visit&& visit) {
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

  int halvings_ = 0;  // times that half of all frames was given up
};

}  // namespace sqslam
