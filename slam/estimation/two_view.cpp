#include "slam/estimation/two_view.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
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
constexpr double kMaxSecondBest = 0.97;      // share of the best motion's score: another one is ambiguous

double EpipolarError(const Eigen::Matrix3d& F21, const Eigen::Vector2d& p1, const Eigen::Vector2d& p2) {
  const Eigen::Vector3d line = F21 * p1.homogeneous();
  const double d = line.dot(p2.homogeneous());
  return d * d / line.head<2>().squaredNorm() / kVariance;
}

// Matches that a motion explains, and its score: the sum of limit - error over them and both images.
struct MotionSupport {
  double score = 0.0;
  std::vector<bool> inliers;
};

MotionSupport SupportOf(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                        const Rigid3d& T_2_1) {
  const Eigen::Matrix3d K_inverse = camera.K().inverse();
  const Eigen::Matrix3d E = Skew(T_2_1.translation) * T_2_1.RotationMatrix();
  const Eigen::Matrix3d F21 = K_inverse.transpose() * E * K_inverse;
  MotionSupport support{0.0, std::vector<bool>(matches.size(), false)};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const double forward = EpipolarError(F21, matches[i].pixel1, matches[i].pixel2);
    const double backward = EpipolarError(F21.transpose(), matches[i].pixel2, matches[i].pixel1);
    support.inliers[i] = forward <= kChi2OneDof && backward <= kChi2OneDof;
    support.score += support.inliers[i] ? 2.0 * kChi2OneDof - forward - backward : 0.0;
  }
  return support;
}

struct Candidate {
  Rigid3d T_camera2_camera1;
  std::vector<std::optional<Eigen::Vector3d>> points;
  int explained = 0;   // matches
  int good = 0;        // of them
  int determined = 0;  // of the good ones
  double score = 0.0;  // of the good ones
};

// Returns the parallax, in radians, above which the noise of both pixels leaves a depth uncertain by less
// than an eighth; no more than what is enough for any lens.
double MinParallax(const Camera& camera) {
  constexpr double kMaxDeviation = 0.125;  // of the depth, relative
  constexpr double kWideParallax = 0.026;  // rad, 1.5 degrees
  return std::min(kWideParallax, std::sqrt(2.0 * kVariance) / camera.fx / kMaxDeviation);
}

// Returns true if the rays are nearest to each other in front of both cameras. Of the motions that a matrix
// decomposes into, most points of the wrong ones are told by this, without a triangulation.
bool MeetInFront(const Rigid3d& T_2_1, const Eigen::Vector3d& ray1, const Eigen::Vector3d& ray2) {
  const Eigen::Vector3d turned = T_2_1.rotation * ray1;
  const double a = turned.squaredNorm(), b = turned.dot(ray2), c = ray2.squaredNorm();
  const double d = turned.dot(T_2_1.translation), e = ray2.dot(T_2_1.translation);
  return b * e > c * d && a * e > b * d;  // both depths, times the determinant a c - b^2 of their equations
}

// Triangulates the matches that the motion explains. A point is good if it is in front of both cameras with a
// small reprojection error, or so far away that its rays are parallel.
Candidate Reconstruct(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                      const Rigid3d& T_camera2_camera1) {
  constexpr double kMaxSquaredError = 4.0 * kVariance;
  constexpr double kParallelCosine = 0.99998;
  const double min_parallax = MinParallax(camera);
  const MotionSupport support = SupportOf(camera, matches, T_camera2_camera1);
  Candidate candidate{T_camera2_camera1, {}};
  candidate.points.resize(matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!support.inliers[i]) {
      continue;
    }
    ++candidate.explained;
    const Eigen::Vector3d ray1 = camera.Unproject(matches[i].pixel1);
    const Eigen::Vector3d ray2 = camera.Unproject(matches[i].pixel2);
    const double cosine = (T_camera2_camera1.rotation * ray1).normalized().dot(ray2.normalized());
    if (cosine > kParallelCosine) {
      ++candidate.good;
      continue;
    }
    if (!MeetInFront(T_camera2_camera1, ray1, ray2)) {
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
  candidate.score = support.score * candidate.good / std::max(candidate.explained, 1);
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

// Motion after small steps along its five degrees of freedom: two of the direction, three of the rotation.
using MotionStep = Eigen::Matrix<double, 5, 1>;

Rigid3d Moved(const Rigid3d& T, const MotionStep& step) {
  const Eigen::Vector3d across1 = T.translation.unitOrthogonal();
  const Eigen::Vector3d across2 = T.translation.cross(across1).normalized();
  return {(ExpRotation(step.tail<3>()) * T.rotation).normalized(),
          (T.translation + step[0] * across1 + step[1] * across2).normalized()};
}

// Information of matches on a motion, and their gradient: the normal equations of the squared Sampson errors.
struct MotionInformation {
  Eigen::Matrix<double, 5, 5> matrix = Eigen::Matrix<double, 5, 5>::Zero();
  MotionStep gradient = MotionStep::Zero();
};

MotionInformation InformationOn(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                                const Rigid3d& T, auto&& is_used) {
  constexpr double kStep = 1e-5;  // rad
  std::array<Rigid3d, 5> moved;
  for (int k = 0; k < 5; ++k) {
    moved[k] = Moved(T, kStep * MotionStep::Unit(k));
  }
  MotionInformation information;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (is_used(i)) {
      const double error = SampsonError(camera, matches[i], T);
      MotionStep derivative;
      for (int k = 0; k < 5; ++k) {
        derivative[k] = (SampsonError(camera, matches[i], moved[k]) - error) / kStep;
      }
      information.matrix += derivative * derivative.transpose() / kVariance;
      information.gradient += derivative * error / kVariance;
    }
  }
  return information;
}

// Returns the standard deviation of the direction of the translation, from the information that the points of
// the candidate hold on all five degrees of freedom.
double DirectionDeviation(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                          const Candidate& candidate) {
  const MotionInformation information =
      InformationOn(camera, matches, candidate.T_camera2_camera1,
                    [&](std::size_t i) { return candidate.points[i].has_value(); });
  const Eigen::Matrix<double, 5, 5> covariance = information.matrix.inverse();
  return std::sqrt(covariance(0, 0) + covariance(1, 1));
}

// Improves a motion by all matches that it explains, and by those that it then explains, until the score no
// longer grows.
Rigid3d Refined(const Camera& camera, const std::vector<TwoViewMatch>& matches, const Rigid3d& T_2_1) {
  constexpr int kMaxSteps = 10;
  Rigid3d best = T_2_1;
  MotionSupport support = SupportOf(camera, matches, best);
  for (int i = 0; i < kMaxSteps; ++i) {
    const MotionInformation information =
        InformationOn(camera, matches, best, [&](std::size_t k) { return support.inliers[k]; });
    const Rigid3d next = Moved(best, -information.matrix.ldlt().solve(information.gradient));
    MotionSupport better = SupportOf(camera, matches, next);
    if (!(better.score > support.score)) {
      break;
    }
    best = next;
    support = std::move(better);
  }
  return best;
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

// Returns true if the directions of two motions differ by more than noise explains.
bool IsOther(const Candidate& a, const Candidate& b) {
  constexpr double kMinAngle = 0.35;  // rad
  return a.T_camera2_camera1.translation.dot(b.T_camera2_camera1.translation) < std::cos(kMinAngle);
}

TwoViewReport ChooseMotion(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                           const std::vector<Rigid3d>& motions, const TwoViewOptions& options) {
  constexpr double kMinGoodShare = 0.5;  // of the matches that a motion explains, to be worth refining
  std::vector<Candidate> candidates;
  for (const Rigid3d& motion : motions) {
    Candidate candidate = Reconstruct(camera, matches, motion);
    candidates.push_back(candidate.good > kMinGoodShare * candidate.explained
                             ? Reconstruct(camera, matches, Refined(camera, matches, motion))
                             : std::move(candidate));
  }
  std::ranges::stable_sort(candidates, std::greater{}, &Candidate::score);
  if (candidates.empty() || candidates.front().good == 0) {
    return {std::nullopt, "the motion has no translation (pure rotation or static camera)"};
  }
  const Candidate& best = candidates.front();
  TwoViewReport report;
  if (best.determined < options.min_points) {
    report.refusal = fmt::format(
        "too little parallax: {} points have enough to determine their depth, at least {} needed (the camera "
        "must translate, not only rotate)",
        best.determined, options.min_points);
  } else if (best.good < 0.8 * static_cast<double>(best.explained)) {
    report.refusal = "too few points could be triangulated";
  } else if (std::ranges::any_of(candidates, [&](const Candidate& other) {
               return IsOther(best, other) && other.score > kMaxSecondBest * best.score;
             })) {
    report.refusal = "the motion is ambiguous (a plane seen from afar)";
  } else {
    report.geometry = TwoViewGeometry{best.T_camera2_camera1, best.points, best.determined,
                                      DirectionDeviation(camera, matches, best)};
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

// Parameters of a search with a short refinement.
cv::UsacParams FastParams(cv::ScoreMethod score, double threshold) {
  cv::UsacParams params;
  params.confidence = kRansacConfidence;
  params.threshold = threshold;
  params.maxIterations = 1000;
  params.score = score;
  params.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  return params;
}

// The same with a shorter refinement: as accurate where there are enough matches, in a third of the time.
// MSAC scores faster still, but with it a fisheye lens of 213 degrees was taken for a usual one.
cv::Mat FindEssentialFast(const std::vector<cv::Point2d>& points1, const std::vector<cv::Point2d>& points2,
                          const cv::Mat& K, std::vector<uchar>& inliers) {
  return cv::findEssentialMat(points1, points2, K, K, cv::noArray(), cv::noArray(), inliers,
                              FastParams(cv::SCORE_METHOD_MAGSAC, std::sqrt(kVariance)));
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

std::size_t FundamentalSupport(const std::vector<TwoViewMatch>& raw_matches) {
  if (raw_matches.size() < kMinMatches) {
    return 0;
  }
  constexpr double kThreshold = 3.0;  // px, for lenses bend epipolar lines
  const auto [points1, points2] = PixelsOf(raw_matches);
  std::vector<uchar> inliers;
  cv::findFundamentalMat(points1, points2, inliers, FastParams(cv::SCORE_METHOD_MSAC, kThreshold));
  return static_cast<std::size_t>(std::ranges::count_if(inliers, [](uchar inlier) { return inlier != 0; }));
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
  std::vector<Rigid3d> motions;
  if (!H_cv.empty()) {
    motions = MotionsFromHomography(H_cv, K_cv);
  }
  if (E_cv.rows >= 3) {
    std::ranges::copy(MotionsFromEssential(E_cv.rowRange(0, 3)), std::back_inserter(motions));
  }
  if (motions.empty()) {
    return {std::nullopt, "no motion explains the matches between two frames"};
  }
  return ChooseMotion(camera, matches, motions, options);
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
