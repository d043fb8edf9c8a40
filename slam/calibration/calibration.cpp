#include "slam/calibration/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/geometry/angles.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kMinViews = 3;
constexpr int kMaxViews = 40;            // that are used for the calibration
constexpr double kMaxViewError = 2.5;    // RMS error of a view, in units of the views' median
constexpr double kMaxCornerError = 5.0;  // error of a corner, robust standard deviations

// Corners of the views, and the result of the last calibration.
class Solver {
 public:
  Solver(const std::vector<BoardView>& views, const CalibrationBoard& board, cv::Size image)
      : views_(views), image_(image) {
    const std::vector<cv::Point3f> corners = BoardCorners(board);
    for (const BoardView& view : views) {
      std::vector<cv::Point3f>& points = points_.emplace_back();
      for (const int id : view.ids) {
        points.push_back(corners[id]);
      }
    }
  }

  void Solve(int flags) {
    const std::vector<std::vector<cv::Point2f>> pixels = ToVector(views_, &BoardView::corners);
    K_ = cv::Mat();
    distortion_ = cv::Mat();
    try {
      rms_ = cv::calibrateCamera(points_, pixels, image_, K_, distortion_, rotations_, translations_,
                                 deviations_, cv::noArray(), view_rms_, flags,
                                 {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-9});
    } catch (const cv::Exception&) {
      rms_ = std::numeric_limits<double>::infinity();
    }
    ThrowIf<InputError>(
        !std::isfinite(rms_) || !cv::checkRange(K_) || K_.at<double>(0, 0) <= 0.0,
        "{} views of the board do not determine a camera, expected different tilts that fill the image",
        views_.size());
  }

  // Returns found minus projected corners, px.
  std::vector<cv::Point2f> Errors(std::size_t view) const {
    std::vector<cv::Point2f> modelled;
    cv::projectPoints(points_[view], rotations_[view], translations_[view], K_, distortion_, modelled);
    std::vector<cv::Point2f> errors;
    for (std::size_t i = 0; i < modelled.size(); ++i) {
      errors.push_back(views_[view].corners[i] - modelled[i]);
    }
    return errors;
  }

  // Returns the names of the dropped views.
  std::vector<std::string> DropViews() {
    constexpr double kMinLimit = 0.3;  // px
    std::vector<double> errors;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      errors.push_back(ViewRms(i));
    }
    const double limit = std::max(kMinLimit, kMaxViewError * UpperMedian(std::move(errors)));
    std::vector<std::string> dropped;
    for (std::size_t i = views_.size(); i-- > 0;) {
      if (ViewRms(i) > limit) {
        dropped.push_back(fmt::format("{} ({:.2f} px)", views_[i].name, ViewRms(i)));
        views_.erase(views_.begin() + i);
        points_.erase(points_.begin() + i);
      }
    }
    return dropped;
  }

  // Returns the number of dropped corners. Needs the poses of all views: call before DropViews().
  int DropCorners() {
    constexpr double kMinLimit = 0.5;  // px
    constexpr double kMadToSigma = 1.4826;
    constexpr std::size_t kMinViewCorners = 6;
    std::vector<double> lengths;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      for (const cv::Point2f& error : Errors(i)) {
        lengths.push_back(std::max(std::abs(error.x), std::abs(error.y)));
      }
    }
    const double limit = std::max(kMinLimit, kMaxCornerError * kMadToSigma * UpperMedian(std::move(lengths)));
    int dropped = 0;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const std::vector<cv::Point2f> errors = Errors(i);
      for (std::size_t k = errors.size(); k-- > 0 && views_[i].corners.size() > kMinViewCorners;) {
        if (cv::norm(errors[k]) > limit) {
          const auto at = static_cast<std::ptrdiff_t>(k);
          views_[i].corners.erase(views_[i].corners.begin() + at);
          views_[i].ids.erase(views_[i].ids.begin() + at);
          points_[i].erase(points_[i].begin() + at);
          ++dropped;
        }
      }
    }
    return dropped;
  }

  double Distortion(int i) const { return distortion_.at<double>(i); }
  double Deviation(int i) const { return deviations_.at<double>(i); }
  std::size_t Size() const { return views_.size(); }

  // Returns true if the distortion folds: rays farther out appear farther in, up to the image's corners.
  bool Folds() const {
    const double x = std::max(K_.at<double>(0, 2), image_.width - K_.at<double>(0, 2)) / K_.at<double>(0, 0);
    const double y = std::max(K_.at<double>(1, 2), image_.height - K_.at<double>(1, 2)) / K_.at<double>(1, 1);
    const double reach = 1.05 * std::hypot(x, y);
    double last = 0.0;
    constexpr int kSteps = 200;
    for (int i = 1; i <= kSteps && last < reach; ++i) {
      const double r = 1.5 * reach * i / kSteps;
      const double r2 = r * r;
      const double shown = r * (1.0 + r2 * (Distortion(0) + r2 * (Distortion(1) + r2 * Distortion(4))));
      if (shown <= last) {
        return true;
      }
      last = shown;
    }
    return last < reach;
  }

  Calibration Result() const {
    Calibration result;
    const cv::Matx33d K = K_;
    result.camera = {image_.width, image_.height, K(0, 0), K(1, 1), K(0, 2), K(1, 2), {}};
    std::copy_n(distortion_.begin<double>(), 5, result.camera.distortion.begin());
    std::copy_n(deviations_.begin<double>(), 4, result.intrinsic_deviation.begin());
    std::copy_n(deviations_.begin<double>() + 4, 5, result.distortion_deviation.begin());
    result.rms = rms_;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      result.views.push_back(ViewOf(i));
    }
    return result;
  }

 private:
  double ViewRms(std::size_t view) const { return view_rms_.at<double>(static_cast<int>(view)); }

  CalibratedView ViewOf(std::size_t i) const {
    CalibratedView view;
    view.name = views_[i].name;
    const std::vector<cv::Point2f> errors = Errors(i);
    for (std::size_t k = 0; k < errors.size(); ++k) {
      view.pixels.emplace_back(views_[i].corners[k].x, views_[i].corners[k].y);
      view.errors.emplace_back(errors[k].x, errors[k].y);
    }
    view.rms = ViewRms(i);
    cv::Mat R;
    cv::Rodrigues(rotations_[i], R);
    const Eigen::Vector3d normal(R.at<double>(0, 2), R.at<double>(1, 2), R.at<double>(2, 2));
    view.normal = normal.z() > 0.0 ? Eigen::Vector3d(-normal) : normal;
    return view;
  }

  std::vector<BoardView> views_;
  std::vector<std::vector<cv::Point3f>> points_;
  cv::Size image_;
  cv::Mat K_, distortion_, deviations_, view_rms_;
  std::vector<cv::Mat> rotations_, translations_;
  double rms_ = 0.0;
};

double CoveredShare(const Calibration& calibration) {
  std::vector<cv::Point2f> all;
  for (const CalibratedView& view : calibration.views) {
    for (const Eigen::Vector2d& pixel : view.pixels) {
      all.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    }
  }
  std::vector<cv::Point2f> hull;
  cv::convexHull(all, hull);
  return cv::contourArea(hull) / (static_cast<double>(calibration.camera.width) * calibration.camera.height);
}

double LargestAngle(const std::vector<CalibratedView>& views) {
  double largest = 0.0;
  for (const CalibratedView& a : views) {
    for (const CalibratedView& b : views) {
      largest = std::max(largest, std::acos(std::clamp(a.normal.dot(b.normal), -1.0, 1.0)));
    }
  }
  return largest;
}

// Position of the whole board in the image, and its tilt.
using Descriptor = Eigen::Matrix<double, 6, 1>;

Descriptor Describe(const BoardView& view, const std::vector<cv::Point3f>& board, cv::Size image) {
  const std::vector<cv::Point2f> all =
      ToVector(board, [](const cv::Point3f& corner) { return cv::Point2f(corner.x, corner.y); });
  const std::vector<cv::Point2f> flat = ToVector(view.ids, [&](int id) { return all[id]; });
  const cv::Rect2f around = cv::boundingRect(all);
  std::vector<cv::Point2f> outline = {
      around.tl(), {around.br().x, around.y}, around.br(), {around.x, around.br().y}};
  const cv::Mat homography = cv::findHomography(flat, view.corners);
  if (homography.empty()) {
    return Descriptor::Zero();
  }
  std::vector<cv::Point2f> quad;
  cv::perspectiveTransform(outline, quad, homography);
  const auto side = [&](std::size_t a, std::size_t b) { return std::max(1e-3, cv::norm(quad[a] - quad[b])); };
  const cv::Point2f center = 0.25F * (quad[0] + quad[1] + quad[2] + quad[3]);
  const double area = std::max(1.0, cv::contourArea(quad));
  constexpr double kTiltWeight = 2.0;  // one side a third longer counts like half the image's width
  Descriptor descriptor;
  descriptor << center.x / image.width, center.y / image.height, 0.5 * std::log(area / image.area()),
      kTiltWeight * std::log(side(0, 3) / side(1, 2)), kTiltWeight * std::log(side(0, 1) / side(3, 2)),
      0.5 * std::log(side(0, 1) / side(0, 3));
  return descriptor;
}

// Returns the indices of at most kMaxViews views that differ most from one another, sharp ones first: in the
// board's position in the image, its size and its tilt in both directions. Skips views similar to a chosen
// one, and those much blurrier than the rest.
std::vector<int> SelectViews(const std::vector<BoardView>& views, const CalibrationBoard& board,
                             cv::Size image) {
  constexpr double kMinGain = 0.03;      // distance below which a view adds nothing
  constexpr double kMinSharpness = 0.6;  // relative to the sharp views
  if (views.empty()) {
    return {};
  }
  const std::vector<cv::Point3f> corners = BoardCorners(board);
  std::vector<Descriptor> descriptors;
  std::vector<double> sharpness;
  for (const BoardView& view : views) {
    descriptors.push_back(Describe(view, corners, image));
    sharpness.push_back(view.sharpness);
  }
  const double reference = std::max(1e-6, LowerQuantile(std::move(sharpness), 0.8));
  std::vector<double> gain(views.size(), 1e3);  // the first view is chosen by sharpness only
  std::vector<int> chosen;
  while (static_cast<int>(chosen.size()) < kMaxViews) {
    int best = -1;
    double best_gain = kMinGain;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double relative = std::min(1.0, views[i].sharpness / reference);
      if (relative >= kMinSharpness && gain[i] * relative > best_gain) {
        best = static_cast<int>(i);
        best_gain = gain[i] * relative;
      }
    }
    if (best < 0) {
      break;
    }
    chosen.push_back(best);
    for (std::size_t i = 0; i < views.size(); ++i) {
      gain[i] = std::min(gain[i], (descriptors[i] - descriptors[best]).norm());
    }
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace

Calibration Calibrate(const std::vector<BoardView>& views, const CalibrationBoard& board, cv::Size image) {
  constexpr int kRounds = 6;
  constexpr double kMinSignificance = 3.0;  // standard deviations
  const std::vector<BoardView> chosen =
      ToVector(SelectViews(views, board, image), [&](const int index) { return views[index]; });
  ThrowIf<InputError>(static_cast<int>(chosen.size()) < kMinViews,
                      "{} different views of the board, expected at least {}: move and tilt it",
                      chosen.size(), kMinViews);
  Solver solver(chosen, board, image);
  std::vector<std::string> dropped_views;
  int dropped_corners = 0;
  int flags = 0;
  solver.Solve(cv::CALIB_FIX_K3);
  for (int round = 0; round < kRounds; ++round) {
    const int corners = solver.DropCorners();
    const std::vector<std::string> dropped = solver.DropViews();
    dropped_corners += corners;
    dropped_views.insert(dropped_views.end(), dropped.begin(), dropped.end());
    ThrowIf<InputError>(static_cast<int>(solver.Size()) < kMinViews,
                        "only {} views of the board agree with one another, expected at least {}: a flat "
                        "board, a fixed focus, no zoom",
                        solver.Size(), kMinViews);
    if (corners == 0 && dropped.empty() && round > 0) {
      break;
    }
    solver.Solve(flags);
  }
  if (std::abs(solver.Distortion(4)) < kMinSignificance * solver.Deviation(8) || solver.Folds()) {
    flags |= cv::CALIB_FIX_K3;
    solver.Solve(flags);
  }
  Calibration result = solver.Result();
  result.dropped_views = dropped_views;
  result.dropped_corners = dropped_corners;
  result.covered = CoveredShare(result);
  result.tilt = LargestAngle(result.views);
  result.folds = solver.Folds();
  return result;
}

std::vector<std::string> Weaknesses(const Calibration& c) {
  constexpr double kMinCovered = 0.7;
  constexpr double kMinTilt = 30.0;  // degrees
  constexpr std::size_t kSafeViews = 10;
  constexpr double kMaxDeviation = 0.005;  // of the focal length
  constexpr double kMaxRms = 1.0;          // px
  std::vector<std::string> weaknesses;
  const auto add = [&](bool weak, const std::string& text) {
    if (weak) {
      weaknesses.push_back(text);
    }
  };
  add(c.covered < kMinCovered, fmt::format("the boards cover {:.0f} % of the image, expected {:.0f} %: the "
                                           "distortion is extrapolated towards its borders",
                                           100.0 * c.covered, 100.0 * kMinCovered));
  add(c.tilt * kDegreesPerRadian < kMinTilt,
      fmt::format("the boards are nearly parallel ({:.0f} degrees at most between two of them, expected "
                  "{:.0f}): the focal length is poorly determined, tilt the board",
                  c.tilt * kDegreesPerRadian, kMinTilt));
  add(c.views.size() < kSafeViews,
      fmt::format("only {} views, expected at least {}", c.views.size(), kSafeViews));
  add(c.intrinsic_deviation[0] > kMaxDeviation * c.camera.fx,
      fmt::format("the standard deviation of fx is {:.1f} px, {:.1f} % of it", c.intrinsic_deviation[0],
                  100.0 * c.intrinsic_deviation[0] / c.camera.fx));
  add(c.rms > kMaxRms,
      fmt::format("the RMS error is {:.2f} px, expected less than {:.0f}: a blurred video or a "
                  "board that is not flat",
                  c.rms, kMaxRms));
  add(c.folds,
      "the distortion folds back within the image, so its corners are wrong: show the board closer to them");
  return weaknesses;
}

}  // namespace sqslam
