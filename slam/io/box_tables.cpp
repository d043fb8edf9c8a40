#include "slam/io/box_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/algorithm/string/case_conv.hpp>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "slam/io/coco.h"
#include "slam/io/image_files.h"
#include "slam/util/limits.h"
#include "slam/util/text_table.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Classes of MOTChallenge's ground truth, from 1.
constexpr std::array<std::string_view, 12> kMotNames = {
    "person", "person", "car",        "bicycle",  "motorcycle",         "vehicle",
    "person", "person", "distractor", "occluder", "occluder_on_ground", "occluder"};

template <typename Names>
std::string ClassName(const Names& names, std::int64_t number) {
  const auto index = static_cast<std::size_t>(number);
  return number < 0             ? std::string(kUnknownClass)
         : index < names.size() ? std::string(names[index])
                                : fmt::format("class_{}", index);
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

// Columns by kind: the number of a class instead of its label is "class_number", cx and cy are the centre, x2
// and y2 the lower right corner.
using Columns = std::map<std::string_view, std::size_t>;

const Columns kBoxesColumns = {{"time", 0}, {"label", 1}, {"score", 2}, {"x", 3},
                               {"y", 4},    {"w", 5},     {"h", 6}};
const Columns kFolderColumns = {{"class_number", 0}, {"x", 1}, {"y", 2}, {"w", 3}, {"h", 4}, {"score", 5}};
const Columns kMotColumns = {{"frame", 0}, {"x", 2},     {"y", 3},           {"w", 4},
                             {"h", 5},     {"score", 6}, {"class_number", 7}};

// Names of columns in the header of a table, those that are preferred first. Each row begins with the kind,
// which is a name too.
constexpr std::array<std::array<std::string_view, 8>, 14> kColumnNames = {{
    {"time", "timestamp"},
    {"frame", "frame_id", "frame_number", "frame_index", "frame_idx"},
    {"image", "filename", "file_name", "image_name", "image_path", "image_id", "file"},
    {"label", "name", "class_name", "category", "class"},
    {"class_number", "class_id", "category_id"},
    {"score", "confidence", "conf", "probability"},
    {"x", "left", "xmin", "x_min", "x1", "bb_left", "bbox_left"},
    {"y", "top", "ymin", "y_min", "y1", "bb_top", "bbox_top"},
    {"cx", "x_center", "xcenter"},
    {"cy", "y_center", "ycenter"},
    {"w", "width", "bb_width", "bbox_width"},
    {"h", "height", "bb_height", "bbox_height"},
    {"x2", "xmax", "x_max", "right"},
    {"y2", "ymax", "y_max", "bottom"},
}};

std::optional<double> NumberIn(const TextLine& line, std::size_t column) {
  return column < line.words.size() ? ParseNumber<double>(line.words[column]) : std::nullopt;
}

// A file with one box on each line.
struct BoxTable {
  const fs::path& path;
  const Columns& columns;
  std::string expected;                 // in a line, for messages
  std::vector<std::string> names = {};  // of the classes by number
  int first = 0;                        // number of the first frame, and of the first class

  bool Has(std::string_view kind) const { return columns.contains(kind); }
  double Number(const TextLine& line, std::string_view kind) const {
    return NumberAt(path, line, columns.at(kind), expected);
  }
  std::int64_t WholeNumber(const TextLine& line, std::string_view kind, std::int64_t least) const {
    const double number = Number(line, kind);
    if (number < static_cast<double>(least) || number > 1e6 || number != std::floor(number)) {
      ThrowBadLine(path, line, expected);
    }
    return static_cast<std::int64_t>(number) - first;
  }
  // True if the file gives the centres of boxes.
  bool ByCenter() const { return !Has("x") || !Has("y"); }

  // Returns true if a column of the box is empty or NaN.
  bool IsWithoutBox(const TextLine& line) const {
    return std::ranges::any_of(std::array{"x", "y", "cx", "cy", "w", "h", "x2", "y2"}, [&](const char* kind) {
      const auto column = columns.find(kind);
      return column != columns.end() && column->second < line.words.size() &&
             (line.words[column->second].empty() || std::isnan(NumberIn(line, column->second).value_or(0.0)));
    });
  }

  // `frame`: of all boxes in the file, if no column tells it.
  FileBox Read(const TextLine& line, const FrameKey& frame = {}) const {
    Box2d box{Number(line, ByCenter() ? "cx" : "x"), Number(line, ByCenter() ? "cy" : "y"), 0.0, 0.0};
    box.width = Has("w") ? Number(line, "w") : Number(line, "x2") - box.x;
    box.height = Has("h") ? Number(line, "h") : Number(line, "y2") - box.y;
    if (box.width <= 0.0 || box.height <= 0.0) {
      ThrowBadLine(path, line, "a box with w and h above 0");
    }
    std::string place = fmt::format("{}:{}", path.string(), line.number);
    std::string label = LabelIn(line, place);
    return {std::move(place), FrameIn(line, frame), {std::move(label), ScoreIn(line), box}};
  }

 private:
  FrameKey FrameIn(const TextLine& line, const FrameKey& otherwise) const {
    if (Has("time")) {
      return FrameTime{Number(line, "time")};
    }
    if (Has("frame")) {
      return FrameNumber{WholeNumber(line, "frame", first)};
    }
    return Has("image") ? FrameKey(line.words[columns.at("image")]) : otherwise;
  }
  std::string LabelIn(const TextLine& line, const std::string& place) const {
    const std::string label = Has("label") ? line.words[columns.at("label")] : "";
    return !label.empty() ? LabelFrom(place, label)
           : Has("label") ? std::string(kUnknownClass)
                          : ClassName(names, WholeNumber(line, "class_number", -1));
  }
  // Returns 1 if the score is not given: no column, an empty cell, NaN, or -1.
  double ScoreIn(const TextLine& line) const {
    if (!Has("score") || columns.at("score") >= line.words.size() ||
        line.words[columns.at("score")].empty()) {
      return 1.0;
    }
    const std::optional<double> score = NumberIn(line, columns.at("score"));
    if (!score) {
      ThrowBadLine(path, line, expected);
    }
    return std::isnan(*score) || *score == -1.0 ? 1.0 : *score;
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

void CheckWords(const BoxTable& table, const TextLine& line, std::size_t least, std::size_t most) {
  if (line.words.size() < least || line.words.size() > most) {
    ThrowBadLine(table.path, line, table.expected);
  }
}

// ---- One file for each frame

constexpr std::size_t kBoxWords = 5;  // class cx cy w h

// Returns true if the last word of each line is the id of a track: a whole number without a decimal point. A
// score of 1 written without one is the same.
bool HasTrackIds(const std::vector<TextLine>& lines) {
  const auto is_id = [](const TextLine& line) {
    const std::string& last = line.words.back();
    return line.words.size() > kBoxWords && last != "0" && last.find_first_not_of("0123456789") == last.npos;
  };
  return !lines.empty() && std::ranges::all_of(lines, is_id);
}

constexpr std::size_t kKeypointWords = 3;  // x y, and whether or how surely it is seen

// Returns true if the words after the box can be keypoints: those seen lie in the box. Labels mark them by
// whole numbers (0, 1, 2). Others are only believed if they span a part of the box, as the numbers of a
// polygon hardly do, and if there are several boxes.
bool CanBeKeypoints(const TextLine& line, bool single) {
  constexpr double kMargin = 0.1;    // of the box
  constexpr double kMinSpan = 0.25;  // of the box
  const auto point_at = [&](std::size_t i) {
    return Eigen::Vector2d(NumberIn(line, i).value_or(NAN), NumberIn(line, i + 1).value_or(NAN));
  };
  const Eigen::Vector2d center = point_at(1), size = point_at(3);
  const Eigen::AlignedBox2d box(center - (0.5 + kMargin) * size, center + (0.5 + kMargin) * size);
  Eigen::AlignedBox2d seen;
  bool whole = true;
  for (std::size_t i = kBoxWords; i + kKeypointWords <= line.words.size(); i += kKeypointWords) {
    const double mark = NumberIn(line, i + 2).value_or(NAN);
    if (!(mark >= 0.0 && mark <= 1.0) && mark != 2.0) {
      return false;
    }
    whole = whole && mark == std::floor(mark);
    if (const Eigen::Vector2d point = point_at(i); mark > 0.0 && !point.isZero()) {
      if (!box.contains(point)) {
        return false;
      }
      seen.extend(point);
    }
  }
  return whole || (!single && !seen.isEmpty() && (seen.sizes().array() >= kMinSpan * size.array()).all());
}

// Removes the keypoints of poses, `class cx cy w h x y v x y v ... [score] [track]`. All lines of a folder
// have the same number of them.
void RemoveKeypoints(std::vector<std::vector<TextLine>>& files) {
  constexpr std::size_t kMinKeypoints = 3;
  std::size_t words = 0, lines = 0;
  for (const std::vector<TextLine>& file : files) {
    for (const TextLine& line : file) {
      words = lines++ == 0 ? line.words.size() : line.words.size() == words ? words : 0;
    }
  }
  const auto are_poses = [&](const std::vector<TextLine>& file) {
    return std::ranges::all_of(file, [&](const TextLine& line) { return CanBeKeypoints(line, lines == 1); });
  };
  if (words < kBoxWords + kMinKeypoints * kKeypointWords || !std::ranges::all_of(files, are_poses)) {
    return;
  }
  const auto removed = static_cast<std::ptrdiff_t>((words - kBoxWords) / kKeypointWords * kKeypointWords);
  for (std::vector<TextLine>& file : files) {
    for (TextLine& line : file) {
      const auto first = line.words.begin() + kBoxWords;
      line.words.erase(first, first + removed);
    }
  }
}

// Replaces the polygon in `class x y x y x y ... [score]` by its bounds, `class cx cy w h [score]`.
void UseBounds(const BoxTable& table, TextLine& line) {
  const std::size_t numbers = line.words.size() - 1;
  std::array<std::array<double, 2>, 2> bounds = {{{INFINITY, -INFINITY}, {INFINITY, -INFINITY}}};
  for (std::size_t i = 0; i + 1 < numbers; i += 2) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double value = NumberAt(table.path, line, 1 + i + axis, table.expected);
      if (value < 0.0 || value > 1.0) {
        ThrowBadLine(table.path, line, table.expected);
      }
      bounds[axis] = {std::min(bounds[axis][0], value), std::max(bounds[axis][1], value)};
    }
  }
  const auto& [x, y] = bounds;
  std::vector<std::string> words = {line.words[0], fmt::format("{}", 0.5 * (x[0] + x[1])),
                                    fmt::format("{}", 0.5 * (y[0] + y[1])), fmt::format("{}", x[1] - x[0]),
                                    fmt::format("{}", y[1] - y[0])};
  if (numbers % 2 == 1) {
    words.push_back(line.words.back());
  }
  line.words = std::move(words);
}

// Returns the text files of a folder and those below it, without hidden ones, in the same order on every
// machine.
std::vector<fs::path> ListTextFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (auto it = fs::recursive_directory_iterator(folder); it != fs::recursive_directory_iterator(); ++it) {
    const bool hidden = IsHidden(it->path());
    if (hidden && it->is_directory()) {
      it.disable_recursion_pending();
    } else if (!hidden && it->path().extension() == ".txt" && it->path() != folder / "classes.txt") {
      files.push_back(it->path());
    }
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace

std::string LabelFrom(const std::string& place, std::string_view text) {
  const std::string label = NormalizedLabel(ValidText(text));
  ThrowIf<InputError>(label.empty() || label.size() > kMaxLabelBytes,
                      "{}: a label of {} bytes, expected 1 to {}", place, label.size(), kMaxLabelBytes);
  return label;
}

std::string CocoClassName(std::int64_t number) { return ClassName(kCocoNames, number); }

std::vector<FileBox> ReadBoxFolder(const fs::path& folder) {
  const std::vector<fs::path> files = ListTextFiles(folder);
  ThrowIf<InputError>(files.empty(), "{}: contains no text file, expected one for each frame with boxes",
                      folder.string());
  const std::vector<std::string> names = ReadNames(folder / "classes.txt", kCocoNames);
  constexpr const char* kExpected =
      "'class x y w h score' in pixels, or 'class cx cy w h [score] [track]' or 'class x y x y x y ... "
      "[score] "
      "[track]' in parts of the image";
  std::vector<std::vector<TextLine>> lines_of;
  for (const fs::path& file : files) {
    lines_of.push_back(ReadTextLines(file, "a file with the boxes of one frame"));
  }
  RemoveKeypoints(lines_of);
  std::vector<FileBox> boxes;
  std::optional<std::string> without_score;
  bool tracks = false;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const BoxTable table{files[i], kFolderColumns, kExpected, names};
    const FrameKey frame = files[i].lexically_relative(folder).replace_extension().generic_string();
    std::vector<TextLine>& lines = lines_of[i];
    const bool has_ids = HasTrackIds(lines);
    tracks = tracks || has_ids;
    for (TextLine& line : lines) {
      line.words.resize(line.words.size() - (has_ids ? 1 : 0));
      CheckWords(table, line, kBoxWords, line.words.max_size());
      const bool polygon = line.words.size() > kBoxWords + 1;
      if (polygon) {
        UseBounds(table, line);
      }
      boxes.push_back(table.Read(line, frame));
      if (line.words.size() == kBoxWords && !has_ids && !without_score) {
        without_score = boxes.back().place;
      }
    }
  }
  if (tracks) {
    spdlog::info(
        "{}: whole numbers in the last column are the ids of tracks, not used; a box without a score has 1",
        folder.string());
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

// ---- One file for all frames

namespace {

// Returns the words of a line of boxes.txt, in which a label may have commas, or cells between commas.
std::vector<std::string> WordsOfBox(const std::string& text) {
  std::vector<std::string> words = CellsOf(text, ' ');
  const auto is_number = [&](std::size_t i) { return ParseNumber<double>(words[i]).has_value(); };
  return words.size() >= 7 && is_number(0) && is_number(2) && is_number(3) ? words
                                                                           : CellsOf(text, SeparatorOf(text));
}

Columns ColumnsOf(const fs::path& path, const TextTable& table) {
  Columns columns;
  for (const auto& names : kColumnNames) {
    for (const std::string_view name : names) {
      const auto found = std::ranges::find(table.names, name);
      if (!name.empty() && found != table.names.end() && !columns.contains(names.front())) {
        columns.emplace(names.front(), static_cast<std::size_t>(found - table.names.begin()));
      }
    }
  }
  const auto has = [&](auto... kinds) { return (columns.contains(kinds) && ...); };
  const bool frame = has("time") || has("frame") || has("image");
  const bool box = (has("x", "y") && (has("w", "h") || has("x2", "y2"))) || has("cx", "cy", "w", "h");
  ThrowIf<InputError>(!frame || !box || !(has("label") || has("class_number")),
                      "{}: its first line names the columns '{}', expected columns for the frame (timestamp, "
                      "frame or image), the "
                      "label and the box (x, y, w, h; xmin, ymin, xmax, ymax; or cx, cy, w, h)",
                      path.string(), VisibleText(fmt::format("{}", fmt::join(table.names, ","))));
  return columns;
}

// Uses the numbers of classes if there is no other label.
void UseClassNumbers(const TextTable& table, Columns& columns) {
  const auto label = columns.find("label");
  const auto is_number = [&](const TextLine& row) {
    const std::optional<double> number = NumberIn(row, label->second);
    return number && *number == std::floor(*number);
  };
  if (label != columns.end() && !table.rows.empty() && std::ranges::all_of(table.rows, is_number)) {
    columns["class_number"] = label->second;
    columns.erase("label");
  }
}

}  // namespace

BoxFormat FormatOfBoxLines(std::string_view text) {
  const TextTable table = TableIn(text);
  if (!table.names.empty() && (table.rows.empty() || SeparatorOf(table.rows.front().text) != ' ')) {
    return BoxFormat::kCsv;
  }
  if (table.rows.empty()) {
    return BoxFormat::kBoxes;
  }
  const TextLine& row = table.rows.front();
  constexpr std::size_t kMotWords = 10;  // of trackers that write blanks
  const auto is_number = [](const std::string& word) { return ParseNumber<double>(word).has_value(); };
  const bool blanks = SeparatorOf(row.text) == ' ';
  const bool mot = blanks ? row.words.size() == kMotWords && std::ranges::all_of(row.words, is_number)
                          : row.words.size() > 1 && is_number(row.words[0]) && is_number(row.words[1]);
  return mot ? BoxFormat::kMot : BoxFormat::kBoxes;
}

std::vector<FileBox> ReadBoxLines(const fs::path& path, std::string_view text) {
  const BoxTable table{path, kBoxesColumns, "'timestamp label score x y w h [object_id [visible_fraction]]'"};
  std::vector<FileBox> boxes;
  for (TextLine& line : TextLinesIn(text)) {
    line.words = WordsOfBox(line.text);
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

std::vector<FileBox> ReadMot(const fs::path& path, std::string_view text) {
  const BoxTable table{path, kMotColumns, "'frame,id,x,y,w,h,score[,class,...]' with frames from 1",
                       ReadNames(path.parent_path() / "labels.txt", kMotNames), 1};
  constexpr std::size_t kClass = 7;
  std::vector<FileBox> boxes;
  for (TextLine& line : TableIn(text).rows) {
    CheckWords(table, line, 7, 10);
    line.words.resize(std::max(line.words.size(), kClass + 1), "-1");
    boxes.push_back(table.Read(line));
    boxes.back().detection.box.x -= 1.0;
    boxes.back().detection.box.y -= 1.0;
  }
  return boxes;
}

std::vector<FileBox> ReadBoxTable(const fs::path& path, std::string_view text) {
  const TextTable rows = TableIn(text);
  Columns columns = ColumnsOf(path, rows);
  UseClassNumbers(rows, columns);
  const std::size_t cells = rows.names.size();
  const BoxTable table{path, columns, fmt::format("{} cells, with numbers for frame and box", cells),
                       ReadNames(path.parent_path() / "labels.txt", kCocoNames)};
  std::vector<FileBox> boxes;
  std::size_t without_box = 0;
  for (const TextLine& line : rows.rows) {
    CheckWords(table, line, cells, cells);
    if (table.IsWithoutBox(line)) {
      ++without_box;
    } else {
      boxes.push_back(table.Read(line));
    }
  }
  if (without_box > 0) {
    spdlog::warn("{}: {} of {} rows have no box (not a number), skipped", path.string(), without_box,
                 rows.rows.size());
  }
  if (ArePartsOfImage(boxes)) {
    MarkParts(boxes);
  }
  if (table.ByCenter()) {
    MoveCentersToCorners(boxes);
  }
  return boxes;
}

}  // namespace sqslam
