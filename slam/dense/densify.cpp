#include "slam/dense/densify.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "slam/dense/consistency.h"
#include "slam/dense/dense_cloud.h"
#include "slam/dense/image_feed.h"
#include "slam/dense/moving_mask.h"
#include "slam/dense/stereo.h"
#include "slam/dense/view_choice.h"
#include "slam/io/cameras.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// The input of a call: the finished map, and the frames that went into it.
struct DenseInput {
  MapSnapshotPtr map;
  Sequence sequence;
  Camera camera;                        // of the depth maps
  std::vector<PosedFrame> frames;       // those with a pose, whose images are there
  std::vector<PosedFrame> keyframes;    // in the order of their frames
  std::vector<std::int64_t> ids;        // of the keyframes
  std::vector<Eigen::Vector3d> points;  // of the map
  double readout = 0.0;                 // seconds from the first to the last row of an image
  MovingMask moving;
};

// The work on a keyframe.
struct KeyframePlan {
  std::vector<Eigen::Vector3d> in_view;  // some of the map points that it sees
  std::optional<DepthRange> range;       // empty: no depth
  std::vector<std::size_t> views, fine;  // positions in DenseInput::frames
  std::string settings;                  // all that its depth follows from but the images, in short
};

Sequence OpenImages(const DensifyRequest& request, const RecordingInfo& info, const Camera& camera) {
  SequenceRequest wanted;
  wanted.path = request.images.empty() ? fs::path(info.sequence_path) : request.images;
  wanted.known_camera = camera;
  try {
    return OpenSequence(wanted);
  } catch (const InputError& error) {
    throw InputError(
        fmt::format("{}: the images that it was made from are needed, expected them at {} or by "
                    "--images ({})",
                    request.result.string(), wanted.path.string(), error.what()));
  }
}

// Poses of the frames whose images are there.
std::vector<PosedFrame> FramesWithImages(const fs::path& result, const Sequence& sequence) {
  std::vector<PosedFrame> frames;
  std::vector<std::string> missing;
  for (const auto& [index, pose] : ReadPosesByFrame(result / "trajectory.txt", sequence)) {
    const fs::path& image = sequence.frames[static_cast<std::size_t>(index)].image_path;
    if (sequence.video_path.empty() && !fs::exists(image)) {
      missing.push_back(image.string());
    } else {
      frames.push_back({index, pose});
    }
  }
  if (frames.empty() && !missing.empty()) {
    throw InputError(
        fmt::format("{}: none of the {} images that it was made from is there, such as {}, expected "
                    "them there or by --images",
                    result.string(), missing.size(), missing.front()));
  }
  if (!missing.empty()) {
    spdlog::warn("{}: {} images that it was made from are not there, such as {}", result.string(),
                 missing.size(), missing.front());
  }
  return frames;
}

DenseInput ReadInput(const DensifyRequest& request) {
  const RecordingReader recording(request.result / "map.sqmap");
  if (recording.Size() == 0) {
    throw InputError(fmt::format("{}: holds no map", (request.result / "map.sqmap").string()));
  }
  DenseInput input;
  input.map = recording.Last();
  const Camera& camera = input.map->camera;
  input.sequence = OpenImages(request, recording.Info(), camera);
  const double scale = request.options.scale;
  input.camera = ResizedCamera(camera, std::max(1, static_cast<int>(std::lround(camera.width * scale))),
                               std::max(1, static_cast<int>(std::lround(camera.height * scale))));
  input.camera.distortion = {};
  input.frames = FramesWithImages(request.result, input.sequence);
  std::vector<SnapshotKeyframe> keyframes = input.map->keyframes;
  std::sort(keyframes.begin(), keyframes.end(),
            [](const auto& a, const auto& b) { return a.frame_index < b.frame_index; });
  for (const SnapshotKeyframe& keyframe : keyframes) {
    input.keyframes.push_back({keyframe.frame_index, keyframe.T_map_camera});
    input.ids.push_back(keyframe.id);
  }
  for (const SnapshotPoint& point : input.map->points) {
    input.points.push_back(point.p_map.cast<double>());
  }
  if (const fs::path used = request.result / "camera.yaml"; fs::exists(used)) {
    input.readout = 1e-3 * ReadCamera(used).readout_ms;
  }
  input.moving = MovingMask(request.result, input.sequence, request.options.moving_labels);
  return input;
}

// FNV-1a of a text, as hexadecimal digits.
std::string HashOf(const std::string& text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) {
    hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
  }
  return fmt::format("{:016x}", hash);
}

std::string SettingsOf(const DenseInput& input, const PosedFrame& keyframe, const KeyframePlan& plan,
                       const DenseOptions& options) {
  const auto numbers = [](const Rigid3d& pose) {
    const auto& q = pose.rotation.coeffs();
    const Eigen::Vector3d& t = pose.translation;
    return fmt::format("{} {} {} {} {} {} {}\n", q[0], q[1], q[2], q[3], t[0], t[1], t[2]);
  };
  DenseOptions estimation = options;
  estimation.fusion = {};  // says what becomes of estimates
  const Camera& c = input.map->camera;
  std::string text =
      DumpOptions(estimation) + input.sequence.path.string() +
      fmt::format("\n{} {} {} {} {} {} {} {}\n{} {}\n", input.readout, c.width, c.height, c.fx, c.fy, c.cx,
                  c.cy, fmt::join(c.distortion, " "), plan.range->nearest, plan.range->farthest) +
      numbers(keyframe.T_map_camera);
  for (const std::vector<std::size_t>* views : {&plan.views, &plan.fine}) {
    for (const std::size_t view : *views) {
      text += fmt::format("{} ", input.frames[view].index) + numbers(input.frames[view].T_map_camera);
    }
  }
  return HashOf(text);
}

std::vector<KeyframePlan> PlanKeyframes(const DenseInput& input, const DenseOptions& options) {
  constexpr std::size_t kSamples = 100;  // map points that tell which views see the same
  constexpr std::size_t kAll = 1U << 24U;
  std::vector<KeyframePlan> plans;
  const ViewOptions& views = options.views;
  for (const PosedFrame& keyframe : input.keyframes) {
    KeyframePlan plan;
    const Rigid3d& pose = keyframe.T_map_camera;
    plan.range = RangeOf(PointsInView(input.points, input.camera, pose, kAll), pose, views);
    plan.in_view = PointsInView(input.points, input.camera, pose, kSamples);
    plan.views = ChooseViews(keyframe, input.frames, plan.in_view, input.camera,
                             {views.large_angle, views.small_angle}, views);
    plan.fine = ChooseViews(keyframe, input.frames, plan.in_view, input.camera,
                            {views.fine_angle, views.large_angle}, views);
    if (plan.views.size() < 2) {
      plan.range.reset();
    }
    if (plan.range) {
      plan.settings = SettingsOf(input, keyframe, plan, options);
    }
    plans.push_back(std::move(plan));
  }
  return plans;
}

// A keyframe's depth; empty where its images cannot be read.
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
  DepthMap map{input.ids[k], keyframe.index, input.camera, keyframe.T_map_camera, {}, {}, own->second.bgr};
  map.depth = EstimateDepth({own->second.gray, keyframe.T_map_camera}, views, stereo_views(plan.fine),
                            input.camera, *plan.range, options);
  input.moving.Apply(map);
  return map;
}

int ThreadsFor(const DensifyRequest& request, const Camera& camera) {
  constexpr double kMemory = 400e6;  // bytes for all
  const double bytes = (4.0 * request.options.stereo.planes + 60.0) * camera.width * camera.height;
  const int most = std::max(1, static_cast<int>(kMemory / bytes));
  const int asked =
      request.threads > 0 ? request.threads : static_cast<int>(std::thread::hardware_concurrency());
  return std::clamp(asked, 1, most);
}

// Hands what threads have done to the one that writes it.
struct Done {
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::pair<std::size_t, std::optional<DepthMap>>> maps;
  std::exception_ptr failure;
  bool stop = false;
};

// Estimates the depth of the keyframes `jobs` with threads, each one keyframe at a time, and puts it into the
// recording. Returns false where `progress` ended it.
bool EstimateAll(const DensifyRequest& request, const DenseInput& input,
                 const std::vector<KeyframePlan>& plans, const std::vector<std::size_t>& jobs,
                 DepthRecording& recording, const DensifyProgress& progress, DensifySummary& summary) {
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
  PosesByFrame poses;
  for (const PosedFrame& frame : input.frames) {
    poses.emplace(frame.index, frame.T_map_camera);
  }
  const ShutterCorrection shutter(input.camera, input.readout, input.sequence, std::move(poses),
                                  input.points);
  ImageFeed feed(input.sequence, input.camera, shutter, needed);
  Done done;
  const auto work = [&] {
    try {
      while (const std::optional<ImageFeed::Job> job = feed.Next()) {
        const std::size_t k = jobs[job->index];
        std::optional<DepthMap> map =
            EstimateKeyframe(input, k, plans[k], job->images, request.options.stereo);
        const std::lock_guard lock(done.mutex);
        if (done.stop || done.failure) {
          return;
        }
        done.maps.emplace_back(k, std::move(map));
        done.changed.notify_all();
      }
    } catch (...) {
      const std::lock_guard lock(done.mutex);
      done.failure = std::current_exception();
      done.changed.notify_all();
    }
  };
  const auto stop = [&done] {
    const std::lock_guard lock(done.mutex);
    done.stop = true;
  };
  std::vector<std::jthread> threads;
  const auto total = static_cast<int>(jobs.size());
  bool going_on = true;
  for (int i = 0; i < ThreadsFor(request, input.camera) && i < total; ++i) {
    threads.emplace_back(work);
  }
  try {
    for (int written = 0; written < total && going_on; ++written) {
      std::unique_lock lock(done.mutex);
      done.changed.wait(lock, [&] { return !done.maps.empty() || done.failure; });
      if (done.failure) {
        std::rethrow_exception(done.failure);
      }
      const auto [k, map] = std::move(done.maps.front());
      done.maps.pop_front();
      lock.unlock();
      if (map) {
        recording.PutEstimate(*map, plans[k].settings);
        ++summary.estimated;
      } else {
        recording.Remove(input.ids[k]);
        ++summary.without;
      }
      going_on = progress(written + 1, total, "depth maps");
    }
  } catch (...) {
    stop();
    throw;
  }
  stop();
  return going_on;
}

// The depth maps read last, so that neighbours that several keyframes share are decoded once.
class EstimateCache {
 public:
  EstimateCache(const DepthRecording& recording, std::size_t most) : recording_(recording), most_(most) {}

  const DepthMap& Get(std::int64_t keyframe) {
    const auto found = std::find_if(maps_.begin(), maps_.end(),
                                    [keyframe](const DepthMap& map) { return map.keyframe == keyframe; });
    if (found != maps_.end()) {
      std::rotate(found, std::next(found), maps_.end());
    } else {
      if (maps_.size() == most_) {
        maps_.pop_front();
      }
      maps_.push_back(recording_.Estimate(keyframe));
    }
    return maps_.back();
  }

 private:
  const DepthRecording& recording_;
  std::size_t most_;
  std::deque<DepthMap> maps_;  // the one asked for last at the end
};

// Holds each depth map against its neighbours, keeps what they confirm and gathers the cloud.
bool FuseAll(const DenseInput& input, const std::vector<KeyframePlan>& plans, const DenseOptions& options,
             double spacing, DepthRecording& recording, const DensifyProgress& progress, DenseCloud& cloud,
             DensifySummary& summary) {
  const std::vector<std::int64_t> estimated = recording.Estimated();
  const std::set<std::int64_t> there(estimated.begin(), estimated.end());
  std::vector<PosedFrame> keyframes;
  std::vector<std::size_t> positions;
  for (std::size_t k = 0; k < input.keyframes.size(); ++k) {
    if (there.contains(input.ids[k])) {
      keyframes.push_back(input.keyframes[k]);
      positions.push_back(k);
    }
  }
  EstimateCache estimates(recording, static_cast<std::size_t>(options.fusion.neighbours) * 4);
  CloudFusion fusion(spacing);
  std::size_t measured = 0;
  std::size_t filled = 0;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const std::size_t k = positions[i];
    std::vector<DepthMap> neighbours;
    for (const std::size_t n :
         ChooseNeighbours(i, keyframes, plans[k].in_view, input.camera, options.fusion.neighbours)) {
      neighbours.push_back(estimates.Get(input.ids[positions[n]]));
    }
    recording.PutKept(KeepConsistent(estimates.Get(input.ids[k]), neighbours, options.fusion));
    const DepthMap kept = recording.Kept(input.ids[k]);  // as any reader will find it
    fusion.Add(kept);
    const auto planes = static_cast<std::size_t>(cv::countNonZero(kept.views == kFilledByPlane));
    measured += static_cast<std::size_t>(cv::countNonZero(kept.depth > 0.0)) - planes;
    filled += planes;
    if (!progress(static_cast<int>(i) + 1, static_cast<int>(keyframes.size()), "fused")) {
      return false;
    }
  }
  cloud = fusion.Cloud();
  const double pixels =
      static_cast<double>(input.keyframes.size()) * input.camera.width * input.camera.height;
  summary.complete = static_cast<double>(measured) / pixels;
  summary.filled = static_cast<double>(filled) / pixels;
  return true;
}

// Edge of the cloud's cubes: so many pixels at the median depth of the map points.
double SpacingOf(const DenseInput& input, const std::vector<KeyframePlan>& plans, double pixels) {
  std::vector<double> depths;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    const Rigid3d T_camera_map = input.keyframes[k].T_map_camera.Inverse();
    for (const Eigen::Vector3d& p : plans[k].in_view) {
      depths.push_back((T_camera_map * p).z());
    }
  }
  return pixels * UpperMedian(std::move(depths)) / input.camera.fx;
}

[[noreturn]] void RefuseMotion(const DensifyRequest& request, const DenseInput& input) {
  if (input.keyframes.size() < 3) {
    throw NoMapError(fmt::format("{}: {} keyframes, expected three or more that see the same",
                                 request.result.string(), input.keyframes.size()));
  }
  throw NoMapError(
      fmt::format("{}: no depth: none of the {} keyframes has two other frames that show the same from {} "
                  "degrees or more "
                  "aside, expected a camera that moves sideways",
                  request.result.string(), input.keyframes.size(), request.options.views.min_angle));
}

}  // namespace

std::string DensifySummary::Text() const {
  return fmt::format("{} points of {} depth maps ({} new); depth of {:.1f} % of the pixels{}", points,
                     estimated + resumed, estimated, 100.0 * complete,
                     filled > 0.0 ? fmt::format(", and of {:.1f} % by planes", 100.0 * filled) : "");
}

DensifySummary Densify(const DensifyRequest& request, const DensifyProgress& progress) {
  CheckOptions(request.options);
  const DenseInput input = ReadInput(request);
  const std::vector<KeyframePlan> plans = PlanKeyframes(input, request.options);
  DensifySummary summary;
  summary.keyframes = static_cast<int>(plans.size());
  if (std::none_of(plans.begin(), plans.end(),
                   [](const KeyframePlan& plan) { return plan.range.has_value(); })) {
    RefuseMotion(request, input);
  }

  DepthRecording recording(request.result / "map.sqmap", DepthRecording::Access::kWrite);
  std::vector<std::size_t> jobs;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    if (!plans[k].range) {
      recording.Remove(input.ids[k]);
      ++summary.without;
    } else if (recording.HasEstimate(input.ids[k], plans[k].settings)) {
      ++summary.resumed;
    } else {
      jobs.push_back(k);
    }
  }
  DenseCloud cloud;
  summary.interrupted =
      !EstimateAll(request, input, plans, jobs, recording, progress, summary) ||
      !FuseAll(input, plans, request.options, SpacingOf(input, plans, request.options.fusion.spacing),
               recording, progress, cloud, summary);
  recording.Close();
  if (summary.interrupted) {
    return summary;
  }
  if (cloud.empty()) {
    throw NoMapError(fmt::format(
        "{}: no depth: of {} depth maps no point is confirmed by {} others, expected more keyframes that see "
        "the same",
        request.result.string(), summary.estimated + summary.resumed, request.options.fusion.min_views));
  }
  summary.points = cloud.size();
  WriteDenseCloud(request.result / "dense.ply", cloud);
  return summary;
}

}  // namespace sqslam
