#include "slam/io/detections.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "slam/io/box_formats.h"
#include "slam/io/coco.h"
#include "slam/io/time_unit.h"
#include "slam/util/atomic_file.h"
#include "slam/util/statistics.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kEnd = "# end ";

bool IsEnd(const std::string& line) { return line.starts_with(kEnd); }

std::string TimeText(double timestamp) { return fmt::format("{:.6f}", timestamp); }

std::string FileHeader(const std::string& settings) {
  return fmt::format("# {}\n# timestamp label score x y w h\n", settings);
}

// Returns the lines of the complete frames in a part file. Lines after the last end of a frame belong to a
// frame that was cut off; it is processed again.
std::vector<std::string> CompleteFrames(const fs::path& part, const std::string& header) {
  std::ifstream in(part, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!text.starts_with(header)) {
    return {};
  }
  std::vector<std::string> lines;
  std::size_t complete = 0;  // lines up to the end of a frame
  std::size_t start = header.size();
  for (std::size_t end = text.find('\n', start); end != std::string::npos; end = text.find('\n', start)) {
    lines.push_back(text.substr(start, end - start));
    start = end + 1;
    complete = IsEnd(lines.back()) ? lines.size() : complete;
  }
  lines.resize(complete);
  return lines;
}

}  // namespace

bool IsKnownLabel(std::string_view label) {
  return std::ranges::find(kCocoNames, label) != kCocoNames.end() ||
         std::ranges::find(kIndoorNames, label) != kIndoorNames.end();
}

std::string NormalizedLabel(std::string_view label) {
  std::string normalized(label);
  std::ranges::replace(normalized, ' ', '_');
  return normalized;
}

namespace {

// Warns once per kind of problem, with the number of occurrences.
void WarnOfBoxes(const std::vector<std::string>& places, std::string_view what) {
  if (!places.empty()) {
    spdlog::warn("{}: {} ({} in all)", places.front(), what, places.size());
  }
}

// Returns the image's name without folder and extension; a timestamp's fraction does not count as one.
std::string ImageStem(const fs::path& name) {
  const std::string ending = name.extension().string();
  const bool fraction = ending.size() > 1 && ParseNumber<std::uint64_t>(ending.substr(1));
  return (fraction ? name.filename() : name.stem()).string();
}

// Returns true if one path is the other, or its last part.
bool EndsAlike(const fs::path& a, const fs::path& b) {
  const fs::path x = a.lexically_normal();
  const fs::path y = b.lexically_normal();
  auto i = x.end();
  auto j = y.end();
  while (i != x.begin() && j != y.begin()) {
    if (*--i != *--j) {
      return false;
    }
  }
  return true;
}

// Assigns the boxes of files to frames.
class DetectionSorter {
 public:
  DetectionSorter(const std::vector<cv::Size>& images, const std::vector<double>& timestamps,
                  const std::vector<std::string>& names)
      : images_(images), timestamps_(timestamps), image_names_(names), frames_(timestamps.size()) {
    // A tenth of a frame interval: allows for rounded timestamps but never reaches the neighbour. The
    // median, since a pause in a recording raises the mean.
    std::vector<double> intervals;
    for (std::size_t i = 1; i < timestamps.size(); ++i) {
      intervals.push_back(timestamps[i] - timestamps[i - 1]);
    }
    if (!intervals.empty()) {
      tolerance_ = std::max(tolerance_, 0.1 * UpperMedian(std::move(intervals)));
    }
    std::set<std::string_view> listed;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!listed.insert(names[i]).second) {
        continue;  // an image that is shown twice
      }
      const std::string stem = ImageStem(names[i]);
      stems_.emplace(stem, i);
      if (const auto number = ParseNumber<std::int64_t>(stem)) {
        numbers_[*number].push_back(i);
      }
    }
  }

  // Converts times to seconds of the frames: in the unit, or as frame numbers, with which most boxes meet a
  // frame.
  void UseTimesOfFrames(const fs::path& path, std::vector<FileBox>& boxes) const {
    std::vector<double> times;
    for (const FileBox& box : boxes) {
      if (const FrameTime* time = std::get_if<FrameTime>(&box.frame)) {
        times.push_back(time->seconds);
      }
    }
    times.erase(std::unique(times.begin(), times.end()), times.end());
    const auto met = [&](const TimeUnit& unit) {
      std::set<Frame> frames;  // not boxes: times in too small a unit all meet the first frame
      for (const double time : times) {
        frames.insert(FrameOf(FrameTime{unit.seconds * time}, ""));
      }
      return frames.size() - frames.count(std::nullopt);
    };
    const auto* const most = std::ranges::max_element(kTimeUnits, {}, met);
    const auto* const unit = met(*most) > 1 ? most : kTimeUnits.begin();
    const auto is_frame = [&](double time) {
      return time == std::floor(time) && time >= 0.0 && time < static_cast<double>(frames_.size());
    };
    const bool numbers =
        times.size() > 1 && 2 * met(*unit) < times.size() && std::ranges::all_of(times, is_frame);
    for (FileBox& box : boxes) {
      if (FrameTime* time = std::get_if<FrameTime>(&box.frame)) {
        box.frame = numbers ? FrameKey(FrameNumber{static_cast<std::int64_t>(time->seconds)})
                            : FrameKey(FrameTime{unit->seconds * time->seconds});
      }
    }
    ReportTimeUnit(path.string(), numbers ? TimeUnit{0.0, "frame numbers"} : *unit);
  }

  void Add(const FileBox& box) {
    Detection detection = box.detection;
    ThrowIf<InputError>(!(detection.score >= 0.0 && detection.score <= 1.0),
                        "{}: score {}, expected a score from 0 to 1", box.place, detection.score);
    ++report_.boxes;
    ++report_.labels[detection.label];
    if (!IsKnownLabel(detection.label)) {
      report_.unknown_labels[detection.label].push_back(box.place);
    }
    const std::optional<std::size_t> frame =
        std::visit([&](const auto& key) { return FrameOf(key, box.place); }, box.frame);
    if (!frame || *frame >= frames_.size()) {
      report_.no_frame.push_back(box.place);
      return;
    }
    const cv::Size& image = images_[std::min(*frame, images_.size() - 1)];
    if (box.in_parts) {
      const Box2d& b = box.detection.box;
      detection.box = {b.x * image.width, b.y * image.height, b.width * image.width, b.height * image.height};
    }
    if (Clip(box.place, image, detection.box)) {
      frames_[*frame].push_back(std::move(detection));
    }
  }

  CheckedDetections Finish() { return {std::move(frames_), std::move(report_)}; }

 private:
  using Frame = std::optional<std::size_t>;

  Frame FrameOf(FrameTime time, const std::string&) const {
    auto nearest = std::ranges::lower_bound(timestamps_, time.seconds);
    if (nearest != timestamps_.begin() &&
        (nearest == timestamps_.end() || time.seconds - *std::prev(nearest) <= *nearest - time.seconds)) {
      --nearest;
    }
    if (nearest == timestamps_.end() || !(std::abs(*nearest - time.seconds) <= tolerance_)) {
      return std::nullopt;
    }
    return static_cast<std::size_t>(nearest - timestamps_.begin());
  }
  Frame FrameOf(FrameNumber frame, const std::string&) const {
    return static_cast<std::size_t>(frame.number);
  }
  Frame FrameOf(ImageNumber image, const std::string& place) const {
    ThrowIf<InputError>(numbers_.empty(),
                        "{}: image_id {} matches no image name, expected the file names under \"images\"",
                        place, image.number);
    const auto found = numbers_.find(image.number);
    if (found == numbers_.end()) {
      return std::nullopt;
    }
    ThrowIfAmbiguous(std::to_string(image.number), place, found->second);
    return found->second.front();
  }
  // Returns the image of that path or name; without images, frame NAME_NUMBER of a video (from 1) or the
  // frame of that time.
  Frame FrameOf(const std::string& name, const std::string& place) const {
    const std::string stem = ImageStem(name);
    if (stems_.contains(stem)) {
      return ImageLike(name, stem, place);
    }
    const std::size_t before = stem.rfind('_');
    const auto number =
        before == std::string::npos ? std::nullopt : ParseNumber<std::int64_t>(stem.substr(before + 1));
    if (stems_.empty() && number && *number > 0) {
      return static_cast<std::size_t>(*number - 1);
    }
    if (const auto time = ParseNumber<double>(stem)) {
      return FrameOf(FrameTime{*time}, place);
    }
    ThrowIf<InputError>(stems_.empty(),
                        "{}: '{}' names no frame, expected NAME_NUMBER (from 1) or a timestamp", place, name);
    return std::nullopt;
  }
  // Returns the image of this stem whose path ends like that of the file (or the other way round), without or
  // with the extension; the only one with the stem if none does.
  Frame ImageLike(const std::string& name, const std::string& stem, const std::string& place) const {
    const auto [begin, end] = stems_.equal_range(stem);
    std::vector<std::size_t> alike;
    std::vector<std::size_t> exact;
    for (auto it = begin; it != end; ++it) {
      const fs::path& image = image_names_[it->second];
      if (EndsAlike(name, image)) {
        exact.push_back(it->second);
      } else if (EndsAlike(fs::path(name).parent_path() / stem, fs::path(image).replace_extension())) {
        alike.push_back(it->second);
      }
    }
    const std::vector<std::size_t>& found = exact.empty() ? alike : exact;
    if (std::next(begin) == end) {
      return begin->second;
    }
    ThrowIfAmbiguous(name, place,
                     found.empty() ? std::vector{begin->second, std::next(begin)->second} : found);
    return found.front();
  }
  void ThrowIfAmbiguous(const std::string& name, const std::string& place,
                        const std::vector<std::size_t>& images) const {
    ThrowIf<InputError>(images.size() > 1,
                        "{}: '{}' may be {} or {}, expected the path of the image in the sequence", place,
                        name, image_names_[images.front()], image_names_[images.back()]);
  }

  // Returns false if the box lies outside the image.
  bool Clip(const std::string& place, const cv::Size& image, Box2d& box) {
    constexpr double kBorderTolerance =
        2.0;  // pixels; boxes that detectors rounded across the border need no warning
    const double left = std::max(box.x, 0.0);
    const double top = std::max(box.y, 0.0);
    const double right = std::min(box.x + box.width, static_cast<double>(image.width));
    const double bottom = std::min(box.y + box.height, static_cast<double>(image.height));
    if (right - left < 1.0 || bottom - top < 1.0) {
      report_.outside.push_back(place);
      return false;
    }
    if (box.x < -kBorderTolerance || box.y < -kBorderTolerance ||
        box.x + box.width > image.width + kBorderTolerance ||
        box.y + box.height > image.height + kBorderTolerance) {
      report_.clipped.push_back(place);
    }
    box = {left, top, right - left, bottom - top};
    return true;
  }

  const std::vector<cv::Size>& images_;
  const std::vector<double>& timestamps_;
  double tolerance_ = 1e-3;  // seconds
  const std::vector<std::string>& image_names_;
  std::multimap<std::string, std::size_t> stems_;             // of the images
  std::map<std::int64_t, std::vector<std::size_t>> numbers_;  // of the images whose names are numbers
  std::vector<std::vector<Detection>> frames_;
  DetectionReport report_;
};

}  // namespace

CheckedDetections CheckDetections(const fs::path& path, const std::vector<cv::Size>& images,
                                  const std::vector<double>& frame_timestamps,
                                  const std::vector<std::string>& image_names) {
  DetectionSorter sorter(images, frame_timestamps, image_names);
  std::vector<FileBox> boxes = ReadBoxFile(path);
  sorter.UseTimesOfFrames(path, boxes);
  for (const FileBox& box : boxes) {
    sorter.Add(box);
  }
  return sorter.Finish();
}

std::vector<std::vector<Detection>> ReadDetections(const fs::path& path, const std::vector<cv::Size>& images,
                                                   const std::vector<double>& frame_timestamps,
                                                   const std::vector<std::string>& image_names) {
  CheckedDetections checked = CheckDetections(path, images, frame_timestamps, image_names);
  for (const auto& [label, places] : checked.report.unknown_labels) {
    WarnOfBoxes(places, label == kUnknownClass ? "box without a class, labelled 'unknown'"
                                               : fmt::format("label '{}' is unknown, kept as it is", label));
  }
  WarnOfBoxes(checked.report.no_frame, "box of a frame that does not exist, ignored");
  WarnOfBoxes(checked.report.outside, "box outside the image, ignored");
  WarnOfBoxes(checked.report.clipped, "box extends more than two pixels beyond the image, clipped");
  return std::move(checked.frames);
}

DetectionWriter::DetectionWriter(fs::path path, std::string settings)
    : path_(std::move(path)),
      part_(path_.string() + ".part"),
      lock_(FileLock::Try(part_)),
      settings_(std::move(settings)) {
  ThrowIf<InputError>(!lock_,
                      "{}: another program is writing this file, expected a separate output for each program",
                      part_.string());
  std::string before = FileHeader(settings_);
  for (const std::string& line : CompleteFrames(part_, before)) {
    before += line + '\n';
    if (IsEnd(line)) {
      done_.insert(line.substr(kEnd.size()));
    } else {
      ++boxes_;
    }
  }
  frames_ = static_cast<int>(done_.size());
  bytes_ = before.size();
  // Truncated in place, since a new file of this name would not be locked.
  std::error_code error;
  fs::resize_file(part_, frames_ > 0 ? bytes_ : 0, error);
  if (error) {
    throw InputError("{}: cannot be written ({})", part_.string(), error.message());
  }
  out_.open(part_, std::ios::binary | std::ios::app);
  Append(frames_ > 0 ? std::string_view() : before);
}

bool DetectionWriter::IsDone(double timestamp) const { return done_.contains(TimeText(timestamp)); }

void DetectionWriter::Append(std::string_view text) {
  out_ << text << std::flush;
  if (!out_) {
    throw InputError("{}: cannot be written ({})", part_.string(), std::strerror(errno));
  }
}

void DetectionWriter::Add(double timestamp, const std::vector<Detection>& detections) {
  const std::string time = TimeText(timestamp);
  std::string text;
  for (const Detection& d : detections) {
    text += fmt::format("{} {} {:.3f} {:.1f} {:.1f} {:.1f} {:.1f}\n", time, d.label, d.score, d.box.x,
                        d.box.y, d.box.width, d.box.height);
  }
  text += fmt::format("{}{}\n", kEnd, time);
  Append(text);
  bytes_ += text.size();
  ++frames_;
  boxes_ += static_cast<int>(detections.size());
}

void DetectionWriter::Finish() {
  out_.close();
  std::ifstream in(part_, std::ios::binary);
  std::string text;
  std::size_t bytes = 0;
  for (std::string line; std::getline(in, line);) {
    bytes += line.size() + 1;
    if (!IsEnd(line)) {
      text += line + '\n';
    }
  }
  in.close();
  ThrowIf<InputError>(
      bytes != bytes_,
      "{}: holds {} bytes, expected the {} written by this program: another program changed it",
      part_.string(), bytes, bytes_);
  WriteFileAtomically(path_, text);
  std::error_code error;
  fs::remove(part_, error);
}

void WriteBoxes(const fs::path& path, const std::string& settings, const std::vector<double>& timestamps,
                const std::vector<std::vector<Detection>>& boxes) {
  DetectionWriter writer(path, settings);
  for (std::size_t i = 0; i < timestamps.size(); ++i) {
    writer.Add(timestamps[i], boxes[i]);
  }
  writer.Finish();
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
  const auto is_object = [&](const TextLine& line) {  // a negative id stands for no object
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
