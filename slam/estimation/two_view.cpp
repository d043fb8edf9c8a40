#include "slam/estimation/two_view.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "slam/estimation/reprojection_error.h"
#include "slam/geometry/lie.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr std::size_t kMinMatches = 20;
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
  int determined = 0;
};

// Returns the parallax, in radians, above which the noise of both pixels leaves a depth uncertain by less
// than an eighth; no more than what is enough for any lens.
double MinParallax(const Camera& camera) {
  constexpr double kMaxDeviation = 0.125;  // of the depth, relative
  constexpr double kWideParallax = 0.026;  // rad, 1.5 degrees
  return std::min(kWideParallax, std::sqrt(2.0 * kVariance) / camera.fx / kMaxDeviation);
}

// Triangulates the inliers. A point is good if it is in front of both cameras with a small reprojection
// error, or so far away that its rays are parallel.
Candidate Reconstruct(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                      const std::vector<bool>& inliers, const Rigid3d& T_camera2_camera1) {
  constexpr double kMaxSquaredError = 4.0 * kVariance;
  constexpr double kParallelCosine = 0.99998;
  const double min_parallax = MinParallax(camera);
  Candidate candidate{T_camera2_camera1, {}};
  candidate.points.resize(matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!inliers[i]) {
      continue;
    }
    const Eigen::Vector3d ray1 = camera.Unproject(matches[i].pixel1);
    const Eigen::Vector3d ray2 = camera.Unproject(matches[i].pixel2);
    const double cosine = (T_camera2_camera1.rotation * ray1).normalized().dot(ray2.normalized());
    if (cosine > kParallelCosine) {
      ++candidate.good;
      continue;
    }
    const Eigen::Vector3d p = Triangulate({}, ray1, T_camera2_camera1, ray2);
    const Eigen::Vector3d p2 = T_camera2_camera1 * p;
    if (!p.allFinite() || p.z() <= 0.0 || p2.z() <= 0.0 ||
        (camera.Project(p) - matches[i].pixel1).squaredNorm() > kMaxSquaredError ||
        (camera.Project(p2) - matches[i].pixel2).squaredNorm() > kMaxSquaredError) {
      continue;
    }
    ++candidate.good;
    candidate.determined += std::acos(std::clamp(cosine, -1.0, 1.0)) >= min_parallax ? 1 : 0;
    candidate.points[i] = p;
  }
  return candidate;
}

// Distance of a match from the epipolar geometry of a motion, px (Sampson 1982).
double SampsonError(const Camera& camera, const TwoViewMatch& match, const Rigid3d& T_2_1) {
  const Eigen::Matrix3d E = Skew(T_2_1.translation) * T_2_1.RotationMatrix();
  const Eigen::Vector3d ray1 = camera.Unproject(match.pixel1);
  const Eigen::Vector3d ray2 = camera.Unproject(match.pixel2);
  const Eigen::Vector3d line2 = E * ray1;
  const Eigen::Vector3d line1 = E.transpose() * ray2;
  return camera.fx * ray2.dot(line2) /
         std::sqrt(line2.head<2>().squaredNorm() + line1.head<2>().squaredNorm());
}

// Returns the standard deviation of the direction of the translation, from the information that the points of
// the candidate hold on all five degrees of freedom.
double DirectionDeviation(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                          const Candidate& candidate) {
  constexpr double kStep = 1e-5;  // rad
  const Rigid3d& T = candidate.T_camera2_camera1;
  const Eigen::Vector3d across1 = T.translation.unitOrthogonal();
  const Eigen::Vector3d across2 = T.translation.cross(across1).normalized();
  std::vector<Rigid3d> moved;
  for (const Eigen::Vector3d& across : {across1, across2}) {
    moved.push_back({T.rotation, (T.translation + kStep * across).normalized()});
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::AngleAxisd turn(kStep, Eigen::Vector3d::Unit(axis));
    moved.push_back({(Eigen::Quaterniond(turn) * T.rotation).normalized(), T.translation});
  }
  Eigen::Matrix<double, 5, 5> information = Eigen::Matrix<double, 5, 5>::Zero();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!candidate.points[i]) {
      continue;
    }
    const double error = SampsonError(camera, matches[i], T);
    Eigen::Matrix<double, 5, 1> gradient;
    for (int k = 0; k < 5; ++k) {
      gradient[k] = (SampsonError(camera, matches[i], moved[k]) - error) / kStep;
    }
    information += gradient * gradient.transpose() / kVariance;
  }
  const Eigen::Matrix<double, 5, 5> covariance = information.inverse();
  return std::sqrt(covariance(0, 0) + covariance(1, 1));
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
  std::ranges::stable_sort(candidates, std::greater{}, [](const Candidate& candidate) {
    return std::pair(candidate.determined, candidate.good);
  });
  if (candidates.empty() || candidates.front().good == 0) {
    return {std::nullopt, "the motion has no translation (pure rotation or static camera)"};
  }
  const Candidate& best = candidates.front();
  const auto num_inliers = std::ranges::count(inliers, true);
  TwoViewReport report;
  if (best.determined < options.min_points) {
    report.refusal = fmt::format(
        "too little parallax: {} points have enough to determine their depth, at least {} needed (the camera "
        "must translate, not only rotate)",
        best.determined, options.min_points);
  } else if (best.good < 0.8 * static_cast<double>(num_inliers)) {
    report.refusal = "too few points could be triangulated";
  } else if (candidates.size() > 1 && candidates[1].determined > kMaxSecondBest * best.determined) {
    report.refusal = "the motion is ambiguous (a plane seen from afar)";
  } else {
    report.geometry = TwoViewGeometry{best.T_camera2_camera1, best.points, best.determined,
                                      DirectionDeviation(camera, matches, best), from_homography};
  }
  return report;
}

std::pair<std::vector<cv::Point2d>, std::vector<cv::Point2d>> PixelsOf(
    const std::vector<TwoViewMatch>& matches) {
  return {ToVector(matches, [](const TwoViewMatch& m) { return cv::Point2d(m.pixel1.x(), m.pixel1.y()); }),
          ToVector(matches, [](const TwoViewMatch& m) { return cv::Point2d(m.pixel2.x(), m.pixel2.y()); })};
}

std::vector<int> IndicesWhere(std::size_t count, auto&& holds) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < count; ++i) {
    if (holds(i)) {
      indices.push_back(static_cast<int>(i));
    }
  }
  return indices;
}

// MAGSAC++ scores and refines: the translation of plain RANSAC is so inaccurate that bundle adjustment of two
// views with little parallax does not recover.
cv::Mat FindEssential(const std::vector<cv::Point2d>& points1, const std::vector<cv::Point2d>& points2,
                      const cv::Mat& K) {
  return cv::findEssentialMat(points1, points2, K, cv::USAC_MAGSAC, kRansacConfidence, std::sqrt(kVariance));
}

// The same with a shorter refinement: as accurate where there are enough matches, in a third of the time.
cv::Mat FindEssentialFast(const std::vector<cv::Point2d>& points1, const std::vector<cv::Point2d>& points2,
                          const cv::Mat& K, std::vector<uchar>& inliers) {
  cv::UsacParams params;
  params.confidence = kRansacConfidence;
  params.threshold = std::sqrt(kVariance);
  params.maxIterations = 1000;
  params.score = cv::SCORE_METHOD_MAGSAC;
  params.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  return cv::findEssentialMat(points1, points2, K, K, cv::noArray(), cv::noArray(), inliers, params);
}

struct RotationFit {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // R_camera2_camera1
  std::vector<double> residuals;                    // px, distance of each match from it
};

RotationFit FitRotation(const Camera& camera, const std::vector<TwoViewMatch>& matches) {
  constexpr int kRounds = 5;  // of iterative reweighting: matches far from the rotation are downweighted
  std::vector<Eigen::Vector3d> rays1;
  std::vector<Eigen::Vector3d> rays2;
  for (const TwoViewMatch& match : matches) {
    rays1.push_back(camera.Unproject(match.pixel1).normalized());
    rays2.push_back(camera.Unproject(match.pixel2).normalized());
  }
  RotationFit fit;
  fit.residuals.assign(matches.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      correlation += rays2[i] * rays1[i].transpose() / std::max(1.0, fit.residuals[i]);
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    fit.R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      fit.residuals[i] = (camera.Project(fit.R * rays1[i]) - matches[i].pixel2).norm();
    }
  }
  return fit;
}

}  // namespace

EpipolarSupport FindEpipolarSupport(const Camera& camera, const std::vector<TwoViewMatch>& matches) {
  constexpr double kMaxResidual = 2.0;      // px, of a match that a rotation explains
  constexpr double kMinExplained = 0.9;     // share of the matches that a rotation explains
  constexpr std::size_t kMaxSampled = 400;  // matches that give the essential matrix
  EpipolarSupport support;
  if (matches.size() < kMinMatches) {
    return support;
  }
  // Images of a camera that turns determine no essential matrix, and the search for one is long.
  const RotationFit turn = FitRotation(camera, matches);
  support.inliers =
      IndicesWhere(matches.size(), [&](std::size_t i) { return turn.residuals[i] <= kMaxResidual; });
  if (static_cast<double>(support.inliers.size()) >= kMinExplained * static_cast<double>(matches.size())) {
    support.only_turns = true;
    support.rotations.emplace_back(turn.R);
    return support;
  }
  support.inliers.clear();
  const std::size_t count = std::min(matches.size(), kMaxSampled);
  std::vector<TwoViewMatch> sampled;
  for (std::size_t i = 0; i < count; ++i) {
    sampled.push_back(matches[i * matches.size() / count]);
  }
  cv::Mat K;
  cv::eigen2cv(camera.K(), K);
  const auto [points1, points2] = PixelsOf(sampled);
  std::vector<uchar> mask;
  const cv::Mat E_cv = FindEssentialFast(points1, points2, K, mask);
  if (E_cv.rows < 3) {
    return support;
  }
  Eigen::Matrix3d E;
  cv::cv2eigen(E_cv.rowRange(0, 3), E);
  support.F21 = camera.K().inverse().transpose() * E * camera.K().inverse();
  const std::vector<Rigid3d> motions = MotionsFromEssential(E_cv.rowRange(0, 3));
  support.rotations = ToVector(motions, &Rigid3d::rotation);
  if (count == matches.size()) {
    support.inliers = IndicesWhere(count, [&](std::size_t i) { return mask[i] != 0; });
    return support;
  }
  support.inliers = IndicesWhere(matches.size(), [&](std::size_t i) {
    const double error = SampsonError(camera, matches[i], motions.front());
    return error * error <= kChi2OneDof * kVariance;
  });
  return support;
}

double FlowWithoutRotation(const Camera& camera, const std::vector<TwoViewMatch>& matches) {
  return UpperMedian(FitRotation(camera, matches).residuals);
}

TwoViewReport EstimateTwoView(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                              const TwoViewOptions& options) {
  if (matches.size() < kMinMatches) {
    return {std::nullopt, "too few matches between two frames (too little texture)"};
  }
  if (FlowWithoutRotation(camera, matches) < kMinTranslationFlow) {
    return {std::nullopt, "the camera only turns (it must translate)"};
  }
  const auto [points1, points2] = PixelsOf(matches);
  const Eigen::Matrix3d K = camera.K();
  cv::Mat K_cv;
  cv::eigen2cv(K, K_cv);
  const cv::Mat H_cv = cv::findHomography(points1, points2, cv::RANSAC, std::sqrt(kChi2TwoDof * kVariance));
  const cv::Mat E_cv = FindEssential(points1, points2, K_cv);
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
