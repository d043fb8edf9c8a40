#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/io/image_files.h"
#include "slam/io/image_header.h"
#include "slam/util/enum_names.h"

namespace sqslam {

struct SequenceFrame {
  double timestamp = 0.0;                // seconds, rising
  std::filesystem::path image_path;      // empty for a video
  std::vector<Detection> detections;     // in pixels of the frame
  std::filesystem::path mask_path = {};  // black: ignored, as in COLMAP; empty: none
};

// Layouts of a sequence, see DetectFormat(); kAuto: detected.
enum class SequenceFormat { kAuto, kTum, kIclNuim, kScenesV2, k7Scenes, kEuroc, kKitti, kImages, kVideo };
constexpr auto EnumNames(SequenceFormat) {
  return std::array{"auto", "tum", "icl-nuim", "scenes-v2", "7-scenes", "euroc", "kitti", "images", "video"};
}

// An image sequence that has been listed but not decoded.
struct Sequence {
  std::filesystem::path path;
  std::filesystem::path video_path;  // empty if the frames are image files
  SequenceFormat format = SequenceFormat::kImages;
  Camera camera;                 // of the frames as delivered
  std::string guessed_by;        // source of the focal length of --camera auto; empty: a calibration
  double guess_deviation = 0.0;  // standard deviation of the log focal length, if it is guessed
  int quarter_turns = 0;         // clockwise, applied to a video's pictures
  std::vector<std::int64_t> video_times = {};  // of a video's frames (VideoIndex::times)
  int image_width = 0;  // px, of the images in the files, turned but not resized; 0: the camera's
  int image_height = 0;
  bool any_image_size = false;                 // images of any size are resized
  std::optional<ValueRange> value_range = {};  // of images with more than 8 bits
  std::vector<SequenceFrame> frames;
  bool has_detections = false;
  cv::Mat fixed_regions =
      {};  // 8UC1 of the frames' size, nonzero where images move with the camera; may be empty
};

struct SequenceRequest {
  std::filesystem::path path;  // a folder, also one with a single video and no image, or a video
  SequenceFormat format = SequenceFormat::kAuto;  // kAuto: see DetectFormat()
  // Calibration file or preset; "auto": a guess (GuessCamera); empty: camera.yaml of the folder, or the
  // dataset's preset, or else a guess for a video or a folder of images.
  std::string camera = {};
  // boxes.txt or folder; empty: boxes.txt of the sequence folder if it is there.
  std::filesystem::path detections = {};
  // WIDTH, WIDTH,HEIGHT or a factor (ParseImageResize); empty: by kMaxMappedSide and kMinMappedPixels.
  std::string resize = {};
  // Camera of an earlier run, instead of `camera` and `resize`: images of any size are resized to it, and
  // boxes are not read.
  std::optional<Camera> known_camera = {};
  // A mask for all images, or a folder with one for each: IMAGE.png (as in COLMAP: a.jpg.png) or, for the
  // frames of a video, numbers; empty: none.
  std::filesystem::path mask = {};
};

// Longer side of frames, px, if the request does not say it: more pixels take time and add nothing to a map.
inline constexpr int kMaxMappedSide = 1280;

// Pixels of frames, if the request does not say it: smaller images are enlarged, as SIFT enlarges all for its
// first octave (Lowe 2004, section 3.3). A keypoint's patch takes 39 pixels across at any resolution, so that
// small images hold few, and none near the border.
inline constexpr double kMinMappedPixels = 480.0 * 360.0;

// Value of --camera for an uncalibrated camera.
inline constexpr const char* kAutoCamera = "auto";

// Lists the frames of a folder with rgb.txt, of a dataset layout (dataset_layouts.h), of a folder of images
// (in numeric order, timestamps from the camera's fps, without depth images, hidden files, and files of
// another name and size than most), or of a video file (timestamps of the container). Calibration and boxes
// refer to the images in the files, as people see them; both are resized with the frames. A calibration of
// another size with the same aspect ratio is scaled to most of the images. A calibration of the stored pixels
// of a video or of portrait photographs is rotated with them. Most of the images decide whether frames are
// portrait or landscape; the others are turned (QuarterTurnsTo). Ground truth is never read. Throws
// InputError that names file, line and what was expected: broken lines, timestamps that do not rise, a broken
// or missing camera, images of another aspect ratio, no frame at all; UsageError for an unknown camera
// preset. Images are not decoded here (FrameSource skips unusable ones), except one to guess a camera.
Sequence OpenSequence(const SequenceRequest& request);

// Returns true if the sequence has a frame of this number, counted from 0. Numbers that were recorded may be
// beyond the end of a sequence that has changed since.
bool HasFrame(const Sequence& sequence, std::int64_t frame);

// Return the timestamps of the frames, and the paths of their images below the sequence (none for a video).
std::vector<double> Timestamps(const Sequence& sequence);
std::vector<std::string> ImageNames(const Sequence& sequence);

// Returns the size of the images in the files, px, turned as the frames are.
cv::Size FileSize(const Sequence& sequence);

// Returns a camera of the frames in pixels of the images in the files.
Camera InFilePixels(const Camera& camera, const Sequence& sequence);

// Returns size and orientation of each frame's image in the files; those of most images for one that cannot
// be read.
std::vector<ImageHeader> ImageHeaders(const Sequence& sequence);

// Reads a file or folder with boxes (ReadDetections) and converts them to pixels of the frames. `warn`: of
// boxes that are dropped or clipped, and of unknown labels.
std::vector<std::vector<Detection>> ReadFrameBoxes(const std::filesystem::path& path,
                                                   const Sequence& sequence, bool warn);

// Converts boxes of a frame to pixels of the shown image in the file. `file`: its size, turned as the frame
// is (FileSize). `quarter_turns`: of the frame (Frame::quarter_turns).
std::vector<Detection> InFilePixels(std::vector<Detection> detections, cv::Size frame, cv::Size file,
                                    int quarter_turns);

}  // namespace sqslam
