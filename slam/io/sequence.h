#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/util/enum_names.h"

namespace sqslam {

struct SequenceFrame {
  double timestamp = 0.0;            // seconds, rising
  std::filesystem::path image_path;  // empty for a video
  std::vector<Detection> detections;
  std::filesystem::path mask_path = {};  // black: ignored, as COLMAP has it; empty: none
};

// Layouts of a sequence, see DetectFormat(); kAuto: by the names in it.
enum class SequenceFormat { kAuto, kTum, kIclNuim, kScenesV2, k7Scenes, kEuroc, kKitti, kImages, kVideo };
constexpr auto EnumNames(SequenceFormat) {
  return std::array{"auto", "tum", "icl-nuim", "scenes-v2", "7-scenes", "euroc", "kitti", "images", "video"};
}

// An image sequence that has been listed but not decoded.
struct Sequence {
  std::filesystem::path path;
  std::filesystem::path video_path;  // empty where the frames are files
  SequenceFormat format = SequenceFormat::kImages;
  Camera camera;           // camera of the frames as they are handed out
  std::string guessed_by;  // source of the focal length of --camera auto; empty: a calibration
  int quarter_turns = 0;   // clockwise, by which a video's pictures are turned
  int image_width = 0;  // px of the turned pictures before they are resized to the camera's; 0: the camera's
  int image_height = 0;
  bool any_image_size = false;  // all are resized, whatever they have
  std::vector<SequenceFrame> frames;
  bool has_detections = false;
};

struct SequenceRequest {
  std::filesystem::path path;
  SequenceFormat format = SequenceFormat::kAuto;  // kAuto: by the names in the folder (DetectFormat)
  // Calibration file or preset; "auto": a guess (GuessCamera); empty: camera.yaml of the folder, or the
  // dataset's preset; without either a guess for a video or a folder of images.
  std::string camera = {};
  // boxes.txt or folder; empty: boxes.txt of the sequence folder if it is there.
  std::filesystem::path detections = {};
  std::string resize = {};  // WIDTH, WIDTH,HEIGHT or a factor (ParseImageResize); empty: as the images are
  // That of the frames as they were once handed out, instead of `camera` and `resize`: the images are brought
  // to its size, whatever they have, and boxes are left out.
  std::optional<Camera> known_camera = {};
  // A mask for all images, or a folder with a mask for each: IMAGE.png (as COLMAP has it: a.jpg.png) or, for
  // the frames of a video, numbers; empty: none.
  std::filesystem::path mask = {};
};

// The word that --camera takes for a camera without a calibration.
inline constexpr const char* kAutoCamera = "auto";

// Lists the frames of a folder with rgb.txt, of one of the dataset layouts (dataset_layouts.h), of a folder
// of images (names in numeric order, timestamps from the camera's fps; depth images are left out), or of a
// video file (timestamps of the container; a calibration of the pictures as they are stored is turned with
// them). Calibration and boxes are those of the images as they lie in the files; `resize` scales both. Ground
// truth is never looked at. Throws InputError that names file, line and what was expected: broken lines,
// timestamps that do not rise, a broken or missing camera, a video of another size, no frame at all;
// UsageError for an unknown camera preset. Images are not opened here (FrameSource skips those that cannot be
// used), but for a guessed camera, which needs the first.
Sequence OpenSequence(const SequenceRequest& request);

// The frames' times, and the file names of their images (none for a video).
std::vector<double> Timestamps(const Sequence& sequence);
std::vector<std::string> ImageNames(const Sequence& sequence);

// Pixels of the images as they lie in the files for one of the frames that come of them, x and y.
Eigen::Vector2d FilePixels(const Sequence& sequence);

}  // namespace sqslam
