
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>
#include <system_error>

#include "app/export/camera_model.h"
#include "slam/geometry/silhouette.h"
#include "slam/io/frame_source.h"
#include "slam/io/image_files.h"
#include "slam/io/input_images.h"
#include "slam/io/result_files.h"
#include "slam/io/sequence.h"
#include "slam/run/known_map.h"
#include "slam/snapshot/recording.h"
#include "slam/system_parts.h"
#include "slam/util/atomic_file.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMasks = "masks";  // folder

Sequence OpenMapped(const KnownMap& known, const fs::path& moved_to) {
  const RecordingReader recording(known.recording);
  SequenceRequest request;
  request.path = moved_to.empty() ? fs::path(recording.Info().sequence_path) : moved_to;
  request.known_camera = known.map.camera;
  Sequence sequence = OpenSequence(request);
  CheckNumbering(recording, sequence);
  return sequence;
}

// True if the sequence's image files can be linked as they are: at the camera's size and inside its folder.
bool AreFilesAsMapped(const Sequence& sequence, const CameraModel& model) {
  if (!sequence.video_path.empty()) {
    return false;
  }
  const fs::path& first =
      sequence.frames[static_cast<std::size_t>(model.images.front().frame_index)].image_path;
  const cv::Mat image = cv::imread(first.string());
  return image.size() == cv::Size(model.camera.width, model.camera.height) &&
         std::ranges::all_of(model.images, [&](const CameraModel::Image& keyframe) {
           const fs::path& file = sequence.frames[static_cast<std::size_t>(keyframe.frame_index)].image_path;
           const fs::path below = file.lexically_relative(sequence.path);
           return !below.empty() && *below.begin() != "..";
         });
}

// Writes the keyframes' images at the camera's size as JPEG. Returns the indices of their frames; those that
// cannot be read are missing.
std::set<std::int64_t> WriteImages(const Sequence& sequence, const CameraModel& model, const fs::path& folder,
                                   const std::function<void(int, int)>& progress) {
  constexpr int kQuality = 95;
  fs::create_directories(folder);
  std::map<std::int64_t, std::string> names;
  for (const CameraModel::Image& image : model.images) {
    names[image.frame_index] = image.name;
  }
  const std::int64_t first = names.begin()->first;
  FrameSource source(sequence, {first, names.rbegin()->first - first + 1, 1});
  std::set<std::int64_t> written;
  while (const std::optional<Frame> frame = source.Next()) {
    const auto name = names.find(frame->index);
    if (name == names.end()) {
      continue;
    }
    WriteFileAtomically(folder / name->second,
                        EncodedImage(".jpg", frame->bgr, {cv::IMWRITE_JPEG_QUALITY, kQuality}));
    written.insert(frame->index);
    progress(static_cast<int>(written.size()), static_cast<int>(names.size()));
  }
  return written;
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

// Drops keyframes without an image (`has_image`, by index of the frame), their observations, and points left
// with fewer than two. Returns the number of dropped keyframes.
int DropWithoutImage(CameraModel& model, const std::function<bool(std::int64_t)>& has_image) {
  std::vector<std::uint32_t> index_of;  // by old index
  std::vector<CameraModel::Image> kept;
  constexpr auto kGone = static_cast<std::uint32_t>(-1);
  for (CameraModel::Image& image : model.images) {
    const bool there = has_image(image.frame_index);
    index_of.push_back(there ? static_cast<std::uint32_t>(kept.size()) : kGone);
    if (there) {
      kept.push_back(std::move(image));
    }
  }
  const auto dropped = static_cast<int>(model.images.size() - kept.size());
  model.images = std::move(kept);
  for (CameraModel::Point& point : model.points) {
    std::erase_if(point.track, [&](const auto& sight) { return index_of[sight.first] == kGone; });
    for (auto& [image, pixel] : point.track) {
      image = index_of[image];
    }
  }
  for (CameraModel::Point& point : model.points) {
    for (const auto& [image, pixel] : point.track) {
      if (point.track.size() < 2) {
        model.images[image].points[pixel] = kNoPoint;
      }
    }
  }
  std::erase_if(model.points, [](const CameraModel::Point& point) { return point.track.size() < 2; });
  return dropped;
}

}  // namespace

ModelSummary ExportModel(const ModelRequest& request, const std::function<void(int, int)>& progress) {
  const fs::path& folder = request.folder;
  const KnownMap known = ReadKnownMap(request.result);
  const Sequence sequence = OpenMapped(known, request.sequence);
  const std::optional<MapScale> scale = ReadMapScale(known.recording);
  CameraModel model =
      ModelOf(MainMapOf(known.map, known.recording.string(), known.options), known.map.camera);
  if (scale) {
    model.Scale(scale->metres);
  }
  ModelSummary summary;
  const auto drop = [&](int& dropped, const std::function<bool(std::int64_t)>& has_image) {
    dropped += DropWithoutImage(model, has_image);
    ThrowIf<InputError>(model.images.empty(),
                        "{}: has no keyframe among the {} images of {} that can be read, expected the "
                        "sequence that was mapped (--images)",
                        known.recording.string(), sequence.frames.size(), sequence.path.string());
  };
  drop(summary.of_other_sequence, [&](std::int64_t frame) {  // an older run that was extended
    return HasFrame(sequence, frame);
  });
  drop(summary.unreadable, [&](std::int64_t frame) {
    std::error_code none;
    return !sequence.video_path.empty() ||
           fs::is_regular_file(sequence.frames[static_cast<std::size_t>(frame)].image_path, none);
  });
  CreateResultFolder(folder);
  const bool linked = AreFilesAsMapped(sequence, model);
  for (CameraModel::Image& image : model.images) {
    const fs::path& file = sequence.frames[static_cast<std::size_t>(image.frame_index)].image_path;
    image.name = linked ? file.lexically_relative(sequence.path).generic_string()
                        : fmt::format("{:06}.jpg", image.frame_index);
  }
  if (linked) {
    fs::create_directory_symlink(fs::absolute(sequence.path), folder / "images");
  } else {
    const std::set<std::int64_t> written = WriteImages(sequence, model, folder / "images", progress);
    drop(summary.unreadable, [&](std::int64_t frame) { return written.contains(frame); });
  }
  if (request.masks) {
    WriteMasks(model, RecordingReader(known.recording).Last()->objects, folder / kMasks);
  }
  if (request.format == ModelFormat::kColmap) {
    fs::create_directories(folder / "sparse" / "0");
    WriteColmap(folder / "sparse" / "0", model);
  } else {
    WritePoints(folder / "points.ply", CloudOf(model));
    WriteTransforms(folder / "transforms.json", model, "points.ply", request.masks ? kMasks : "");
  }
  summary.images = static_cast<int>(model.images.size());
  summary.points = static_cast<int>(model.points.size());
  summary.error = model.MeanError();
  return summary;
}

}  // namespace sqslam::app
