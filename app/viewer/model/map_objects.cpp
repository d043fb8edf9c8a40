#include "app/viewer/model/map_objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/algorithm/string/case_conv.hpp>
#include <memory>
#include <regex>
#include <sstream>
#include <string_view>

#include "slam/fitting/surface_measures.h"
#include "slam/geometry/angles.h"
#include "slam/geometry/nearest_solid.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace {

using boost::algorithm::to_lower_copy;

const ColumnInfo& InfoOf(ObjectColumn column) { return ObjectColumns()[static_cast<std::size_t>(column)]; }

// Returns the text in a column of words.
std::string TextOf(const ObjectRow& row, ObjectColumn column) {
  return column == ObjectColumn::kName ? ShownName(row.object) : row.object.label;
}

constexpr std::string_view kSigns = "<>=!";

struct Comparison {
  std::string_view sign;
  bool (*holds)(std::partial_ordering order);
};
constexpr std::array<Comparison, 6> kComparisons = {{
    {"<", [](std::partial_ordering order) { return order < 0; }},
    {"<=", [](std::partial_ordering order) { return order <= 0; }},
    {">", [](std::partial_ordering order) { return order > 0; }},
    {">=", [](std::partial_ordering order) { return order >= 0; }},
    {"=", [](std::partial_ordering order) { return order == 0; }},
    {"!=", [](std::partial_ordering order) { return order != 0; }},
}};

}  // namespace

std::span<const ColumnInfo> ObjectColumns() {
  using enum ObjectColumn;
  using Object = SnapshotObject;
  using Number = std::optional<double>;
  static const std::array<ColumnInfo, 14> kColumns = {{
      {kId, "id", "ID", "number of the object in the map", [](const Object& o) { return Number(o.id); },
       "{:.0f}"},
      {kName, "name", "Name", "what it is called; its label unless it was renamed"},
      {kLabel, "label", "Label", "class that the detector gave it"},
      {kObservations, "observations", "Seen", "frames in which one of the detector's boxes was its",
       [](const Object& o) { return Number(o.observations); }, "{:.0f}"},
      {kPoints, "points", "Points", "map points that lie on it, after outlier removal",
       [](const Object& o) { return Number(o.points); }, "{:.0f}"},
      {kScore, "score", "Score", "mean score of the detector, 0 to 1",
       [](const Object& o) { return Number(o.score); }, "{:.2f}"},
      {kSizeX, "ax", "ax", "half size along its x axis, in the map's unit",
       [](const Object& o) { return Number(o.superquadric.shape.half_size.x()); }},
      {kSizeY, "ay", "ay", "half size along its y axis, in the map's unit",
       [](const Object& o) { return Number(o.superquadric.shape.half_size.y()); }},
      {kSizeZ, "az", "az", "half size along its z axis, in the map's unit",
       [](const Object& o) { return Number(o.superquadric.shape.half_size.z()); }},
      {kE1, "e1", "e1", "exponent of its side view: 0.1 a box, 1 an ellipse, near 2 a diamond",
       [](const Object& o) { return Number(o.superquadric.shape.e1); }, "{:.2f}"},
      {kE2, "e2", "e2", "exponent of its cross-section: 0.1 a box, 1 an ellipse, near 2 a diamond",
       [](const Object& o) { return Number(o.superquadric.shape.e2); }, "{:.2f}"},
      {kYaw, "yaw", "Yaw", "turn about the vertical, degrees",
       [](const Object& o) { return Number(o.yaw * kDegreesPerRadian); }, "{:.0f}\u00b0"},
      {kResidual, "residual", "Residual", "rms distance of its points to its surface, in the map's unit",
       [](const Object& o) { return o.points > 0 ? Number(o.fit.point_rms) : std::nullopt; }},
      {kAgreement, "agreement", "Box IoU", "mean IoU of its outline's box with the detector's, 0 to 1",
       [](const Object& o) { return o.fit.box_agreement > 0.0 ? Number(o.fit.box_agreement) : std::nullopt; },
       "{:.2f}"},
  }};
  return kColumns;
}

std::string ObjectName(const SnapshotObject& object) {
  return object.name.empty() ? NumberedLabel(object.label, object.id) : object.name;
}

std::string NumberedLabel(const std::string& label, int id) {
  return fmt::format("{} {}", ReadableLabel(label), id);
}

std::vector<ObjectRow> ObjectRows(const MapSnapshot& map, const ObjectEdits& edits) {
  return ToVector(map.objects, [&](const SnapshotObject& object) {
    return ObjectRow{object, edits.Of(object.id).hidden};
  });
}

std::string CellText(const ObjectRow& row, ObjectColumn column) {
  const ColumnInfo& info = InfoOf(column);
  if (info.number == nullptr) {
    return TextOf(row, column);
  }
  const std::optional<double> number = info.number(row.object);
  return number ? fmt::format(fmt::runtime(info.format), *number + 0.0) : "\u2013";
}

void SortRows(std::vector<ObjectRow>& rows, ObjectColumn column, bool ascending) {
  const auto before = [&](const ObjectRow& a, const ObjectRow& b) {
    const auto number = InfoOf(column).number;
    if (number == nullptr) {
      const std::string left = to_lower_copy(TextOf(a, column));
      const std::string right = to_lower_copy(TextOf(b, column));
      return ascending ? left < right : right < left;
    }
    const std::optional<double> left = number(a.object);
    const std::optional<double> right = number(b.object);
    if (!left || !right) {
      return left && !right;
    }
    return ascending ? *left < *right : *right < *left;
  };
  std::ranges::stable_sort(rows, before);
}

RowFilter::RowFilter(const std::string& text) {
  static const std::regex kSpacedSign(" *([<>=!]+) *");
  std::istringstream stream(std::regex_replace(text, kSpacedSign, "$1"));  // "e1 > 0.5" becomes "e1>0.5"
  for (std::string part; stream >> part;) {
    const std::size_t at = part.find_first_of(kSigns);
    if (at == std::string::npos) {
      terms_.push_back({.word = to_lower_copy(part)});
    } else {
      AddComparison(part, at);
    }
  }
}

void RowFilter::AddComparison(const std::string& part, std::size_t at) {
  const std::string key = to_lower_copy(part.substr(0, at));
  const std::size_t value = std::min(part.find_first_not_of(kSigns, at), part.size());
  const std::string sign = part.substr(at, value - at);
  Term term;
  term.word = to_lower_copy(part.substr(value));
  term.number = ParseNumber<double>(term.word);
  std::vector<std::string> keys;
  for (const ColumnInfo& info : ObjectColumns()) {
    keys.push_back(info.key);
    if (info.key == key || to_lower_copy(info.title) == key) {
      term.column = info.column;
    }
  }
  for (const Comparison& comparison : kComparisons) {
    term.holds = comparison.sign == sign ? comparison.holds : term.holds;
  }
  if (!term.column) {
    problem_ = fmt::format("no column '{}'{}", key, DidYouMean(key, keys));
  } else if (term.holds == nullptr) {
    problem_ = fmt::format("'{}', expected <, <=, >, >=, = or !=", sign);
  } else if (InfoOf(*term.column).number != nullptr && !term.number) {
    problem_ = fmt::format("{}{}: expected a number", key, sign);
  }
  terms_.push_back(std::move(term));
}

bool RowFilter::Holds(const Term& term, const ObjectRow& row) {
  if (!term.column) {
    return to_lower_copy(ShownName(row.object)).find(term.word) != std::string::npos ||
           to_lower_copy(row.object.label).find(term.word) != std::string::npos ||
           std::to_string(row.object.id) == term.word;
  }
  const auto number_of = InfoOf(*term.column).number;
  if (number_of == nullptr) {
    return term.holds(to_lower_copy(TextOf(row, *term.column)) <=> term.word);
  }
  const std::optional<double> number = number_of(row.object);
  return number && term.holds(*number <=> *term.number);
}

bool RowFilter::Shows(const ObjectRow& row) const {
  return problem_.empty() &&
         std::ranges::all_of(terms_, [&row](const Term& term) { return Holds(term, row); });
}

std::vector<ObjectPoint> ObjectPoints(const MapSnapshot& map, const SnapshotObject& object) {
  const SurfaceDistance distance(object.superquadric.shape);
  const Rigid3d T_object_map = object.superquadric.T_map_object.Inverse();
  std::vector<ObjectPoint> points;
  for (const SnapshotPoint& point : map.points) {
    if (point.object_id != object.id && point.rejected_by != object.id) {
      continue;
    }
    const Eigen::Vector3d p = point.p_map.cast<double>();
    points.push_back(
        {p, distance(T_object_map * p), static_cast<double>(point.anomaly), point.object_id == object.id});
  }
  return points;
}

MapSnapshotPtr Represented(const MapSnapshotPtr& map, SolidKind kind) {
  if (kind == SolidKind::kSuperquadric || !map) {
    return map;
  }
  auto represented = std::make_shared<MapSnapshot>(*map);
  for (SnapshotObject& object : represented->objects) {
    object.superquadric = NearestOfKind(kind, object.superquadric);
    object.parts.clear();
    object.yaw = sqslam::YawOf(object.superquadric.T_map_object.rotation);
  }
  return represented;
}

}  // namespace sqslam::viewer
