#include "slam/dense/stereo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

// Refines once: scores the inverse depths and a step to either side, then moves to the top of the parabola
// through them, or to the better side if there is no top. If no score is `enough`, for example if these views
// don't see the surface, the inverse depth stays.
void RefineOnce(PatchScores& scores, float step, float enough, cv::Mat& inverse_depth, cv::Mat& score) {
  std::array<cv::Mat, 3> tried;
  std::vector<float> row_depth(static_cast<std::size_t>(scores.Width()));
  for (int k = 0; k < 3; ++k) {
    cv::Mat& found = tried[static_cast<std::size_t>(k)];
    found.create(scores.Height(), scores.Width(), CV_32F);
    const float offset = static_cast<float>(k - 1) * step;
    scores.Visit(
        [&](int y) {
          const float* row = inverse_depth.ptr<float>(y);
          std::transform(row, row + scores.Width(), row_depth.begin(),
                         [offset](float value) { return value + offset; });
          return row_depth.data();
        },
        [&](int y, const float* row) { std::copy_n(row, scores.Width(), found.ptr<float>(y)); });
  }
  for (int y = 0; y < scores.Height(); ++y) {
    const float* left = tried[0].ptr<float>(y);
    const float* middle = tried[1].ptr<float>(y);
    const float* right = tried[2].ptr<float>(y);
    float* depth = inverse_depth.ptr<float>(y);
    float* kept = score.ptr<float>(y);
    for (int x = 0; x < scores.Width(); ++x) {
      const float bend = left[x] - 2.0F * middle[x] + right[x];
      const bool top = middle[x] >= left[x] && middle[x] >= right[x] && bend < 0.0F;
      const float shift = top ? 0.5F * (left[x] - right[x]) / bend : (right[x] > left[x] ? 1.0F : -1.0F);
      const float best = std::max({left[x], middle[x], right[x]});
      depth[x] += best >= enough ? step * shift : 0.0F;
      kept[x] = std::max(kept[x], best);
    }
  }
}

// Smooths each inverse depth by a plane fitted to its neighbours on the same surface: inverse depth is linear
// over the image of a plane. Pixels with a poor score are skipped.
cv::Mat Smoothed(const cv::Mat& inverse_depth, const cv::Mat& score, float enough, int reach) {
  constexpr float kOneSurface = 0.02F;  // of the inverse depth
  constexpr int kStep = 2;              // a denser grid adds nothing
  cv::Mat smoothed = inverse_depth.clone();
  for (int y = 0; y < smoothed.rows; ++y) {
    for (int x = 0; x < smoothed.cols; ++x) {
      const float middle = inverse_depth.at<float>(y, x);
      if (score.at<float>(y, x) < enough) {
        continue;
      }
      float n = 0.0F, sx = 0.0F, sy = 0.0F, sxx = 0.0F, sxy = 0.0F, syy = 0.0F, sd = 0.0F, sxd = 0.0F,
            syd = 0.0F;
      for (int dy = -reach; dy <= reach; dy += kStep) {
        if (y + dy < 0 || y + dy >= smoothed.rows) {
          continue;
        }
        const float* row = inverse_depth.ptr<float>(y + dy);
        const float* scores = score.ptr<float>(y + dy);
        const int first = x - std::min(x, reach) / kStep * kStep;
        const int last = std::min(smoothed.cols - 1, x + reach);
        for (int u = first; u <= last; u += kStep) {
          const float d = row[u] - middle;
          if (scores[u] < enough || std::abs(d) > kOneSurface * middle) {
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
      constexpr float kFew = 6.0F;
      if (n >= kFew && det > 1.0F) {  // the plane's value at the pixel itself (Cramer's rule)
        const float top =
            sd * (sxx * syy - sxy * sxy) - sx * (sxd * syy - sxy * syd) + sy * (sxd * sxy - sxx * syd);
        smoothed.at<float>(y, x) = middle + top / det;
      }
    }
  }
  return smoothed;
}

}  // namespace

cv::Mat EstimateDepth(const StereoView& keyframe, const std::vector<StereoView>& views,
                      const std::vector<StereoView>& fine_views, const Camera& camera,
                      const DepthRange& range, const StereoOptions& options) {
  PatchScores coarse(keyframe, views, camera, options.noise);
  const PlaneMap planes =
      AggregateSemiGlobally(SweepPlanes(coarse, range, options.planes), keyframe.gray, options);
  const double farthest = 1.0 / range.farthest;
  const double step = (1.0 / range.nearest - farthest) / (options.planes - 1);
  cv::Mat inverse_depth = planes.plane * step + farthest;
  cv::Mat score(planes.cost.size(), CV_32F);
  planes.cost.convertTo(score, CV_32F, -1.0 / 254.0, 1.0);
  PatchScores scores(keyframe, fine_views.size() < 2 ? views : fine_views, camera, options.noise);
  const auto enough = static_cast<float>(1.0 - options.max_cost / 254.0);
  double finer = 0.5 * step;
  for (int round = 0; round < options.refinements; ++round, finer *= 0.5) {
    cv::medianBlur(inverse_depth, inverse_depth, 3);
    RefineOnce(scores, static_cast<float>(finer), enough, inverse_depth, score);
  }
  if (options.smoothing > 0) {
    inverse_depth = Smoothed(inverse_depth, score, enough, options.smoothing);
  }
  cv::Mat depth = 1.0 / cv::max(inverse_depth, 0.5 * farthest);
  depth.setTo(0.0F, score < enough);
  return depth;
}

}  // namespace sqslam
