
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "app/export/camera_model.h"
#include "slam/geometry/silhouette.h"
#include "slam/io/frame_source.h"
#include "slam/io/image_files.h"
#include "slam/io/image_header.h"
#include "slam/io/input_images.h"
#include "slam/io/result_files.h"
#include "slam/io/sequence.h"
#include "slam/run/map_to_extend.h"
#include "slam/snapshot/recording.h"
#include "slam/system_parts.h"
#include "slam/util/atomic_file.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMasks = "masks";  // folder

// Opens the images in the size that they have in the files.
Sequence OpenMapped(const MapToExtend& known, const fs::path& moved_to) {
  const RecordingReader recording(known.recording);
  SequenceRequest request;
  request.path = moved_to.empty() ? fs::path(recording.Info().sequence_path) : moved_to;
  request.known_camera = known.map.camera;
  Sequence sequence = OpenSequence(request);
  sequence.camera = InFilePixels(sequence.camera, sequence);
  CheckNumbering(recording, sequence);
  return sequence;
}

using ImageFiles =
    std::map<std::int64_t, std::string>;  // names by frame, relative to the folder of the images

const fs::path& FileOf(const Sequence& sequence, std::int64_t frame) {
  return sequence.frames[static_cast<std::size_t>(frame)].image_path;
}

// Returns true if a program that ignores EXIF reads the pixels that were mapped from the image file: 8 bits,
// not transparent, in the size of most, neither rotated nor mirrored.
bool ShowsMappedPixels(const Sequence& sequence, std::int64_t frame) {
  const std::string bytes = ReadImageFile(FileOf(sequence, frame)).bytes;
  const cv::Mat raw = DecodeImage(bytes, cv::IMREAD_UNCHANGED).pixels;
  if (raw.size() != FileSize(sequence) || (raw.type() != CV_8UC3 && raw.type() != CV_8UC1)) {
    return false;
  }
  const cv::Mat shown =
      DecodeImage(bytes, raw.type() == CV_8UC3 ? cv::IMREAD_COLOR : cv::IMREAD_GRAYSCALE).pixels;
  return shown.size() == raw.size() && cv::norm(raw, shown, cv::NORM_INF) == 0.0;
}

// Returns the name of an image in the folder of images: its path in the sequence, with underscores for
// blanks, which COLMAP's text files cannot hold.
std::string ExportedName(const Sequence& sequence, std::int64_t frame) {
  const fs::path& path = FileOf(sequence, frame);
  const fs::path below = path.lexically_relative(sequence.path);
  const bool inside = !below.empty() && *below.begin() != "..";
  std::string name = (inside ? below : path.filename()).generic_string();
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isspace(c) != 0; }, '_');
  return name;
}

// Names the images, and returns the frames whose files can be used as they are. Two images never share a
// name.
std::set<std::int64_t> NameImages(const Sequence& sequence, ImageFiles& files) {
  std::set<std::int64_t> as_they_are;
  std::set<std::string> names;
  for (auto& [frame, name] : files) {
    if (sequence.video_path.empty() && ShowsMappedPixels(sequence, frame)) {
      name = ExportedName(sequence, frame);
      as_they_are.insert(frame);
    }
    if (name.empty() || !names.insert(name).second) {
      name = fmt::format("{:06}{}", frame,
                         as_they_are.contains(frame) ? FileOf(sequence, frame).extension().string() : ".jpg");
      names.insert(name);
    }
  }
  return as_they_are;
}

// Copies or links the files of these frames.
void CopyImages(const Sequence& sequence, const ImageFiles& files, const std::set<std::int64_t>& frames,
                bool link, const fs::path& folder) {
  for (const std::int64_t frame : frames) {
    const fs::path target = folder / files.at(frame);
    fs::create_directories(target.parent_path());
    if (link) {
      fs::create_symlink(fs::absolute(FileOf(sequence, frame)), target);
    } else {
      fs::copy_file(FileOf(sequence, frame), target, fs::copy_options::overwrite_existing);
    }
  }
}

// Writes the images at the camera's size as JPEG, turned as they were mapped. Returns those that can be read.
ImageFiles WriteImages(const Sequence& sequence, const ImageFiles& files, const fs::path& folder,
                       const std::function<void(int, int)>& progress) {
  constexpr int kQuality = 99;
  const std::int64_t first = files.begin()->first;
  FrameSource source(sequence, {first, files.rbegin()->first - first + 1, 1});
  ImageFiles written;
  while (const std::optional<Frame> frame = source.Next()) {
    if (const auto file = files.find(frame->index); file != files.end()) {
      WriteFileAtomically(folder / file->second,
                          EncodedImage(".jpg", frame->bgr, {cv::IMWRITE_JPEG_QUALITY, kQuality}));
      written.insert(*file);
      progress(static_cast<int>(written.size()), static_cast<int>(files.size()));
    }
  }
  return written;
}

// Fills the folder of images: files that show the mapped pixels are copied or linked, the others written.
// Returns the images by frame, without those that cannot be read.
ImageFiles PutImages(const Sequence& sequence, ImageFiles files, bool link, const fs::path& folder,
                     const std::function<void(int, int)>& progress) {
  fs::create_directories(folder);
  const std::set<std::int64_t> as_they_are = NameImages(sequence, files);
  CopyImages(sequence, files, as_they_are, link, folder);
  ImageFiles to_write = files;
  std::erase_if(to_write, [&](const auto& file) { return as_they_are.contains(file.first); });
  std::erase_if(files, [&](const auto& file) { return !as_they_are.contains(file.first); });
  if (!to_write.empty()) {
    files.merge(WriteImages(sequence, to_write, folder, progress));
  }
  return files;
}

// Writes NAME.png for each image NAME.
void WriteMasks(const CameraModel& model, const std::vector<SnapshotObject>& objects,
                const fs::path& folder) {
  for (const CameraModel::Image& image : model.images) {
    cv::Mat mask(model.camera.height, model.camera.width, CV_8U, cv::Scalar(0));
    for (const SnapshotObject& object : objects) {
      std::vector<cv::Point> outline;
      for (const Eigen::Vector2d& pixel : DistortedOutline(
               Silhouette(object.superquadric, model.camera, image.T_camera_map.Inverse()), model.camera)) {
        outline.emplace_back(cvRound(pixel.x()), cvRound(pixel.y()));
      }
      if (!outline.empty()) {
        cv::fillPoly(mask, std::vector{outline}, cv::Scalar(255));
      }
    }
    const fs::path file = folder / (image.name + ".png");
    fs::create_directories(file.parent_path());
    WriteFileAtomically(file, EncodedImage(".png", mask));
  }
}

std::vector<SnapshotPoint> CloudOf(const CameraModel& model) {
  return ToVector(model.points, [](const CameraModel::Point& point) {
    return SnapshotPoint{.p_map = point.p_map.cast<float>(), .rgb = point.rgb};
  });
}

// Returns the keyframes whose images are expected to be readable, with empty names.
ImageFiles ListImages(const Map& map, const Sequence& sequence, ModelSummary& summary) {
  ImageFiles files;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    if (!HasFrame(sequence, keyframe.frame_index)) {
      ++summary.of_other_sequence;  // the run that was extended
    } else if (!sequence.video_path.empty() || ReadImageHeader(FileOf(sequence, keyframe.frame_index))) {
      files.emplace(keyframe.frame_index, "");
    } else {
      ++summary.unreadable;
    }
  }
  return files;
}

}  // namespace

ModelSummary ExportModel(const ModelRequest& request, const std::function<void(int, int)>& progress) {
  const fs::path& folder = request.folder;
  const MapToExtend known = ReadKnownMap(request.result);
  const Sequence sequence = OpenMapped(known, request.sequence);
  const Map map = MainMapOf(known.map, known.recording.string(), known.options);
  ModelSummary summary;
  ImageFiles files = ListImages(map, sequence, summary);
  const auto check_any = [&] {
    ThrowIf<InputError>(files.empty(),
                        "{}: has no keyframe among the {} images of {} that can be read, expected the "
                        "sequence that was mapped (--images)",
                        known.recording.string(), sequence.frames.size(), sequence.path.string());
  };
  check_any();
  CreateResultFolder(folder);
  const std::size_t listed = files.size();
  files = PutImages(sequence, std::move(files), request.link, folder / "images", progress);
  summary.unreadable += static_cast<int>(listed - files.size());
  check_any();
  CameraModel model = ModelOf(map, known.map.camera, sequence.camera, files);
  if (const std::optional<MapScale> scale = ReadMapScale(known.recording)) {
    model.Scale(scale->metres);
  }
  if (request.masks) {
    WriteMasks(model, RecordingReader(known.recording).Last()->objects, folder / kMasks);
  }
  if (request.format == ModelFormat::kColmap) {
    fs::create_directories(folder / "sparse" / "0");
    WriteColmap(folder / "sparse" / "0", model);
  } else {
    WritePoints(folder / "points.ply", CloudOf(model), FrameOf(*RecordingReader(known.recording).Last()));
    WriteTransforms(folder / "transforms.json", model, "points.ply", request.masks ? kMasks : "");
  }
  summary.images = static_cast<int>(model.images.size());
  summary.points = static_cast<int>(model.points.size());
  summary.error = model.MeanError();
  return summary;
}

}  // namespace sqslam::app
