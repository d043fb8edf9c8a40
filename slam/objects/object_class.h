#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "slam/geometry/solid_iou.h"
#include "slam/objects/part_template.h"
#include "slam/objects/size_prior.h"

namespace sqslam {

// What is known of the objects of a class: the prior over their shape, proportions and size, and the traits
// on which questions and simulators depend.
struct ObjectClass : SizePrior {
  std::array<double, 3> shapes = {0.5, 0.3, 0.2};  // probabilities, in the order of kPrimitives
  bool hollow = false;              // many lines of sight pass through its hull, as below the top of a table
  bool on_floor = false;            // stands on the lowest surface, not on furniture
  bool back = false;                // a seat with a back, which may be all that shows over a table
  std::vector<PartTemplate> parts;  // ways in which it may consist of parts; empty: one solid

  bool legs = false;                       // a top on legs: things stand under it, within the hull
  bool holds = false;                      // a container: things stand in it
  double mass = 0.0;                       // of one of typical size, kg; 0: unknown
  double volume = 0.0;                     // of the box of typical size, cubic metres; 0: unknown
  double friction = 0.6;                   // sliding friction coefficient
  std::vector<std::string> synonyms = {};  // other words for it, in lower case with underscores
};

// Returns the prior over the back alone of a seat: as wide and high, a fifth as deep.
ObjectClass BackOf(const ObjectClass& seat);

// The known classes.
class ClassTable {
 public:
  ClassTable() = default;  // knows no class

  // Reads the classes that objects.class_priors names: default (configs/classes.yaml), off, or a file like
  // it. Throws InputError naming file, line and label.
  static ClassTable Named(const std::string& name);

  const ObjectClass& Of(const std::string& label) const;  // the wide default for an unknown label
  const std::map<std::string, ObjectClass>& All() const { return by_label_; }

 private:
  std::map<std::string, ObjectClass> by_label_;
  ObjectClass unknown_;
};

}  // namespace sqslam
