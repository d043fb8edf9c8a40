#include <algorithm>
#include <array>
#include <boost/algorithm/string/case_conv.hpp>
#include <map>
#include <string_view>

#include "slam/io/box_text.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Classes of MOTChallenge's ground truth, from 1.
constexpr std::array<std::string_view, 12> kMotNames = {
    "person", "person", "car",        "bicycle",  "motorcycle",         "vehicle",
    "person", "person", "distractor", "occluder", "occluder_on_ground", "occluder"};

// Names of columns: in each row the kind of column, which is a name too, and its other names.
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

// Columns of a table by kind.
class Columns {
 public:
  Columns(const fs::path& path, const TextLine& header) {
    for (std::size_t i = 0; i < header.words.size(); ++i) {
      const std::string name = boost::algorithm::to_lower_copy(header.words[i]);
      for (const auto& names : kColumnNames) {
        if (!name.empty() && std::ranges::find(names, name) != names.end()) {
          at_.emplace(names.front(), i);
        }
      }
    }
    const bool frame = Has("time") || Has("frame") || Has("image");
    const bool box = (Has("x") && Has("y") && ((Has("w") && Has("h")) || (Has("x2") && Has("y2")))) ||
                     (Has("cx") && Has("cy") && Has("w") && Has("h"));
    if (!frame || !box || !Has("label")) {
      ThrowBadLine(path, header,
                   "columns for the frame (timestamp, frame or image), the label and the box (x, y, w, h; "
                   "xmin, ymin, xmax, ymax; or cx, cy, w, h)");
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
        WholeNumberAt(path, line, columns["frame"], 0.0, "a frame's number from 0"))};
  }
  return ImageStem(line.words[columns["image"]]);
}

}  // namespace

std::vector<FileBox> ReadMot(const fs::path& path, std::string_view text) {
  constexpr const char* kMotLine = "'frame,id,x,y,w,h,score[,class,...]' with frames from 1";
  const std::vector<std::string> names = ReadNames(path.parent_path() / "labels.txt");
  std::vector<FileBox> boxes;
  for (const TextLine& whole : TextLinesIn(text)) {
    const TextLine line = SplitAt(whole, ',');
    if (line.words.size() < 7 || line.words.size() > 10) {
      ThrowBadLine(path, line, kMotLine);
    }
    const double frame = WholeNumberAt(path, line, 0, 1.0, kMotLine);
    Box2d box = BoxAt(path, line, 2, kMotLine);
    box.x -= 1.0;
    box.y -= 1.0;
    const double category = line.words.size() > 7 ? NumberAt(path, line, 7, kMotLine) : -1.0;
    const double index = category < 1.0 ? 0.0 : WholeNumberAt(path, line, 7, 1.0, kMotLine) - 1.0;
    boxes.push_back({PlaceOf(path, line),
                     FrameNumber{static_cast<std::int64_t>(frame) - 1},
                     {names.empty() ? ClassName(kMotNames, index) : ClassName(names, index),
                      NumberAt(path, line, 6, kMotLine), box}});
  }
  return boxes;
}

std::vector<FileBox> ReadTable(const fs::path& path, std::string_view text, const cv::Size& image) {
  const std::vector<TextLine> lines = TextLinesIn(text);
  const char separator = lines.front().text.find(';') != std::string::npos ? ';' : ',';
  const TextLine header = SplitAt(lines.front(), separator);
  const Columns columns(path, header);
  const bool centers = !columns.Has("x") || !columns.Has("y");  // then it has both centre columns
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

}  // namespace sqslam
