#include "slam/dense/stereo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "slam/util/wide_registers.h"

namespace sqslam {
namespace {

// Computes the matching costs of a keyframe's pixels by a plane sweep (Collins 1996; Gallup et al., CVPR
// 2007): 8 bit with a channel for each plane, 0 for perfect agreement, 254 for none. The planes are parallel
// to the image and evenly spaced in inverse depth from the farthest (0) to the nearest.
cv::Mat SweepPlanes(PatchScores& scores, const DepthRange& range, int planes) {
  std::vector<cv::Mat> costs(static_cast<std::size_t>(planes));
  for (int i = 0; i < planes; ++i) {
    const double share = static_cast<double>(i) / (planes - 1);
    const double inverse = (1.0 - share) / range.farthest + share / range.nearest;
    const cv::Mat score = scores.At(cv::Mat(scores.Size(), CV_32F, cv::Scalar(inverse)));
    cv::Mat(cv::max(score, 0.0)).convertTo(costs[static_cast<std::size_t>(i)], CV_8U, -254.0, 254.0);
  }
  cv::Mat volume;
  cv::merge(costs, volume);
  return volume;
}

constexpr std::size_t kPaths = 4;  // of each pass: two passes make eight

// Extends a path by a pixel: costs for all planes (Eq. 13 of the paper). `last`: those at the previous pixel,
// padded with a large cost on both ends; `least`: their minimum. Adds to `sums` and returns the new minimum.
SQSLAM_WIDE_REGISTERS std::int16_t ExtendPath(int planes, const std::uint8_t* __restrict costs,
                                              const std::int16_t* __restrict last, std::int16_t least,
                                              std::int16_t small_penalty, std::int16_t large_penalty,
                                              std::int16_t* __restrict path, std::int16_t* __restrict sums) {
  const auto jump = static_cast<std::int16_t>(least + large_penalty);
  std::int16_t smallest = std::numeric_limits<std::int16_t>::max();
  for (int d = 0; d < planes; ++d) {
    const std::int16_t down = last[d - 1];
    const std::int16_t up = last[d + 1];
    std::int16_t near = down < up ? down : up;
    near = static_cast<std::int16_t>(near + small_penalty);
    std::int16_t from = last[d] < near ? last[d] : near;
    from = from < jump ? from : jump;
    const auto cost = static_cast<std::int16_t>(costs[d] + from - least);
    path[d] = cost;
    sums[d] = static_cast<std::int16_t>(sums[d] + cost);
    smallest = cost < smallest ? cost : smallest;
  }
  return smallest;
}

// Costs of a path at the pixels of a row, with a pixel more on either side from which it costs nothing to
// come.
class PathRow {
 public:
  PathRow(int width, int planes) : costs_(width + 2, planes + 2, std::int16_t{0}), least_(costs_.rows) {
    constexpr std::int16_t kPaddingCost = 16000;  // beyond the first and the last plane
    costs_.col(0).setTo(kPaddingCost);
    costs_.col(planes + 1).setTo(kPaddingCost);
  }
  std::int16_t* At(int x) { return costs_[x + 1] + 1; }
  std::int16_t& Least(int x) { return least_[static_cast<std::size_t>(x) + 1]; }

 private:
  cv::Mat1s costs_;
  std::vector<std::int16_t> least_;
};

// Returns the penalty of a large step by the contrast between the pixels.
std::array<std::int16_t, 256> LargePenalties(const StereoOptions& options) {
  std::array<std::int16_t, 256> penalties{};
  for (int contrast = 0; contrast < 256; ++contrast) {
    const double penalty = options.large_penalty / (1.0 + contrast / options.edge_contrast);
    penalties[static_cast<std::size_t>(contrast)] =
        static_cast<std::int16_t>(std::max<long>(options.small_penalty, std::lround(penalty)));
  }
  return penalties;
}

// Adds the costs of half of the paths to `sums`: those from the left and from above, or if `back`, from the
// right and from below.
void AddPaths(const cv::Mat& costs, const cv::Mat& gray, const StereoOptions& options, bool back,
              cv::Mat& sums) {
  const int planes = costs.channels();
  const std::array<std::int16_t, 256> large = LargePenalties(options);
  const auto small = static_cast<std::int16_t>(options.small_penalty);
  const int step = back ? -1 : 1;
  cv::Mat padded;
  cv::copyMakeBorder(gray, padded, 1, 1, 1, 1, cv::BORDER_REPLICATE);
  const auto gray_at = [&](int x, int y) { return int{padded.at<std::uint8_t>(y + 1, x + 1)}; };
  std::array<PathRow, kPaths> now{PathRow(gray.cols, planes), PathRow(gray.cols, planes),
                                  PathRow(gray.cols, planes), PathRow(gray.cols, planes)};
  std::array<PathRow, kPaths> before{PathRow(gray.cols, planes), PathRow(gray.cols, planes),
                                     PathRow(gray.cols, planes), PathRow(gray.cols, planes)};
  for (int y = back ? gray.rows - 1 : 0; y >= 0 && y < gray.rows; y += step) {
    std::swap(now, before);
    for (int x = back ? gray.cols - 1 : 0; x >= 0 && x < gray.cols; x += step) {
      const auto extend = [&](PathRow& path, PathRow& last, int from_x, int from_y) {
        const int contrast = std::abs(gray_at(x, y) - gray_at(from_x, from_y));
        path.Least(x) =
            ExtendPath(planes, costs.ptr<std::uint8_t>(y, x), last.At(from_x), last.Least(from_x), small,
                       large[static_cast<std::size_t>(contrast)], path.At(x), sums.ptr<std::int16_t>(y, x));
      };
      extend(now[0], now[0], x - step, y);
      for (int p = 1; p < static_cast<int>(kPaths); ++p) {
        const auto path = static_cast<std::size_t>(p);
        extend(now[path], before[path], x + p - 2, y - step);
      }
    }
  }
}

// Returns the plane of the least sum, refined by the parabola through it and its neighbours.
float LeastPlane(const std::int16_t* sums, int planes) {
  const int d = static_cast<int>(std::min_element(sums, sums + planes) - sums);
  if (d == 0 || d == planes - 1) {
    return static_cast<float>(d);
  }
  const auto curvature = static_cast<float>(sums[d - 1] - 2 * sums[d] + sums[d + 1]);
  return static_cast<float>(d) +
         (curvature > 0.0F ? 0.5F * static_cast<float>(sums[d - 1] - sums[d + 1]) / curvature : 0.0F);
}

// Inverse depths under refinement, each 32FC1.
struct Refined {
  cv::Mat inverse_depth;
  cv::Mat score;
  cv::Mat variance;  // of the inverse depth, by the scores around it
};

// Returns the variance of the position of a top of the score, by its curvature (second derivative): patches
// that differ by noise alone have residuals of 2 (1 - score) of their own variance.
float VarianceAtTop(float score, float curvature) {
  constexpr float kPatchPixels = 25.0F;  // pixels
  return 2.0F * std::max(1.0F - score, 0.0F) / (kPatchPixels * curvature);
}

// Scores the inverse depths and a step to either side, then moves to the top of the parabola through them, or
// to the better side if there is no top. If no score reaches `min_score`, for example if these views don't
// see the surface, the inverse depth stays.
void RefineOnce(PatchScores& scores, float step, float min_score, Refined& refined) {
  auto& [inverse_depth, score, variance] = refined;
  const cv::Mat1f farther = scores.At(inverse_depth - step);
  const cv::Mat1f middle = scores.At(inverse_depth);
  const cv::Mat1f nearer = scores.At(inverse_depth + step);
  for (int y = 0; y < middle.rows; ++y) {
    for (int x = 0; x < middle.cols; ++x) {
      const float left = farther(y, x), center = middle(y, x), right = nearer(y, x);
      const float curvature = left - 2.0F * center + right;
      const bool top = center >= left && center >= right && curvature < 0.0F;
      const float shift = top ? 0.5F * (left - right) / curvature : (right > left ? 1.0F : -1.0F);
      const float best = std::max({left, center, right});
      if (best >= min_score) {
        inverse_depth.at<float>(y, x) += step * shift;
        variance.at<float>(y, x) =
            std::min(top ? VarianceAtTop(center, -curvature / (step * step)) : 1e9F, step * step);
      }
      score.at<float>(y, x) = std::max(score.at<float>(y, x), best);
    }
  }
}

// Smooths each inverse depth by a plane fitted to its neighbours on the same surface: inverse depth is linear
// over the image of a plane. Pixels with a poor score are skipped.
cv::Mat Smoothed(const cv::Mat& inverse_depth, const cv::Mat& score, float min_score) {
  constexpr int kSmoothingReach = 6;        // pixels
  constexpr float kMaxSurfaceStep = 0.02F;  // of the inverse depth, on one surface
  constexpr float kMinFitPixels = 6.0F;
  constexpr int kStep = 2;  // a denser grid adds nothing
  cv::Mat smoothed = inverse_depth.clone();
  for (int y = 0; y < smoothed.rows; ++y) {
    for (int x = 0; x < smoothed.cols; ++x) {
      const float middle = inverse_depth.at<float>(y, x);
      if (score.at<float>(y, x) < min_score) {
        continue;
      }
      float n = 0.0F, sx = 0.0F, sy = 0.0F, sxx = 0.0F, sxy = 0.0F, syy = 0.0F, sd = 0.0F, sxd = 0.0F,
            syd = 0.0F;
      for (int dy = -kSmoothingReach; dy <= kSmoothingReach; dy += kStep) {
        if (y + dy < 0 || y + dy >= smoothed.rows) {
          continue;
        }
        const float* row = inverse_depth.ptr<float>(y + dy);
        const float* scores = score.ptr<float>(y + dy);
        const int first = x - std::min(x, kSmoothingReach) / kStep * kStep;
        const int last = std::min(smoothed.cols - 1, x + kSmoothingReach);
        for (int u = first; u <= last; u += kStep) {
          const float d = row[u] - middle;
          if (scores[u] < min_score || std::abs(d) > kMaxSurfaceStep * middle) {
            continue;
          }
          const auto a = static_cast<float>(u - x);
          const auto b = static_cast<float>(dy);
          n += 1.0F;
          sx += a, sy += b, sxx += a * a, sxy += a * b, syy += b * b;
          sd += d, sxd += a * d, syd += b * d;
        }
      }
      const float det = n * (sxx * syy - sxy * sxy) - sx * (sx * syy - sxy * sy) + sy * (sx * sxy - sxx * sy);
      if (n >= kMinFitPixels && det > 1.0F) {  // the plane's value at the pixel itself (Cramer's rule)
        const float top =
            sd * (sxx * syy - sxy * sxy) - sx * (sxd * syy - sxy * syd) + sy * (sxd * sxy - sxx * syd);
        smoothed.at<float>(y, x) = middle + top / det;
      }
    }
  }
  return smoothed;
}

}  // namespace

PlaneMap AggregateSemiGlobally(const cv::Mat& costs, const cv::Mat& gray, const StereoOptions& options) {
  cv::Mat sums = cv::Mat::zeros(gray.size(), CV_16SC(costs.channels()));
  AddPaths(costs, gray, options, false, sums);
  AddPaths(costs, gray, options, true, sums);
  PlaneMap map{cv::Mat(gray.size(), CV_32F), cv::Mat(gray.size(), CV_8U)};
  for (int y = 0; y < gray.rows; ++y) {
    for (int x = 0; x < gray.cols; ++x) {
      const float plane = LeastPlane(sums.ptr<std::int16_t>(y, x), costs.channels());
      map.plane.at<float>(y, x) = plane;
      map.cost.at<std::uint8_t>(y, x) = costs.ptr<std::uint8_t>(y, x)[std::lround(plane)];
    }
  }
  return map;
}

// Returns how far a point moves in the views per unit of inverse depth, pixels: the mean over the views.
double ParallaxPerInverseDepth(const StereoView& keyframe, const std::vector<StereoView>& views,
                               const Camera& camera) {
  double sum = 0.0;
  for (const StereoView& view : views) {
    const Rigid3d T_view_keyframe = view.T_map_camera.Inverse() * keyframe.T_map_camera;
    sum += camera.fx * T_view_keyframe.translation.head<2>().norm();
  }
  return sum / static_cast<double>(views.size());
}

StereoDepth EstimateDepth(const StereoView& keyframe, const std::vector<StereoView>& views,
                          const std::vector<StereoView>& fine_views, const Camera& camera,
                          const DepthRange& range, const StereoOptions& options) {
  constexpr double kNoise = 2.0;      // grey levels, standard deviation of image noise
  constexpr double kPoseError = 0.1;  // pixels, of the views' poses
  constexpr double kMaxCost =
      150.0;  // of the plane found, above which a pixel has no depth; 254: no agreement
  PatchScores coarse(keyframe, views, camera, kNoise);
  const PlaneMap planes =
      AggregateSemiGlobally(SweepPlanes(coarse, range, options.planes), keyframe.gray, options);
  const double farthest = 1.0 / range.farthest;
  const double step = (1.0 / range.nearest - farthest) / (options.planes - 1);
  Refined refined{planes.plane * step + farthest, {}, cv::Mat(keyframe.gray.size(), CV_32F, step * step)};
  auto& [inverse_depth, score, variance] = refined;
  planes.cost.convertTo(score, CV_32F, -1.0 / 254.0, 1.0);
  const std::vector<StereoView>& finest = fine_views.size() < 2 ? views : fine_views;
  PatchScores scores(keyframe, finest, camera, kNoise);
  const auto min_score = static_cast<float>(1.0 - kMaxCost / 254.0);
  double finer = 0.5 * step;
  for (int round = 0; round < options.refinements; ++round, finer *= 0.5) {
    cv::medianBlur(inverse_depth, inverse_depth, 3);
    RefineOnce(scores, static_cast<float>(finer), min_score, refined);
  }
  inverse_depth = Smoothed(inverse_depth, score, min_score);
  StereoDepth result;
  result.depth = 1.0 / cv::max(inverse_depth, 0.5 * farthest);
  result.depth.setTo(0.0F, score < min_score);
  const double pose = kPoseError / ParallaxPerInverseDepth(keyframe, finest, camera);
  cv::sqrt(variance + pose * pose, result.sigma);
  result.sigma = result.sigma.mul(result.depth);
  return result;
}

}  // namespace sqslam
