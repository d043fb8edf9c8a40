#include "slam/run/path_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "slam/features/orb_extractor.h"
#include "slam/io/frame_source.h"
#include "slam/mapping/view_graph.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr std::size_t kMaxCompared = 50;  // jumps of which the images are read, the largest

struct SceneDepths {
  double nearest = 0.0;
  double farthest = 0.0;
};

// Returns the distance of a point from a line segment.
double DistanceToSegment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * along).norm();
}

// Returns the distance of a match from the part of its epipolar line that lies between two depths, px.
double DistanceFromPoses(const Camera& camera, const TwoViewMatch& match, const Rigid3d& T_after_before,
                         double nearest, double farthest) {
  constexpr int kParts = 16;  // of the range of inverse depths
  const Eigen::Vector3d ray = camera.Unproject(match.pixel1);
  double distance = std::numeric_limits<double>::infinity();
  std::optional<Eigen::Vector2d> last;
  for (int i = 0; i <= kParts; ++i) {
    const double inverse = std::lerp(1.0 / farthest, 1.0 / nearest, static_cast<double>(i) / kParts);
    const Eigen::Vector3d p = T_after_before * (ray / inverse);
    if (p.z() <= 0.05 * nearest) {
      break;  // behind the camera, and all nearer points too
    }
    const Eigen::Vector2d pixel = camera.Project(p);
    distance = std::min(distance, DistanceToSegment(match.pixel2, last.value_or(pixel), pixel));
    last = pixel;
  }
  return distance;
}

// Returns true if the matches alone determine another rotation. With a baseline as long as the scene is deep,
// most matches agree with some depth whatever the rotation.
bool RotatesOtherwise(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                      const Rigid3d& T_after_before) {
  constexpr double kMaxDifference = 0.17;  // rad, 10 degrees
  const std::vector<Eigen::Quaterniond> rotations = FindEpipolarSupport(camera, matches).rotations;
  return !rotations.empty() && std::ranges::all_of(rotations, [&](const Eigen::Quaterniond& rotation) {
    return rotation.angularDistance(T_after_before.rotation) > kMaxDifference;
  });
}

// Returns the depths between which most map points lie that a camera shows; none if it shows few.
std::optional<SceneDepths> DepthsSeen(const Camera& camera, const MapSnapshot& map,
                                      const Rigid3d& T_map_camera) {
  constexpr std::size_t kMinPoints = 20;
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  std::vector<double> depths;
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d p = T_camera_map * point.p_map.cast<double>();
    if (p.z() > 0.0 && camera.Shows(camera.Project(p))) {
      depths.push_back(p.z());
    }
  }
  if (depths.size() < kMinPoints) {
    return std::nullopt;
  }
  std::ranges::sort(depths);
  return SceneDepths{0.5 * depths[depths.size() / 20], 2.0 * depths[depths.size() - 1 - depths.size() / 20]};
}

// Number of the frame of each pose, by timestamp.
class FrameNumbers {
 public:
  explicit FrameNumbers(const Sequence& sequence) {
    for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
      numbers_[Key(sequence.frames[i].timestamp)] = static_cast<std::int64_t>(i);
    }
  }
  std::optional<std::int64_t> Of(const TimedPose& pose) const {
    const auto found = numbers_.find(Key(pose.timestamp));
    return found != numbers_.end() ? std::optional(found->second) : std::nullopt;
  }
  // Returns "frame 12 (0.400 s)", or the time alone if the frame is not known.
  std::string Name(const TimedPose& pose) const {
    const std::optional<std::int64_t> number = Of(pose);
    return number ? fmt::format("frame {} ({:.3f} s)", *number, pose.timestamp)
                  : fmt::format("{:.3f} s", pose.timestamp);
  }

 private:
  static std::int64_t Key(double timestamp) { return std::llround(1e4 * timestamp); }
  std::map<std::int64_t, std::int64_t> numbers_;
};

std::optional<FrameFeatures> FeaturesOf(const Sequence& sequence, const Camera& camera, std::int64_t frame) {
  FrameSource source(sequence, {.start = frame, .count = 1}, 1);
  const std::optional<Frame> image = source.Next();
  return image ? std::optional(OrbExtractor({}).Extract(image->gray, image->bgr, camera, image->ignored))
               : std::nullopt;
}

StepEvidence CompareImages(const Sequence& sequence, const Camera& camera, const MapSnapshot& map,
                           const FrameNumbers& numbers, const TimedPose& before, const TimedPose& after) {
  const std::optional<std::int64_t> first = numbers.Of(before);
  const std::optional<std::int64_t> second = numbers.Of(after);
  const std::optional<SceneDepths> depths = DepthsSeen(camera, map, before.T_map_camera);
  const std::optional<FrameFeatures> a = first ? FeaturesOf(sequence, camera, *first) : std::nullopt;
  const std::optional<FrameFeatures> b = second ? FeaturesOf(sequence, camera, *second) : std::nullopt;
  if (!depths || !a || !b) {
    return StepEvidence::kNone;
  }
  FeatureDatabase database;
  bool only_turns = false;
  std::vector<TwoViewMatch> matches;
  for (const auto& [i, j] : MatchImages(camera, *a, *b, database, only_turns)) {
    matches.push_back({a->keypoints[i].pixel, b->keypoints[j].pixel});
  }
  return JudgeStep(camera, matches, after.T_map_camera.Inverse() * before.T_map_camera, depths->nearest,
                   depths->farthest);
}

void RemovePoses(const std::set<double>& times, Trajectory& trajectory) {
  std::erase_if(trajectory, [&](const TimedPose& pose) { return times.contains(pose.timestamp); });
}

std::string ListSteps(const std::vector<PathJump>& jumps, StepEvidence evidence, const Trajectory& trajectory,
                      const FrameNumbers& numbers) {
  constexpr int kListed = 5;
  std::string list;
  int count = 0;
  for (const PathJump& jump : jumps) {
    if (jump.evidence == evidence && ++count <= kListed) {
      list += fmt::format("{}{} and {}", list.empty() ? "" : ", ", numbers.Name(trajectory[jump.after - 1]),
                          numbers.Name(trajectory[jump.after]));
    }
  }
  return count > kListed ? fmt::format("{} and at {} more places", list, count - kListed) : list;
}

// Returns "frames 10 to 20, 31", from poses in the order of time.
std::string ListFrames(const std::vector<std::size_t>& poses, const Trajectory& trajectory,
                       const FrameNumbers& numbers) {
  std::string list;
  for (std::size_t i = 0; i < poses.size();) {
    std::size_t end = i + 1;
    while (end < poses.size() && poses[end] == poses[end - 1] + 1) {
      ++end;
    }
    list += fmt::format("{}{}", list.empty() ? "" : ", ", numbers.Name(trajectory[poses[i]]));
    if (end > i + 1) {
      list += " to " + numbers.Name(trajectory[poses[end - 1]]);
    }
    i = end;
  }
  return list;
}

}  // namespace

std::vector<PathJump> FindJumps(const Trajectory& trajectory) {
  constexpr std::size_t kAround = 15;  // steps on either side
  constexpr double kMinTimes = 8.0;    // of the median step
  std::vector<double> speeds;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    const double seconds = trajectory[i].timestamp - trajectory[i - 1].timestamp;
    speeds.push_back(
        (trajectory[i].T_map_camera.translation - trajectory[i - 1].T_map_camera.translation).norm() /
        std::max(seconds, 1e-6));
  }
  std::vector<PathJump> jumps;
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    const auto begin = speeds.begin() + static_cast<std::ptrdiff_t>(i < kAround ? 0 : i - kAround);
    const auto end = speeds.begin() + static_cast<std::ptrdiff_t>(std::min(i + kAround + 1, speeds.size()));
    const double usual = UpperMedian(std::vector<double>(begin, end));
    if (end - begin > static_cast<std::ptrdiff_t>(kAround) && speeds[i] > kMinTimes * usual) {
      jumps.push_back({i + 1, speeds[i] / std::max(usual, 1e-12)});
    }
  }
  return jumps;
}

StepEvidence JudgeStep(const Camera& camera, const std::vector<TwoViewMatch>& matches,
                       const Rigid3d& T_after_before, double nearest, double farthest) {
  constexpr std::size_t kMinMatches = 30;  // images that share nothing have fewer by chance
  constexpr double kMaxDistance = 0.01;    // of a match that agrees, in image widths
  constexpr double kMinAgreeing = 0.5;     // share of the matches, for a step that is right
  constexpr double kMaxAgreeing = 0.25;    // for one that is wrong
  constexpr std::size_t kMinAlike = 150;   // matches of images that are alike; fewer may be wrong together
  if (matches.size() < kMinMatches) {
    return StepEvidence::kCut;
  }
  const auto agreeing = std::ranges::count_if(matches, [&](const TwoViewMatch& match) {
    return DistanceFromPoses(camera, match, T_after_before, nearest, farthest) <= kMaxDistance * camera.width;
  });
  const double share = static_cast<double>(agreeing) / static_cast<double>(matches.size());
  if (share >= kMinAgreeing) {
    return RotatesOtherwise(camera, matches, T_after_before) ? StepEvidence::kNone : StepEvidence::kConfirmed;
  }
  return share <= kMaxAgreeing && matches.size() >= kMinAlike ? StepEvidence::kContradicted
                                                              : StepEvidence::kNone;
}

std::vector<std::size_t> PosesThatContradict(const std::vector<PathJump>& jumps, std::size_t num_poses) {
  std::vector<std::size_t> sides[2];
  int side = 0;
  auto jump = jumps.begin();
  for (std::size_t i = 0; i < num_poses; ++i) {
    while (jump != jumps.end() && jump->after <= i) {
      side = jump->evidence == StepEvidence::kContradicted ? 1 - side : side;
      ++jump;
    }
    sides[side].push_back(i);
  }
  return sides[0].size() < sides[1].size() ? sides[0] : sides[1];
}

std::vector<PathJump> FindDoubtfulJumps(const Sequence& sequence, const Camera& camera,
                                        const MapSnapshot& map, const Trajectory& trajectory) {
  std::vector<PathJump> jumps = FindJumps(trajectory);
  const FrameNumbers numbers(sequence);
  std::vector<PathJump*> largest = ToVector(jumps, [](PathJump& jump) { return &jump; });
  std::ranges::stable_sort(largest, std::greater<>(), &PathJump::times);
  largest.resize(std::min(largest.size(), kMaxCompared));
  for (PathJump* jump : largest) {
    jump->evidence =
        CompareImages(sequence, camera, map, numbers, trajectory[jump->after - 1], trajectory[jump->after]);
  }
  std::erase_if(jumps, [](const PathJump& jump) { return jump.evidence == StepEvidence::kConfirmed; });
  return jumps;
}

std::vector<std::string> CheckPath(const Sequence& sequence, const Camera& camera, FinishedMap& map) {
  std::vector<std::string> warnings;
  if (sequence.frames.empty()) {
    return warnings;
  }
  const std::vector<PathJump> jumps = FindDoubtfulJumps(sequence, camera, *map.snapshot, map.trajectory);
  const FrameNumbers numbers(sequence);
  const auto warn = [&](StepEvidence evidence, const char* what, const char* meaning) {
    const std::string steps = ListSteps(jumps, evidence, map.trajectory, numbers);
    if (!steps.empty()) {
      warnings.push_back(fmt::format("{} between {}: {}", what, steps, meaning));
    }
  };
  warn(StepEvidence::kNone, "the camera's path jumps", "the map may be wrong there");
  warn(StepEvidence::kCut, "the view changes completely",
       "both sides are in one map because they seem to show the same place; check that they do");
  warn(StepEvidence::kContradicted, "the path jumps, but not the images,", "the map is wrong on one side");
  const std::vector<std::size_t> wrong = PosesThatContradict(jumps, map.trajectory.size());
  if (wrong.empty()) {
    return warnings;
  }
  warnings.push_back(fmt::format("{} of {} poses are not in the trajectory, as images contradict them: {}",
                                 wrong.size(), map.trajectory.size(),
                                 ListFrames(wrong, map.trajectory, numbers)));
  std::set<double> times;
  for (const std::size_t i : wrong) {
    times.insert(map.trajectory[i].timestamp);
  }
  RemovePoses(times, map.trajectory);
  RemovePoses(times, map.keyframes);
  return warnings;
}

}  // namespace sqslam
