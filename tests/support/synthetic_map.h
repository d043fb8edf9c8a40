#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/recognition/vocabulary.h"

namespace sqslam::testing {

// The quality of a view of a synthetic world.
struct Sight {
  double pixel_noise = 0.0;  // px, standard deviation
  int flipped_bits = 0;      // of each descriptor
  int clutter = 0;           // keypoints without a point of the world, after all others
  int octave = 0;            // of all keypoints
  std::uint64_t seed = 1;
};

// Points with random descriptors and a camera: the ground truth of every synthetic map. Lengths in metres.
struct SyntheticWorld {
  Camera camera{640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0};
  std::vector<Eigen::Vector3d> points;  // world frame
  std::vector<Descriptor> descriptors;  // one per point

  struct View {
    FrameFeaturesPtr features;
    std::vector<int> points;  // index of the point that each keypoint shows, -1 for clutter
  };
  // The points in the image, in the order of their indices.
  View See(const Rigid3d& T_camera_world, const Sight& sight = {}) const;
};

// A map with its ground truth. Map frame and world frame are equal, unless drift has bent the map.
struct SyntheticMap : SyntheticWorld {
  std::vector<Rigid3d> T_camera_map;  // ground truth, by keyframe
  Map map;
};

struct SyntheticMapOptions {
  int keyframes = 6;
  int points = 300;
  double pixel_noise = 0.0;  // px, standard deviation
  double on_plane = 0.0;     // share of the points that lie on a plane; all others are above it
  std::uint64_t seed = 7;
  double half_extent = 1.0;  // of the cloud along x and z, m; 0.8 of it along y
  Camera camera{640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0};
};

// Exact poses and points, keyframes on an arc that look at a cloud around the origin, every point seen by
// every keyframe; one keypoint per point, in the same order in each keyframe.
SyntheticMap MakeSyntheticMap(const SyntheticMapOptions& options);

// T_camera_map on the arc of MakeSyntheticMap(): keyframe k stands at `place` k, 0.48 m from the next.
Rigid3d PoseOnArc(double place);

// A rotation about an axis through the origin.
Rigid3d Turn(double radians, const Eigen::Vector3d& axis);

// Against gravity, for the plane of SyntheticMapOptions::on_plane, which goes through the origin.
Eigen::Vector3d PlaneUp();

struct RingMapOptions {
  int keyframes = 28;                       // 15 degrees apart, so that the last ones overlap with the first
  double scale_drift = 3e-4;                // logarithm of the scale, per degree of the ring
  double rotation_drift = 0.03;             // degrees per degree
  bool repeated = false;                    // 16 degrees of the wall look like those on the opposite side
  KeyframeId first_id = 0;                  // of the keyframes; points start at a thousand times this id
  std::shared_ptr<IdSource> ids = nullptr;  // null: a source of its own
};

// One lap on the ring without drift.
inline RingMapOptions ExactRing() { return {.keyframes = 24, .scale_drift = 0.0, .rotation_drift = 0.0}; }

// Map of a camera that moved around a ring, looking outward at a wall of points, without closing the loop:
// points seen at both ends are two map points each, and the map is bent by drift.
SyntheticMap MakeRingMap(const RingMapOptions& options);

// T_camera_world on the ring, `degrees` from its start.
Rigid3d PoseOnRing(double degrees);

// Root mean square distance of the keyframes' centres from the truth after the best similarity transform.
double CenterError(const SyntheticMap& ring);

// Distance between the centres of two cameras, in the units of their common frame.
double CenterDistance(const Rigid3d& T_camera1_map, const Rigid3d& T_camera2_map);

// Largest reprojection error of all observations, px.
double LargestReprojectionError(const Map& map, const Camera& camera);

// The same features, all of them found in one octave.
FrameFeaturesPtr WithOctave(const FrameFeatures& features, int octave);

// Number of references between points and keyframes that lack their counterpart, and of duplicate keypoints
// and keyframes of a point. 0 in a consistent map.
int CountBrokenReferences(const Map& map);

// Words for random descriptors, the same in every run; and the words of each keyframe of a map.
std::shared_ptr<const Vocabulary> RandomWords();
void GiveWords(const Vocabulary& vocabulary, Map& map);

}  // namespace sqslam::testing
