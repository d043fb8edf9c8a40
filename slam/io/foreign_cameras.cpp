#include "slam/io/foreign_cameras.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "slam/util/json_file.h"
#include "slam/util/text_table.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr double kPixelCentre = 0.5;  // of the first pixel, in COLMAP and nerfstudio

void SetDistortion(YAML::Node& own, bool fisheye, const std::vector<double>& values) {
  if (fisheye) {
    own["distortion_model"] = "fisheye";
  }
  own["distortion"] = values;
}

// ---- Files of one list of names and values

// Refuses other words than these under a key.
struct ForeignWords {
  const char* key;
  std::set<std::string> words;
};

// An entry of camera.yaml and its place in another program's file: a key, and the index in its list, or -1
// for the whole value.
struct ForeignEntry {
  const char* name;
  const char* key;
  int index = -1;
};

struct ForeignNames {
  std::vector<ForeignWords> models;
  std::vector<ForeignEntry> entries;
};

// Kalibr and EuRoC
const ForeignNames kIntrinsics = {
    {{"camera_model", {"pinhole"}},
     {"distortion_model", {"radtan", "radial-tangential", "none", "equidistant"}}},
    {{"width", "resolution", 0},
     {"height", "resolution", 1},
     {"fx", "intrinsics", 0},
     {"fy", "intrinsics", 1},
     {"cx", "intrinsics", 2},
     {"cy", "intrinsics", 3},
     {"distortion", "distortion_coeffs"},
     {"distortion", "distortion_coefficients"},
     {"fps", "rate_hz"}}};
// ROS and OpenCV, also in the spelling of its older programs and of scripts
const ForeignNames kMatrix = {{{"distortion_model", {"plumb_bob", "equidistant"}}},
                              {{"width", "image_width"},
                               {"height", "image_height"},
                               {"fx", "camera_matrix", 0},
                               {"cx", "camera_matrix", 2},
                               {"fy", "camera_matrix", 4},
                               {"cy", "camera_matrix", 5},
                               {"distortion", "distortion_coefficients"},
                               {"distortion", "dist_coeff"},
                               {"distortion", "dist_coeffs"}}};

// The message sensor_msgs/CameraInfo of ROS 1 and 2
const ForeignNames kCameraInfo = {{{"distortion_model", {"plumb_bob", "equidistant", ""}}},
                                  {{"width", "width"},
                                   {"height", "height"},
                                   {"fx", "k", 0},
                                   {"cx", "k", 2},
                                   {"fy", "k", 4},
                                   {"cy", "k", 5},
                                   {"distortion", "d"}}};

// Returns the root with its keys in lower case.
YAML::Node InLowerCase(const YAML::Node& root) {
  YAML::Node lower;
  for (const auto& entry : root) {
    std::string key = entry.first.Scalar();
    std::ranges::transform(key, key.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    lower[key] = entry.second;
  }
  return lower;
}

// Returns the numbers of a list of lists as one list, without zeros behind the fifth: OpenCV writes up to 14
// coefficients of the lens. Others are returned as they are.
YAML::Node Flattened(const YAML::Node& value) {
  constexpr std::size_t kCoefficients = 5;
  constexpr std::size_t kMatrixSize = 9;
  if (!value.IsSequence()) {
    return value;
  }
  std::vector<YAML::Node> items;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const bool is_row = value[i].IsSequence();
    for (std::size_t k = 0; is_row && k < value[i].size(); ++k) {
      items.push_back(value[i][k]);
    }
    if (!is_row) {
      items.push_back(value[i]);
    }
  }
  while (items.size() > kCoefficients && items.size() != kMatrixSize && items.back().IsScalar() &&
         ParseNumber<double>(items.back().Scalar()) == 0.0) {
    items.pop_back();
  }
  if (items.size() == value.size()) {
    return value;  // with its line
  }
  YAML::Node flat;
  for (const YAML::Node& item : items) {
    flat.push_back(item);
  }
  return flat;
}

YAML::Node Convert(const ForeignNames& names, const YAML::Node& camera, const fs::path& path) {
  for (const auto& [key, words] : names.models) {
    const YAML::Node model = camera[key];
    if (model && (!model.IsScalar() || !words.contains(model.Scalar()))) {
      throw InputError("{}:{}: {} is {}, expected {}", path.string(), model.Mark().line + 1, key,
                       model.IsScalar() ? model.Scalar() : "not a word", fmt::join(words, " or "));
    }
  }
  YAML::Node own;
  const YAML::Node opencv = camera["fisheye_model"];
  const YAML::Node model = camera["distortion_model"];
  if ((model && model.Scalar() == "equidistant") || (opencv && opencv.IsScalar() && opencv.Scalar() == "1")) {
    own["distortion_model"] = "fisheye";
  }
  for (const auto& [name, key, index] : names.entries) {
    const YAML::Node node = camera[key];
    if (!node) {
      continue;
    }
    const YAML::Node value =
        Flattened(node.IsMap() && node["data"] ? node["data"] : node);  // a matrix of ROS
    if (index < 0) {
      own[name] = value;
    } else if (value.IsSequence() && static_cast<std::size_t>(index) < value.size()) {
      own[name] = value[index];
    }
  }
  return own;
}

// ---- ORB-SLAM and stella_vslam

// Copies `names` and the coefficients of the lens from entries with these prefixes, of which the first one
// found counts.
YAML::Node WithPrefixes(const YAML::Node& root, const std::vector<std::string>& prefixes, bool fisheye) {
  YAML::Node own;
  const auto copy = [&](const char* name, const char* key) {
    for (const std::string& prefix : prefixes) {
      if (const YAML::Node value = root[prefix + key]; value && !own[name]) {
        own[name] = value;
      }
    }
  };
  for (const char* name : {"width", "height", "fx", "fy", "cx", "cy", "fps"}) {
    copy(name, name);
  }
  copy("width", "cols");
  copy("height", "rows");
  YAML::Node coefficients;
  constexpr std::array kFisheye = {"k1", "k2", "k3", "k4"};
  constexpr std::array kRadialTangential = {"k1", "k2", "p1", "p2", "k3"};
  const auto add = [&](const char* name) {
    copy(name, name);
    coefficients.push_back(own[name] ? own[name] : YAML::Node(0.0));
    own.remove(name);
  };
  if (fisheye) {
    std::ranges::for_each(kFisheye, add);
    own["distortion_model"] = "fisheye";
  } else {
    std::ranges::for_each(kRadialTangential, add);
  }
  own["distortion"] = coefficients;
  return own;
}

// Returns true for a fisheye lens. `model`: may be missing.
bool IsFisheye(const YAML::Node& model, const std::set<std::string>& pinhole,
               const std::set<std::string>& fisheye, const char* key, const fs::path& path) {
  if (!model) {
    return false;
  }
  const std::string word = model.IsScalar() ? model.Scalar() : "not a word";
  ThrowIf<InputError>(!pinhole.contains(word) && !fisheye.contains(word),
                      "{}:{}: {} is {}, expected {} or {}", path.string(), model.Mark().line + 1, key, word,
                      fmt::join(pinhole, " or "), fmt::join(fisheye, " or "));
  return fisheye.contains(word);
}

// Also reads OpenVSLAM's files, from which stella_vslam comes.
YAML::Node FromOrbSlam(const YAML::Node& root, const fs::path& path) {
  if (const YAML::Node model = root["Camera.model"]) {
    return WithPrefixes(root, {"Camera."},
                        IsFisheye(model, {"perspective"}, {"fisheye"}, "Camera.model", path));
  }
  const bool fisheye = IsFisheye(root["Camera.type"], {"PinHole", "Pinhole", "Rectified"}, {"KannalaBrandt8"},
                                 "Camera.type", path);
  return WithPrefixes(root, {"Camera1.", "Camera."}, fisheye);
}

YAML::Node FromStella(const YAML::Node& root, const fs::path& path) {
  const YAML::Node camera = root["Camera"];
  const bool fisheye = IsFisheye(camera["model"], {"perspective"}, {"fisheye"}, "model", path);
  return WithPrefixes(camera, {""}, fisheye);
}

// ---- COLMAP and nerfstudio

// Parameters of COLMAP's models by name, in the order of cameras.txt. "f" is fx and fy.
const std::map<std::string, std::vector<std::string>> kColmapModels = {
    {"SIMPLE_PINHOLE", {"f", "cx", "cy"}},
    {"PINHOLE", {"fx", "fy", "cx", "cy"}},
    {"SIMPLE_RADIAL", {"f", "cx", "cy", "k1"}},
    {"RADIAL", {"f", "cx", "cy", "k1", "k2"}},
    {"OPENCV", {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"}},
    {"FULL_OPENCV", {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}},
    {"OPENCV_FISHEYE", {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"}},
    {"SIMPLE_RADIAL_FISHEYE", {"f", "cx", "cy", "k1"}},
    {"RADIAL_FISHEYE", {"f", "cx", "cy", "k1", "k2"}},
};

// Returns a camera by the names of its parameters, with the pixel centres of COLMAP. `place`: for messages.
YAML::Node FromColmapParameters(std::map<std::string, double> values, double width, double height,
                                bool fisheye, const std::string& place) {
  ThrowIf<InputError>(!fisheye && (values["k4"] != 0.0 || values["k5"] != 0.0 || values["k6"] != 0.0),
                      "{}: k4, k5 and k6 of a rational lens model, expected at most k1, k2, p1, p2 and k3",
                      place);
  const double f = values["f"];
  YAML::Node own;
  own["width"] = width;
  own["height"] = height;
  own["fx"] = values["fx"] + f;
  own["fy"] = values["fy"] + f;
  own["cx"] = values["cx"] - kPixelCentre;
  own["cy"] = values["cy"] - kPixelCentre;
  if (fisheye) {
    SetDistortion(own, true, {values["k1"], values["k2"], values["k3"], values["k4"]});
  } else {
    SetDistortion(own, false, {values["k1"], values["k2"], values["p1"], values["p2"], values["k3"]});
  }
  return own;
}

// Returns true if the first data line of cameras.txt is 'ID MODEL WIDTH HEIGHT PARAMETERS'.
bool IsColmap(const std::vector<TextLine>& lines) {
  return !lines.empty() && lines.front().words.size() > 4 && kColmapModels.contains(lines.front().words[1]) &&
         ParseNumber<int>(lines.front().words[0]);
}

YAML::Node FromColmap(const std::vector<TextLine>& lines, const fs::path& path) {
  constexpr const char* kExpected = "'CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS' with the numbers of the model";
  const std::vector<std::string> first(lines[0].words.begin() + 1, lines[0].words.end());
  for (const TextLine& line : lines) {
    ThrowIf<InputError>(!std::equal(first.begin(), first.end(), line.words.begin() + 1, line.words.end()),
                        "{}:{}: a camera that differs from the first one, expected one for all images",
                        path.string(), line.number);
  }
  const TextLine& line = lines.front();
  const std::vector<std::string>& names = kColmapModels.at(line.words[1]);
  if (line.words.size() != 4 + names.size()) {
    ThrowBadLine(path, line, kExpected);
  }
  std::map<std::string, double> values;
  for (std::size_t i = 0; i < names.size(); ++i) {
    values[names[i]] = NumberAt(path, line, 4 + i, kExpected);
  }
  return FromColmapParameters(values, NumberAt(path, line, 2, kExpected), NumberAt(path, line, 3, kExpected),
                              line.words[1].ends_with("FISHEYE"),
                              fmt::format("{}:{}", path.string(), line.number));
}

// Names of COLMAP's models by their numbers.
constexpr std::array<const char*, 10> kColmapNumbers = {
    "SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL",         "RADIAL",        "OPENCV", "OPENCV_FISHEYE",
    "FULL_OPENCV",    "FOV",     "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE"};

// Reads the cameras of cameras.bin as the lines of cameras.txt.
std::vector<TextLine> LinesOfColmap(std::string_view bytes, const fs::path& path) {
  std::vector<TextLine> lines;
  const auto take = [&]<typename Number>(Number number) {
    ThrowIf<InputError>(bytes.size() < sizeof(Number), "{}: ends in camera {}, expected COLMAP's cameras.bin",
                        path.string(), lines.size());
    std::memcpy(&number, bytes.data(), sizeof(Number));
    bytes.remove_prefix(sizeof(Number));
    return number;
  };
  const std::uint64_t count = take(std::uint64_t{});
  while (lines.size() < count) {
    const std::uint32_t id = take(std::uint32_t{});
    const auto model = static_cast<std::size_t>(take(std::int32_t{}));
    const auto known =
        model < kColmapNumbers.size() ? kColmapModels.find(kColmapNumbers[model]) : kColmapModels.end();
    ThrowIf<InputError>(known == kColmapModels.end(),
                        "{}: camera {} has the model number {}, expected one that cameras.txt may name: 0 to "
                        "6, 8 or 9",
                        path.string(), id, static_cast<std::int32_t>(model));
    std::vector<std::string> words = {fmt::format("{}", id), known->first};
    for (int side = 0; side < 2; ++side) {
      words.push_back(fmt::format("{}", take(std::uint64_t{})));
    }
    for (std::size_t i = 0; i < known->second.size(); ++i) {
      words.push_back(fmt::format("{}", take(double{})));
    }
    std::string text = fmt::format("{}", fmt::join(words, " "));
    lines.push_back({static_cast<int>(lines.size()) + 1, std::move(text), std::move(words)});
  }
  ThrowIf<InputError>(lines.empty(), "{}: holds no camera", path.string());
  return lines;
}

// Reads the intrinsics of transforms.json at the top, or those that all of its frames share.
YAML::Node FromTransforms(const nlohmann::ordered_json& root, const fs::path& path) {
  ThrowIf<InputError>(!root.is_object(), "{}: expected the transforms.json of nerfstudio, an object",
                      path.string());
  constexpr std::array kKeys = {"w", "h", "fl_x", "fl_y", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4"};
  const nlohmann::ordered_json frames = root.value("frames", nlohmann::ordered_json::array());
  const auto find = [&](const char* key, const auto& frame) {
    return root.contains(key)  ? root.at(key)
           : frame.is_object() ? frame.value(key, nlohmann::ordered_json())
                               : nlohmann::ordered_json();
  };
  const nlohmann::ordered_json first =
      frames.is_array() && !frames.empty() ? frames.front() : nlohmann::ordered_json();
  std::map<std::string, double> values;
  for (const char* key : kKeys) {
    const nlohmann::ordered_json value = find(key, first);
    const bool same = !frames.is_array() || std::ranges::all_of(frames, [&](const auto& frame) {
      return find(key, frame) == value;
    });
    ThrowIf<InputError>(!same, "{}: {} differs between its frames, expected one camera for all images",
                        path.string(), key);
    values[key] = value.is_number() ? value.get<double>() : 0.0;
  }
  const double angle = root.contains("camera_angle_x") && root.at("camera_angle_x").is_number()
                           ? root.at("camera_angle_x").get<double>()
                           : 0.0;
  values["fx"] =
      values["fl_x"] > 0.0 || angle <= 0.0 ? values["fl_x"] : 0.5 * values["w"] / std::tan(0.5 * angle);
  values["fy"] = values["fl_y"] > 0.0 ? values["fl_y"] : values["fx"];
  for (const auto& [key, side] : {std::pair("cx", "w"), std::pair("cy", "h")}) {
    values[key] = find(key, first).is_number() ? values[key] : 0.5 * values[side];
  }
  const nlohmann::ordered_json model = find("camera_model", first);
  const std::string name = model.is_string() ? model.get<std::string>() : "OPENCV";
  ThrowIf<InputError>(!kColmapModels.contains(name),
                      "{}: camera_model is {}, expected OPENCV, OPENCV_FISHEYE or PINHOLE", path.string(),
                      name);
  return FromColmapParameters(values, values["w"], values["h"], name.ends_with("FISHEYE"), path.string());
}

// Removes OpenCV's first line, which is no valid YAML.
std::string WithoutDirective(const std::string& text) {
  return text.starts_with("%YAML") ? text.substr(std::min(text.find('\n'), text.size())) : text;
}

// Returns the entries of OpenCV's XML: numbers, words, and matrices as lists. Boost's reader recurses, so
// that deep nesting overflows the stack.
YAML::Node EntriesOfXml(std::string_view text) {
  YAML::Node entries;
  const auto between = [](std::string_view all, std::string_view start, std::string_view end) {
    const std::size_t first = std::min(all.find(start), all.size());
    const std::string_view rest = all.substr(std::min(first + start.size(), all.size()));
    return rest.substr(0, rest.find(end));
  };
  text = between(text, "<opencv_storage>", "</opencv_storage>");
  for (std::size_t at = text.find('<'); at != text.npos; at = text.find('<')) {
    text.remove_prefix(at + 1);
    const std::string name(text.substr(0, text.find_first_of("> \t\n")));
    const std::string end = text.starts_with("!--") ? "-->" : "</" + name + ">";
    const std::string_view body = text.substr(0, text.find(end));
    text.remove_prefix(std::min(body.size() + end.size(), text.size()));
    const bool matrix = body.find("<data>") != body.npos;
    std::istringstream content(
        std::string(matrix ? between(body, "<data>", "</data>") : between(body, ">", "<")));
    const std::vector<std::string> words{std::istream_iterator<std::string>(content), {}};
    if (matrix) {
      entries[name] = words;
    } else if (words.size() == 1) {
      entries[name] = words.front();
    }
  }
  return entries;
}

YAML::Node FromYaml(const YAML::Node& root, const fs::path& path) {
  if (!root.IsMap()) {
    return root;
  }
  if (root["cam0"] && root["cam0"].IsMap()) {
    return Convert(kIntrinsics, root["cam0"], path);
  }
  if (root["intrinsics"]) {
    return Convert(kIntrinsics, root, path);
  }
  for (const char* key : {"K", "k"}) {
    if (root[key] && root[key].IsSequence() && root["width"]) {
      return Convert(kCameraInfo, InLowerCase(root), path);
    }
  }
  if (root["camera_matrix"] || root["Camera_Matrix"]) {
    return Convert(kMatrix, InLowerCase(root), path);
  }
  if (root["Camera.fx"] || root["Camera1.fx"]) {
    return FromOrbSlam(root, path);
  }
  return root["Camera"] && root["Camera"].IsMap() ? FromStella(root, path) : root;
}

}  // namespace

YAML::Node ReadCameraInOwnNames(const fs::path& path) {
  constexpr const char* kExpected = "a camera description with width, height, fx, fy, cx, cy";
  if (path.extension() == ".bin") {
    return FromColmap(LinesOfColmap(ReadFile(path, kExpected), path), path);
  }
  const std::string text = ReadText(path, kExpected);
  if (text.find("<opencv_storage>") != text.npos) {
    return Convert(kMatrix, InLowerCase(EntriesOfXml(text)), path);
  }
  if (const std::vector<TextLine> lines = TextLinesIn(text); IsColmap(lines)) {
    return FromColmap(lines, path);
  }
  if (text.find("\"fl_x\"") != text.npos || text.find("\"camera_angle_x\"") != text.npos) {
    return FromTransforms(ParseJson(path, text, "the transforms.json of nerfstudio"), path);
  }
  return FromYaml(YAML::Load(WithoutDirective(text)), path);
}

}  // namespace sqslam
