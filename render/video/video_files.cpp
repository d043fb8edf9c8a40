#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <ranges>
#include <regex>

#include "render/picture/png_density.h"
#include "render/video/video.h"
#include "render/video/video_encoder.h"
#include "slam/io/image_files.h"
#include "slam/io/video_index.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxQueuedFrames = 4;  // frames that may wait for the encoder

const std::regex kFrameField(R"(\{frame(?::(\d+))?\})");  // {frame} or {frame:04}

}  // namespace

bool IsFrameTemplate(const std::string& name) { return std::regex_search(name, kFrameField); }

std::string FrameName(const std::string& name, int number) {
  std::smatch match;
  if (!std::regex_search(name, match, kFrameField)) {
    return name;
  }
  const std::string digits = match[1].str();
  const int width = digits.empty() ? 0 : std::min(20, std::stoi(digits.substr(0, 3)));
  return match.prefix().str() + fmt::format("{:0{}}", number, width) + match.suffix().str();
}

bool IsVideo(const fs::path& path) {
  return path.extension() == ".mp4" || path.extension() == ".gif" || path.extension() == ".webp";
}

FrameWriter::FrameWriter(const fs::path& output, cv::Size size, double fps) : output_(output) {
  if (IsFrameTemplate(output.string())) {
    ThrowIf<UsageError>(output.extension() != ".png", "{}: expected a numbered name that ends in .png",
                        output.string());
    std::error_code error;
    if (output.has_parent_path()) {
      fs::create_directories(output.parent_path(), error);
    }
  } else if (IsVideo(output)) {
    ThrowIf<UsageError>(output.extension() == ".mp4" && (size.width % 2 != 0 || size.height % 2 != 0),
                        "resolution {},{}: the sides of a video must be even", size.width, size.height);
    file_.emplace(output_);
    video_.emplace(file_->Path(), size, fps, output_);
  } else {
    throw UsageError("{}: expected FILE.mp4, .gif or .webp, or a name with {{frame:04}} that ends in .png",
                     output.string());
  }
  encoding_.emplace(kMaxQueuedFrames, [this](const Job& job) { Write(job); });
}

void FrameWriter::Write(const Job& job) {
  if (video_) {
    video_->Add(job.frame);
    return;
  }
  WriteFileAtomically(FrameName(output_.string(), job.number),
                      WithDensity(EncodedImage(".png", job.frame, {cv::IMWRITE_PNG_COMPRESSION, 3})));
}

void FrameWriter::Add(const cv::Mat& frame, int number) {
  encoding_->Add({frame.clone(), number});
  ++added_;
}

void FrameWriter::Close() {
  encoding_->Finish();
  if (file_ && added_ > 0) {
    video_->Finish();
    file_->Commit();
  }
}

namespace {

struct Part {
  fs::path path;
  std::string video;  // name without the part
  Shard shard;
};

std::optional<Part> ParsePart(const fs::path& path) {
  static const std::regex pattern(R"((.*)\.part-(\d{1,6})-of-(\d{1,6})(\.[^.]+))");
  const std::string name = path.string();
  std::smatch match;
  if (!std::regex_match(name, match, pattern)) {
    return std::nullopt;
  }
  return Part{path, match[1].str() + match[4].str(), {std::stoi(match[2].str()), std::stoi(match[3].str())}};
}

// Returns the parts in order; throws InputError unless they are complete and of one video.
std::vector<Part> SortedParts(const std::vector<std::string>& pieces) {
  std::map<int, Part> by_index;
  for (const std::string& piece : pieces) {
    const std::optional<Part> part = ParsePart(piece);
    if (!part) {
      throw InputError(
          "{}: not named like a piece of a video, expected FILE.part-I-of-N.mp4 or numbered pictures", piece);
    }
    const Part& first = by_index.empty() ? *part : by_index.begin()->second;
    ThrowIf<InputError>(part->video != first.video || part->shard.count != first.shard.count,
                        "{}: a piece of another video than {}, expected one of {} pieces of {}", piece,
                        first.path.string(), first.shard.count, first.video);
    ThrowIf<InputError>(part->shard.index < 1 || part->shard.index > part->shard.count,
                        "{}: there is no piece {} of {}", piece, part->shard.index, part->shard.count);
    if (!by_index.emplace(part->shard.index, *part).second) {
      throw InputError("{}: is given twice, expected each piece once", piece);
    }
  }
  const int count = by_index.begin()->second.shard.count;
  std::vector<int> missing;
  for (int i = 1; i <= count; ++i) {
    if (by_index.count(i) == 0) {
      missing.push_back(i);
    }
  }
  if (!missing.empty()) {
    throw InputError("{}: missing {} {} of {}", by_index.begin()->second.video,
                     missing.size() == 1 ? "piece" : "pieces", fmt::join(missing, ", "), count);
  }
  return ToVector(by_index | std::views::values);
}

struct Opened {
  cv::Size size;
  double fps = 0.0;
  int frames = 0;
};

Opened Open(const fs::path& path) {
  Opened opened;
  cv::VideoCapture video;
  ThrowIf<InputError>(!fs::exists(path) || !video.open(FfmpegName(path), cv::CAP_FFMPEG),
                      "{}: cannot be read as a video, expected a piece that was finished", path.string());
  opened.size = {static_cast<int>(video.get(cv::CAP_PROP_FRAME_WIDTH)),
                 static_cast<int>(video.get(cv::CAP_PROP_FRAME_HEIGHT))};
  opened.fps = video.get(cv::CAP_PROP_FPS);
  opened.frames = static_cast<int>(video.get(cv::CAP_PROP_FRAME_COUNT));
  return opened;
}

// Reads and checks size, frame rate and lengths of all parts before anything is written.
std::vector<Opened> Checked(const std::vector<Part>& parts) {
  std::vector<Opened> opened;
  int total = 0;
  for (const Part& part : parts) {
    opened.push_back(Open(part.path));
    const Opened& first = opened.front();
    const Opened& now = opened.back();
    ThrowIf<InputError>(now.size != first.size || std::abs(now.fps - first.fps) > 1e-3,
                        "{}: {}x{} at {:g} fps, expected {}x{} at {:g} fps as {}", part.path.string(),
                        now.size.width, now.size.height, now.fps, first.size.width, first.size.height,
                        first.fps, parts.front().path.string());
    total += now.frames;
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto [first, end] = ItemsOf(parts[i].shard, 0, total, SegmentFrames(opened[i].fps));
    if (end - first != opened[i].frames) {
      // If one part is truncated, all others seem too long: report the shortest.
      const auto [shortest, longest] = std::ranges::minmax_element(opened, {}, &Opened::frames);
      throw InputError("{}: {} frames, expected about {} as in the other pieces; was it interrupted?",
                       parts[static_cast<std::size_t>(shortest - opened.begin())].path.string(),
                       shortest->frames, longest->frames);
    }
  }
  return opened;
}

int JoinParts(const std::vector<std::string>& pieces, const fs::path& output, const VideoProgress& progress) {
  const std::vector<Part> parts = SortedParts(pieces);
  const std::vector<Opened> opened = Checked(parts);
  AtomicPath file(output);
  const int done = ConcatenateVideos(ToVector(parts, &Part::path), ToVector(opened, &Opened::frames),
                                     file.Path(), progress);
  file.Commit();
  return done;
}

// Returns the files that a name with a {frame} field matches.
std::vector<std::string> FilesOf(const std::string& name) {
  const fs::path folder = fs::path(name).has_parent_path() ? fs::path(name).parent_path() : fs::path(".");
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::optional<std::int64_t> number = LastNumber(entry.path().filename().string());
    if (number &&
        entry.path().filename() == fs::path(FrameName(name, static_cast<int>(*number))).filename()) {
      files.push_back(entry.path().string());
    }
  }
  ThrowIf<InputError>(files.empty(), "{}: no picture has such a name, expected numbered pictures", name);
  return files;
}

std::vector<std::string> SortedPictures(const std::vector<std::string>& pieces) {
  const std::vector<std::string> files =
      pieces.size() == 1 && IsFrameTemplate(pieces.front()) ? FilesOf(pieces.front()) : pieces;
  std::map<std::int64_t, std::string> by_number;
  for (const std::string& file : files) {
    const std::optional<std::int64_t> number = LastNumber(fs::path(file).filename().string());
    ThrowIf<InputError>(!number, "{}: no number in its name, expected numbered pictures", file);
    const auto [found, is_new] = by_number.emplace(*number, file);
    ThrowIf<InputError>(!is_new, "{}: has the same number as {}; leave one out", file, found->second);
  }
  std::vector<std::string> sorted;
  std::int64_t next = by_number.begin()->first;
  for (const auto& [number, file] : by_number) {
    ThrowIf<InputError>(number != next, "{}: comes after picture {}, expected picture {}: one is missing",
                        file, next - 1, next);
    ++next;
    sorted.push_back(file);
  }
  return sorted;
}

int JoinPictures(const std::vector<std::string>& pieces, const fs::path& output, double fps,
                 const VideoProgress& progress) {
  const std::vector<std::string> files = SortedPictures(pieces);
  std::optional<FrameWriter> writer;
  cv::Size size;
  int done = 0;
  for (const std::string& file : files) {
    const cv::Mat picture = ReadImage(file, cv::IMREAD_COLOR);
    ThrowIf<InputError>(picture.empty(), "{}: cannot be read, expected a picture", file);
    if (!writer) {
      size = picture.size();
      writer.emplace(output, size, fps);
    }
    ThrowIf<InputError>(picture.size() != size, "{}: {}x{}, expected {}x{} as {}", file, picture.cols,
                        picture.rows, size.width, size.height, files.front());
    writer->Add(picture, done++);
    if (progress && !progress(done, static_cast<int>(files.size()))) {
      break;
    }
  }
  writer->Close();
  return done;
}

}  // namespace

int JoinVideo(const std::vector<std::string>& pieces, const fs::path& output, double fps,
              const VideoProgress& progress) {
  ThrowIf<UsageError>(pieces.empty(), "--join: expected pieces of a video or numbered pictures");
  const bool pictures = fs::path(pieces.front()).extension() != ".mp4";
  return pictures ? JoinPictures(pieces, output, fps, progress) : JoinParts(pieces, output, progress);
}

}  // namespace sqslam
