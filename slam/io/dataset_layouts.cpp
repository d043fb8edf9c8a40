#include "slam/io/dataset_layouts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <regex>

#include "slam/io/cameras.h"
#include "slam/io/foreign_cameras.h"
#include "slam/io/image_files.h"
#include "slam/util/data_path.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

struct NumberedLayout {
  SequenceFormat format;
  const char* pattern;  // image names
  const char* example;
};
constexpr std::array<NumberedLayout, 3> kLayouts = {{
    {SequenceFormat::kIclNuim, R"(scene_\d+_\d+\.png)", "rgb/0.png or scene_00_0000.png"},
    {SequenceFormat::kScenesV2, R"(\d+-color\.(png|jpg))", "00000-color.png"},
    {SequenceFormat::k7Scenes, R"(frame-\d+\.color\.(png|jpg))", "frame-000000.color.png"},
}};

bool IsWholeNumber(const std::string& word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
}

// "number path number path", with the colour image first or second. TUM's file of that name has seconds.
bool HasNumberedAssociations(const fs::path& folder) {
  if (!fs::exists(folder / "associations.txt")) {
    return false;
  }
  const auto lines = ReadTextLines(folder / "associations.txt", "lines 'number path number path'");
  return !lines.empty() && IsWholeNumber(lines.front().words.front());
}

bool HasFreiburgPoses(const fs::path& folder) {
  return std::any_of(fs::directory_iterator(folder), fs::directory_iterator(), [](const auto& entry) {
    return entry.path().filename().string().ends_with(".gt.freiburg");
  });
}

// Lists the images of associations.txt with their numbers.
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

std::vector<fs::path> ImagesLike(const fs::path& folder, const char* pattern) {
  return FilesLike(folder, std::regex(pattern, std::regex::icase));
}

const NumberedLayout& LayoutOf(SequenceFormat format) {
  return *std::ranges::find_if(kLayouts,
                               [&](const NumberedLayout& layout) { return layout.format == format; });
}

std::vector<SequenceFrame> ListByName(const NumberedLayout& layout, const fs::path& folder, double fps) {
  const bool icl_as_tum = layout.format == SequenceFormat::kIclNuim && fs::is_directory(folder / "rgb");
  const std::vector<fs::path> images =
      icl_as_tum ? ImagesLike(folder / "rgb", R"(\d+\.(png|jpg))") : ImagesLike(folder, layout.pattern);
  std::vector<SequenceFrame> frames;
  for (const fs::path& image : images) {
    const auto number = LastNumber(image.filename().string());
    ThrowIf<InputError>(!number, "{}: its number is too large, expected a frame number", image.string());
    frames.push_back({static_cast<double>(*number) / fps, image, {}});
  }
  return frames;
}

// Returns the camera's folder; empty if there is none.
fs::path EurocCamera(const fs::path& path) {
  for (const fs::path& folder : {path, path / "cam0", path / "mav0" / "cam0"}) {
    if (fs::is_regular_file(folder / "data.csv") && fs::is_directory(folder / "data")) {
      return folder;
    }
  }
  return {};
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

std::vector<SequenceFrame> ListEuroc(const fs::path& folder) {
  constexpr const char* kExpected = "'timestamp in ns,file'";
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

std::vector<SequenceFrame> ListKitti(const fs::path& folder) {
  constexpr const char* kExpected = "a time in seconds a line";
  const fs::path list = folder / "times.txt";
  const std::vector<fs::path> images =
      ImagesLike(folder / fmt::format("image_{}", KittiCamera(folder)), R"(\d+\.(png|jpg))");
  std::vector<SequenceFrame> frames;
  for (const TextLine& line : ReadTextLines(list, kExpected)) {
    if (frames.size() == images.size()) {
      break;
    }
    frames.push_back({NumberAt(list, line, 0, kExpected), images[frames.size()], {}});
  }
  return frames;
}

// `what`: the origin of the timestamps.
void CheckRising(const std::vector<SequenceFrame>& frames, const char* what) {
  for (std::size_t i = 1; i < frames.size(); ++i) {
    ThrowIf<InputError>(frames[i].timestamp <= frames[i - 1].timestamp,
                        "{}: its {} does not follow that of {}, expected rising {}s",
                        frames[i].image_path.string(), what, frames[i - 1].image_path.filename().string(),
                        what);
  }
}

}  // namespace

std::optional<Camera> CameraOfDataset(SequenceFormat format, const fs::path& folder) {
  if (format == SequenceFormat::kEuroc) {
    return ReadCamera(EurocCamera(folder) / "sensor.yaml");
  }
  if (format != SequenceFormat::kKitti) {
    return std::nullopt;
  }
  const std::vector<SequenceFrame> frames = ListTimed(format, folder);
  const double seconds = frames.back().timestamp - frames.front().timestamp;
  const double fps = seconds > 0.0 ? static_cast<double>(frames.size() - 1) / seconds : 10.0;
  return ReadKittiCamera(folder / "calib.txt", KittiCamera(folder), frames.front().image_path, fps);
}

std::vector<SequenceFrame> ListTimed(SequenceFormat format, const fs::path& folder) {
  const bool euroc = format == SequenceFormat::kEuroc;
  ThrowIf<InputError>(euroc ? EurocCamera(folder).empty() : KittiCamera(folder) < 0,
                      "{}: not of the {} layout, expected {}", folder.string(), NameOf(format),
                      euroc ? "mav0/cam0 with data.csv and data/" : "times.txt beside image_2");
  std::vector<SequenceFrame> frames = euroc ? ListEuroc(EurocCamera(folder)) : ListKitti(folder);
  ThrowIf<InputError>(frames.empty(), "{}: no image of the {} layout in it, expected at least one",
                      folder.string(), NameOf(format));
  CheckRising(frames, "time");
  return frames;
}

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
  if (fs::is_directory(path / "rgb") && (HasNumberedAssociations(path) || HasFreiburgPoses(path))) {
    return SequenceFormat::kIclNuim;
  }
  if (!EurocCamera(path).empty()) {
    return SequenceFormat::kEuroc;
  }
  if (KittiCamera(path) >= 0) {
    return SequenceFormat::kKitti;
  }
  for (const NumberedLayout& layout : kLayouts) {
    if (!ImagesLike(path, layout.pattern).empty()) {
      return layout.format;
    }
  }
  return SequenceFormat::kImages;
}

std::string PresetOf(SequenceFormat format, const fs::path& folder) {
  if (format == SequenceFormat::kTum) {
    std::smatch match;
    const std::string name = NamedPath(folder).filename().string();
    return std::regex_search(name, match, std::regex("freiburg[123]")) ? "tum-" + match.str() : "";
  }
  const bool known =
      std::ranges::any_of(kLayouts, [&](const NumberedLayout& layout) { return layout.format == format; });
  return known ? NameOf(format) : "";
}

std::vector<SequenceFrame> ListNumbered(SequenceFormat format, const fs::path& folder, double fps) {
  const NumberedLayout& layout = LayoutOf(format);
  const bool listed = format == SequenceFormat::kIclNuim && fs::exists(folder / "associations.txt");
  std::vector<SequenceFrame> frames =
      listed ? ListAssociations(folder, fps) : ListByName(layout, folder, fps);
  ThrowIf<InputError>(frames.empty(), "{}: no image of the {} layout in it, expected names like {}",
                      folder.string(), NameOf(format), layout.example);
  CheckRising(frames, "frame number");
  return frames;
}

}  // namespace sqslam
