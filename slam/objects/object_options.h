#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "slam/objects/association_method.h"

namespace sqslam {

// Filter for the detector's boxes.
struct DetectionFilterOptions {
  std::vector<std::string> ignored_labels = {
      "person"};                  // boxes of these are dropped: they move by themselves
  double min_score = 0.25;        // detections with a lower score are ignored, in [0, 1]
  double max_box_share = 0.9;     // boxes larger than this share of the image area are dropped
  double min_box_share = 0.0005;  // boxes smaller than this share of the image area are dropped
  double duplicate_iou = 0.7;     // of two boxes with a higher IoU, the one with the lower score is dropped
  double border_margin = 3.0;     // a box edge nearer to the image border counts as cut off, px
  double border_share = 0.05;     // plus this share of the box's size across the edge
  double max_cut_share = 0.03;    // a cut-off box with a smaller share of the image cannot start an object

  void VisitFields(auto&& visit) {
    visit("ignored_labels", ignored_labels);
    visit("min_score", min_score, 0.0, 1.0);
    visit("border_margin", border_margin, 0.0, 100.0);
  }
};

// Assignment of boxes to landmarks (section "Data Association").
struct AssociationOptions {
  AssociationMethod method = AssociationMethod::kFull;
  double min_iou = 0.5;       // IoU with the predicted box that makes a candidate, in [0, 1]
  double accept_iou = 0.7;    // IoU that is accepted without shared points, in [0, 1]
  double min_shared = 0.33;   // share of the observation's points that must be the landmark's, in [0, 1]
  int min_shared_points = 3;  // least number of these points
  int inter_frame_gap = 3;    // maximum frames since the last sighting to count as consecutive
  double other_label_shared = 0.5;      // share of points for which a box of another label is accepted
  double other_label_iou = 0.7;         // IoU for which a box of another label is accepted
  double alpha = 0.01;                  // significance level of the one-sample t-test and the rank-sum test
  int rank_sum_points = 60;             // maximum points of each cloud in the rank-sum test
  int min_t_samples = 6;                // centroids a landmark needs for the t-test
  double projected_iou = 0.3;           // IoU of box and projected landmark required along with the t-test
  double projected_iou_alone = 0.5;     // IoU of box and projected landmark that suffices alone
  double max_centroid_distance = 0.75;  // centroid to landmark, in units of the landmark's largest half size
  int min_points = 5;                   // points a box needs to start a landmark
  bool start_without_points = true;     // or it is whole and away from all known landmarks
  bool discount_parts = true;           // boxes of parts start no landmark, cut ones give no centroid
  std::optional<AssociationRules> rules;  // instead of those of the method

  void VisitFields(auto&& visit) {
    visit("method", method);
    visit("min_iou", min_iou, 0.0, 1.0);
    visit("alpha", alpha, 1e-9, 0.5);
    visit("projected_iou", projected_iou, 0.0, 1.0);
  }
};

// Extended Isolation Forest (section "Extended Isolation Forest").
struct IsolationForestOptions {
  bool enabled = true;      // remove points by their anomaly score
  int trees = 40;           // number of isolation trees
  int max_samples = 256;    // maximum points per tree (fewer for a smaller cloud)
  double threshold = 0.65;  // anomaly score above which a point is removed, in [0, 1]
  int min_points = 20;      // smaller clouds are left alone

  void VisitFields(auto&& visit) {
    visit("enabled", enabled);
    visit("trees", trees, 1, 1000);
    visit("threshold", threshold, 0.0, 1.0);
  }
};

// Frames that vote on whether a point lies in the object's box: all (the paper), only those that observed the
// point (a hidden point says nothing), or none (no reprojection test).
enum class ReprojectionVotes { kAll, kObserved, kNone };
constexpr auto EnumNames(ReprojectionVotes) { return std::array{"all", "observed", "none"}; }

// Removal of points that don't belong to the object (section "Outlier Removal").
struct OutlierOptions {
  // Depth gate in a frame: distance from the quartiles in units of their distance; 0: no gate.
  double depth_iqr = 1.5;
  double min_inside_share = 0.8;  // share of the sightings in which a point must lie in the object's box
  ReprojectionVotes reprojection = ReprojectionVotes::kObserved;
  double box_margin = 0.05;  // boxes are grown by this share of their size for the vote
  int min_votes = 2;         // frames in which a point must have been seen in the object's box
  // A point outside one of the object's boxes, also beyond an edge that is not free, is removed until the
  // next box that holds it. False: the shares and votes decide.
  bool newest_box_decides = false;
  IsolationForestOptions isolation_forest;

  void VisitFields(auto&& visit) {
    visit("depth_iqr", depth_iqr, 0.0, 100.0);
    visit("reprojection", reprojection);
    visit("isolation_forest", isolation_forest);
  }
};

// Fit of the yaw to the lines of a frame. kRobust: lines weigh by their length, with a robust loss, and the
// axes are projected at each line's midpoint, which avoids a perspective error for lines away from the
// object's centre. kLeastSquares: equal weights, least squares of the angles (Eq. 7), the start with the most
// matches, and axes projected at the centroid of the points.
enum class LineFit { kRobust, kLeastSquares };

// Yaw from line segments and from the point cloud (section "Pose Estimation").
struct YawOptions {
  LineFit fit = LineFit::kRobust;
  int line_interval = 5;            // an object's lines are extracted in every n-th frame at most; 0: never
  int line_pixels = 15000;          // area of boxes searched for lines, per frame on average; 0: no limit
  int line_views = 20;              // frames with lines that an object gets without waiting its turn
  double max_box_share = 0.3;       // larger boxes are not searched for lines, share of the image area
  double min_line_length = 15.0;    // shorter line segments are ignored, px
  double box_margin = 10.0;         // boxes are grown by this for the line search, px
  int samples = 18;                 // start angles, evenly over 90 degrees
  double match_angle_deg = 5.0;     // a line matches an axis below this angle in the image
  int min_lines = 3;                // lines that a box needs to tell a yaw
  double independent_views = 4.0;   // effective number of views at most: line errors repeat from view to view
  double max_refinement_deg = 5.0;  // refinements farther from the best sample are rejected
  double pca_min_ratio = 1.21;      // least ratio of the variances along the first and the second axis
  int pca_min_points = 20;          // points that the principal axis needs

  void VisitFields(auto&& visit) {
    visit("line_interval", line_interval, 0, 1000);
    visit("samples", samples, 2, 360);
    visit("match_angle_deg", match_angle_deg, 0.1, 45.0);
  }
};

// Centre of a cloud: the middle of its extent, or the mean of its points.
enum class CloudCentre { kMiddle, kCentroid };

// Half sizes from the point cloud, and the shape exponents (section "Size And Shape").
struct SizeShapeOptions {
  CloudCentre centre = CloudCentre::kMiddle;
  double thinnest_share = 0.02;  // lower bound on half sizes, share of the largest one
  double grid_step = 0.2;        // start values of the exponents: 0.1, 0.1 + step, ... 1.9 on both axes
  double huber = 0.1;            // width of the robust loss, share of the mean half size
  double regularisation = 0.01;  // weight of the prior that both exponents are `prior_exponent`
  double prior_exponent = 0.5;   // from 0.1 (edged) over 1 (round) to 1.9
  int max_iterations = 20;       // Levenberg-Marquardt steps

  void VisitFields(auto&& visit) { visit("regularisation", regularisation, 0.0, 100.0); }
};

// Joint refinement of centre, half sizes, yaw and shape against points and box edges (method "refined").
struct RefinementOptions {
  bool enabled = true;             // false: the cloud alone, without supports, classes and other objects
  int max_views = 30;              // views whose box edges are used, spread over the viewing directions
  double edge_sigma_px = 1.5;      // standard deviation of a box edge, px, to which edge_sigma_share is added
  double edge_sigma_share = 0.03;  // share of the box size
  // Standard deviation of a point's distance to the surface, px in a typical view, plus a share of the size
  // that boxes show: no superquadric follows every bump.
  double point_sigma_px = 1.5;
  double point_sigma_share = 0.01;  // added share of the size that boxes show
  // Standard deviation of a point's observations, px: the smaller its baseline, the less its depth counts; 0:
  // depth is as certain as the rest.
  double depth_sigma_px = 3.0;
  double point_weight = 2.0;     // the points together weigh at most as much as this many views
  double contact_sigma = 0.05;   // standard deviation of the gap to the support, share of the shown size
  double contact_weight = 10.0;  // weight of the contact with the support, relative to one box edge
  double floating_cost = 4.0;    // less log probability that an object stands on none of the surfaces
  double exponent_sigma = 0.2;   // standard deviation of both exponents about those of the kind of shape
  // Standard deviation of the log of the width of a round thing's ends over that of its middle: bottles,
  // bowls; 0: both are as wide.
  double taper_sigma = 0.5;
  double edge_bias_sigma = 0.02;  // standard deviation of the detector's bias per side, share of the box size
  int max_iterations = 30;        // Levenberg-Marquardt steps
  double cost_tolerance = 0.02;   // steps that reduce the cost (half a chi square) by less are the last

  void VisitFields(auto&& visit) {
    visit("edge_sigma_px", edge_sigma_px, 0.01, 100.0);
    visit("edge_sigma_share", edge_sigma_share, 0.0, 1.0);
    visit("point_weight", point_weight, 0.0, 10000.0);
    visit("taper_sigma", taper_sigma, 0.0, 10.0);
    visit("edge_bias_sigma", edge_bias_sigma, 1e-6, 1.0);
  }
};

// Merging of duplicate landmarks (section "Data Association", end).
struct MergingOptions {
  bool by_test_alone = false;        // by the two-sample t-test and nothing else
  double alpha = 0.001;              // significance level of the two-sample t-test
  int min_samples = 4;               // centroids that both need for the test
  double overlap = 0.4;              // shared volume over the smaller volume: same label
  double overlap_other_label = 0.6;  // the same for different labels
  // Frames with a box for each of them above which the two stay apart: this share of the views of the rarer
  // one, or the number if that is more and the labels are the same.
  double max_seen_together_share = 0.05;
  int max_seen_together = 3;  // least number of such frames, for the same label

  void VisitFields(auto&& visit) {
    visit("alpha", alpha, 1e-9, 0.5);
    visit("overlap", overlap, 0.0, 1.0);
  }
};

// Up direction and support plane (gravity.h).
struct GravityOptions {
  double max_angle_deg = 65.0;   // up lies within this angle of the cameras' mean up direction
  double inlier_share = 0.006;   // points nearer to the plane than this share of the median depth support it
  int ransac_iterations = 4000;  // random planes tried
  int min_points = 30;           // map points needed to look for a plane
  double min_support = 0.08;     // share of the points that must lie on the plane
};

// The paper's steps alone, or the joint refinement after them.
enum class ObjectMethod { kPaper, kRefined };
constexpr auto EnumNames(ObjectMethod) { return std::array{"paper", "refined"}; }

// Representation in which objects are shown, written and scored; no other step depends on it. Ellipsoids and
// cuboids approximate the solid of the superquadric (method "paper": have its size, with exponents 1 and
// 0.1); a quadric is the dual quadric of the boxes alone.
enum class Representation { kSuperquadric, kEllipsoid, kQuadric, kCuboid };
constexpr auto EnumNames(Representation) {
  return std::array{"superquadric", "ellipsoid", "quadric", "cuboid"};
}

// Initialisation of a quadric: the boxes of several views (QuadricSLAM), or one view of it on its support,
// with the proportions of its class and the symmetry of its texture (SO-SLAM). Both are refined by the boxes.
enum class QuadricInit { kMultiView, kSingleView };
constexpr auto EnumNames(QuadricInit) { return std::array{"multi-view", "single-view"}; }

struct ObjectOptions {
  ObjectMethod method = ObjectMethod::kRefined;
  Representation representation = Representation::kSuperquadric;
  QuadricInit quadric_init = QuadricInit::kMultiView;  // of representation "quadric"
  std::string class_priors = "default";                // default (configs/classes.yaml), off, or a file
  int min_observations = 10;                           // boxes needed to show an object
  int min_points = 4;                                  // map points needed to show an object
  double min_box_agreement = 0.35;       // mean IoU of projected object and boxes needed to show an object
  double pointless_box_agreement = 0.6;  // the same for an object with fewer than min_points
  double min_reliability = 0.3;          // needed to show an object; those below 0.4 are shown as uncertain
  int forget_after = 300;  // frames without a box after which an object that was never good is deleted
  int max_estimates = 2;   // most outdated objects re-estimated at a keyframe; 0: no limit
  bool keep_size = false;  // of the superquadric, in ellipsoids and cuboids; else they overlap it most
  DetectionFilterOptions detections;
  AssociationOptions association;
  OutlierOptions outliers;
  YawOptions yaw;
  SizeShapeOptions size_shape;
  RefinementOptions refinement;
  MergingOptions merging;
  GravityOptions gravity;

  void VisitFields(auto&& visit) {
    visit("method", method);
    visit("representation", representation);
    visit("quadric_init", quadric_init);
    visit("class_priors", class_priors);
    visit("min_observations", min_observations, 1, 10000);
    visit("min_reliability", min_reliability, 0.0, 1.0);
    visit("forget_after", forget_after, 1, 1000000);
    visit("max_estimates", max_estimates, 0, 10000);
    visit("detections", detections);
    visit("association", association);
    visit("outliers", outliers);
    visit("yaw", yaw);
    visit("size_shape", size_shape);
    visit("refinement", refinement);
    visit("merging", merging);
  }
};

}  // namespace sqslam
