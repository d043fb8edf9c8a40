#pragma once

#include <Eigen/Core>
#include <algorithm>
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
};

// Returns the rows of an edited map (Apply with HiddenObjects::kKeep, to let hidden objects be shown again).
std::vector<ObjectRow> ObjectRows(const MapSnapshot& map, const ObjectEdits& edits = {});

// Returns the given name of an object, or its label with blanks and its number: "potted plant 3".
std::string ObjectName(const SnapshotObject& object);
std::string NumberedLabel(const std::string& label, int id);

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
  std::string key;    // one word, for filters
  std::string title;  // short, for a header
  std::string help;   // meaning and unit
  // Value in a column of numbers (degrees for angles), empty if unknown. Null for columns of words.
  std::optional<double> (*number)(const SnapshotObject& object) = nullptr;
  const char* format = "{:.3g}";  // of the value, for fmt; the default suits lengths of any size
};

// All columns, in the order of a table and of ObjectColumn.
std::span<const ColumnInfo> ObjectColumns();

// Returns the text of a cell; a dash if the value is unknown.
std::string CellText(const ObjectRow& row, ObjectColumn column);

// Sorts stably: numbers by value, words case-insensitively, unknown values always last.
void SortRows(std::vector<ObjectRow>& rows, ObjectColumn column, bool ascending);

// Selects the rows that match a search. Words must all occur in id, name or label, case-insensitively;
// comparisons (observations>100, seen > 100, e1<=0.3, label=cup, yaw>-45) name a column by its key or title,
// yaw in degrees; blanks around the sign are allowed. An empty text matches all.
class RowFilter {
 public:
  RowFilter() = default;
  explicit RowFilter(const std::string& text);

  bool Shows(const ObjectRow& row) const;

  // Names the part of the text that is no column or number, for a hint beside the field; empty if all is
  // valid. With a problem no row is shown.
  const std::string& Problem() const { return problem_; }

  // Returns true if the text has a comparison.
  bool Compares() const {
    return std::ranges::any_of(terms_, [](const Term& term) { return term.holds != nullptr; });
  }

 private:
  struct Term {
    std::optional<ObjectColumn> column = {};               // empty: a word
    bool (*holds)(std::partial_ordering order) = nullptr;  // compares the value with word or number
    std::string word = {};                                 // lower case
    std::optional<double> number = {};
  };

  static bool Holds(const Term& term, const ObjectRow& row);
  void AddComparison(const std::string& part, std::size_t at);

  std::vector<Term> terms_;
  std::string problem_;
};

// A map point of an object, or one that was rejected as its outlier.
struct ObjectPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  double residual = 0.0;  // signed distance to the object's surface, map units; below 0 inside
  double anomaly = 0.0;   // isolation score in [0, 1]; 0 if it has none
  bool kept = true;
};

std::vector<ObjectPoint> ObjectPoints(const MapSnapshot& map, const SnapshotObject& object);

// Returns the map with its objects replaced by solids of another kind at the same place and of the same size,
// like the option `objects.representation` of a run; for superquadrics the snapshot itself.
MapSnapshotPtr Represented(const MapSnapshotPtr& map, SolidKind kind);

}  // namespace sqslam::viewer
