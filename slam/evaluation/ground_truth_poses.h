#pragma once

#include <filesystem>

#include "slam/io/sequence.h"
#include "slam/io/trajectory.h"

namespace sqslam {

// The poses T_world_camera that come with a sequence, in metres, at the times that OpenSequence gives its
// frames (frame number over the camera's fps in the numbered layouts). Throws InputError that names the file,
// its line, and what was expected.
//
//   groundtruth.txt  TUM format, in any layout; goes before the dataset's own files
//   7-scenes         frame-000000.pose.txt, ...: T_world_camera as four rows (Shotton et al., CVPR 2013)
//   scenes-v2        pc/NN.pose beside imgs/scene_NN, or a single *.pose in the folder itself: one line
//                    'qw qx qy qz x y z' a frame (Lai et al., ICRA 2014)
//   icl-nuim         a single *.gt.freiburg in the folder: TUM lines with the frame number as time (Handa et
//                    al., ICRA 2014), see MirrorIclNuim
Trajectory ReadGroundTruthPoses(const Sequence& sequence);

// The same of the sequence in a folder.
Trajectory ReadTruePoses(const std::filesystem::path& sequence);

// Turns a pose of ICL-NUIM as published, whose camera has its y axis up (fy = -480), into that of a camera
// with y down (fy = +480) that takes the same images, in the world mirrored at its plane y = 0: M T M with M
// = diag(1, -1, 1), which changes the signs of y and of the quaternion's x and z.
Rigid3d MirrorIclNuim(const Rigid3d& published);

}  // namespace sqslam
