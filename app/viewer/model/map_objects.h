#pragma once

#include <Eigen/Core>
#include <compare>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "slam/geometry/solid_iou.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

// One object of a map in the table of objects.
struct ObjectRow {
  SnapshotObject object;  // as edited
  bool hidden = false;
  std::vector<int> parts;  // ids of the objects that were merged into it
};

// The rows of an edited map (Apply with HiddenObjects::kKeep, so that hidden objects can be shown again).
std::vector<ObjectRow> ObjectRows(const MapSnapshot& map, const ObjectEdits& edits = {});

// The name that somebody gave an object, or its label as people write it with its number: "potted plant 3".
std::string ObjectName(const SnapshotObject& object);
std::string NumberedLabel(std::string label, int id);

enum class ObjectColumn {
  kId,
  kName,
  kLabel,
  kObservations,
  kPoints,
  kScore,
  kSizeX,
  kSizeY,
  kSizeZ,
  kE1,
  kE2,
  kYaw,
  kResidual,
  kAgreement
};

struct ColumnInfo {
  ObjectColumn column;
  std::string key;    // in filters, one word
  std::string title;  // short, for a header
  std::string help;   // what it is, with its unit
  // The value in a column of numbers (degrees for angles), empty where it is not known, and its format. Null
  // for columns of words.
  std::optional<double> (*number)(const SnapshotObject& object) = nullptr;
  const char* format = "{:.3g}";  // as fmt; lengths: map units may be of any size
};

// All columns, in the order of a table and of ObjectColumn.
std::span<const ColumnInfo> ObjectColumns();

// The text of a cell: a number with three digits or two decimals, a dash for what is not known.
std::string CellText(const ObjectRow& row, ObjectColumn column);

// Stable. Numbers by size, words without regard to case; what is not known comes last either way.
void SortRows(std::vector<ObjectRow>& rows, ObjectColumn column, bool ascending);

// Chooses the rows that a search shows. Words must all occur in id, name or label, without regard to case;
// comparisons (observations>100, seen > 100, e1<=0.3, label=cup, yaw>-45) name a column by its key or title,
// yaw in degrees; blanks around the sign are fine. An empty text shows all.
class RowFilter {
 public:
  RowFilter() = default;
  explicit RowFilter(const std::string& text);

  bool Shows(const ObjectRow& row) const;

  // Names what of the text is no column or number, for a hint beside the field; empty where all is
  // understood. Such a part shows no row.
  const std::string& Problem() const { return problem_; }

 private:
  struct Term {
    std::optional<ObjectColumn> column = {};               // empty: a word
    bool (*holds)(std::partial_ordering order) = nullptr;  // of the value against word or number
    std::string word = {};                                 // lower case
    std::optional<double> number = {};
  };

  static bool Holds(const Term& term, const ObjectRow& row);
  void AddComparison(const std::string& part, std::size_t at);

  std::vector<Term> terms_;
  std::string problem_;
};

// A map point of an object, or one that its outlier removal took away.
struct ObjectPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  double residual = 0.0;  // signed distance to the object's surface, map units; below 0 inside
  double anomaly = 0.0;   // isolation score in [0, 1]; 0 where it has none
  bool kept = true;
};

std::vector<ObjectPoint> ObjectPoints(const MapSnapshot& map, const SnapshotObject& object);

// The map with its objects at the same place and of the same size as solids of another kind, as the option
// `objects.representation` of a run makes them; the snapshot itself for superquadrics.
MapSnapshotPtr Represented(const MapSnapshotPtr& map, SolidKind kind);

}  // namespace sqslam::viewer
