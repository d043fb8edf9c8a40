#include "slam/io/detection_writer.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

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

}  // namespace sqslam
