#include "slam/detection/detection_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "slam/io/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kEnd = "# end ";

std::string TimeText(double timestamp) { return fmt::format("{:.6f}", timestamp); }

std::string Header(const std::string& settings) {
  return fmt::format("# {}\n# timestamp label score x y w h\n", settings);
}

// What is complete in a part file: all up to the last end of a frame.
std::string CompletePart(const fs::path& part, const std::string& header) {
  std::ifstream in(part, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (text.compare(0, header.size(), header) != 0) {
    return header;
  }
  const std::size_t last = text.rfind(kEnd);
  const std::size_t end = last == std::string::npos ? std::string::npos : text.find('\n', last);
  if (last == std::string::npos) {
    return header;
  }
  // A last line without its end may be cut off within the number: that frame is done again.
  return end == std::string::npos ? text.substr(0, last) : text.substr(0, end + 1);
}

}  // namespace

DetectionWriter::DetectionWriter(fs::path path, std::string settings)
    : path_(std::move(path)), part_(path_.string() + ".part"), settings_(std::move(settings)) {
  const std::string before = CompletePart(part_, Header(settings_));
  for (std::size_t at = before.find(kEnd); at != std::string::npos; at = before.find(kEnd, at + 1)) {
    const std::size_t start = at + std::strlen(kEnd);
    done_.push_back(before.substr(start, before.find('\n', start) - start));
  }
  WriteFileAtomically(part_, before);
  out_.open(part_, std::ios::binary | std::ios::app);
  if (!out_) {
    throw InputError(fmt::format("{}: cannot be written ({})", part_.string(), std::strerror(errno)));
  }
}

bool DetectionWriter::IsDone(double timestamp) const {
  return std::find(done_.begin(), done_.end(), TimeText(timestamp)) != done_.end();
}

void DetectionWriter::Add(double timestamp, const std::vector<Detection>& detections) {
  const std::string time = TimeText(timestamp);
  for (const Detection& d : detections) {
    out_ << fmt::format("{} {} {:.3f} {:.1f} {:.1f} {:.1f} {:.1f}\n", time, d.label, d.score, d.box.x,
                        d.box.y, d.box.width, d.box.height);
  }
  out_ << kEnd << time << '\n' << std::flush;
  if (!out_) {
    throw InputError(fmt::format("{}: cannot be written ({})", part_.string(), std::strerror(errno)));
  }
  done_.push_back(time);
}

void DetectionWriter::Finish() {
  out_.close();
  std::ifstream in(part_, std::ios::binary);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(kEnd, 0) != 0) {
      text += line + '\n';
    }
  }
  in.close();
  WriteFileAtomically(path_, text);
  std::error_code error;
  fs::remove(part_, error);
}

}  // namespace sqslam
