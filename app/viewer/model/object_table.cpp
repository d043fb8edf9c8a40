#include "app/viewer/model/object_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>

#include "slam/geometry/angles.h"
#include "slam/util/options.h"

namespace sqslam::viewer {
namespace {

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

const ColumnInfo& InfoOf(ObjectColumn column) {
  const std::span<const ColumnInfo> columns = ObjectColumns();
  return *std::find_if(columns.begin(), columns.end(),
                       [column](const ColumnInfo& info) { return info.column == column; });
}

// Of columns of words, and of ids for the words of a search.
std::string TextOf(const ObjectRow& row, ObjectColumn column) {
  return column == ObjectColumn::kName ? row.name : row.label;
}

std::optional<double> ParseNumber(const std::string& text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

constexpr std::string_view kSigns = "<>=!";

// "e1 > 0.5 cup" as "e1>0.5 cup".
std::string WithoutBlanksAroundSigns(const std::string& text) {
  std::string tight;
  for (const char c : text) {
    const bool sign = kSigns.find(c) != std::string_view::npos;
    while (sign && !tight.empty() && tight.back() == ' ') {
      tight.pop_back();
    }
    const bool after_sign = !tight.empty() && kSigns.find(tight.back()) != std::string_view::npos;
    if (c != ' ' || !after_sign) {
      tight += c;
    }
  }
  return tight;
}

template <typename Value>
bool Compare(const std::string& comparison, const Value& a, const Value& b) {
  if (comparison == "<") {
    return a < b;
  }
  if (comparison == "<=") {
    return a <= b;
  }
  if (comparison == ">") {
    return a > b;
  }
  if (comparison == ">=") {
    return a >= b;
  }
  return (a == b) == (comparison == "=");
}

}  // namespace

std::span<const ColumnInfo> ObjectColumns() {
  using enum ObjectColumn;
  static const std::array<ColumnInfo, 14> kColumns = {{
      {kId, "id", "ID", "number of the object in the map"},
      {kName, "name", "Name", "what it is called; its label unless it was renamed", false},
      {kLabel, "label", "Label", "class that the detector gave it", false},
      {kObservations, "observations", "Seen", "frames in which one of the detector's boxes was its"},
      {kPoints, "points", "Points", "map points that lie on it, after outlier removal"},
      {kScore, "score", "Score", "mean score of the detector, 0 to 1"},
      {kSizeX, "ax", "ax", "half size along its x axis, map units"},
      {kSizeY, "ay", "ay", "half size along its y axis, map units"},
      {kSizeZ, "az", "az", "half size along its z axis, map units"},
      {kE1, "e1", "e1", "exponent of its side view: 0.1 a box, 1 an ellipse, near 2 a diamond"},
      {kE2, "e2", "e2", "exponent of its cross-section: 0.1 a box, 1 an ellipse, near 2 a diamond"},
      {kYaw, "yaw", "Yaw", "turn about the vertical, degrees"},
      {kResidual, "residual", "Residual", "rms distance of its points to its surface, map units"},
      {kAgreement, "agreement", "Box IoU", "mean IoU of its outline's box with the detector's, 0 to 1"},
  }};
  return kColumns;
}

std::optional<double> ObjectRow::Number(ObjectColumn column) const {
  switch (column) {
    case ObjectColumn::kId:
      return id;
    case ObjectColumn::kName:
    case ObjectColumn::kLabel:
      return std::nullopt;
    case ObjectColumn::kObservations:
      return observations;
    case ObjectColumn::kPoints:
      return points;
    case ObjectColumn::kScore:
      return score;
    case ObjectColumn::kSizeX:
      return half_size.x();
    case ObjectColumn::kSizeY:
      return half_size.y();
    case ObjectColumn::kSizeZ:
      return half_size.z();
    case ObjectColumn::kE1:
      return e1;
    case ObjectColumn::kE2:
      return e2;
    case ObjectColumn::kYaw:
      return yaw * kDegreesPerRadian;
    case ObjectColumn::kResidual:
      return residual;
    case ObjectColumn::kAgreement:
      return agreement;
  }
  return std::nullopt;
}

std::vector<ObjectRow> ObjectRows(const MapSnapshot& map, const ObjectEdits& edits) {
  std::vector<ObjectRow> rows;
  for (const SnapshotObject& object : map.objects) {
    const Superquadric& shape = object.superquadric.shape;
    ObjectRow& row = rows.emplace_back();
    row.id = object.id;
    row.name = ShownName(object);
    row.label = object.label;
    row.observations = object.observations;
    row.points = object.points;
    row.score = object.score;
    row.half_size = shape.half_size;
    row.e1 = shape.e1;
    row.e2 = shape.e2;
    row.yaw = object.yaw;
    if (object.points > 0) {
      row.residual = object.fit.point_rms;
    }
    if (object.fit.box_agreement > 0.0) {
      row.agreement = object.fit.box_agreement;
    }
    row.hidden = edits.Of(object.id).hidden;
    row.parts = edits.PartsOf(object.id);
  }
  return rows;
}

std::string CellText(const ObjectRow& row, ObjectColumn column) {
  if (!InfoOf(column).is_number) {
    return TextOf(row, column);
  }
  const std::optional<double> number = row.Number(column);
  if (!number) {
    return "\u2013";
  }
  switch (column) {
    case ObjectColumn::kId:
    case ObjectColumn::kObservations:
    case ObjectColumn::kPoints:
      return fmt::format("{:.0f}", *number);
    case ObjectColumn::kYaw:
      return fmt::format("{:.0f}\u00b0", *number + 0.0);
    case ObjectColumn::kScore:
    case ObjectColumn::kE1:
    case ObjectColumn::kE2:
    case ObjectColumn::kAgreement:
      return fmt::format("{:.2f}", *number);
    default:  // lengths: map units may be of any size
      return fmt::format("{:.3g}", *number);
  }
}

void SortRows(std::vector<ObjectRow>& rows, ObjectColumn column, bool ascending) {
  const auto before = [&](const ObjectRow& a, const ObjectRow& b) {
    if (!InfoOf(column).is_number) {
      const std::string left = Lower(TextOf(a, column));
      const std::string right = Lower(TextOf(b, column));
      return ascending ? left < right : right < left;
    }
    const std::optional<double> left = a.Number(column);
    const std::optional<double> right = b.Number(column);
    if (!left || !right) {
      return left && !right;
    }
    return ascending ? *left < *right : *right < *left;
  };
  std::stable_sort(rows.begin(), rows.end(), before);
}

RowFilter::RowFilter(const std::string& text) {
  std::istringstream stream(WithoutBlanksAroundSigns(text));
  for (std::string part; stream >> part;) {
    const std::size_t at = part.find_first_of(kSigns);
    if (at == std::string::npos) {
      terms_.push_back({std::nullopt, "", Lower(part), std::nullopt});
    } else {
      AddComparison(part, at);
    }
  }
}

void RowFilter::AddComparison(const std::string& part, std::size_t at) {
  const std::string key = Lower(part.substr(0, at));
  const std::size_t value = part.find_first_not_of(kSigns, at);
  Term term;
  term.comparison = part.substr(at, value == std::string::npos ? value : value - at);
  term.word = value == std::string::npos ? "" : Lower(part.substr(value));
  term.number = ParseNumber(term.word);
  std::vector<std::string> keys;
  for (const ColumnInfo& info : ObjectColumns()) {
    keys.push_back(info.key);
    if (info.key == key || Lower(info.title) == key) {
      term.column = info.column;
    }
  }
  static const std::vector<std::string> kComparisons = {"<", "<=", ">", ">=", "=", "!="};
  if (!term.column) {
    const std::string nearest = NearestWord(key, keys);
    problem_ = fmt::format("no column '{}'{}", key,
                           nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
  } else if (std::find(kComparisons.begin(), kComparisons.end(), term.comparison) == kComparisons.end()) {
    problem_ = fmt::format("'{}', expected <, <=, >, >=, = or !=", term.comparison);
  } else if (InfoOf(*term.column).is_number && !term.number) {
    problem_ = fmt::format("{}{}: expected a number", key, term.comparison);
  }
  terms_.push_back(std::move(term));
}

bool RowFilter::Holds(const Term& term, const ObjectRow& row) {
  if (!term.column) {
    return Lower(row.name).find(term.word) != std::string::npos ||
           Lower(row.label).find(term.word) != std::string::npos || std::to_string(row.id) == term.word;
  }
  if (!InfoOf(*term.column).is_number) {
    return Compare(term.comparison, Lower(TextOf(row, *term.column)), term.word);
  }
  const std::optional<double> number = row.Number(*term.column);
  return number && Compare(term.comparison, *number, *term.number);
}

bool RowFilter::Shows(const ObjectRow& row) const {
  return problem_.empty() &&
         std::all_of(terms_.begin(), terms_.end(), [&row](const Term& term) { return Holds(term, row); });
}

}  // namespace sqslam::viewer
