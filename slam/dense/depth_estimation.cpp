#include "slam/dense/depth_estimation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <iterator>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "slam/dense/stereo.h"
#include "slam/dense/view_choice.h"
#include "slam/io/image_files.h"
#include "slam/tracking/rolling_shutter.h"
#include "slam/util/parallel.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Inverse depth over an image: value at the centre, slopes over width and height, and lower bound.
struct InverseDepthPlane {
  Eigen::Vector3d coefficients;
  double least = 0.0;

  double At(double u, double v) const {
    return std::max(least, coefficients.dot(Eigen::Vector3d(1.0, u - 0.5, v - 0.5)));
  }
};

std::optional<InverseDepthPlane> PlaneThrough(const std::vector<Eigen::Vector3d>& in_view,
                                              const Camera& camera, const Rigid3d& T_map_camera) {
  constexpr std::size_t kMinPoints = 10;
  constexpr double kDamping = 0.01;  // of the slopes, which few points determine poorly
  if (in_view.size() < kMinPoints) {
    return std::nullopt;
  }
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  Eigen::Matrix3d A =
      kDamping * static_cast<double>(in_view.size()) * Eigen::Vector3d(0.0, 1.0, 1.0).asDiagonal();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p_map : in_view) {
    const Eigen::Vector3d p = T_camera_map * p_map;
    const Eigen::Vector2d pixel = camera.Project(p);
    const Eigen::Vector3d row(1.0, pixel.x() / camera.width - 0.5, pixel.y() / camera.height - 0.5);
    A += row * row.transpose();
    b += row / p.z();
  }
  return InverseDepthPlane{A.ldlt().solve(b), 0.7 / (T_camera_map * in_view.back()).z()};  // farthest last
}

}  // namespace

ShutterCorrection::ShutterCorrection(const Camera& camera, double readout, const Sequence& sequence,
                                     PosesByFrame poses, std::vector<Eigen::Vector3d> points)
    : camera_(camera),
      readout_(readout),
      timestamps_(Timestamps(sequence)),
      poses_(std::move(poses)),
      points_(std::move(points)) {}

cv::Mat ShutterCorrection::Apply(std::int64_t frame, const cv::Mat& image) const {
  constexpr std::size_t kSamples = 300;  // map points
  const auto middle = poses_.find(frame);
  if (readout_ == 0.0 || middle == poses_.end() || image.empty()) {
    return image;
  }
  const auto before = poses_.contains(frame - 1) ? poses_.find(frame - 1) : middle;
  const auto after = poses_.contains(frame + 1) ? poses_.find(frame + 1) : middle;
  const auto plane =
      PlaneThrough(PointsInView(points_, camera_, middle->second, kSamples), camera_, middle->second);
  if (before == after || !plane) {
    return image;
  }
  const double seconds = timestamps_[static_cast<std::size_t>(after->first)] -
                         timestamps_[static_cast<std::size_t>(before->first)];
  const CameraMotion motion =
      CameraMotion::Between(before->second.Inverse(), after->second.Inverse(), seconds);
  cv::Mat places_x(camera_.height, camera_.width, CV_32F);
  cv::Mat places_y(camera_.height, camera_.width, CV_32F);
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      const double inverse =
          plane->At(static_cast<double>(x) / camera_.width, static_cast<double>(y) / camera_.height);
      const Eigen::Vector2d flow = motion.InImage(
          camera_, camera_.Unproject({static_cast<double>(x), static_cast<double>(y)}) / inverse);
      const auto delay = [this](double row) { return ((row + 0.5) / camera_.height - 0.5) * readout_; };
      const double taken = delay(y + delay(y) * flow.y());  // in the row where the point was seen
      places_x.at<float>(y, x) = static_cast<float>(x + taken * flow.x());
      places_y.at<float>(y, x) = static_cast<float>(y + taken * flow.y());
    }
  }
  cv::Mat corrected;
  cv::remap(image, corrected, places_x, places_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return corrected;
}

namespace {

// Returns the frames of the sequence that jobs need: all of a video, which is read from its start.
std::vector<std::int64_t> FramesToRead(const Sequence& sequence,
                                       const std::vector<std::vector<std::int64_t>>& jobs) {
  std::set<std::int64_t> frames;
  for (const std::vector<std::int64_t>& job : jobs) {
    std::ranges::copy_if(job, std::inserter(frames, frames.end()),
                         [&](std::int64_t frame) { return HasFrame(sequence, frame); });
  }
  for (std::size_t i = 0; !sequence.video_path.empty() && i < sequence.frames.size(); ++i) {
    frames.insert(static_cast<std::int64_t>(i));
  }
  return {frames.begin(), frames.end()};
}

Sequence WithFrames(const Sequence& sequence, const std::vector<std::int64_t>& frames) {
  Sequence some = sequence;
  some.frames =
      ToVector(frames, [&](std::int64_t frame) { return sequence.frames[static_cast<std::size_t>(frame)]; });
  return some;
}

}  // namespace

ImageFeed::ImageFeed(const Sequence& sequence, const Camera& camera, const ShutterCorrection& shutter,
                     const std::vector<std::vector<std::int64_t>>& jobs)
    : jobs_(jobs),
      frames_(FramesToRead(sequence, jobs)),
      camera_(camera),
      shutter_(shutter),
      source_(WithFrames(sequence, frames_)) {
  for (std::size_t i = 0; i < jobs_.size(); ++i) {
    keyframes_.insert(jobs_[i].front());
    for (const std::int64_t frame : jobs_[i]) {
      last_jobs_[frame] = i;
    }
  }
  const Camera recorded = ResizedCamera(sequence.camera, camera.width, camera.height);
  if (!recorded.HasDistortion()) {
    return;
  }
  places_x_.create(camera.height, camera.width, CV_32F);
  places_y_.create(camera.height, camera.width, CV_32F);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d place =
          recorded.ProjectDistorted(camera.Unproject({static_cast<double>(x), static_cast<double>(y)}));
      places_x_.at<float>(y, x) = static_cast<float>(place.x());
      places_y_.at<float>(y, x) = static_cast<float>(place.y());
    }
  }
}

DenseImage ImageFeed::Prepare(std::int64_t index, const Frame& frame) const {
  const auto straight = [this, index](const cv::Mat& image) {
    cv::Mat result = Resized(image, {camera_.width, camera_.height});
    if (!places_x_.empty()) {
      cv::remap(cv::Mat(result), result, places_x_, places_y_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    }
    return shutter_.Apply(index, result);
  };
  return {keyframes_.contains(index) ? straight(frame.bgr) : cv::Mat(), straight(frame.gray)};
}

ImageFeed::Job ImageFeed::Next() {
  const std::lock_guard lock(mutex_);
  Job job{next_++, {}};
  const std::vector<std::int64_t>& needed = jobs_[job.index];
  while (read_ < std::ranges::max(needed)) {
    const std::optional<Frame> frame = source_.Next();
    if (!frame) {
      break;
    }
    read_ = frames_[static_cast<std::size_t>(frame->index)];
    if (const auto last = last_jobs_.find(read_); last != last_jobs_.end() && last->second >= job.index) {
      images_.emplace(read_, Prepare(read_, *frame));
    }
  }
  for (const std::int64_t frame : needed) {
    if (const auto image = images_.find(frame); image != images_.end()) {
      job.images.insert(*image);
    }
  }
  std::erase_if(images_, [&](const auto& image) { return last_jobs_.at(image.first) <= job.index; });
  return job;
}

namespace {

// Estimates a keyframe's depth. Returns nothing if its images cannot be read.
std::optional<DepthMap> EstimateKeyframe(const DenseInput& input, std::size_t k, const KeyframePlan& plan,
                                         const std::map<std::int64_t, DenseImage>& images,
                                         const StereoOptions& options) {
  const PosedFrame& keyframe = input.keyframes[k];
  const auto stereo_views = [&](const std::vector<std::size_t>& chosen) {
    std::vector<StereoView> views;
    for (const std::size_t view : chosen) {
      if (const auto image = images.find(input.frames[view].index); image != images.end()) {
        views.push_back({image->second.gray, input.frames[view].T_map_camera});
      }
    }
    return views;
  };
  const auto own = images.find(keyframe.index);
  const std::vector<StereoView> views = stereo_views(plan.views);
  if (own == images.end() || views.size() < 2) {
    return std::nullopt;
  }
  DepthMap map{input.ids[k], keyframe.index, input.camera, keyframe.T_map_camera, {}, {},
               {},           own->second.bgr};
  auto [depth, sigma] = EstimateDepth({own->second.gray, keyframe.T_map_camera}, views,
                                      stereo_views(plan.fine), input.camera, *plan.range, options);
  map.depth = depth;
  map.sigma = sigma;
  input.moving.Apply(map);
  return map;
}

int ThreadsFor(int asked, const StereoOptions& options, const Camera& camera) {
  constexpr double kMemory = 400e6;  // bytes for all threads
  const double bytes = (4.0 * options.planes + 60.0) * camera.width * camera.height;
  const int most = std::max(1, static_cast<int>(kMemory / bytes));
  return std::clamp(asked > 0 ? asked : static_cast<int>(std::thread::hardware_concurrency()), 1, most);
}

// Frames that each job needs, the keyframe first.
std::vector<std::vector<std::int64_t>> FramesOf(const DenseInput& input,
                                                const std::vector<KeyframePlan>& plans,
                                                const std::vector<std::size_t>& jobs) {
  std::vector<std::vector<std::int64_t>> needed;
  for (const std::size_t k : jobs) {
    std::vector<std::int64_t> frames = {input.keyframes[k].index};
    std::set<std::int64_t> others;
    for (const std::vector<std::size_t>* views : {&plans[k].views, &plans[k].fine}) {
      for (const std::size_t view : *views) {
        others.insert(input.frames[view].index);
      }
    }
    frames.insert(frames.end(), others.begin(), others.end());
    needed.push_back(std::move(frames));
  }
  return needed;
}

}  // namespace

bool EstimateDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                       const std::vector<std::size_t>& jobs, const StereoOptions& options, int threads,
                       const TakeDepthMap& take) {
  PosesByFrame poses;
  for (const PosedFrame& frame : input.frames) {
    poses.emplace(frame.index, frame.T_map_camera);
  }
  const ShutterCorrection shutter(input.camera, input.readout, input.sequence, std::move(poses),
                                  input.points);
  ImageFeed feed(input.sequence, input.camera, shutter, FramesOf(input, plans, jobs));
  std::mutex taking;
  bool stopped = false;
  ParallelFor(jobs.size(), ThreadsFor(threads, options, input.camera), [&](std::size_t) {
    if (std::unique_lock lock(taking); stopped) {
      return;
    }
    const ImageFeed::Job job = feed.Next();
    const std::size_t k = jobs[job.index];
    const std::optional<DepthMap> map = EstimateKeyframe(input, k, plans[k], job.images, options);
    const std::lock_guard lock(taking);
    stopped = stopped || !take(k, map);
  });
  return !stopped;
}

}  // namespace sqslam
