#include "slam/dense/plane_fill.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "slam/dense/depth_fusion.h"
#include "slam/util/disjoint_sets.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kReach = 2;       // pixels beyond a region's border that support its depth: colours mix there
constexpr int kMinPixels = 60;  // least size of a region, and of its part with depth
constexpr double kMaxDifference = 0.03;  // distance of a depth from its plane, share of the depth

// Returns the label of each pixel's region (32SC1): connected pixels of similar colour.
cv::Mat RegionsOf(const cv::Mat& bgr) {
  constexpr int kMaxStep = 3;  // grey levels of any channel between neighbouring pixels
  cv::Mat smooth;
  cv::GaussianBlur(bgr, smooth, {3, 3}, 0.0);
  const int cols = smooth.cols;
  DisjointSets sets(smooth.total());
  const auto join = [&](const cv::Vec3b& a, const cv::Vec3b& b, int i, int j) {
    const int step = std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
    if (step <= kMaxStep) {
      sets.Join(i, j);
    }
  };
  for (int y = 0; y < smooth.rows; ++y) {
    const cv::Vec3b* row = smooth.ptr<cv::Vec3b>(y);
    const cv::Vec3b* below = y + 1 < smooth.rows ? smooth.ptr<cv::Vec3b>(y + 1) : nullptr;
    for (int x = 0; x < cols; ++x) {
      if (x + 1 < cols) {
        join(row[x], row[x + 1], y * cols + x, y * cols + x + 1);
      }
      if (below != nullptr) {
        join(row[x], below[x], y * cols + x, (y + 1) * cols + x);
      }
    }
  }
  cv::Mat regions(smooth.size(), CV_32S);
  for (int i = 0; i < static_cast<int>(smooth.total()); ++i) {
    regions.at<std::int32_t>(i / cols, i % cols) = sets.Root(i);
  }
  return regions;
}

// Inverse depth at a pixel: for a plane it is linear over the image, (u, v, 1) . plane.
struct Support {
  Eigen::Vector3d pixel;  // u, v, 1
  double inverse = 0.0;
};

std::optional<Eigen::Vector3d> PlaneThrough(const std::vector<Support>& support) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Support& s : support) {
    A += s.pixel * s.pixel.transpose();
    b += s.pixel * s.inverse;
  }
  const Eigen::Vector3d plane = A.ldlt().solve(b);
  return plane.allFinite() ? std::optional(plane) : std::nullopt;
}

bool LiesOn(const Eigen::Vector3d& plane, const Support& s) {
  return std::abs(plane.dot(s.pixel) - s.inverse) <= kMaxDifference * s.inverse;
}

struct FittedPlane {
  Eigen::Vector3d inverse_depth;
  double sigma = 0.0;  // of its depths, share of them: as its supports show
};

// Returns the plane with the RMS of its residuals, which curved surfaces increase.
FittedPlane WithSigma(const Eigen::Vector3d& plane, const std::vector<Support>& inliers) {
  double squares = 0.0;
  for (const Support& s : inliers) {
    const double residual = plane.dot(s.pixel) / s.inverse - 1.0;
    squares += residual * residual;
  }
  return {plane, std::sqrt(squares / static_cast<double>(inliers.size()))};
}

// Returns the plane with the most inliers (RANSAC), or nothing if there are fewer than `min_inliers`.
std::optional<FittedPlane> CommonPlane(const std::vector<Support>& support, int trials, double min_inliers,
                                       cv::RNG& random, std::vector<Support>& inliers) {
  constexpr std::size_t kMaxTested = 200;  // supports tested per trial
  const std::size_t stride = std::max<std::size_t>(1, support.size() / kMaxTested);
  std::size_t most = 0;
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (int trial = 0; trial < trials; ++trial) {
    Eigen::Matrix3d pixels;
    Eigen::Vector3d inverses;
    for (int i = 0; i < 3; ++i) {
      const Support& s =
          support[static_cast<std::size_t>(random.uniform(0, static_cast<int>(support.size())))];
      pixels.row(i) = s.pixel.transpose();
      inverses[i] = s.inverse;
    }
    const double area = std::abs(pixels.determinant());  // twice the triangle's, pixels^2
    if (area < 20.0) {
      continue;
    }
    const Eigen::Vector3d plane = pixels.partialPivLu().solve(inverses);
    std::size_t votes = 0;
    for (std::size_t i = 0; i < support.size(); i += stride) {
      votes += LiesOn(plane, support[i]) ? 1U : 0U;
    }
    if (votes > most) {
      most = votes;
      best = plane;
    }
  }
  for (int round = 0; round < 2 && most > 0; ++round) {
    inliers.clear();
    std::ranges::copy_if(support, std::back_inserter(inliers),
                         [&](const Support& s) { return LiesOn(best, s); });
    const auto fitted = PlaneThrough(inliers);
    if (static_cast<double>(inliers.size()) < min_inliers || !fitted) {
      return std::nullopt;
    }
    best = *fitted;
  }
  return most > 0 ? std::optional(WithSigma(best, inliers)) : std::nullopt;
}

// Returns the planes of a region of one colour that extends around corners, such as doors of a kitchen: each
// holds a share of the supports, the largest first.
std::vector<FittedPlane> SeveralPlanes(std::vector<Support> support, cv::RNG& random) {
  constexpr std::size_t kMaxPlanes = 4;
  constexpr double kMinShare = 0.15;  // of the supports that must lie on each plane
  constexpr int kTrials = 400;        // finds a plane of a fifth of the supports in 19 of 20 cases
  const double min_inliers = std::max(kMinShare * static_cast<double>(support.size()), double{kMinPixels});
  std::vector<FittedPlane> planes;
  std::vector<Support> inliers;
  while (planes.size() < kMaxPlanes && static_cast<double>(support.size()) >= min_inliers) {
    const auto plane = CommonPlane(support, kTrials, min_inliers, random, inliers);
    if (!plane) {
      break;
    }
    planes.push_back(*plane);
    std::erase_if(support, [&](const Support& s) { return LiesOn(plane->inverse_depth, s); });
  }
  return planes;
}

struct Region {
  std::vector<cv::Point> empty;  // pixels without depth
  std::vector<Support> support;
};

// Returns the regions with enough empty pixels and enough supports, in the order of their labels.
std::vector<Region> EmptyRegions(const DepthMap& map, const cv::Mat& labels) {
  std::vector<Region> regions(labels.total());
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      const auto own = static_cast<std::size_t>(labels.at<std::int32_t>(y, x));
      const float z = map.depth.at<float>(y, x);
      if (!(z > 0.0F)) {
        regions[own].empty.emplace_back(x, y);
        continue;
      }
      const Support support{{double(x), double(y), 1.0}, 1.0 / z};
      regions[own].support.push_back(support);
      std::array<std::size_t, 4> others{own, own, own, own};
      std::size_t count = 0;
      for (const auto& [dx, dy] : {std::pair(-kReach, 0), {kReach, 0}, {0, -kReach}, {0, kReach}}) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= labels.cols || y + dy >= labels.rows) {
          continue;
        }
        const auto other = static_cast<std::size_t>(labels.at<std::int32_t>(y + dy, x + dx));
        if (std::ranges::find(others, other) == others.end()) {
          others[count++] = other;
          regions[other].support.push_back(support);
        }
      }
    }
  }
  std::erase_if(regions, [](const Region& region) {
    return std::min(region.empty.size(), region.support.size()) < std::size_t{kMinPixels};
  });
  return regions;
}

// For each pixel of a region, the first pixels with depth along eight directions, within the region or up to
// kReach beyond.
class RayHits {
 public:
  RayHits(const cv::Mat& labels, const cv::Mat& depth) {
    for (std::size_t d = 0; d < kDirections.size(); ++d) {
      Trace(labels, depth, kDirections[d], met_[d]);
    }
  }

  // Returns the index of the plane that most lines meet: at least three lines, and most of those that meet
  // anything. -1 if there is none.
  int PlaneAt(const cv::Point& pixel, const std::vector<FittedPlane>& planes, const cv::Mat& depth) const {
    constexpr int kMinVotes = 3;
    std::vector<int> votes(planes.size());
    int met = 0;
    for (const cv::Mat& of_direction : met_) {
      const std::int32_t at = of_direction.at<std::int32_t>(pixel);
      if (at < 0) {
        continue;
      }
      ++met;
      const cv::Point there(at % depth.cols, at / depth.cols);
      const Support support{{double(there.x), double(there.y), 1.0}, 1.0 / depth.at<float>(there)};
      for (std::size_t i = 0; i < planes.size(); ++i) {
        votes[i] += LiesOn(planes[i].inverse_depth, support) ? 1 : 0;
      }
    }
    const auto most = std::ranges::max_element(votes);
    return *most >= kMinVotes && 2 * *most > met ? static_cast<int>(most - votes.begin()) : -1;
  }

 private:
  static constexpr std::array<std::array<int, 2>, 8> kDirections = {
      {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};

  static void Trace(const cv::Mat& labels, const cv::Mat& depth, const std::array<int, 2>& step,
                    cv::Mat& met) {
    const auto [dx, dy] = step;
    met = cv::Mat(labels.size(), CV_32S, cv::Scalar(-1));
    const cv::Rect whole({0, 0}, labels.size());
    for (int i = 0; i < labels.rows; ++i) {
      const int y = dy > 0 ? labels.rows - 1 - i : i;  // the pixel ahead comes first
      for (int k = 0; k < labels.cols; ++k) {
        const int x = dx > 0 ? labels.cols - 1 - k : k;
        cv::Point ahead(x + dx, y + dy);
        if (!whole.contains(ahead)) {
          continue;
        }
        std::int32_t& own = met.at<std::int32_t>(y, x);
        if (labels.at<std::int32_t>(ahead) == labels.at<std::int32_t>(y, x)) {
          own = depth.at<float>(ahead) > 0.0F ? ahead.y * labels.cols + ahead.x : met.at<std::int32_t>(ahead);
          continue;
        }
        for (int beyond = 0; beyond < kReach && own < 0 && whole.contains(ahead); ++beyond) {
          own = depth.at<float>(ahead) > 0.0F ? ahead.y * labels.cols + ahead.x : -1;
          ahead += cv::Point(dx, dy);
        }
      }
    }
  }

  std::array<cv::Mat, kDirections.size()> met_;  // 32SC1: row and column in one number; -1: none
};

// Gives a pixel the depth of a plane, unless the plane is seen at a grazing angle.
void Fill(const cv::Point& pixel, const FittedPlane& plane, DepthMap& map) {
  constexpr double kMaxSlope = 10.0;  // of a trusted plane (tangent)
  const double inverse = plane.inverse_depth.dot(Eigen::Vector3d(pixel.x, pixel.y, 1.0));
  const double slope = plane.inverse_depth.head<2>().norm() * map.camera.fx / std::max(inverse, 1e-12);
  if (inverse > 0.0 && slope < kMaxSlope) {
    map.depth.at<float>(pixel) = static_cast<float>(1.0 / inverse);
    map.sigma.at<float>(pixel) = static_cast<float>(plane.sigma);
    map.views.at<std::uint8_t>(pixel) = kFilledByPlane;
  }
}

// Fills a region with the plane that each pixel sees around it. Pixels follow the majority of their
// neighbourhood: single lines of hits end at clutter.
void FillByRays(const Region& region, const std::vector<FittedPlane>& planes, const RayHits& hits,
                const cv::Mat& known, DepthMap& map) {
  constexpr int kRadius = 6;         // pixels, of a neighbourhood
  constexpr double kMinShare = 0.4;  // share of its empty pixels that must see the same plane
  const cv::Rect bounds = cv::boundingRect(region.empty);
  const auto count_around = [&](const auto& counts) {  // per pixel of `bounds`, over its neighbourhood
    cv::Mat mask(bounds.size(), CV_32F, cv::Scalar(0.0));
    for (std::size_t i = 0; i < region.empty.size(); ++i) {
      mask.at<float>(region.empty[i] - bounds.tl()) = counts(i) ? 1.0F : 0.0F;
    }
    cv::boxFilter(mask, mask, CV_32F, cv::Size(2 * kRadius + 1, 2 * kRadius + 1), {-1, -1}, false,
                  cv::BORDER_CONSTANT);
    return mask;
  };
  std::vector<int> seen(region.empty.size());
  std::ranges::transform(region.empty, seen.begin(),
                         [&](const cv::Point& pixel) { return hits.PlaneAt(pixel, planes, known); });
  const cv::Mat all = count_around([](std::size_t) { return true; });
  std::vector<float> most(region.empty.size());
  std::vector<int> chosen(region.empty.size(), -1);
  for (int plane = 0; plane < static_cast<int>(planes.size()); ++plane) {
    const cv::Mat agree = count_around([&](std::size_t i) { return seen[i] == plane; });
    for (std::size_t i = 0; i < region.empty.size(); ++i) {
      const cv::Point at = region.empty[i] - bounds.tl();
      if (agree.at<float>(at) > std::max<double>(most[i], kMinShare * all.at<float>(at))) {
        most[i] = agree.at<float>(at);
        chosen[i] = plane;
      }
    }
  }
  for (std::size_t i = 0; i < region.empty.size(); ++i) {
    if (chosen[i] >= 0) {
      Fill(region.empty[i], planes[static_cast<std::size_t>(chosen[i])], map);
    }
  }
}

}  // namespace

DepthMap FillPlanes(const DepthMap& map) {
  constexpr double kMinSupport = 0.7;  // share of a region's known depths that must lie on one plane
  constexpr int kTrials = 40;
  DepthMap filled = map;
  filled.depth = map.depth.clone();
  filled.sigma =
      map.sigma.empty() ? cv::Mat(map.depth.size(), CV_32F, cv::Scalar(kUnknownSigma)) : map.sigma.clone();
  filled.views = map.views.clone();
  const cv::Mat earlier = map.views == kFilledByPlane;
  filled.depth.setTo(0.0F, earlier);
  filled.views.setTo(0, earlier);
  cv::RNG random(1);
  const cv::Mat labels = RegionsOf(map.bgr);
  const cv::Mat known = filled.depth.clone();
  std::optional<RayHits> hits;  // created on demand
  for (const Region& region : EmptyRegions(filled, labels)) {
    std::vector<Support> inliers;
    const double min_inliers = kMinSupport * static_cast<double>(region.support.size());
    const auto plane = CommonPlane(region.support, kTrials, min_inliers, random, inliers);
    if (!plane) {
      if (const auto planes = SeveralPlanes(region.support, random); !planes.empty()) {
        if (!hits) {
          hits.emplace(labels, known);
        }
        FillByRays(region, planes, *hits, known, filled);
      }
      continue;
    }
    std::vector<cv::Point2f> corners, hull;
    for (const Support& s : inliers) {
      corners.emplace_back(static_cast<float>(s.pixel.x()), static_cast<float>(s.pixel.y()));
    }
    cv::convexHull(corners, hull);
    for (const cv::Point& pixel : region.empty) {
      if (cv::pointPolygonTest(hull, cv::Point2f(pixel), false) >= 0.0) {
        Fill(pixel, *plane, filled);
      }
    }
  }
  return filled;
}

DepthMap KeepConfirmedFills(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                            const DepthFusionOptions& options) {
  DepthMap kept = map;
  kept.depth = map.depth.clone();
  kept.views = map.views.clone();
  const std::vector<Rigid3d> T_neighbour_map =
      ToVector(neighbours, [](const DepthMap& neighbour) { return neighbour.T_map_camera.Inverse(); });
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (map.views.at<std::uint8_t>(y, x) != kFilledByPlane) {
        continue;
      }
      const Eigen::Vector3d p_map = map.PointAt(x, y);
      int agree = 0;
      bool seen_through = false;
      for (std::size_t i = 0; i < neighbours.size() && !seen_through; ++i) {
        const DepthMap& other = neighbours[i];
        const Eigen::Vector3d p = T_neighbour_map[i] * p_map;
        const Eigen::Vector2d pixel = p.z() > 0.0 ? other.camera.Project(p) : Eigen::Vector2d(-1.0, -1.0);
        const auto u = static_cast<int>(std::lround(pixel.x()));
        const auto v = static_cast<int>(std::lround(pixel.y()));
        if (u < 0 || v < 0 || u >= other.depth.cols || v >= other.depth.rows) {
          continue;
        }
        const double z = other.depth.at<float>(v, u);
        agree += std::abs(z - p.z()) <= kMaxDepthDifference * p.z() ? 1 : 0;
        seen_through = other.views.at<std::uint8_t>(v, u) != kFilledByPlane &&
                       z > (1.0 + 3.0 * kMaxDepthDifference) * p.z();
      }
      if (seen_through || agree < options.min_views || map.SigmaAt(x, y) > options.max_sigma) {
        kept.depth.at<float>(y, x) = 0.0F;
        kept.views.at<std::uint8_t>(y, x) = 0;
      }
    }
  }
  return kept;
}

}  // namespace sqslam
