#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <regex>

#include "render/video/video.h"
#include "render/video/video_encoder.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kQueue = 4;  // frames that wait for the encoder

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

FrameWriter::FrameWriter(const fs::path& output, cv::Size size, double fps) : output_(output) {
  if (IsFrameTemplate(output.string())) {
    if (output.extension() != ".png") {
      throw UsageError(fmt::format("{}: expected a numbered name that ends in .png", output.string()));
    }
    std::error_code error;
    if (output.has_parent_path()) {
      fs::create_directories(output.parent_path(), error);
    }
  } else if (output.extension() == ".mp4") {
    OpenVideo(size, fps);
  } else {
    throw UsageError(
        fmt::format("{}: expected FILE.mp4, or a name with {{frame:04}} that ends in .png", output.string()));
  }
  encoding_.emplace(kQueue, [this](const Job& job) { Write(job); });
}

void FrameWriter::OpenVideo(cv::Size size, double fps) {
  if (size.width % 2 != 0 || size.height % 2 != 0) {
    throw UsageError(
        fmt::format("resolution {},{}: the sides of a video must be even", size.width, size.height));
  }
  file_.emplace(output_);
  video_.emplace(file_->Path(), size, fps, output_);
}

void FrameWriter::Write(const Job& job) {
  if (video_) {
    video_->Add(job.frame);
    return;
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", job.frame, bytes, {cv::IMWRITE_PNG_COMPRESSION, 3});
  WriteFileAtomically(FrameName(output_.string(), job.number),
                      {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// Disks and network folders may lose what they have taken: whether all is there is seen from the file itself.
void FrameWriter::CheckVideo() const {
  std::error_code error;
  const auto bytes = fs::exists(file_->Path(), error) ? fs::file_size(file_->Path(), error) : 0;
  int frames = 0;
  if (cv::VideoCapture back; bytes > 0 && back.open(file_->Path().string(), cv::CAP_FFMPEG)) {
    cv::Mat first;
    frames = back.read(first) ? static_cast<int>(back.get(cv::CAP_PROP_FRAME_COUNT)) : 0;
  }
  if (frames != added_) {
    throw InputError(fmt::format("{}: only {} of {} frames could be written ({} bytes), expected free space",
                                 output_.string(), frames, added_, bytes));
  }
}

void FrameWriter::Add(const cv::Mat& frame, int number) {
  encoding_->Add({frame.clone(), number});
  ++added_;
}

void FrameWriter::Close() {
  encoding_->Finish();
  if (file_ && added_ > 0) {
    video_->Finish();
    CheckVideo();
    file_->Commit();
  }
}

}  // namespace sqslam
