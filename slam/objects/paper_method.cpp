#include "slam/objects/paper_method.h"

namespace sqslam {

ObjectOptions OptionsOfMethod(ObjectOptions options) {
  if (options.method != ObjectMethod::kPaper) {
    return options;
  }
  constexpr int kNever = 1000000;  // frames
  options.min_box_agreement = 0.0;
  options.min_reliability = 0.0;
  options.pointless_box_agreement = 0.0;
  options.forget_after = kNever;
  options.max_estimates = 0;
  options.detections.border_margin = 4.0;
  options.detections.border_share = 0.0;
  AssociationOptions& association = options.association;
  association.min_t_samples = 2;
  association.start_without_points = false;
  association.discount_parts = false;
  if (association.method == AssociationMethod::kFull) {
    association.rules = {
        .parts = {.predicted_box = true, .points = true, .one_sample = true, .merge_by_test = true},
        .one_sample = OneSampleTest::kOfMean,
        .least_spread = 1e-6,
        .still = true,
        .points_later = false};
  }
  options.refinement.enabled = false;
  options.merging.by_test_alone = true;
  options.merging.alpha = association.alpha;
  options.merging.min_samples = 2;
  OutlierOptions& outliers = options.outliers;
  outliers.depth_iqr = 0.0;
  outliers.newest_box_decides = true;
  if (outliers.reprojection == ReprojectionVotes::kObserved) {
    outliers.reprojection = ReprojectionVotes::kAll;
  }
  outliers.box_margin = 0.0;
  outliers.isolation_forest.min_points = 4;
  options.keep_size = true;  // "both of which have the same pose and size"
  options.yaw.fit = LineFit::kLeastSquares;
  options.yaw.line_interval = 1;
  options.yaw.line_pixels = 0;
  options.yaw.max_box_share = 1.0;
  options.yaw.pca_min_ratio = 1.0;
  options.yaw.pca_min_points = 3;
  SizeShapeOptions& shape = options.size_shape;
  shape.centre = CloudCentre::kCentroid;
  shape.thinnest_share = 0.001;
  shape.huber = 10.0;  // mean half sizes: beyond all residuals
  shape.regularisation = 0.0;
  shape.prior_exponent = 1.0;
  return options;
}

}  // namespace sqslam
