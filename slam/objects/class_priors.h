#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/objects/part_template.h"
#include "slam/objects/shape_kind.h"

namespace sqslam {

// Prior over the shape, proportions and size of the objects of a class.
struct ClassPrior {
  std::array<double, 3> shapes = {0.5, 0.3, 0.2};  // probabilities, in the order of ShapeKind
  double log_width_ratio = 0.0;   // natural logarithm of the longer horizontal size over the shorter, >= 0
  double log_height_ratio = 0.0;  // of the height over the geometric mean of the horizontal sizes
  double width_sigma = 1.0;       // standard deviation of log_width_ratio
  double height_sigma = 1.5;
  std::optional<double> log_metres;  // logarithm of the geometric mean of the full sizes; empty: any size
  double size_sigma = 0.0;           // standard deviation of log_metres
  double handle = 0.0;               // share of those with a handle on one side
  bool hollow = false;               // lines of sight pass through its hull, as below the top of a table
  bool on_floor = false;             // stands on the lowest surface, not on furniture
  bool back = false;                 // a seat with a back, which may be all that shows over a table
  std::vector<PartTemplate> parts;   // ways in which it may consist of parts; empty: one solid
};

// Returns the prior over the back alone of a seat: as wide and high, a fifth as deep.
ClassPrior BackOf(const ClassPrior& seat);

class ClassPriors {
 public:
  ClassPriors() = default;  // knows no class

  // Reads configs/classes.yaml or a file like it. Throws InputError naming file, line and label.
  static ClassPriors Read(const std::filesystem::path& path);

  // Returns the priors named by objects.class_priors: default, off, or a file.
  static ClassPriors Named(const std::string& option);

  const ClassPrior& Of(const std::string& label) const;  // the wide default for an unknown label

 private:
  std::map<std::string, ClassPrior> by_label_;
  ClassPrior unknown_;
};

// Natural logarithm of metres per map unit.
struct MetricScale {
  double log_scale = 0.0;
  double sigma = 0.0;
};

// An object whose class has a known metric size.
struct SizedObject {
  int id = 0;
  double log_scale = 0.0;  // logarithm of the class's size in metres over the mapped size
  double sigma = 0.0;
};

// Estimates the map's scale from all objects but `id`, with Cauchy weights; empty if fewer than three remain.
std::optional<MetricScale> ScaleExcluding(std::optional<int> id, const std::vector<SizedObject>& objects);

// Mean of the logarithms of the three full sizes.
double LogSize(const Superquadric& shape);

}  // namespace sqslam
