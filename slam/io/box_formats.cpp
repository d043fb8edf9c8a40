#include "slam/io/box_formats.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/algorithm/string/case_conv.hpp>
#include <boost/algorithm/string/split.hpp>
#include <boost/algorithm/string/trim.hpp>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "slam/io/coco.h"
#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

// Classes of MOTChallenge's ground truth, from 1.
constexpr std::array<std::string_view, 12> kMotNames = {
    "person", "person", "car",        "bicycle",  "motorcycle",         "vehicle",
    "person", "person", "distractor", "occluder", "occluder_on_ground", "occluder"};

// Returns the text as a label. `place`: FILE or FILE:LINE, for the message.
std::string LabelFrom(const std::string& place, std::string_view text) {
  const std::string label = NormalizedLabel(ValidText(text));
  ThrowIf<InputError>(label.empty() || label.size() > kMaxLabelBytes,
                      "{}: a label of {} bytes, expected 1 to {}", place, label.size(), kMaxLabelBytes);
  return label;
}

template <typename Names>
std::string ClassName(const Names& names, double number) {
  const auto index = static_cast<std::size_t>(number);
  return index < names.size() ? std::string(names[index]) : fmt::format("class_{}", index);
}

// Reads the class names of a file, one per line; `otherwise` if there is no such file.
template <typename Names>
std::vector<std::string> ReadNames(const fs::path& path, const Names& otherwise) {
  std::vector<std::string> names;
  if (fs::exists(path)) {
    for (const TextLine& line : ReadTextLines(path, "the name of a class on each line")) {
      names.push_back(LabelFrom(path.string(), line.text));
    }
  }
  return names.empty() ? std::vector<std::string>(otherwise.begin(), otherwise.end()) : names;
}

// Returns the image's name without folder and extension; a timestamp's fraction does not count as one.
std::string ImageStem(const std::string& name) {
  const fs::path file(name);
  const std::string ending = file.extension().string();
  const bool fraction = ending.size() > 1 && ParseNumber<std::uint64_t>(ending.substr(1));
  return (fraction ? file.filename() : file.stem()).string();
}

// ---- Boxes in columns of text

// Columns by kind: the number of a class instead of its label is "class_number", cx and cy are the centre, x2
// and y2 the lower right corner.
using Columns = std::map<std::string_view, std::size_t>;

const Columns kBoxesColumns = {{"time", 0}, {"label", 1}, {"score", 2}, {"x", 3},
                               {"y", 4},    {"w", 5},     {"h", 6}};
const Columns kFolderColumns = {{"class_number", 0}, {"x", 1}, {"y", 2}, {"w", 3}, {"h", 4}, {"score", 5}};
const Columns kMotColumns = {{"frame", 0}, {"x", 2},     {"y", 3},           {"w", 4},
                             {"h", 5},     {"score", 6}, {"class_number", 7}};

// Names of columns in the header of a table: each row begins with the kind, which is a name too.
constexpr std::array<std::array<std::string_view, 6>, 13> kColumnNames = {{
    {"time", "timestamp"},
    {"frame", "frame_id", "frame_number"},
    {"image", "filename", "file_name", "image_id", "file"},
    {"label", "class", "name", "class_name", "category"},
    {"score", "confidence", "conf"},
    {"x", "left", "xmin", "x_min", "x1"},
    {"y", "top", "ymin", "y_min", "y1"},
    {"cx", "x_center", "xcenter"},
    {"cy", "y_center", "ycenter"},
    {"w", "width"},
    {"h", "height"},
    {"x2", "xmax", "x_max", "right"},
    {"y2", "ymax", "y_max", "bottom"},
}};

// A file with one box on each line.
struct BoxTable {
  const fs::path& path;
  const Columns& columns;
  std::string expected;                 // in a line, for messages
  std::vector<std::string> names = {};  // of the classes by number
  int first = 0;                        // number of the first frame, and of the first class

  bool Has(std::string_view kind) const { return columns.contains(kind); }
  double NumberIn(const TextLine& line, std::string_view kind) const {
    return NumberAt(path, line, columns.at(kind), expected);
  }
  std::int64_t WholeNumberIn(const TextLine& line, std::string_view kind) const {
    const double number = NumberIn(line, kind);
    if (number < first || number > 1e6 || number != static_cast<int>(number)) {
      ThrowBadLine(path, line, expected);
    }
    return static_cast<std::int64_t>(number) - first;
  }
  // True if the file gives the centres of boxes.
  bool ByCenter() const { return !Has("x") || !Has("y"); }

  // `frame`: of all boxes in the file, if no column tells it.
  FileBox Read(const TextLine& line, const FrameKey& frame = {}) const {
    Box2d box{NumberIn(line, ByCenter() ? "cx" : "x"), NumberIn(line, ByCenter() ? "cy" : "y"), 0.0, 0.0};
    box.width = Has("w") ? NumberIn(line, "w") : NumberIn(line, "x2") - box.x;
    box.height = Has("h") ? NumberIn(line, "h") : NumberIn(line, "y2") - box.y;
    if (box.width <= 0.0 || box.height <= 0.0) {
      ThrowBadLine(path, line, "a box with w and h above 0");
    }
    const bool scored = Has("score") && columns.at("score") < line.words.size();
    std::string place = fmt::format("{}:{}", path.string(), line.number);
    std::string label = LabelIn(line, place);
    return {std::move(place),
            FrameIn(line, frame),
            {std::move(label), scored ? NumberIn(line, "score") : 1.0, box}};
  }

 private:
  FrameKey FrameIn(const TextLine& line, const FrameKey& otherwise) const {
    if (Has("time")) {
      return FrameTime{NumberIn(line, "time")};
    }
    if (Has("frame")) {
      return FrameNumber{WholeNumberIn(line, "frame")};
    }
    return Has("image") ? FrameKey(ImageStem(line.words[columns.at("image")])) : otherwise;
  }
  std::string LabelIn(const TextLine& line, const std::string& place) const {
    return Has("label") ? LabelFrom(place, line.words[columns.at("label")])
                        : ClassName(names, static_cast<double>(WholeNumberIn(line, "class_number")));
  }
};

// Returns true if the boxes are in parts of the image, not in pixels: a box in pixels never lies within the
// first pixel.
bool ArePartsOfImage(const std::vector<FileBox>& boxes) {
  return !boxes.empty() && std::ranges::all_of(boxes, [](const FileBox& item) {
    const Box2d& box = item.detection.box;
    return std::max({std::abs(box.x), std::abs(box.y), box.width, box.height}) <= 1.0;
  });
}

void MarkParts(std::vector<FileBox>& boxes) {
  for (FileBox& item : boxes) {
    item.in_parts = true;
  }
}

void MoveCentersToCorners(std::vector<FileBox>& boxes) {
  for (FileBox& item : boxes) {
    Box2d& box = item.detection.box;
    box = {box.x - 0.5 * box.width, box.y - 0.5 * box.height, box.width, box.height};
  }
}

// Returns the line with its cells as words, without surrounding blanks and quotes.
TextLine SplitAt(TextLine line, char separator) {
  boost::algorithm::split(line.words, line.text, [separator](char c) { return c == separator; });
  for (std::string& cell : line.words) {
    boost::algorithm::trim_if(cell, [](char c) { return c == ' ' || c == '\t' || c == '"' || c == '\r'; });
  }
  return line;
}

void CheckWords(const BoxTable& table, const TextLine& line, std::size_t least, std::size_t most) {
  if (line.words.size() < least || line.words.size() > most) {
    ThrowBadLine(table.path, line, table.expected);
  }
}

std::vector<FileBox> ReadBoxes(const fs::path& path, std::string_view text) {
  const BoxTable table{path, kBoxesColumns, "'timestamp label score x y w h [object_id [visible_fraction]]'"};
  std::vector<FileBox> boxes;
  for (const TextLine& line : TextLinesIn(text)) {
    CheckWords(table, line, 7, 9);
    for (std::size_t i = 7; i < line.words.size(); ++i) {
      NumberAt(path, line, i, table.expected);
    }
    boxes.push_back(table.Read(line));
  }
  ThrowIf<InputError>(ArePartsOfImage(boxes),
                      "{}: all boxes are smaller than a pixel, as if in fractions of the image; expected x y "
                      "w h in pixels from the top-left corner",
                      path.string());
  return boxes;
}

// Reads one file for each frame.
std::vector<FileBox> ReadFolder(const fs::path& folder) {
  const fs::path names_file = folder / "classes.txt";
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".txt" && entry.path() != names_file) {
      files.push_back(entry.path());
    }
  }
  ThrowIf<InputError>(files.empty(), "{}: contains no text file, expected one for each frame with boxes",
                      folder.string());
  std::ranges::sort(files);  // same order of warnings on every machine
  const std::vector<std::string> names = ReadNames(names_file, kCocoNames);
  constexpr const char* kExpected =
      "'class x y w h score' in pixels, or 'class cx cy w h [score]' in parts of the image";
  std::vector<FileBox> boxes;
  std::optional<std::string> without_score;
  for (const fs::path& file : files) {
    const BoxTable table{file, kFolderColumns, kExpected, names};
    for (const TextLine& line : ReadTextLines(file, "a file with the boxes of one frame")) {
      CheckWords(table, line, 5, 6);
      boxes.push_back(table.Read(line, file.stem().string()));
      if (line.words.size() == 5 && !without_score) {
        without_score = boxes.back().place;
      }
    }
  }
  if (ArePartsOfImage(boxes)) {
    MarkParts(boxes);
    MoveCentersToCorners(boxes);
  } else if (without_score) {
    throw InputError("{}: a box without a score in a folder with boxes in pixels, expected {}",
                     *without_score, kExpected);
  }
  return boxes;
}

std::vector<FileBox> ReadMot(const fs::path& path, std::string_view text) {
  const BoxTable table{path, kMotColumns, "'frame,id,x,y,w,h,score[,class,...]' with frames from 1",
                       ReadNames(path.parent_path() / "labels.txt", kMotNames), 1};
  constexpr std::size_t kClass = 7;
  std::vector<FileBox> boxes;
  for (const TextLine& whole : TextLinesIn(text)) {
    TextLine line = SplitAt(whole, ',');
    CheckWords(table, line, 7, 10);
    line.words.resize(std::max(line.words.size(), kClass + 1), "1");
    if (NumberAt(path, line, kClass, table.expected) < 1.0) {  // trackers write -1 for an unknown class
      line.words[kClass] = "1";
    }
    boxes.push_back(table.Read(line));
    boxes.back().detection.box.x -= 1.0;
    boxes.back().detection.box.y -= 1.0;
  }
  return boxes;
}

Columns ColumnsOf(const fs::path& path, const TextLine& header) {
  Columns columns;
  for (std::size_t i = 0; i < header.words.size(); ++i) {
    const std::string name = boost::algorithm::to_lower_copy(header.words[i]);
    for (const auto& names : kColumnNames) {
      if (!name.empty() && std::ranges::find(names, name) != names.end()) {
        columns.emplace(names.front(), i);
      }
    }
  }
  const auto has = [&](auto... kinds) { return (columns.contains(kinds) && ...); };
  const bool frame = has("time") || has("frame") || has("image");
  const bool box = (has("x", "y") && (has("w", "h") || has("x2", "y2"))) || has("cx", "cy", "w", "h");
  if (!frame || !box || !has("label")) {
    ThrowBadLine(path, header,
                 "columns for the frame (timestamp, frame or image), the label and the box (x, y, w, h; "
                 "xmin, ymin, xmax, ymax; or cx, cy, w, h)");
  }
  return columns;
}

// Reads a table with a header line (CSV).
std::vector<FileBox> ReadTable(const fs::path& path, std::string_view text) {
  const std::vector<TextLine> lines = TextLinesIn(text);
  const char separator = lines.front().text.find(';') != std::string::npos ? ';' : ',';
  const TextLine header = SplitAt(lines.front(), separator);
  const Columns columns = ColumnsOf(path, header);
  const std::size_t cells = header.words.size();
  const BoxTable table{path, columns, fmt::format("{} cells, with numbers for frame and box", cells)};
  std::vector<FileBox> boxes;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const TextLine line = SplitAt(lines[i], separator);
    CheckWords(table, line, cells, cells);
    boxes.push_back(table.Read(line));
  }
  if (ArePartsOfImage(boxes)) {
    MarkParts(boxes);
  }
  if (table.ByCenter()) {
    MoveCentersToCorners(boxes);
  }
  return boxes;
}

// ---- COCO

// Decodes the text that pycocotools writes: groups of five bits, lowest first, with a bit for "more follows";
// from the fourth count on differences to the one before the last.
std::vector<std::int64_t> CountsOf(std::string_view text, const std::string& place) {
  constexpr int kBits = 5;
  constexpr int kMaxBits = 40;
  std::vector<std::int64_t> counts;
  for (std::size_t at = 0; at < text.size();) {
    std::int64_t value = 0;
    bool more = true;
    for (int shift = 0; more; shift += kBits) {
      const int group = at < text.size() ? text[at++] - '0' : -1;
      ThrowIf<InputError>(
          group < 0 || group > 0x3f || shift > kMaxBits,
          "{}: the run lengths of its mask are broken, expected counts as pycocotools writes them", place);
      value |= std::int64_t{group & 0x1f} << shift;
      more = (group & 0x20) != 0;
      if (!more && (group & 0x10) != 0) {
        value -= std::int64_t{1} << (shift + kBits);  // negative
      }
    }
    counts.push_back(counts.size() > 2 ? value + counts[counts.size() - 2] : value);
  }
  return counts;
}

// Runs go down the columns of the image, in turn outside and inside the mask.
Box2d BoundsOfRuns(const std::vector<std::int64_t>& counts, std::int64_t height, std::int64_t width,
                   const std::string& place) {
  std::int64_t left = width, top = height, right = 0, bottom = 0;
  std::int64_t begin = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    ThrowIf<InputError>(counts[i] < 0 || counts[i] > height * width - begin,
                        "{}: the runs of its mask do not fit an image of {}x{}", place, width, height);
    const std::int64_t end = begin + counts[i];
    if (i % 2 == 1 && end > begin) {
      const bool one_column = begin / height == (end - 1) / height;
      left = std::min(left, begin / height);
      right = std::max(right, (end - 1) / height + 1);
      top = std::min(top, one_column ? begin % height : 0);
      bottom = std::max(bottom, one_column ? (end - 1) % height + 1 : height);
    }
    begin = end;
  }
  return {static_cast<double>(left), static_cast<double>(top),
          static_cast<double>(std::max<std::int64_t>(0, right - left)),
          static_cast<double>(std::max<std::int64_t>(0, bottom - top))};
}

Box2d BoundsOfPolygons(const Json& polygons, const std::string& place) {
  Eigen::AlignedBox2d bounds;
  for (const Json& polygon : polygons) {
    const auto numbers = polygon.get<std::vector<double>>();
    ThrowIf<InputError>(numbers.size() < 6 || numbers.size() % 2 != 0,
                        "{}: expected polygons [x, y, x, y, x, y, ...]", place);
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
      bounds.extend(Eigen::Vector2d(numbers[i], numbers[i + 1]));
    }
  }
  if (bounds.isEmpty()) {
    return {};
  }
  return {bounds.min().x(), bounds.min().y(), bounds.sizes().x(), bounds.sizes().y()};
}

}  // namespace

Box2d BoundsOfMask(const Json& segmentation, const std::string& place) {
  if (segmentation.is_array()) {
    return BoundsOfPolygons(segmentation, place);
  }
  const auto height = segmentation.at("size").at(0).get<std::int64_t>();
  const auto width = segmentation.at("size").at(1).get<std::int64_t>();
  ThrowIf<InputError>(std::min(height, width) < 1 || std::max(height, width) > kMaxImageSide,
                      "{}: its mask is {}x{}, expected sides of 1 to {}", place, width, height,
                      kMaxImageSide);
  const Json& counts = segmentation.at("counts");
  return BoundsOfRuns(counts.is_string() ? CountsOf(counts.get<std::string>(), place)
                                         : counts.get<std::vector<std::int64_t>>(),
                      height, width, place);
}

namespace {

// COCO's category ids go up to 90 and skip these.
constexpr std::array kCocoGaps = {12, 26, 29, 30, 45, 66, 68, 69, 71, 83};

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

// Segmenters often write no box beside a mask.
Box2d CocoBounds(const Json& entry, const std::string& place) {
  if (!entry.contains("bbox") && entry.contains("segmentation")) {
    return BoundsOfMask(entry.at("segmentation"), place);
  }
  const Json& corners = entry.at("bbox");
  return {corners.at(0).get<double>(), corners.at(1).get<double>(), corners.at(2).get<double>(),
          corners.at(3).get<double>()};
}

FileBox BoxOf(std::string place, const Json& entry, const CocoTables& tables) {
  const Box2d box = CocoBounds(entry, place);
  ThrowIf<InputError>(!(box.width > 0.0) || !(box.height > 0.0),
                      "{}: expected a bbox [x, y, w, h] with w and h above 0, or a mask that is not empty",
                      place);
  const auto category = entry.at("category_id").get<std::int64_t>();
  const auto name = tables.categories.find(category);
  const std::string label = name != tables.categories.end() ? name->second : CocoName(category);
  FrameKey frame = std::string();
  if (const Json& id = entry.at("image_id"); id.is_string()) {
    frame = ImageStem(id.get<std::string>());
  } else if (tables.images.empty()) {
    frame = ImageNumber{id.get<std::int64_t>()};
  } else if (const auto image = tables.images.find(id.get<std::int64_t>()); image != tables.images.end()) {
    frame = ImageStem(image->second);
  } else {
    throw InputError("{}: image_id {} is not among the images", place, id.get<std::int64_t>());
  }
  const Detection detection{LabelFrom(place, label), entry.value("score", 1.0), box};
  return {std::move(place), std::move(frame), detection};
}

std::vector<FileBox> ReadCoco(const fs::path& path, const std::string& text) {
  constexpr const char* kExpected =
      "COCO's annotations or results: image_id, category_id, bbox [x, y, w, h] and a score for each box";
  const Json document = ParseJson(path, text, kExpected);
  std::vector<FileBox> boxes;
  try {
    CocoTables tables;
    if (document.is_object()) {
      for (const Json& image : document.value("images", Json::array())) {
        tables.images[image.at("id").get<std::int64_t>()] = image.at("file_name").get<std::string>();
      }
      for (const Json& category : document.value("categories", Json::array())) {
        tables.categories[category.at("id").get<std::int64_t>()] = category.at("name").get<std::string>();
      }
    }
    const Json& entries = document.is_object() ? document.at("annotations") : document;
    for (const Json& entry : entries) {
      boxes.push_back(BoxOf(fmt::format("{}: box {}", path.string(), boxes.size()), entry, tables));
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError("{}: box {}: expected {}", path.string(), boxes.size(), kExpected);
  }
  return boxes;
}

// Detects the format of a file by its content.
BoxFormat FormatOf(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first != std::string::npos && (text[first] == '{' || text[first] == '[')) {
    return BoxFormat::kCoco;
  }
  const std::vector<TextLine> lines = TextLinesIn(text);
  if (lines.empty()) {
    return BoxFormat::kBoxes;
  }
  const TextLine& line = lines.front();
  // A comma may stand in a label of boxes.txt, but not between its numbers.
  const auto is_number = [&](std::size_t i) { return ParseNumber<double>(line.words[i]).has_value(); };
  if (line.text.find_first_of(",;") == std::string::npos ||
      (line.words.size() >= 7 && is_number(0) && is_number(2) && is_number(3))) {
    return BoxFormat::kBoxes;
  }
  return ParseNumber<double>(SplitAt(line, ',').words.front()) ? BoxFormat::kMot : BoxFormat::kCsv;
}

}  // namespace

std::vector<FileBox> ReadBoxFile(const fs::path& path) {
  if (fs::is_directory(path)) {
    return ReadFolder(path);
  }
  const std::string text = ReadFile(path, "a file with boxes");  // once: a pipe does not give it again
  switch (FormatOf(text)) {
    case BoxFormat::kCoco:
      return ReadCoco(path, text);
    case BoxFormat::kMot:
      return ReadMot(path, text);
    case BoxFormat::kCsv:
      return ReadTable(path, text);
    default:
      return ReadBoxes(path, text);
  }
}

}  // namespace sqslam
