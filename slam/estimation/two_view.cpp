#include "slam/estimation/two_view.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "slam/estimation/reprojection_error.h"
#include "slam/geometry/angles.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kVariance = 1.0;  // px^2, of a matched corner
constexpr double kRansacConfidence = 0.999;
constexpr double kMinTranslationFlow = 1.5;  // px, median flow after removing the best pure rotation
constexpr double kHomographyShare = 0.45;    // of both scores, above which the homography is chosen
constexpr double kMaxSecondBest = 0.75;      // share of the best solution's points: another one is ambiguous

double HomographyError(const Eigen::Matrix3d& H21, const Eigen::Vector2d& p1, const Eigen::Vector2d& p2) {
  return ((H21 * p1.homogeneous()).hnormalized() - p2).squaredNorm() / kVariance;
}

double EpipolarError(const Eigen::Matrix3d& F21, const Eigen::Vector2d& p1, const Eigen::Vector2d& p2) {
  const Eigen::Vector3d line = F21 * p1.homogeneous();
  const double d = line.dot(p2.homogeneous());
  return d * d / line.head<2>().squaredNorm() / kVariance;
}

struct ModelSupport {
  double score = 0.0;
  std::vector<bool> inliers;
};

// The score sums kChi2TwoDof - error over both directions for errors below the limit. The threshold is the
// same for both models, so that the scores are comparable.
ModelSupport Score(const std::vector<TwoViewMatch>& matches, double limit, auto&& error) {
  ModelSupport support{0.0, std::vector<bool>(matches.size(), false)};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const auto [forward, backward] = error(matches[i]);
    support.inliers[i] = forward <= limit && backward <= limit;
    support.score += forward <= limit ? kChi2TwoDof - forward : 0.0;
    support.score += backward <= limit ? kChi2TwoDof - backward : 0.0;
  }
  return support;
}

struct Candidate {
  Rigid3d T_camera2_camera1;
  std::vector<std::optional<Eigen::Vector3d>> points;
  int good = 0;
  double parallax = 0.0;
};

// Triangulates the inliers; a point is good if it is in front of both cameras with a small reprojection
// error.
Candidate Reconstruct(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                      const std::vector<bool>& inliers, const Rigid3d& T_camera2_camera1) {
  constexpr double kMaxSquaredError = 4.0 * kVariance;
  Candidate candidate{T_camera2_camera1, {}, 0, 0.0};
  candidate.points.resize(matches.size());
  const Eigen::Vector3d center2 = T_camera2_camera1.Inverse().translation;
  std::vector<double> angles;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!inliers[i]) {
      continue;
    }
    const Eigen::Vector3d p = Triangulate({}, camera.Unproject(matches[i].pixel1), T_camera2_camera1,
                                          camera.Unproject(matches[i].pixel2));
    const Eigen::Vector3d p2 = T_camera2_camera1 * p;
    if (!p.allFinite() || p.z() <= 0.0 || p2.z() <= 0.0 ||
        (camera.Project(p) - matches[i].pixel1).squaredNorm() > kMaxSquaredError ||
        (camera.Project(p2) - matches[i].pixel2).squaredNorm() > kMaxSquaredError) {
      continue;
    }
    ++candidate.good;
    const double cosine = std::clamp(CosParallax(p, Eigen::Vector3d::Zero(), center2), -1.0, 1.0);
    angles.push_back(std::acos(cosine) * kDegreesPerRadian);
    if (cosine < 0.99998) {
      candidate.points[i] = p;
    }
  }
  if (!angles.empty()) {
    candidate.parallax = UpperMedian(std::move(angles));
  }
  return candidate;
}

// Scales the translation to unit length.
Rigid3d MotionOf(const cv::Mat& rotation, const cv::Mat& translation) {
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation, R);
  cv::cv2eigen(translation, t);
  return {Eigen::Quaterniond(R).normalized(), t.normalized()};
}

std::vector<Rigid3d> MotionsFromHomography(const cv::Mat& H, const cv::Mat& K) {
  std::vector<cv::Mat> rotations, translations, normals;
  cv::decomposeHomographyMat(H, K, rotations, translations, normals);
  std::vector<Rigid3d> motions;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    if (cv::norm(translations[i]) > 1e-9) {
      motions.push_back(MotionOf(rotations[i], translations[i]));
    }
  }
  return motions;
}

std::vector<Rigid3d> MotionsFromEssential(const cv::Mat& E) {
  cv::Mat R1, R2, t;
  cv::decomposeEssentialMat(E, R1, R2, t);
  return {MotionOf(R1, t), MotionOf(R1, -t), MotionOf(R2, t), MotionOf(R2, -t)};
}

TwoViewReport ChooseMotion(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                           const std::vector<bool>& inliers, const std::vector<Rigid3d>& motions,
                           bool from_homography, const TwoViewOptions& options) {
  std::vector<Candidate> candidates =
      ToVector(motions, [&](const Rigid3d& motion) { return Reconstruct(camera, matches, inliers, motion); });
  std::ranges::stable_sort(candidates, std::greater{}, &Candidate::good);
  if (candidates.empty() || candidates.front().good == 0) {
    return {std::nullopt, "the motion has no translation (pure rotation or static camera)"};
  }
  const Candidate& best = candidates.front();
  const auto num_inliers = std::ranges::count(inliers, true);
  TwoViewReport report;
  if (best.parallax < options.min_parallax) {
    report.refusal = "too little parallax (the camera must translate, not only rotate)";
  } else if (best.good < options.min_points || best.good < 0.8 * static_cast<double>(num_inliers)) {
    report.refusal = "too few points could be triangulated";
  } else if (candidates.size() > 1 && candidates[1].good > kMaxSecondBest * best.good) {
    report.refusal = "the motion is ambiguous (a plane seen from afar)";
  } else {
    report.geometry = TwoViewGeometry{best.T_camera2_camera1, best.points, from_homography};
  }
  return report;
}

}  // namespace

double FlowWithoutRotation(const Camera& camera, const std::vector<TwoViewMatch>& matches) {
  constexpr int kRounds = 5;  // of iterative reweighting: matches far from the rotation are downweighted
  std::vector<Eigen::Vector3d> rays1;
  std::vector<Eigen::Vector3d> rays2;
  for (const TwoViewMatch& match : matches) {
    rays1.push_back(camera.Unproject(match.pixel1).normalized());
    rays2.push_back(camera.Unproject(match.pixel2).normalized());
  }
  std::vector<double> residuals(matches.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      correlation += rays2[i] * rays1[i].transpose() / std::max(1.0, residuals[i]);
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Eigen::Matrix3d R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      residuals[i] = (camera.Project(R * rays1[i]) - matches[i].pixel2).norm();
    }
  }
  return UpperMedian(std::move(residuals));
}

TwoViewReport EstimateTwoView(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                              const TwoViewOptions& options) {
  constexpr std::size_t kMinMatches = 20;
  if (matches.size() < kMinMatches) {
    return {std::nullopt, "too few matches between two frames (too little texture)"};
  }
  if (FlowWithoutRotation(camera, matches) < kMinTranslationFlow) {
    return {std::nullopt, "the camera only turns (it must translate)"};
  }
  const auto points1 =
      ToVector(matches, [](const TwoViewMatch& m) { return cv::Point2d(m.pixel1.x(), m.pixel1.y()); });
  const auto points2 =
      ToVector(matches, [](const TwoViewMatch& m) { return cv::Point2d(m.pixel2.x(), m.pixel2.y()); });
  const Eigen::Matrix3d K = camera.K();
  cv::Mat K_cv;
  cv::eigen2cv(K, K_cv);
  const cv::Mat H_cv = cv::findHomography(points1, points2, cv::RANSAC, std::sqrt(kChi2TwoDof * kVariance));
  // MAGSAC++ refines its models; the translation of plain RANSAC is so inaccurate that bundle adjustment of
  // two views with little parallax does not recover.
  const cv::Mat E_cv =
      cv::findEssentialMat(points1, points2, K_cv, cv::USAC_MAGSAC, kRansacConfidence, std::sqrt(kVariance));
  ModelSupport homography;
  ModelSupport fundamental;
  if (!H_cv.empty()) {
    Eigen::Matrix3d H;
    cv::cv2eigen(H_cv, H);
    const Eigen::Matrix3d H_inverse = H.inverse();
    homography = Score(matches, kChi2TwoDof, [&](const TwoViewMatch& m) {
      return std::pair(HomographyError(H, m.pixel1, m.pixel2),
                       HomographyError(H_inverse, m.pixel2, m.pixel1));
    });
  }
  if (E_cv.rows >= 3) {
    Eigen::Matrix3d E;
    cv::cv2eigen(E_cv.rowRange(0, 3), E);
    const Eigen::Matrix3d F = K.inverse().transpose() * E * K.inverse();
    fundamental = Score(matches, kChi2OneDof, [&](const TwoViewMatch& m) {
      return std::pair(EpipolarError(F, m.pixel1, m.pixel2),
                       EpipolarError(F.transpose(), m.pixel2, m.pixel1));
    });
  }
  const double both = homography.score + fundamental.score;
  if (both <= 0.0) {
    return {std::nullopt, "no motion explains the matches between two frames"};
  }
  if (fundamental.inliers.empty() || homography.score / both > kHomographyShare) {
    return ChooseMotion(camera, matches, homography.inliers, MotionsFromHomography(H_cv, K_cv), true,
                        options);
  }
  return ChooseMotion(camera, matches, fundamental.inliers, MotionsFromEssential(E_cv.rowRange(0, 3)), false,
                      options);
}

Eigen::Vector3d Triangulate(const Rigid3d& T_camera1_map, const Eigen::Vector3d& ray1,
                            const Rigid3d& T_camera2_map, const Eigen::Vector3d& ray2) {
  const Eigen::Matrix<double, 3, 4> P1 = T_camera1_map.Matrix().topRows<3>();
  const Eigen::Matrix<double, 3, 4> P2 = T_camera2_map.Matrix().topRows<3>();
  cv::Matx44d A;  // OpenCV's decomposition compiles in a tenth of the time of Eigen's
  for (int i = 0; i < 4; ++i) {
    A(0, i) = ray1.x() * P1(2, i) - P1(0, i);
    A(1, i) = ray1.y() * P1(2, i) - P1(1, i);
    A(2, i) = ray2.x() * P2(2, i) - P2(0, i);
    A(3, i) = ray2.y() * P2(2, i) - P2(1, i);
  }
  cv::Matx41d singular_values;
  cv::Matx44d U, Vt;
  cv::SVD::compute(A, singular_values, U, Vt);
  return Eigen::Vector3d(Vt(3, 0), Vt(3, 1), Vt(3, 2)) / Vt(3, 3);
}

double CosParallax(const Eigen::Vector3d& p_map, const Eigen::Vector3d& center1,
                   const Eigen::Vector3d& center2) {
  return (center1 - p_map).normalized().dot((center2 - p_map).normalized());
}

}  // namespace sqslam
