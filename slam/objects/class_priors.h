#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// Modes of the prior over the exponents: box, upright cylinder, ellipsoid.
enum class ShapeKind { kBox, kCylinder, kEllipsoid };
constexpr auto EnumNames(ShapeKind) { return std::array{"box", "cylinder", "ellipsoid"}; }
inline constexpr std::array kShapeKinds = {ShapeKind::kBox, ShapeKind::kCylinder, ShapeKind::kEllipsoid};

// Exponents e1, e2 in the middle of a mode.
std::array<double, 2> ExponentsOf(ShapeKind kind);
ShapeKind NearestKind(double e1, double e2);

// Prior knowledge of a class of things: the shapes, proportions and sizes to expect.
struct ClassPrior {
  std::array<double, 3> shapes = {0.5, 0.3, 0.2};  // probabilities, in the order of ShapeKind
  double log_width_ratio = 0.0;   // natural logarithm of the longer horizontal size over the shorter, >= 0
  double log_height_ratio = 0.0;  // of the height over the geometric mean of the horizontal sizes
  double width_sigma = 1.0;       // standard deviations of the two
  double height_sigma = 1.5;
  std::optional<double> log_metres;  // of the geometric mean of the three full sizes; empty: any size
  double size_sigma = 0.0;           // standard deviation of that
  bool hollow = false;               // lines of sight run through its hull: below a chair's or a table's top
};

// Sizes and shapes of things by their label.
class ClassPriors {
 public:
  ClassPriors() = default;  // knows no class

  // Reads configs/classes.yaml or a file like it. Throws InputError that names file, line and label.
  static ClassPriors Read(const std::filesystem::path& path);

  // Those that the option objects.class_priors means: default, off, or a file.
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

// An object whose class tells its size in metres.
struct SizedObject {
  int id = 0;
  double log_scale = 0.0;  // of the class's size over the mapped one
  double sigma = 0.0;
};

// The map's scale by all objects but `id`, with Cauchy weights; empty where fewer than three are left.
std::optional<MetricScale> ScaleWithout(int id, const std::vector<SizedObject>& objects);

// Mean of the logarithms of the three full sizes.
double LogSize(const Superquadric& shape);

}  // namespace sqslam
