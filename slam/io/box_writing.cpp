#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "slam/io/box_formats.h"
#include "slam/io/coco.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/json_file.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Returns COCO's class names, followed by the other labels that occur.
std::vector<std::string> Classes(const std::vector<ImageBoxes>& frames) {
  std::vector<std::string> names(kCocoNames.begin(), kCocoNames.end());
  for (const ImageBoxes& frame : frames) {
    for (const Detection& detection : frame.detections) {
      if (std::ranges::find(names, detection.label) == names.end()) {
        names.push_back(detection.label);
      }
    }
  }
  return names;
}

std::int64_t IndexOf(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) - names.begin();
}

// Returns the image's path without extension; a video's frames are NAME_NUMBER, from 1, as Ultralytics does.
std::string NameOf(const ImageBoxes& frame, bool video) {
  const fs::path bare = fs::path(frame.name).replace_extension();
  return video ? fmt::format("{}_{}", bare.filename().string(), frame.number + 1) : bare.generic_string();
}

nlohmann::ordered_json CocoDocument(const std::vector<ImageBoxes>& frames,
                                    const std::vector<std::string>& names, bool video) {
  nlohmann::ordered_json document{{"images", nlohmann::ordered_json::array()},
                                  {"annotations", nlohmann::ordered_json::array()},
                                  {"categories", nlohmann::ordered_json::array()}};
  for (const ImageBoxes& frame : frames) {
    document["images"].push_back({{"id", frame.number},
                                  {"file_name", video ? NameOf(frame, video) : frame.name},
                                  {"width", frame.image.width},
                                  {"height", frame.image.height}});
    for (const Detection& d : frame.detections) {
      document["annotations"].push_back({{"id", document["annotations"].size() + 1},
                                         {"image_id", frame.number},
                                         {"category_id", IndexOf(names, d.label) + 1},
                                         {"bbox", {d.box.x, d.box.y, d.box.width, d.box.height}},
                                         {"area", d.box.width * d.box.height},
                                         {"iscrowd", 0},
                                         {"score", d.score}});
    }
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    document["categories"].push_back({{"id", i + 1}, {"name", names[i]}});
  }
  return document;
}

void WriteFolder(const fs::path& path, const std::vector<ImageBoxes>& frames,
                 const std::vector<std::string>& names, bool video) {
  CreateResultFolder(path);
  std::map<std::string, std::string> images;  // by the name of their file
  for (const ImageBoxes& frame : frames) {
    const std::string name = NameOf(frame, video);
    const auto [other, is_new] = images.emplace(name, frame.name);
    ThrowIf<InputError>(!is_new && other->second != frame.name,
                        "{}: {} and {} would share {}.txt, expected images with different names; "
                        "--output-format coco keeps them apart",
                        path.string(), other->second, frame.name, name);
    fs::create_directories((path / name).parent_path());
    std::string text;
    for (const Detection& d : frame.detections) {
      const Box2d& b = d.box;
      const cv::Size& image = frame.image;
      text += fmt::format("{} {:.6f} {:.6f} {:.6f} {:.6f} {:.3f}\n", IndexOf(names, d.label),
                          (b.x + 0.5 * b.width) / image.width, (b.y + 0.5 * b.height) / image.height,
                          b.width / image.width, b.height / image.height, d.score);
    }
    WriteFileAtomically(path / (name + ".txt"), text);
  }
  WriteFileAtomically(path / "classes.txt", fmt::format("{}\n", fmt::join(names, "\n")));
}

std::string MotText(const std::vector<ImageBoxes>& frames, const std::vector<std::string>& names) {
  std::string text;
  for (const ImageBoxes& frame : frames) {
    for (const Detection& d : frame.detections) {
      text +=
          fmt::format("{},-1,{:.1f},{:.1f},{:.1f},{:.1f},{:.3f},{},-1,-1\n", frame.number + 1, d.box.x + 1.0,
                      d.box.y + 1.0, d.box.width, d.box.height, d.score, IndexOf(names, d.label) + 1);
    }
  }
  return text;
}

}  // namespace

void WriteBoxFile(const fs::path& path, BoxFormat format, bool video, const std::vector<ImageBoxes>& frames) {
  const std::vector<std::string> names = Classes(frames);
  switch (format) {
    case BoxFormat::kFolder:
      WriteFolder(path, frames, names, video);
      return;
    case BoxFormat::kCoco:
      WriteJsonFile(path, CocoDocument(frames, names, video));
      return;
    case BoxFormat::kMot:
      WriteFileAtomically(path, MotText(frames, names));
      WriteFileAtomically(path.parent_path() / "labels.txt", fmt::format("{}\n", fmt::join(names, "\n")));
      return;
    default:
      throw UsageError("box format: cannot be written, expected boxes, yolo, coco or mot");
  }
}

}  // namespace sqslam
