#include "slam/io/sequence.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <utility>

#include "slam/io/cameras.h"
#include "slam/io/dataset_layouts.h"
#include "slam/io/detections.h"
#include "slam/io/image_files.h"
#include "slam/io/image_header.h"
#include "slam/io/video_index.h"
#include "slam/util/image_decoding.h"
#include "slam/util/statistics.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

fs::path CameraBeside(const SequenceRequest& request) {
  const fs::path folder = fs::is_directory(request.path) ? request.path : request.path.parent_path();
  return folder / "camera.yaml";
}

// Returns true for a user's own pictures without a calibration beside them. For a dataset, a guess would only
// hide that its calibration is missing.
bool ShouldGuessCamera(const SequenceRequest& request, SequenceFormat format) {
  const bool own = format == SequenceFormat::kVideo || format == SequenceFormat::kImages;
  return !request.known_camera && (request.camera == kAutoCamera ||
                                   (request.camera.empty() && own && !fs::exists(CameraBeside(request))));
}

// An image with the size and orientation of most.
struct TypicalImage {
  fs::path path;
  ImageHeader header;
};

// Looks at evenly spaced images. Returns the first one of the most frequent size; nothing if none of them can
// be read.
std::optional<TypicalImage> FindTypicalImage(const std::vector<SequenceFrame>& frames) {
  constexpr std::size_t kMaxSamples = 24;
  const std::size_t count = std::min(kMaxSamples, frames.size());
  std::vector<std::pair<TypicalImage, int>> sizes;  // with their number
  for (std::size_t i = 0; i < count; ++i) {
    const fs::path& path = frames[i * frames.size() / count].image_path;
    const std::optional<ImageHeader> header = ReadImageHeader(path);
    if (!header) {
      continue;
    }
    const auto same = std::ranges::find_if(
        sizes, [&](const auto& counted) { return counted.first.header.size == header->size; });
    if (same == sizes.end()) {
      sizes.emplace_back(TypicalImage{path, *header}, 1);
    } else {
      ++same->second;
    }
  }
  const auto most = std::ranges::max_element(sizes, {}, &std::pair<TypicalImage, int>::second);
  return most == sizes.end() ? std::nullopt : std::optional(most->first);
}

// Suggests a subfolder with images; empty if there is none.
std::string SuggestSubfolder(const fs::path& folder) {
  std::vector<fs::path> below;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory() && !IsHidden(entry.path()) &&
        (DetectFormat(entry.path()) != SequenceFormat::kImages || !ListColorImages(entry.path()).empty())) {
      below.push_back(entry.path());
    }
  }
  std::ranges::sort(below);
  return below.empty() ? "" : fmt::format("; did you mean {}?", below.front().string());
}

// Returns the images of a folder that are frames: those named like most, and others of the same size. A
// cut-off frame keeps its number, and a thumbnail takes none.
std::vector<fs::path> ListFrameImages(const fs::path& folder) {
  const std::vector<fs::path> files = ListColorImages(folder);
  std::map<std::string, std::vector<SequenceFrame>> by_pattern;
  for (const fs::path& file : files) {
    by_pattern[NamePattern(file)].push_back({0.0, file, {}});
  }
  const auto most =
      std::ranges::max_element(by_pattern, {}, [](const auto& named) { return named.second.size(); });
  const std::optional<TypicalImage> typical =
      by_pattern.size() > 1 ? FindTypicalImage(most->second) : std::nullopt;
  std::vector<fs::path> frames;
  std::vector<fs::path> others;
  for (const fs::path& file : files) {
    const auto is_frame = [&] {
      const std::optional<ImageHeader> header = ReadImageHeader(file);
      return header &&
             (header->size == typical->header.size || header->size == Turned(typical->header.size, 1));
    };
    (!typical || NamePattern(file) == most->first || is_frame() ? frames : others).push_back(file);
  }
  if (!others.empty()) {
    spdlog::warn(
        "{}: {} of {} files left out, such as {}: named otherwise than most, and unreadable or not {}x{}",
        folder.string(), others.size(), files.size(), others.front().filename().string(),
        typical->header.size.width, typical->header.size.height);
  }
  return frames;
}

std::vector<SequenceFrame> ListImages(const fs::path& folder, double fps) {
  std::vector<SequenceFrame> frames;
  for (const fs::path& image : ListFrameImages(folder)) {
    frames.push_back({static_cast<double>(frames.size()) / fps, image, {}});
  }
  if (frames.empty()) {
    throw InputError("{}: no rgb.txt and no image in it, expected at least one (.png, .jpg, ...){}",
                     folder.string(), SuggestSubfolder(folder));
  }
  return frames;
}

std::vector<SequenceFrame> ListFrames(SequenceFormat format, const fs::path& path, double fps) {
  return format == SequenceFormat::kImages ? ListImages(path, fps) : ListDataset(format, path, fps);
}

// Returns the size of most images, as shown; empty if none can be read.
cv::Size SizeOfImages(SequenceFormat format, const fs::path& path) {
  if (format == SequenceFormat::kVideo) {
    const auto [width, height] = IndexVideo(path).ShownSize();
    return {width, height};
  }
  const std::optional<TypicalImage> typical = FindTypicalImage(ListFrames(format, path, Camera().fps));
  return typical ? typical->header.size : cv::Size();
}

// Returns the requested calibration, the sequence's own, or that of its dataset.
Camera CameraOf(const SequenceRequest& request, SequenceFormat format) {
  const auto size = [&] { return SizeOfImages(format, request.path); };
  if (!request.camera.empty()) {
    return ReadCamera(CameraFile(request.camera), size);
  }
  const fs::path beside = CameraBeside(request);
  if (fs::exists(beside)) {
    return ReadCamera(beside, size);
  }
  if (const std::optional<Camera> own = CameraOfDataset(format, request.path)) {
    return *own;
  }
  const std::string preset = PresetOf(format, request.path);
  if (preset.empty()) {
    throw InputError(
        "{}: does not exist, expected the camera's calibration there, or --camera FILE.yaml (sqslam "
        "calibrate makes one), --camera PRESET ({}), or --camera auto, which guesses and refines it",
        beside.string(), fmt::join(CameraPresetNames(), ", "));
  }
  spdlog::info("{}: {} layout without camera.yaml, taken with --camera {}", request.path.string(),
               NameOf(format), preset);
  return ReadCamera(CameraFile(preset));
}

CameraGuess GuessFromImages(const std::vector<SequenceFrame>& frames,
                            const std::optional<TypicalImage>& typical, double fps) {
  if (const auto guess = typical ? GuessCamera(typical->path, fps) : std::nullopt) {
    return *guess;
  }
  const fs::path& first = frames.front().image_path;
  const DecodedImage decoded = DecodeImage(ReadImageFile(first).bytes, cv::IMREAD_COLOR);
  ThrowIf<InputError>(decoded.too_large, "{}: {}", first.string(), decoded.problem);
  throw InputError("{}: cannot be read, expected an image to take the camera's size from", first.string());
}

// Returns the frame rate by the timestamps. `assumed`: that of a single frame.
double FrameRate(const std::vector<SequenceFrame>& frames, double assumed) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    intervals.push_back(frames[i].timestamp - frames[i - 1].timestamp);
  }
  const double interval = intervals.empty() ? 0.0 : UpperMedian(std::move(intervals));
  return interval > 0.0 ? std::round(100.0 / interval) / 100.0 : assumed;  // times are rounded, too
}

// Returns the calibration of images of this size: scaled if they have the same aspect ratio.
Camera CameraInSize(const Camera& camera, cv::Size image, const fs::path& sequence) {
  if (image == cv::Size(camera.width, camera.height)) {
    return camera;
  }
  // A side that was rounded is up to a pixel off.
  const double difference = std::abs(static_cast<double>(image.width) * camera.height -
                                     static_cast<double>(image.height) * camera.width);
  ThrowIf<InputError>(
      difference > std::max(camera.width, camera.height),
      "{}: is {}x{}, expected the camera's {}x{} or its aspect ratio; cropped or distorted images need "
      "a calibration of their own (sqslam calibrate), or --camera auto",
      sequence.string(), image.width, image.height, camera.width, camera.height);
  spdlog::info("{}: is {}x{}, the calibration is of {}x{}: scaled to it", sequence.string(), image.width,
               image.height, camera.width, camera.height);
  return ResizedCamera(camera, image.width, image.height);
}

// Returns the calibration of most images: rotated if they are shown rotated to the sensor, and scaled to
// their size.
Camera CameraAsShown(Camera camera, const TypicalImage& typical, const fs::path& sequence) {
  const cv::Size size(camera.width, camera.height);
  const cv::Size shown = typical.header.size;
  CheckImageSides(sequence, size);
  if ((size.width > size.height) != (shown.width > shown.height) && size.width != size.height &&
      shown.width != shown.height) {
    const int exif = typical.header.quarter_turns;
    const int turns = exif % 2 != 0 ? exif : QuarterTurnsTo(shown, {size});
    spdlog::info("{}: most images are turned by {} degrees, the calibration with them", typical.path.string(),
                 90 * turns);
    camera = RotatedCamera(camera, turns);
  }
  return CameraInSize(camera, shown, sequence);
}

// Returns the calibration of a video's pictures as shown. A calibration of the stored pictures, before a
// phone's rotation flag is applied, is rotated with them.
Camera VideoCamera(Camera camera, const VideoIndex& video, const fs::path& path) {
  const auto [width, height] = video.ShownSize();
  if (cv::Size(camera.width, camera.height) == video.stored) {
    camera = ResizedCamera(camera, video.width, video.height);  // pixels become square
  }
  const bool portrait = camera.height > camera.width;
  if (video.quarter_turns % 2 != 0 && portrait == (video.height > video.width) && width != height) {
    spdlog::info("{}: rotated by {} degrees as its metadata says, together with its calibration",
                 path.string(), 90 * video.quarter_turns);
    camera = RotatedCamera(camera, video.quarter_turns);
  }
  camera = CameraInSize(camera, {width, height}, path);
  camera.fps = video.fps;
  return camera;
}

// Returns the size of the images in files, turned as the frames are.
cv::Size SizeInFiles(const Camera& camera, const std::optional<TypicalImage>& typical) {
  const cv::Size size(camera.width, camera.height);
  return typical ? Turned(typical->header.size, QuarterTurnsTo(size, typical->header)) : size;
}

// Lists frames and camera, both as in the files.
void ListSequence(const SequenceRequest& request, Sequence& sequence) {
  const bool guess = ShouldGuessCamera(request, sequence.format);
  const Camera camera = request.known_camera ? *request.known_camera
                        : guess              ? Camera()
                                             : CameraOf(request, sequence.format);
  sequence.camera = camera;
  const auto use_guess = [&sequence](const CameraGuess& guessed) {
    sequence.camera = guessed.camera;
    sequence.guessed_by = guessed.source;
    sequence.guess_deviation = guessed.deviation;
  };
  const auto use_size = [&sequence](cv::Size size) {
    sequence.image_width = size.width;
    sequence.image_height = size.height;
  };
  if (sequence.format != SequenceFormat::kVideo) {
    sequence.frames = ListFrames(sequence.format, sequence.path, camera.fps);
    const std::optional<TypicalImage> typical = FindTypicalImage(sequence.frames);
    if (guess) {
      use_guess(GuessFromImages(sequence.frames, typical, FrameRate(sequence.frames, camera.fps)));
    } else if (!request.known_camera && typical) {
      sequence.camera = CameraAsShown(camera, *typical, sequence.path);
    }
    sequence.value_range = FindValueRange(ToVector(sequence.frames, &SequenceFrame::image_path));
    use_size(request.known_camera ? SizeInFiles(camera, typical)
                                  : cv::Size(sequence.camera.width, sequence.camera.height));
    return;
  }
  const VideoIndex video = IndexVideo(sequence.path);
  for (const double timestamp : video.timestamps) {
    sequence.frames.push_back({timestamp, {}, {}});
  }
  sequence.video_path = sequence.path;
  sequence.quarter_turns = video.quarter_turns;
  sequence.video_times = video.times;
  if (guess) {
    use_guess(GuessCamera(video.ShownSize().first, video.ShownSize().second, video.fps));
  } else if (!request.known_camera) {
    sequence.camera = VideoCamera(camera, video, sequence.path);
  }
  use_size({video.ShownSize().first, video.ShownSize().second});
}

double UsualScale(const cv::Size& image) {
  constexpr double kMaxEnlargement = 2.0;  // beyond it, an image gains nothing
  const double enlargement = std::sqrt(kMinMappedPixels / image.area());
  const double longer_side = std::max(image.width, image.height);
  return std::min(std::clamp(enlargement, 1.0, kMaxEnlargement), kMaxMappedSide / longer_side);
}

ImageResize ResizeOf(const SequenceRequest& request, const cv::Size& image) {
  return request.resize.empty() ? ImageResize{.scale = UsualScale(image)} : ParseImageResize(request.resize);
}

void AttachDetections(const SequenceRequest& request, Sequence& sequence) {
  fs::path path = request.detections;
  if (path.empty() && fs::is_directory(request.path) && fs::exists(request.path / "boxes.txt")) {
    path = request.path / "boxes.txt";
  }
  if (path.empty()) {
    return;
  }
  ThrowIf<InputError>(!fs::exists(path), "{}: does not exist, expected a file or folder with boxes",
                      path.string());
  std::vector<std::vector<Detection>> detections = ReadFrameBoxes(path, sequence, true);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    sequence.frames[i].detections = std::move(detections[i]);
  }
  sequence.has_detections = true;
}

// Returns the mask of an image in a folder of masks; empty if there is none.
fs::path MaskOf(const fs::path& masks, const fs::path& sequence, const fs::path& image) {
  const fs::path name = image.filename();
  for (fs::path candidate : {masks / image.lexically_relative(sequence), masks / name}) {
    candidate += ".png";
    if (fs::exists(candidate)) {
      return candidate;
    }
  }
  const fs::path bare = (masks / name).replace_extension(".png");
  return fs::exists(bare) ? bare : fs::path();
}

void AttachMasks(const fs::path& masks, Sequence& sequence) {
  if (!fs::is_directory(masks)) {
    ThrowIf<InputError>(ReadImage(masks, cv::IMREAD_GRAYSCALE).empty(),
                        "{}: cannot be read, expected an image (black: ignored) or a folder of them",
                        masks.string());
    for (SequenceFrame& frame : sequence.frames) {
      frame.mask_path = masks;
    }
    return;
  }
  std::map<std::int64_t, fs::path> by_number;  // of a video's frames
  if (!sequence.video_path.empty()) {
    for (const fs::path& file : ListColorImages(masks)) {
      by_number[LastNumber(file.filename().string()).value_or(-1)] = file;
    }
  }
  std::size_t found = 0;
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    SequenceFrame& frame = sequence.frames[i];
    if (const auto it = by_number.find(static_cast<std::int64_t>(i)); it != by_number.end()) {
      frame.mask_path = it->second;
    } else if (!frame.image_path.empty()) {
      frame.mask_path = MaskOf(masks, sequence.path, frame.image_path);
    }
    found += frame.mask_path.empty() ? 0 : 1;
  }
  ThrowIf<InputError>(found == 0, "{}: no mask for any of the {} frames, expected {}", masks.string(),
                      sequence.frames.size(),
                      sequence.video_path.empty() ? "files named IMAGE.png, such as 0001.jpg.png"
                                                  : "numbers of frames, such as 0.png");
  if (found < sequence.frames.size()) {
    spdlog::info("{}: masks for {} of {} frames", masks.string(), found, sequence.frames.size());
  }
}

// Returns the video of a folder that holds nothing else to map.
std::optional<fs::path> OnlyVideoIn(const fs::path& folder) {
  constexpr std::array kExtensions = {".mp4", ".mov", ".avi", ".mkv", ".m4v", ".webm"};
  if (!fs::is_directory(folder) || DetectFormat(folder) != SequenceFormat::kImages ||
      !ListColorImages(folder).empty()) {
    return std::nullopt;
  }
  std::vector<fs::path> videos;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (IsHidden(entry.path())) {
      continue;
    }
    std::string extension = entry.path().extension().string();
    std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
    if (std::ranges::find(kExtensions, extension) != kExtensions.end()) {
      videos.push_back(entry.path());
    }
  }
  return videos.size() == 1 ? std::optional(videos.front()) : std::nullopt;
}

}  // namespace

Sequence OpenSequence(const SequenceRequest& given) {
  SequenceRequest request = given;
  request.path = OnlyVideoIn(given.path).value_or(given.path);
  const SequenceFormat detected = DetectFormat(request.path);
  const SequenceFormat format = request.format == SequenceFormat::kAuto ? detected : request.format;
  ThrowIf<InputError>((format == SequenceFormat::kVideo) == fs::is_directory(request.path),
                      "{}: expected a {} for --format {}", request.path.string(),
                      format == SequenceFormat::kVideo ? "video file" : "folder", NameOf(format));
  Sequence sequence;
  sequence.path = fs::absolute(request.path).lexically_normal();
  sequence.format = format;
  ListSequence(request, sequence);
  sequence.any_image_size = request.known_camera.has_value();
  if (!request.known_camera) {
    if (const std::optional<ValueRange>& range = sequence.value_range; range && !range->IsWide()) {
      spdlog::info(
          "{}: its images have more than 8 bits and use the values {:.6g} to {:.6g}: mapped as black to "
          "white",
          sequence.path.string(), range->black, range->white);
    }
    const cv::Size file(sequence.camera.width, sequence.camera.height);
    CheckImageSides(sequence.path, file);
    if (const ImageResize resize = ResizeOf(request, file); resize.Changes()) {
      const cv::Size size = resize.Of(file);
      sequence.camera = ResizedCamera(sequence.camera, size.width, size.height);
    }
    AttachDetections(request, sequence);
    if (!request.mask.empty()) {
      AttachMasks(request.mask, sequence);
    }
  }
  return sequence;
}

bool HasFrame(const Sequence& sequence, std::int64_t frame) {
  return frame >= 0 && frame < std::ssize(sequence.frames);
}

std::vector<double> Timestamps(const Sequence& sequence) {
  return ToVector(sequence.frames, &SequenceFrame::timestamp);
}

std::vector<std::string> ImageNames(const Sequence& sequence) {
  std::vector<std::string> names;
  for (const SequenceFrame& frame : sequence.frames) {
    if (!frame.image_path.empty()) {
      const fs::path below = frame.image_path.lexically_relative(sequence.path);
      names.push_back((below.empty() ? frame.image_path : below).generic_string());
    }
  }
  return names;
}

cv::Size FileSize(const Sequence& sequence) {
  return sequence.image_width > 0 ? cv::Size(sequence.image_width, sequence.image_height)
                                  : cv::Size(sequence.camera.width, sequence.camera.height);
}

Camera InFilePixels(const Camera& camera, const Sequence& sequence) {
  const cv::Size file = FileSize(sequence);
  const bool resized =
      file != cv::Size(camera.width, camera.height);  // else the numbers are not rounded again
  return resized ? ResizedCamera(camera, file.width, file.height) : camera;
}

std::vector<ImageHeader> ImageHeaders(const Sequence& sequence) {
  return ToVector(sequence.frames, [typical = ImageHeader{FileSize(sequence)}](const SequenceFrame& frame) {
    return frame.image_path.empty() ? typical : ReadImageHeader(frame.image_path).value_or(typical);
  });
}

std::vector<std::vector<Detection>> ReadFrameBoxes(const fs::path& path, const Sequence& sequence,
                                                   bool warn) {
  const std::vector<ImageHeader> headers = ImageHeaders(sequence);
  const std::vector<cv::Size> sizes = ToVector(headers, &ImageHeader::size);
  const std::vector<double> timestamps = Timestamps(sequence);
  const std::vector<std::string> names = ImageNames(sequence);
  std::vector<std::vector<Detection>> frames = warn ? ReadDetections(path, sizes, timestamps, names)
                                                    : CheckDetections(path, sizes, timestamps, names).frames;
  const cv::Size frame(sequence.camera.width, sequence.camera.height);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int turns = QuarterTurnsTo(frame, headers[i]);
    for (Detection& detection : frames[i]) {
      detection.box = Turned(detection.box, headers[i].size, turns, frame);
    }
  }
  return frames;
}

std::vector<Detection> InFilePixels(std::vector<Detection> detections, cv::Size frame, cv::Size file,
                                    int quarter_turns) {
  for (Detection& detection : detections) {
    detection.box = Turned(detection.box, frame, -quarter_turns, Turned(file, quarter_turns));
  }
  return detections;
}

}  // namespace sqslam
