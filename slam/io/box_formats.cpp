#include "slam/io/box_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "slam/io/coco.h"
#include "slam/util/error.h"
#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kBoxesLine = "'timestamp label score x y w h [object_id [visible_fraction]]'";
constexpr const char* kMotLine = "'frame,id,x,y,w,h,score[,class,...]' with frames from 1";

// Classes of MOTChallenge's ground truth, from 1.
constexpr std::array<std::string_view, 12> kMotNames = {
    "person", "person", "car",        "bicycle",  "motorcycle",         "vehicle",
    "person", "person", "distractor", "occluder", "occluder_on_ground", "occluder"};

// COCO's category numbers go to 90 and leave these out.
constexpr std::array kCocoGaps = {12, 26, 29, 30, 45, 66, 68, 69, 71, 83};

std::string LabelFrom(const fs::path& path, std::string_view text) {
  const std::string label = NormalizedLabel(ValidText(text));
  if (label.empty() || label.size() > kMaxLabelBytes) {
    throw InputError(fmt::format("{}: a label of {} bytes, expected 1 to {}", path.string(), label.size(),
                                 kMaxLabelBytes));
  }
  return label;
}

// Names of classes, a line each; empty where there is no such file.
std::vector<std::string> ReadNames(const fs::path& path) {
  std::vector<std::string> names;
  if (fs::exists(path)) {
    for (const TextLine& line : ReadTextLines(path, "the name of a class a line")) {
      names.push_back(LabelFrom(path, line.text));
    }
  }
  return names;
}

template <typename Names>
std::string ClassName(const Names& names, double number) {
  const auto index = static_cast<std::size_t>(number);
  return index < names.size() ? std::string(names[index]) : fmt::format("class_{}", index);
}

// The class number in a cell, which is whole and not below `least`.
double ClassNumberAt(const fs::path& path, const TextLine& line, std::size_t index, double least,
                     std::string_view expected) {
  const double number = NumberAt(path, line, index, expected);
  if (number < least || number > 1e6 || number != static_cast<int>(number)) {
    ThrowBadLine(path, line, expected);
  }
  return number;
}

Box2d BoxAt(const fs::path& path, const TextLine& line, std::size_t first, std::string_view expected) {
  const Box2d box{NumberAt(path, line, first, expected), NumberAt(path, line, first + 1, expected),
                  NumberAt(path, line, first + 2, expected), NumberAt(path, line, first + 3, expected)};
  if (box.width <= 0.0 || box.height <= 0.0) {
    ThrowBadLine(path, line, "a box with w and h above 0");
  }
  return box;
}

// The image's name without folder and ending; a time's fraction is no ending.
std::string ImageStem(const std::string& name) {
  const fs::path file(name);
  const std::string ending = file.extension().string();
  const bool fraction = ending.size() > 1 && ParseNumber<std::uint64_t>(ending.substr(1));
  return (fraction ? file.filename() : file.stem()).string();
}

// No box in pixels is smaller than a pixel and lies in the first one.
bool IsPartOfImage(const Box2d& box) {
  return std::max({std::abs(box.x), std::abs(box.y), box.width, box.height}) <= 1.0;
}

bool ArePartsOfImage(const std::vector<FileBox>& boxes) {
  return !boxes.empty() &&
         std::ranges::all_of(boxes, [](const FileBox& b) { return IsPartOfImage(b.detection.box); });
}

Box2d Scaled(const Box2d& box, const cv::Size& image) {
  return {box.x * image.width, box.y * image.height, box.width * image.width, box.height * image.height};
}

Box2d AroundCenter(const Box2d& box) {
  return {box.x - 0.5 * box.width, box.y - 0.5 * box.height, box.width, box.height};
}

std::string PlaceOf(const fs::path& path, const TextLine& line) {
  return fmt::format("{}:{}", path.string(), line.number);
}

// ---- boxes.txt

std::vector<FileBox> ReadBoxes(const fs::path& path) {
  std::vector<FileBox> boxes;
  for (const TextLine& line : ReadTextLines(path, "a boxes.txt")) {
    if (line.words.size() < 7 || line.words.size() > 9) {
      ThrowBadLine(path, line, kBoxesLine);
    }
    const double timestamp = NumberAt(path, line, 0, kBoxesLine);
    const std::string label = ValidText(line.words[1]);
    if (label.size() > kMaxLabelBytes) {
      ThrowBadLine(path, line, fmt::format("a label of at most {} bytes", kMaxLabelBytes));
    }
    for (std::size_t i = 7; i < line.words.size(); ++i) {
      NumberAt(path, line, i, kBoxesLine);
    }
    boxes.push_back({PlaceOf(path, line),
                     FrameTime{timestamp},
                     {label, NumberAt(path, line, 2, kBoxesLine), BoxAt(path, line, 3, kBoxesLine)}});
  }
  if (ArePartsOfImage(boxes)) {
    throw InputError(
        fmt::format("{}: all boxes are smaller than a pixel, as if they were parts of the image; expected x "
                    "y w h in pixels "
                    "from the top-left corner",
                    path.string()));
  }
  return boxes;
}

// ---- A file for each frame

std::vector<FileBox> ReadFolder(const fs::path& folder, const cv::Size& image) {
  constexpr const char* kExpected =
      "'class x y w h score' in pixels, or 'class cx cy w h [score]' in parts of the image";
  const fs::path names_file = folder / "classes.txt";
  const std::vector<std::string> names = ReadNames(names_file);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".txt" && entry.path() != names_file) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    throw InputError(
        fmt::format("{}: no text file in it, expected one for each frame with boxes", folder.string()));
  }
  std::sort(files.begin(), files.end());  // warnings come in the same order on every machine
  std::vector<FileBox> boxes;
  std::optional<std::string> without_score;
  for (const fs::path& file : files) {
    for (const TextLine& line : ReadTextLines(file, "a file with the boxes of one frame")) {
      const double number = ClassNumberAt(file, line, 0, 0.0, kExpected);
      if (line.words.size() < 5 || line.words.size() > 6) {
        ThrowBadLine(file, line, kExpected);
      }
      const bool scored = line.words.size() == 6;
      without_score = scored || without_score ? without_score : PlaceOf(file, line);
      boxes.push_back({PlaceOf(file, line),
                       file.stem().string(),
                       {names.empty() ? ClassName(kCocoNames, number) : ClassName(names, number),
                        scored ? NumberAt(file, line, 5, kExpected) : 1.0, BoxAt(file, line, 1, kExpected)}});
    }
  }
  const bool parts = ArePartsOfImage(boxes);
  if (!parts && without_score) {
    throw InputError(fmt::format("{}: a box without a score in a folder with boxes in pixels, expected {}",
                                 *without_score, kExpected));
  }
  for (FileBox& box : boxes) {
    box.detection.box = parts ? AroundCenter(Scaled(box.detection.box, image)) : box.detection.box;
  }
  return boxes;
}

// ---- COCO

std::string CocoName(std::int64_t category) {
  const auto gaps = std::ranges::count_if(kCocoGaps, [&](int gap) { return gap <= category; });
  return category < 1 || std::ranges::count(kCocoGaps, category) > 0
             ? fmt::format("class_{}", category)
             : ClassName(kCocoNames, static_cast<double>(category - 1 - gaps));
}

struct CocoTables {
  std::map<std::int64_t, std::string> images;  // file names
  std::map<std::int64_t, std::string> categories;
};

FileBox BoxOf(const fs::path& path, std::string place, const nlohmann::ordered_json& entry,
              const CocoTables& tables) {
  const nlohmann::ordered_json& corners = entry.at("bbox");
  const Box2d box{corners.at(0).get<double>(), corners.at(1).get<double>(), corners.at(2).get<double>(),
                  corners.at(3).get<double>()};
  if (!(box.width > 0.0) || !(box.height > 0.0)) {
    throw InputError(fmt::format("{}: expected a bbox [x, y, w, h] with w and h above 0", place));
  }
  const auto category = entry.at("category_id").get<std::int64_t>();
  const auto name = tables.categories.find(category);
  const std::string label = name != tables.categories.end() ? name->second : CocoName(category);
  FrameKey frame = std::string();
  if (const nlohmann::ordered_json& id = entry.at("image_id"); id.is_string()) {
    frame = ImageStem(id.get<std::string>());
  } else if (tables.images.empty()) {
    frame = ImageNumber{id.get<std::int64_t>()};
  } else if (const auto image = tables.images.find(id.get<std::int64_t>()); image != tables.images.end()) {
    frame = ImageStem(image->second);
  } else {
    throw InputError(fmt::format("{}: image_id {} is not among the images", place, id.get<std::int64_t>()));
  }
  return {std::move(place), std::move(frame), {LabelFrom(path, label), entry.value("score", 1.0), box}};
}

std::vector<FileBox> ReadCoco(const fs::path& path) {
  constexpr const char* kExpected =
      "COCO's annotations or results: image_id, category_id, bbox [x, y, w, h] and a score for each box";
  const nlohmann::ordered_json document = ReadJsonFile<nlohmann::ordered_json>(path, kExpected);
  std::vector<FileBox> boxes;
  try {
    CocoTables tables;
    if (document.is_object()) {
      for (const nlohmann::ordered_json& image : document.value("images", nlohmann::ordered_json::array())) {
        tables.images[image.at("id").get<std::int64_t>()] = image.at("file_name").get<std::string>();
      }
      for (const nlohmann::ordered_json& category :
           document.value("categories", nlohmann::ordered_json::array())) {
        tables.categories[category.at("id").get<std::int64_t>()] = category.at("name").get<std::string>();
      }
    }
    const nlohmann::ordered_json& entries = document.is_object() ? document.at("annotations") : document;
    for (const nlohmann::ordered_json& entry : entries) {
      boxes.push_back(BoxOf(path, fmt::format("{}: box {}", path.string(), boxes.size()), entry, tables));
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError(fmt::format("{}: box {}: expected {}", path.string(), boxes.size(), kExpected));
  }
  return boxes;
}

// ---- Tables

// The line's cells as its words, without blanks and quotes around them.
TextLine SplitAt(TextLine line, char separator) {
  line.words.clear();
  std::size_t begin = 0;
  for (std::size_t end = 0; end != std::string::npos; begin = end + 1) {
    end = line.text.find(separator, begin);
    std::string cell = line.text.substr(begin, end == std::string::npos ? end : end - begin);
    const auto is_around = [](char c) { return c == ' ' || c == '\t' || c == '"' || c == '\r'; };
    cell.erase(cell.begin(), std::ranges::find_if_not(cell, is_around));
    while (!cell.empty() && is_around(cell.back())) {
      cell.pop_back();
    }
    line.words.push_back(std::move(cell));
  }
  return line;
}

std::vector<FileBox> ReadMot(const fs::path& path, const std::vector<TextLine>& lines) {
  const std::vector<std::string> names = ReadNames(path.parent_path() / "labels.txt");
  std::vector<FileBox> boxes;
  for (const TextLine& text : lines) {
    const TextLine line = SplitAt(text, ',');
    if (line.words.size() < 7 || line.words.size() > 10) {
      ThrowBadLine(path, line, kMotLine);
    }
    const double frame = ClassNumberAt(path, line, 0, 1.0, kMotLine);
    Box2d box = BoxAt(path, line, 2, kMotLine);
    box.x -= 1.0;
    box.y -= 1.0;
    const double category = line.words.size() > 7 ? NumberAt(path, line, 7, kMotLine) : -1.0;
    const double index = category < 1.0 ? 0.0 : ClassNumberAt(path, line, 7, 1.0, kMotLine) - 1.0;
    boxes.push_back({PlaceOf(path, line),
                     FrameNumber{static_cast<std::int64_t>(frame) - 1},
                     {names.empty() ? ClassName(kMotNames, index) : ClassName(names, index),
                      NumberAt(path, line, 6, kMotLine), box}});
  }
  return boxes;
}

// Names of columns, and the kinds that they are of.
using ColumnName = std::pair<std::string_view, const char*>;
constexpr std::array kColumnNames = std::to_array<ColumnName>({{"timestamp", "time"},
                                                               {"time", "time"},
                                                               {"frame", "frame"},
                                                               {"frame_id", "frame"},
                                                               {"frame_number", "frame"},
                                                               {"image", "image"},
                                                               {"filename", "image"},
                                                               {"file_name", "image"},
                                                               {"image_id", "image"},
                                                               {"file", "image"},
                                                               {"label", "label"},
                                                               {"class", "label"},
                                                               {"name", "label"},
                                                               {"class_name", "label"},
                                                               {"category", "label"},
                                                               {"score", "score"},
                                                               {"confidence", "score"},
                                                               {"conf", "score"},
                                                               {"x", "x"},
                                                               {"left", "x"},
                                                               {"xmin", "x"},
                                                               {"x_min", "x"},
                                                               {"x1", "x"},
                                                               {"y", "y"},
                                                               {"top", "y"},
                                                               {"ymin", "y"},
                                                               {"y_min", "y"},
                                                               {"y1", "y"},
                                                               {"cx", "cx"},
                                                               {"x_center", "cx"},
                                                               {"xcenter", "cx"},
                                                               {"cy", "cy"},
                                                               {"y_center", "cy"},
                                                               {"ycenter", "cy"},
                                                               {"w", "w"},
                                                               {"width", "w"},
                                                               {"h", "h"},
                                                               {"height", "h"},
                                                               {"x2", "x2"},
                                                               {"xmax", "x2"},
                                                               {"x_max", "x2"},
                                                               {"right", "x2"},
                                                               {"y2", "y2"},
                                                               {"ymax", "y2"},
                                                               {"y_max", "y2"},
                                                               {"bottom", "y2"}});

// The columns of a table by their kinds.
class Columns {
 public:
  Columns(const fs::path& path, const TextLine& header) {
    for (std::size_t i = 0; i < header.words.size(); ++i) {
      std::string name = header.words[i];
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
      for (const auto& [other, kind] : kColumnNames) {
        if (name == other) {
          at_.emplace(kind, i);
        }
      }
    }
    const bool frame = Has("time") || Has("frame") || Has("image");
    const bool box = (Has("x") && Has("y") && ((Has("w") && Has("h")) || (Has("x2") && Has("y2")))) ||
                     (Has("cx") && Has("cy") && Has("w") && Has("h"));
    if (!frame || !box || !Has("label")) {
      ThrowBadLine(
          path, header,
          "columns for the frame (timestamp, frame or image), the label and the box (x, y, w, h; xmin, ymin, "
          "xmax, ymax; or cx, cy, w, h)");
    }
  }
  bool Has(const char* kind) const { return at_.contains(kind); }
  std::size_t operator[](const char* kind) const { return at_.at(kind); }

 private:
  std::map<std::string, std::size_t> at_;
};

FrameKey FrameIn(const fs::path& path, const TextLine& line, const Columns& columns) {
  if (columns.Has("time")) {
    return FrameTime{NumberAt(path, line, columns["time"], "seconds")};
  }
  if (columns.Has("frame")) {
    return FrameNumber{static_cast<std::int64_t>(
        ClassNumberAt(path, line, columns["frame"], 0.0, "a frame's number from 0"))};
  }
  return ImageStem(line.words[columns["image"]]);
}

std::vector<FileBox> ReadTable(const fs::path& path, const std::vector<TextLine>& lines,
                               const cv::Size& image) {
  const char separator = lines.front().text.find(';') != std::string::npos ? ';' : ',';
  const TextLine header = SplitAt(lines.front(), separator);
  const Columns columns(path, header);
  const bool centers = !columns.Has("x");
  const std::string expected = fmt::format("{} cells with numbers for the box", header.words.size());
  std::vector<FileBox> boxes;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const TextLine line = SplitAt(lines[i], separator);
    if (line.words.size() != header.words.size()) {
      ThrowBadLine(path, line, expected);
    }
    const auto number = [&](const char* kind) { return NumberAt(path, line, columns[kind], expected); };
    Box2d box{number(centers ? "cx" : "x"), number(centers ? "cy" : "y"), 0.0, 0.0};
    box.width = columns.Has("w") ? number("w") : number("x2") - box.x;
    box.height = columns.Has("h") ? number("h") : number("y2") - box.y;
    if (box.width <= 0.0 || box.height <= 0.0) {
      ThrowBadLine(path, line, "a box with w and h above 0");
    }
    boxes.push_back(
        {PlaceOf(path, line),
         FrameIn(path, line, columns),
         {LabelFrom(path, line.words[columns["label"]]), columns.Has("score") ? number("score") : 1.0, box}});
  }
  const bool parts = ArePartsOfImage(boxes);
  for (FileBox& box : boxes) {
    Box2d& b = box.detection.box;
    b = parts ? Scaled(b, image) : b;
    b = centers ? AroundCenter(b) : b;
  }
  return boxes;
}

}  // namespace

BoxFormat DetectBoxFormat(const fs::path& path) {
  if (fs::is_directory(path)) {
    return BoxFormat::kFolder;
  }
  const std::string text = ReadFile(path, "a file with boxes");
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first != std::string::npos && (text[first] == '{' || text[first] == '[')) {
    return BoxFormat::kCoco;
  }
  const std::vector<TextLine> lines = ReadTextLines(path, "a file with boxes");
  if (lines.empty() || lines.front().text.find_first_of(",;") == std::string::npos) {
    return BoxFormat::kBoxes;
  }
  return ParseNumber<double>(SplitAt(lines.front(), ',').words.front()) ? BoxFormat::kMot : BoxFormat::kCsv;
}

std::vector<FileBox> ReadBoxFile(const fs::path& path, const cv::Size& image) {
  switch (DetectBoxFormat(path)) {
    case BoxFormat::kFolder:
      return ReadFolder(path, image);
    case BoxFormat::kCoco:
      return ReadCoco(path);
    case BoxFormat::kMot:
      return ReadMot(path, ReadTextLines(path, kMotLine));
    case BoxFormat::kCsv:
      return ReadTable(path, ReadTextLines(path, "a table with boxes"), image);
    case BoxFormat::kBoxes:
      break;
  }
  return ReadBoxes(path);
}

}  // namespace sqslam
