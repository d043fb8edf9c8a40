#include <fmt/format.h>

#include <charconv>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <regex>

#include "render/video/video.h"
#include "render/video/video_encoder.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/worker_thread.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kQueue = 4;  // frames that wait for the encoder

// A {frame} or {frame:04} field.
std::optional<std::smatch> FrameField(const std::string& name, std::smatch& match) {
  static const std::regex field(R"(\{frame(?::(\d+))?\})");
  return std::regex_search(name, match, field) ? std::optional(match) : std::nullopt;
}

void WritePng(const fs::path& path, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 3});
  WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

bool IsFrameTemplate(const std::string& name) {
  std::smatch match;
  return FrameField(name, match).has_value();
}

std::string FrameName(const std::string& name, int number) {
  std::smatch match;
  if (!FrameField(name, match)) {
    return name;
  }
  const std::string digits = match[1].str();
  const int width = digits.empty() ? 0 : std::min(20, std::stoi(digits.substr(0, 3)));
  return match.prefix().str() + fmt::format("{:0{}}", number, width) + match.suffix().str();
}

struct FrameWriter::Impl {
  struct Job {
    cv::Mat frame;
    int number;
  };

  Impl(const fs::path& wanted, cv::Size wanted_size, double wanted_fps)
      : output(wanted), size(wanted_size), fps(wanted_fps), numbered(IsFrameTemplate(wanted.string())) {
    if (numbered) {
      if (output.extension() != ".png") {
        throw UsageError(fmt::format("{}: expected a numbered name that ends in .png", output.string()));
      }
    } else if (output.extension() == ".mp4") {
      OpenVideo();
    } else {
      throw UsageError(fmt::format("{}: expected FILE.mp4, or a name with {{frame:04}} that ends in .png",
                                   output.string()));
    }
    const fs::path folder = output.parent_path();
    std::error_code error;
    if (!folder.empty() && numbered) {
      fs::create_directories(folder, error);
    }
    encoder.emplace(kQueue, [this](const Job& job) { WriteFrame(job); });
  }

  void OpenVideo() {
    if (size.width % 2 != 0 || size.height % 2 != 0) {
      throw UsageError(
          fmt::format("resolution {},{}: the sides of a video must be even", size.width, size.height));
    }
    file.emplace(output);
    try {
      video.emplace(file->Path(), size, fps);
    } catch (const InputError& error) {
      throw InputError(Named(error.what()));
    }
  }

  // Messages name the file that the user asked for, not the temporary one.
  std::string Named(std::string message) const {
    const std::string temporary = file->Path().string();
    const std::size_t at = message.find(temporary);
    return at == std::string::npos ? message : message.replace(at, temporary.size(), output.string());
  }

  void WriteFrame(const Job& job) {
    if (numbered) {
      WritePng(FrameName(output.string(), job.number), job.frame);
      return;
    }
    try {
      video->Add(job.frame);
    } catch (const InputError& error) {
      throw InputError(Named(error.what()));
    }
  }

  void FinishVideo() {
    try {
      video->Finish();
    } catch (const InputError& error) {
      throw InputError(Named(error.what()));
    }
  }

  // Disks and network folders may lose what they have taken: whether all is there is seen from the file
  // itself.
  void CheckVideo() const {
    std::error_code error;
    const auto bytes = fs::exists(file->Path(), error) ? fs::file_size(file->Path(), error) : 0;
    int frames = 0;
    if (cv::VideoCapture back; bytes > 0 && back.open(file->Path().string(), cv::CAP_FFMPEG)) {
      cv::Mat first;
      frames = back.read(first) ? static_cast<int>(back.get(cv::CAP_PROP_FRAME_COUNT)) : 0;
    }
    if (frames != added) {
      throw InputError(
          fmt::format("{}: only {} of {} frames could be written ({} bytes), expected free space",
                      output.string(), frames, added, bytes));
    }
  }

  fs::path output;
  cv::Size size;
  double fps;
  bool numbered;
  int added = 0;
  std::optional<AtomicPath> file;
  std::optional<VideoEncoder> video;
  std::optional<WorkerThread<Job>> encoder;  // last: it uses the rest
};

FrameWriter::FrameWriter(const fs::path& output, cv::Size size, double fps)
    : impl_(std::make_unique<Impl>(output, size, fps)) {}
FrameWriter::~FrameWriter() = default;
FrameWriter::FrameWriter(FrameWriter&&) noexcept = default;

void FrameWriter::Add(const cv::Mat& frame, int number) {
  impl_->encoder->Add({frame.clone(), number});
  ++impl_->added;
}

void FrameWriter::Close() {
  Impl& s = *impl_;
  s.encoder->Finish();
  if (s.file && s.added > 0) {
    s.FinishVideo();
    s.CheckVideo();
    s.file->Commit();
  }
}

}  // namespace sqslam
