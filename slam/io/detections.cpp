#include "slam/io/detections.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "slam/io/coco.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kEnd = "# end ";

bool IsEnd(const std::string& line) { return line.starts_with(kEnd); }

std::string TimeText(double timestamp) { return fmt::format("{:.6f}", timestamp); }

std::string FileHeader(const std::string& settings) {
  return fmt::format("# {}\n# timestamp label score x y w h\n", settings);
}

// The lines of the frames that a part file holds whole. What comes after the last whole line that ends a
// frame was cut off; that frame is done again.
std::vector<std::string> WholeFrames(const fs::path& part, const std::string& header) {
  std::ifstream in(part, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!text.starts_with(header)) {
    return {};
  }
  std::vector<std::string> lines;
  std::size_t whole = 0;  // lines up to the end of a frame
  std::size_t start = header.size();
  for (std::size_t end = text.find('\n', start); end != std::string::npos; end = text.find('\n', start)) {
    lines.push_back(text.substr(start, end - start));
    start = end + 1;
    whole = IsEnd(lines.back()) ? lines.size() : whole;
  }
  lines.resize(whole);
  return lines;
}

}  // namespace

bool IsKnownLabel(std::string_view label) {
  return std::find(kCocoNames.begin(), kCocoNames.end(), label) != kCocoNames.end() ||
         std::find(kMoreNames.begin(), kMoreNames.end(), label) != kMoreNames.end();
}

std::string NormalizedLabel(std::string_view label) {
  std::string normalized(label);
  std::replace(normalized.begin(), normalized.end(), ' ', '_');
  return normalized;
}

namespace {

std::string PlaceOf(const fs::path& path, const TextLine& line) {
  return fmt::format("{}:{}", path.string(), line.number);
}

// Once for a kind of thing, with the number of times it happened.
void WarnOf(const std::vector<std::string>& places, std::string_view what) {
  if (!places.empty()) {
    spdlog::warn("{}: {} (lines like this: {})", places.front(), what, places.size());
  }
}

class DetectionReader {
 public:
  DetectionReader(const Camera& camera, const std::vector<double>& timestamps)
      : camera_(camera), timestamps_(timestamps), frames_(timestamps.size()) {
    // A tenth of a frame: room for rounded timestamps, but never for the neighbour.
    if (timestamps.size() > 1) {
      tolerance_ = std::max(tolerance_, 0.1 * (timestamps.back() - timestamps.front()) /
                                            static_cast<double>(timestamps.size() - 1));
    }
  }

  void ReadBoxesFile(const fs::path& path) {
    constexpr const char* kExpected = "'timestamp label score x y w h [object_id [visible_fraction]]'";
    for (const TextLine& line : ReadTextLines(path, "a boxes.txt")) {
      if (line.words.size() < 7 || line.words.size() > 9) {
        ThrowBadLine(path, line, kExpected);
      }
      const double timestamp = NumberAt(path, line, 0, kExpected);
      Detection detection;
      detection.label = ValidText(line.words[1]);
      if (detection.label.size() > kMaxLabelBytes) {
        ThrowBadLine(path, line, fmt::format("a label of at most {} bytes", kMaxLabelBytes));
      }
      detection.score = NumberAt(path, line, 2, kExpected);
      detection.box = BoxAt(path, line, 3, kExpected);
      for (std::size_t i = 7; i < line.words.size(); ++i) {
        NumberAt(path, line, i, kExpected);
      }
      Add(path, line, timestamp, std::move(detection));
    }
  }

  void ReadFrameFile(const fs::path& path, double timestamp) {
    constexpr const char* kExpected = "'class x y w h score' with a COCO class number from 0 to 79";
    for (const TextLine& line : ReadTextLines(path, "a file with the boxes of one frame")) {
      const double number = NumberAt(path, line, 0, kExpected);
      if (line.words.size() != 6 || number < 0.0 || number != static_cast<int>(number)) {
        ThrowBadLine(path, line, kExpected);
      }
      const auto index = static_cast<std::size_t>(number);
      Detection detection;
      detection.label =
          index < kCocoNames.size() ? std::string(kCocoNames[index]) : fmt::format("class_{}", index);
      detection.box = BoxAt(path, line, 1, kExpected);
      detection.score = NumberAt(path, line, 5, kExpected);
      Add(path, line, timestamp, std::move(detection));
    }
  }

  CheckedDetections Finish() { return {std::move(frames_), std::move(report_)}; }

 private:
  static Box2d BoxAt(const fs::path& path, const TextLine& line, std::size_t first, const char* expected) {
    const Box2d box{NumberAt(path, line, first, expected), NumberAt(path, line, first + 1, expected),
                    NumberAt(path, line, first + 2, expected), NumberAt(path, line, first + 3, expected)};
    if (box.width <= 0.0 || box.height <= 0.0) {
      ThrowBadLine(path, line, "a box with w and h above 0");
    }
    return box;
  }

  std::optional<std::size_t> FrameAt(double timestamp) const {
    const auto after = std::lower_bound(timestamps_.begin(), timestamps_.end(), timestamp - tolerance_);
    if (after == timestamps_.end() || *after > timestamp + tolerance_) {
      return std::nullopt;
    }
    return static_cast<std::size_t>(after - timestamps_.begin());
  }

  void Add(const fs::path& path, const TextLine& line, double timestamp, Detection detection) {
    if (detection.score < 0.0 || detection.score > 1.0) {
      ThrowBadLine(path, line, "a score from 0 to 1");
    }
    ++report_.boxes;
    ++report_.labels[detection.label];
    if (!IsKnownLabel(detection.label)) {
      report_.unknown_labels[detection.label].push_back(PlaceOf(path, line));
    }
    const std::optional<std::size_t> frame = FrameAt(timestamp);
    if (!frame) {
      report_.no_frame.push_back(PlaceOf(path, line));
      return;
    }
    if (Clip(path, line, detection.box)) {
      frames_[*frame].push_back(std::move(detection));
    }
  }

  // False where nothing of the box is left.
  bool Clip(const fs::path& path, const TextLine& line, Box2d& box) {
    constexpr double kSlack = 2.0;  // pixels that detectors round over the border; not worth a warning
    const double left = std::max(box.x, 0.0);
    const double top = std::max(box.y, 0.0);
    const double right = std::min(box.x + box.width, static_cast<double>(camera_.width));
    const double bottom = std::min(box.y + box.height, static_cast<double>(camera_.height));
    if (right - left < 1.0 || bottom - top < 1.0) {
      report_.outside.push_back(PlaceOf(path, line));
      return false;
    }
    if (box.x < -kSlack || box.y < -kSlack || box.x + box.width > camera_.width + kSlack ||
        box.y + box.height > camera_.height + kSlack) {
      report_.clipped.push_back(PlaceOf(path, line));
    }
    box = {left, top, right - left, bottom - top};
    return true;
  }

  const Camera& camera_;
  const std::vector<double>& timestamps_;
  double tolerance_ = 1e-3;  // seconds
  std::vector<std::vector<Detection>> frames_;
  DetectionReport report_;
};

double TimestampOfName(const fs::path& path) {
  const std::optional<double> timestamp = ParseNumber<double>(path.stem().string());
  if (!timestamp) {
    throw InputError(fmt::format("{}: expected a file named TIMESTAMP.txt", path.string()));
  }
  return *timestamp;
}

}  // namespace

CheckedDetections CheckDetections(const fs::path& path, const Camera& camera,
                                  const std::vector<double>& frame_timestamps) {
  DetectionReader reader(camera, frame_timestamps);
  if (!fs::is_directory(path)) {
    reader.ReadBoxesFile(path);
    return reader.Finish();
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path)) {
    if (entry.path().extension() == ".txt") {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    throw InputError(
        fmt::format("{}: no TIMESTAMP.txt in it, expected one for each frame with boxes", path.string()));
  }
  std::sort(files.begin(), files.end());  // warnings come in the same order on every machine
  for (const fs::path& file : files) {
    reader.ReadFrameFile(file, TimestampOfName(file));
  }
  return reader.Finish();
}

std::vector<std::vector<Detection>> ReadDetections(const fs::path& path, const Camera& camera,
                                                   const std::vector<double>& frame_timestamps) {
  CheckedDetections checked = CheckDetections(path, camera, frame_timestamps);
  for (const auto& [label, places] : checked.report.unknown_labels) {
    WarnOf(places, fmt::format("label '{}' is not known, used as it is", label));
  }
  WarnOf(checked.report.no_frame, "box at a time at which there is no frame, left out");
  WarnOf(checked.report.outside, "box outside the image, left out");
  WarnOf(checked.report.clipped, "box reaches more than two pixels out of the image, clipped");
  return std::move(checked.frames);
}

DetectionWriter::DetectionWriter(fs::path path, std::string settings, const Eigen::Vector2d& file_pixels)
    : path_(std::move(path)),
      part_(path_.string() + ".part"),
      settings_(std::move(settings)),
      file_pixels_(file_pixels) {
  std::string before = FileHeader(settings_);
  for (const std::string& line : WholeFrames(part_, before)) {
    before += line + '\n';
    if (IsEnd(line)) {
      done_.insert(line.substr(kEnd.size()));
    } else {
      ++boxes_;
    }
  }
  WriteFileAtomically(part_, before);
  out_.open(part_, std::ios::binary | std::ios::app);
  if (!out_) {
    throw InputError(fmt::format("{}: cannot be written ({})", part_.string(), std::strerror(errno)));
  }
}

bool DetectionWriter::IsDone(double timestamp) const { return done_.contains(TimeText(timestamp)); }

void DetectionWriter::Add(double timestamp, const std::vector<Detection>& detections) {
  const std::string time = TimeText(timestamp);
  for (const Detection& d : detections) {
    out_ << fmt::format("{} {} {:.3f} {:.1f} {:.1f} {:.1f} {:.1f}\n", time, d.label, d.score,
                        d.box.x * file_pixels_.x(), d.box.y * file_pixels_.y(),
                        d.box.width * file_pixels_.x(), d.box.height * file_pixels_.y());
  }
  out_ << kEnd << time << '\n' << std::flush;
  if (!out_) {
    throw InputError(fmt::format("{}: cannot be written ({})", part_.string(), std::strerror(errno)));
  }
  done_.insert(time);
  boxes_ += static_cast<int>(detections.size());
}

void DetectionWriter::Finish() {
  out_.close();
  std::ifstream in(part_, std::ios::binary);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (!IsEnd(line)) {
      text += line + '\n';
    }
  }
  in.close();
  WriteFileAtomically(path_, text);
  std::error_code error;
  fs::remove(part_, error);
}

std::string LimitBoxes(const std::filesystem::path& boxes, int count) {
  const std::vector<TextLine> lines = ReadTextLines(boxes, "a boxes.txt");
  constexpr std::size_t kLabel = 1;
  constexpr std::size_t kId = 7;
  for (const TextLine& line : lines) {
    if (line.words.size() <= kLabel) {
      ThrowBadLine(boxes, line, "'timestamp label score x y w h [object_id [visible_fraction]]'");
    }
  }
  const bool has_ids = std::ranges::all_of(lines, [](const auto& line) { return line.words.size() > kId; });
  const std::size_t column = has_ids ? kId : kLabel;
  const auto is_object = [&](const TextLine& line) {  // an id below 0 is nothing that is there
    return !has_ids || !line.words[kId].starts_with('-');
  };
  std::map<std::string, int> counts;
  for (const TextLine& line : lines) {
    counts[line.words[column]] += is_object(line) ? 1 : 0;
  }
  std::vector<std::pair<int, std::string>> order;  // most boxes first
  for (const auto& [object, boxes_of_it] : counts) {
    if (boxes_of_it > 0) {
      order.emplace_back(-boxes_of_it, object);
    }
  }
  std::ranges::sort(order);
  std::set<std::string> kept;
  for (std::size_t i = 0; i < order.size() && i < static_cast<std::size_t>(count); ++i) {
    kept.insert(order[i].second);
  }
  std::string text =
      fmt::format("# boxes of {} {} of {}\n", kept.size(), has_ids ? "objects" : "labels", boxes.string());
  for (const TextLine& line : lines) {
    if (is_object(line) && kept.contains(line.words[column])) {
      text += line.text + "\n";
    }
  }
  return text;
}

}  // namespace sqslam
