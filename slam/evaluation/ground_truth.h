#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/geometry/solid_iou.h"
#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"

namespace sqslam {

struct GroundTruthObject {
  int id = 0;
  std::string name;  // empty if the file has none
  std::string label;
  Solid solid;         // in the world frame of the ground truth, metres
  int detections = 0;  // number of detections of it; 0 if unknown
  bool scored = true;  // known accurately enough for its 3D IoU to be meaningful
};

// Returns the object's name, or its label if it has none.
inline const std::string& ShownName(const GroundTruthObject& object) {
  return object.name.empty() ? object.label : object.name;
}

// Ground truth of a sequence. Only evaluation reads it; mapping never does.
struct GroundTruth {
  Trajectory trajectory;  // T_world_camera
  int frames = 0;         // frames of the sequence
  bool has_objects = false;
  bool has_detection_counts = false;
  bool has_scored = false;  // the file says which objects are scored; otherwise all are
  std::vector<GroundTruthObject> objects;
};

// Reads the poses of a sequence folder (groundtruth.txt, or a dataset's own, see ReadGroundTruthPoses),
// counts its frames, and reads objects_gt.json and the object ids of boxes.txt if they exist. Throws
// InputError naming file and line or object.
GroundTruth ReadGroundTruth(const std::filesystem::path& sequence);

// Reads objects_gt.json: a list, or an object whose key `objects` holds it; T_world_object as 16 numbers or
// four rows, or, without it, center and yaw. The solid is the primitive's; a `shape` that differs from
// that of the primitive's name (cuboid 0.1, 0.1; cylinder 0.1, 1; ellipsoid 1, 1) makes it a superquadric of
// this shape, because the shape is more specific than the name.
std::vector<GroundTruthObject> ReadGroundTruthObjects(const std::filesystem::path& path);

// Reads the poses T_world_camera of a sequence, in metres, with the frame times of OpenSequence (frame number
// over the camera's fps in the numbered layouts). Throws InputError naming the file, its line, and what was
// expected.
//
//   groundtruth.txt  TUM format, in any layout; preferred over the dataset's own files
//   7-scenes         frame-000000.pose.txt, ...: T_world_camera as four rows (Shotton et al., CVPR 2013)
//   scenes-v2        pc/NN.pose beside imgs/scene_NN, or a single *.pose in the folder itself: one line
//                    'qw qx qy qz x y z' a frame (Lai et al., ICRA 2014)
//   icl-nuim         a single *.gt.freiburg in the folder: TUM lines with the frame number as time (Handa et
//                    al., ICRA 2014), see MirrorIclNuim
//   euroc            state_groundtruth_estimate0/data.csv beside cam0, poses of the body, with T_BS of
//                    cam0/sensor.yaml (Burri et al., IJRR 2016)
//   kitti            poses/NN.txt beside sequences/, poses of camera 0 (Geiger et al., CVPR 2012)
Trajectory ReadGroundTruthPoses(const Sequence& sequence);

// The same for the sequence in a folder.
Trajectory ReadTruePoses(const std::filesystem::path& sequence);

// Converts a published pose of ICL-NUIM, whose camera has its y axis up (fy = -480), into that of a camera
// with y down (fy = +480) with the same images, in the world mirrored at its plane y = 0: M T M with M =
// diag(1, -1, 1), which changes the signs of y and of the quaternion's x and z.
Rigid3d MirrorIclNuim(const Rigid3d& published);

}  // namespace sqslam
