#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <variant>
#include <vector>

#include "slam/geometry/box2.h"

namespace sqslam {

// Formats of box files, as detectors, labelling tools and trackers write them.
enum class BoxFormat {
  kBoxes,   // lines `timestamp label score x y w h [object_id [visible_fraction]]`
  kFolder,  // one text file a frame, lines `class x y w h score` in pixels from the top-left corner, or in
            // fractions of the image `class cx cy w h` or a polygon `class x y x y x y ...`, both with
            // [score] [track] behind (Ultralytics, darknet)
  kCoco,    // JSON: a data set with images, annotations and categories, or a list of results
  kMot,     // lines `frame,id,x,y,w,h,score[,class,...]`, frames and pixels from 1 (MOTChallenge)
  kCsv,     // a table with a header line
};
constexpr auto EnumNames(BoxFormat) { return std::array{"boxes", "yolo", "coco", "mot", "csv"}; }

// The frame of a box, as its file gives it.
struct ImageNumber {
  std::int64_t number;  // the image's name, without leading zeros
};
struct FrameNumber {
  std::int64_t number;  // from 0
};
struct FrameTime {
  double seconds;
};
using FrameKey = std::variant<FrameTime, FrameNumber, ImageNumber, std::string>;  // last: path or name

struct FileBox {
  std::string place;  // FILE:LINE, or FILE with the number of the annotation
  FrameKey frame;
  Detection detection;    // pixels, top-left corner
  bool in_parts = false;  // in parts of the image's width and height instead
};

// Reads all boxes of a file or folder. Labels are those of the file's own categories, or of classes.txt in
// the folder (labels.txt beside a MOT file), or COCO's (MOTChallenge's). Throws InputError that names file
// and line, also if the content is ambiguous. A class below the first one is kUnknownClass (coco.h), and a
// score that is missing or -1 counts as 1.
std::vector<FileBox> ReadBoxFile(const std::filesystem::path& path);

// The boxes of one frame, for writing.
struct ImageBoxes {
  double timestamp = 0.0;
  std::int64_t number = 0;  // from 0
  std::string name;         // of the image (ImageNames), or of the video
  cv::Size image;           // px
  std::vector<Detection> detections;
};

// Writes kFolder (in image fractions, with classes.txt), kCoco or kMot (with labels.txt beside it), which
// ReadBoxFile can read. Throws InputError if they cannot be written, UsageError for other formats.
void WriteBoxFile(const std::filesystem::path& path, BoxFormat format, bool video,
                  const std::vector<ImageBoxes>& frames);

// Returns the bounds of an annotation's `segmentation` in COCO's JSON, pixels: polygons [[x, y, x, y, ...],
// ...], or run lengths {"size": [height, width], "counts": list or text}. Has no area if the mask is
// empty. Throws nlohmann::json::exception for other types, InputError that begins with `place` for impossible
// values.
Box2d BoundsOfMask(const nlohmann::ordered_json& segmentation, const std::string& place);

}  // namespace sqslam
