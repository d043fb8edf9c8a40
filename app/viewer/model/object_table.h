#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

enum class ObjectColumn {
  kId,
  kName,  // what it is called, or its label
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
  bool is_number = true;
};

// All columns, in the order of a table.
std::span<const ColumnInfo> ObjectColumns();

// One object of a map. Lengths in map units.
struct ObjectRow {
  int id = 0;
  std::string name;  // never empty: the label where it has no name
  std::string label;
  int observations = 0;  // frames in which a box was associated with it
  int points = 0;
  double score = 0.0;  // of the detector, in [0, 1]
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();
  double e1 = 0.0;
  double e2 = 0.0;
  double yaw = 0.0;                 // radians
  std::optional<double> residual;   // rms distance of its points to the surface; empty without points
  std::optional<double> agreement;  // mean IoU with its boxes, in [0, 1]; empty where it was not estimated
  bool hidden = false;
  std::vector<int> parts;  // ids of the objects that were merged into it

  // Empty for words, and where it is not known.
  std::optional<double> Number(ObjectColumn column) const;
};

// The rows of an edited map (Apply with HiddenObjects::kKeep, so that hidden objects can be shown again).
std::vector<ObjectRow> ObjectRows(const MapSnapshot& map, const ObjectEdits& edits = {});

// What a cell shows: three significant digits, yaw in degrees, a dash for what is not known.
std::string CellText(const ObjectRow& row, ObjectColumn column);

// Stable. Numbers by size, words without regard to case; what is not known comes last either way.
void SortRows(std::vector<ObjectRow>& rows, ObjectColumn column, bool ascending);

// Which rows a search shows. Words must all occur in id, name or label, without regard to case; comparisons
// (observations>100, seen > 100, e1<=0.3, label=cup, yaw>-45) name a column by its key or title, yaw in
// degrees; blanks around the sign are fine. An empty text shows all.
class RowFilter {
 public:
  RowFilter() = default;
  explicit RowFilter(const std::string& text);

  bool Shows(const ObjectRow& row) const;

  // What of the text is no column or number, for a hint beside the field; empty where all is understood.
  // Such a part shows no row.
  const std::string& Problem() const { return problem_; }

 private:
  struct Term {
    std::optional<ObjectColumn> column;  // empty: a word
    std::string comparison;              // < <= > >= = !=
    std::string word;                    // lower case
    std::optional<double> number;
  };

  static bool Holds(const Term& term, const ObjectRow& row);
  void AddComparison(const std::string& part, std::size_t at);

  std::vector<Term> terms_;
  std::string problem_;
};

}  // namespace sqslam::viewer
