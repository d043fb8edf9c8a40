#include "slam/io/dataset_layouts.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <regex>

#include "slam/io/cameras.h"
#include "slam/io/image_files.h"
#include "slam/util/data_path.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

std::vector<fs::path> ImagesLike(const fs::path& folder, const char* pattern) {
  return FilesLike(folder, std::regex(pattern, std::regex::icase));
}

bool IsWholeNumber(const std::string& word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
}

// ---- Images whose names are frame numbers. Timestamps are these over fps, so that a missing image leaves a
// gap.

constexpr char kNumbers[] = R"(\d+\.(png|jpg))";
constexpr char kIclNames[] = R"(scene_\d+_\d+\.png)";
constexpr char kScenesNames[] = R"(\d+-color\.(png|jpg))";
constexpr char k7ScenesNames[] = R"(frame-\d+\.color\.(png|jpg))";

template <const char* kNames>
bool HasImages(const fs::path& folder) {
  return !ImagesLike(folder, kNames).empty();
}

template <const char* kNames>
std::vector<SequenceFrame> ListByName(const fs::path& folder, double fps) {
  std::vector<SequenceFrame> frames;
  for (const fs::path& image : ImagesLike(folder, kNames)) {
    const auto number = LastNumber(image.filename().string());
    ThrowIf<InputError>(!number, "{}: its number is too large, expected a frame number", image.string());
    frames.push_back({static_cast<double>(*number) / fps, image, {}});
  }
  return frames;
}

// "number path number path", with the colour image first or second. TUM's file of that name has seconds.
bool HasNumberedAssociations(const fs::path& folder) {
  if (!fs::exists(folder / "associations.txt")) {
    return false;
  }
  const auto lines = ReadTextLines(folder / "associations.txt", "lines 'number path number path'");
  return !lines.empty() && IsWholeNumber(lines.front().words.front());
}

std::vector<SequenceFrame> ListAssociations(const fs::path& folder, double fps) {
  const fs::path list = folder / "associations.txt";
  constexpr const char* kExpected = "'number depth/FILE number rgb/FILE'";
  std::vector<SequenceFrame> frames;
  for (const TextLine& line : ReadTextLines(list, kExpected)) {
    if (line.words.size() < 4) {
      ThrowBadLine(list, line, kExpected);
    }
    const bool color_first = line.words[1].starts_with("rgb/") || line.words[3].starts_with("depth/");
    const std::size_t number = color_first ? 0 : 2;
    if (!IsWholeNumber(line.words[number])) {
      ThrowBadLine(list, line, kExpected);
    }
    frames.push_back({NumberAt(list, line, number, kExpected) / fps, folder / line.words[number + 1], {}});
  }
  return frames;
}

// Recognises the dataset, and the images of its renderer.
bool IsIcl(const fs::path& folder) {
  const auto is_poses = [](const auto& entry) {
    return entry.path().filename().string().ends_with(".gt.freiburg");
  };
  const bool dataset = fs::is_directory(folder / "rgb") &&
                       (HasNumberedAssociations(folder) ||
                        std::any_of(fs::directory_iterator(folder), fs::directory_iterator(), is_poses));
  return dataset || HasImages<kIclNames>(folder);
}

std::vector<SequenceFrame> ListIcl(const fs::path& folder, double fps) {
  if (fs::exists(folder / "associations.txt")) {
    return ListAssociations(folder, fps);
  }
  return fs::is_directory(folder / "rgb") ? ListByName<kNumbers>(folder / "rgb", fps)
                                          : ListByName<kIclNames>(folder, fps);
}

// ---- EuRoC and KITTI, with their own timestamps

// Returns the camera's folder; empty if there is none.
fs::path EurocCamera(const fs::path& path) {
  for (const fs::path& folder : {path, path / "cam0", path / "mav0" / "cam0"}) {
    if (fs::is_regular_file(folder / "data.csv") && fs::is_directory(folder / "data")) {
      return folder;
    }
  }
  return {};
}

bool IsEuroc(const fs::path& path) { return !EurocCamera(path).empty(); }

std::vector<SequenceFrame> ListEuroc(const fs::path& path, double) {
  constexpr const char* kExpected = "'timestamp in ns,file'";
  const fs::path folder = EurocCamera(path);
  if (folder.empty()) {
    return {};
  }
  const fs::path list = folder / "data.csv";
  std::vector<SequenceFrame> frames;
  for (const TextLine& line : ReadTextLines(list, kExpected)) {
    const std::size_t comma = line.text.find(',');
    const std::string time = line.text.substr(0, comma);
    if (comma == std::string::npos || !IsWholeNumber(time) || time.size() > 19) {
      ThrowBadLine(list, line, kExpected);
    }
    const std::size_t end = line.text.find_last_not_of(" \t\r");
    frames.push_back(
        {1e-9 * std::stod(time), folder / "data" / line.text.substr(comma + 1, end - comma), {}});
  }
  return frames;
}

// Returns the colour camera if it exists, else the grey one; -1: neither.
int KittiCamera(const fs::path& path) {
  for (const int number : {2, 0}) {
    if (fs::is_regular_file(path / "times.txt") && fs::is_directory(path / fmt::format("image_{}", number))) {
      return number;
    }
  }
  return -1;
}

bool IsKitti(const fs::path& path) { return KittiCamera(path) >= 0; }

std::vector<SequenceFrame> ListKitti(const fs::path& folder, double) {
  constexpr const char* kExpected = "a time in seconds on each line";
  if (!IsKitti(folder)) {
    return {};
  }
  const fs::path list = folder / "times.txt";
  const std::vector<fs::path> images =
      ImagesLike(folder / fmt::format("image_{}", KittiCamera(folder)), kNumbers);
  std::vector<SequenceFrame> frames;
  for (const TextLine& line : ReadTextLines(list, kExpected)) {
    if (frames.size() == images.size()) {
      break;
    }
    frames.push_back({NumberAt(list, line, 0, kExpected), images[frames.size()], {}});
  }
  return frames;
}

using ProjectionMatrix = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

ProjectionMatrix ReadKittiProjection(const std::filesystem::path& calib, int number) {
  constexpr const char* kExpected = "'P2: ' and the 12 numbers of a projection matrix";
  const std::string key = fmt::format("P{}:", number);
  for (const TextLine& line : ReadTextLines(calib, kExpected)) {
    if (line.words.front() != key) {
      continue;
    }
    if (line.words.size() != 13) {
      ThrowBadLine(calib, line, kExpected);
    }
    ProjectionMatrix p;
    for (int i = 0; i < 12; ++i) {
      p.data()[i] = NumberAt(calib, line, static_cast<std::size_t>(i) + 1, kExpected);
    }
    if (!(p(0, 0) > 0.0 && p(1, 1) > 0.0)) {
      ThrowBadLine(calib, line, "focal lengths above 0");
    }
    return p;
  }
  throw InputError("{}: no line {}, expected {}", calib.string(), key, kExpected);
}

// Reads a camera of calib.txt, such as 2 for the line "P2: ..." of 12 numbers; its images are rectified.
// `image`: gives the size.
Camera ReadKittiCamera(const std::filesystem::path& calib, int number, const std::filesystem::path& image,
                       double fps) {
  const ProjectionMatrix p = ReadKittiProjection(calib, number);
  const cv::Mat picture = ReadImage(image, cv::IMREAD_COLOR);
  ThrowIf<InputError>(picture.empty(), "{}: cannot be read, expected an image to take the camera's size from",
                      image.string());
  return {picture.cols, picture.rows, p(0, 0), p(1, 1), p(0, 2), p(1, 2), {}, fps};
}

// ---- All layouts

struct DatasetLayout {
  SequenceFormat format;
  bool (*detect)(const fs::path& folder);
  std::vector<SequenceFrame> (*list)(const fs::path& folder, double fps);
  const char* expected;   // files in it, for messages
  const char* timestamp;  // their origin
};

// In the order of detection.
constexpr std::array<DatasetLayout, 5> kLayouts = {{
    {SequenceFormat::kIclNuim, IsIcl, ListIcl, "names like rgb/0.png or scene_00_0000.png", "frame number"},
    {SequenceFormat::kEuroc, IsEuroc, ListEuroc, "mav0/cam0 with data.csv and images in data/", "time"},
    {SequenceFormat::kKitti, IsKitti, ListKitti, "times.txt beside image_2 with images", "time"},
    {SequenceFormat::kScenesV2, HasImages<kScenesNames>, ListByName<kScenesNames>,
     "names like 00000-color.png", "frame number"},
    {SequenceFormat::k7Scenes, HasImages<k7ScenesNames>, ListByName<k7ScenesNames>,
     "names like frame-000000.color.png", "frame number"},
}};

}  // namespace

SequenceFormat DetectFormat(const fs::path& path) {
  ThrowIf<InputError>(!fs::exists(path),
                      "{}: does not exist, expected a sequence folder, an image folder or a video",
                      path.string());
  if (!fs::is_directory(path)) {
    return SequenceFormat::kVideo;
  }
  if (fs::exists(path / "rgb.txt")) {
    return SequenceFormat::kTum;
  }
  const auto* found =
      std::ranges::find_if(kLayouts, [&](const DatasetLayout& layout) { return layout.detect(path); });
  return found == kLayouts.end() ? SequenceFormat::kImages : found->format;
}

std::vector<SequenceFrame> ListDataset(SequenceFormat format, const fs::path& folder, double fps) {
  const DatasetLayout& layout = *std::ranges::find(kLayouts, format, &DatasetLayout::format);
  const std::vector<SequenceFrame> frames = layout.list(folder, fps);
  ThrowIf<InputError>(frames.empty(), "{}: contains no image of the {} layout, expected {}", folder.string(),
                      NameOf(format), layout.expected);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    ThrowIf<InputError>(frames[i].timestamp <= frames[i - 1].timestamp,
                        "{}: its {} does not follow that of {}, expected rising {}s",
                        frames[i].image_path.string(), layout.timestamp,
                        frames[i - 1].image_path.filename().string(), layout.timestamp);
  }
  return frames;
}

std::string PresetOf(SequenceFormat format, const fs::path& folder) {
  if (format == SequenceFormat::kTum) {
    std::smatch match;
    const std::string name = AbsolutePath(folder).filename().string();
    return std::regex_search(name, match, std::regex("freiburg[123]")) ? "tum-" + match.str() : "";
  }
  const bool known = format == SequenceFormat::kIclNuim || format == SequenceFormat::kScenesV2 ||
                     format == SequenceFormat::k7Scenes;
  return known ? NameOf(format) : "";
}

std::optional<Camera> CameraOfDataset(SequenceFormat format, const fs::path& folder) {
  if (format == SequenceFormat::kEuroc) {
    return ReadCamera(EurocCamera(folder) / "sensor.yaml");
  }
  if (format != SequenceFormat::kKitti) {
    return std::nullopt;
  }
  const std::vector<SequenceFrame> frames = ListDataset(format, folder, 1.0);
  const double seconds = frames.back().timestamp - frames.front().timestamp;
  const double fps = seconds > 0.0 ? static_cast<double>(frames.size() - 1) / seconds : 10.0;
  return ReadKittiCamera(folder / "calib.txt", KittiCamera(folder), frames.front().image_path, fps);
}

Rigid3d ReadEurocExtrinsics(const std::filesystem::path& sensor) {
  constexpr const char* kExpected = "the 16 numbers of T_BS, the camera's pose in the body";
  const std::string text = ReadFile(sensor, kExpected);
  try {
    const auto numbers = YAML::Load(text)["T_BS"]["data"].as<std::array<double, 16>>();
    const Eigen::Matrix4d matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>(numbers.data());
    const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
    if ((rotation.transpose() * rotation).isIdentity(0.01) && rotation.determinant() > 0.0) {
      return {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()};
    }
  } catch (const YAML::Exception&) {  // refused below
  }
  throw InputError("{}: T_BS is missing or not a rigid motion, expected {}", sensor.string(), kExpected);
}

Rigid3d ReadKittiExtrinsics(const std::filesystem::path& calib, int number) {
  const ProjectionMatrix p = ReadKittiProjection(calib, number);
  const double z = p(2, 3);
  return {Eigen::Quaterniond::Identity(),
          {-(p(0, 3) - p(0, 2) * z) / p(0, 0), -(p(1, 3) - p(1, 2) * z) / p(1, 1), -z}};
}

}  // namespace sqslam
