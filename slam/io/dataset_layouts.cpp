#include "slam/io/dataset_layouts.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <initializer_list>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <regex>
#include <utility>

#include "slam/io/cameras.h"
#include "slam/io/image_files.h"
#include "slam/io/time_unit.h"
#include "slam/util/data_path.h"
#include "slam/util/text_table.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

std::vector<fs::path> ImagesLike(const fs::path& folder, const char* pattern) {
  return FilesLike(folder, std::regex(pattern, std::regex::icase));
}

bool IsWholeNumber(const std::string& word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
}

// ---- rgb.txt

bool IsTum(const fs::path& folder) { return fs::exists(folder / "rgb.txt"); }

// Columns of the time and of the path; the path is the rest of the line if the columns have no names.
struct ImageColumns {
  std::size_t time = 0;
  std::optional<std::size_t> path = std::nullopt;
};

ImageColumns ImageColumnsOf(const std::vector<std::string>& names) {
  const auto find = [&](std::initializer_list<const char*> parts) {
    const auto found = std::ranges::find_if(names, [&](const std::string& name) {
      return std::ranges::any_of(parts, [&](const char* part) { return name.find(part) != name.npos; });
    });
    return static_cast<std::size_t>(found - names.begin());
  };
  const std::size_t time = find({"time", "stamp"});
  const std::size_t path = find({"file", "path", "image", "rgb"});
  return std::max(time, path) < names.size() && time != path ? ImageColumns{time, path} : ImageColumns{};
}

// Returns the path in a line of rgb.txt: the cell of its column, the rest behind the time, which may hold
// blanks and commas, or the next cell if only that is a file.
std::string PathIn(const fs::path& folder, const TextLine& row, const ImageColumns& columns) {
  if (columns.path && *columns.path < row.words.size()) {
    return row.words[*columns.path];
  }
  std::string rest = row.text.substr(std::min(row.text.find_first_of(" \t,;"), row.text.size()));
  rest.erase(0, rest.find_first_not_of("\" \t,;"));
  rest.erase(rest.find_last_not_of("\" \t") + 1);
  const bool has_more =
      row.words.size() > 2 && !fs::exists(folder / rest) && fs::exists(folder / row.words[1]);
  return has_more ? row.words[1] : rest;
}

std::vector<SequenceFrame> ListTum(const fs::path& folder, double fps) {
  const fs::path list = folder / "rgb.txt";
  constexpr const char* kExpected = "'timestamp path'";
  std::vector<SequenceFrame> frames;
  TextTable table = ReadTextTable(list, "lines 'timestamp path'");
  ThrowIf<InputError>(table.rows.empty(), "{}: lists no image, expected at least one line {}", list.string(),
                      kExpected);
  const ImageColumns columns = ImageColumnsOf(table.names);
  int equal_times = 0;
  bool whole = true;
  for (TextLine& row : table.rows) {
    std::vector<std::string> words = CellsOf(row.text, ' ');
    if (!columns.path && ParseNumber<double>(words.front())) {  // commas and semicolons are of the path
      row.words = std::move(words);
    }
    if (row.words.size() < 2) {
      ThrowBadLine(list, row, kExpected);
    }
    const double timestamp = NumberAt(list, row, columns.time, kExpected);
    whole = whole && IsWholeNumber(row.words[columns.time]);
    if (!frames.empty() && timestamp == frames.back().timestamp) {
      ++equal_times;
    } else if (!frames.empty() && timestamp < frames.back().timestamp) {
      ThrowBadLine(
          list, row,
          fmt::format("a timestamp after {:.6f}, that of the frame before", frames.back().timestamp));
    } else {
      frames.push_back({timestamp, folder / PathIn(folder, row, columns), {}});
    }
  }
  if (equal_times > 0) {
    spdlog::warn("{}: {} of {} images have the time of the image before, skipped", list.string(), equal_times,
                 table.rows.size());
  }
  const TimeUnit unit = UnitOfTimes(ToVector(frames, &SequenceFrame::timestamp), whole, fps);
  ReportTimeUnit(list.string(), unit);
  for (SequenceFrame& frame : frames) {
    frame.timestamp *= unit.seconds;
  }
  return frames;
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
  for (const TextLine& line : ReadTextTable(list, kExpected).rows) {
    if (line.words.size() < 2 || !IsWholeNumber(line.words[0]) || line.words[0].size() > 19) {
      ThrowBadLine(list, line, kExpected);
    }
    frames.push_back({1e-9 * std::stod(line.words[0]), folder / "data" / line.words[1], {}});
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
constexpr std::array<DatasetLayout, 6> kLayouts = {{
    {SequenceFormat::kTum, IsTum, ListTum, "rgb.txt with lines 'timestamp path'", "time"},
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
