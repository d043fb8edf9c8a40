#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/io/sequence.h"

namespace sqslam {

// Detects a path's layout by its file names. Throws InputError if the path does not exist.
//
//   tum        rgb.txt
//   icl-nuim   rgb/0.png, rgb/1.png, ... with associations.txt (frame numbers) or *.gt.freiburg, or the
//              renderer's own scene_00_0000.png (Handa et al., ICRA 2014)
//   scenes-v2  00000-color.png, ... (RGB-D Scenes v2, Lai et al., ICRA 2014: imgs/scene_NN)
//   7-scenes   frame-000000.color.png, ... (Shotton et al., CVPR 2013: SCENE/seq-NN)
//   euroc      mav0/cam0 with data.csv and data/ (Burri et al., IJRR 2016), or a folder above it
//   kitti      times.txt beside image_2 or image_0 (Geiger et al., CVPR 2012: sequences/NN)
//   images     any other folder;  video: any file
SequenceFormat DetectFormat(const std::filesystem::path& path);

// Returns the preset of a dataset's camera; empty if there is none. TUM cameras are told apart by the
// dataset's folder names (..._freiburg1_...).
std::string PresetOf(SequenceFormat format, const std::filesystem::path& folder);

// Returns the calibration that comes with the data: EuRoC's sensor.yaml, KITTI's calib.txt. Returns nothing
// for other layouts.
std::optional<Camera> CameraOfDataset(SequenceFormat format, const std::filesystem::path& folder);

// Lists the frames of a dataset's layout (tum to kitti). Timestamps are the dataset's own, in the unit that
// UnitOfTimes() recognises in rgb.txt, or frame numbers over fps, so that a missing image leaves a gap.
// Throws InputError if there are none, or if timestamps do not rise.
std::vector<SequenceFrame> ListDataset(SequenceFormat format, const std::filesystem::path& folder,
                                       double fps);

// Returns T_body_camera of EuRoC's sensor.yaml (its T_BS). Throws InputError.
Rigid3d ReadEurocExtrinsics(const std::filesystem::path& sensor);

// Returns T_camera0_camera of a camera in KITTI's calib.txt: its centre in the frame of camera 0, in metres;
// the images are rectified to one orientation. Throws InputError.
Rigid3d ReadKittiExtrinsics(const std::filesystem::path& calib, int number);

}  // namespace sqslam
