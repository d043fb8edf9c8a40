#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace sqslam {

// Traits of a class in configs/classes.yaml that its use depends on: how things stand on it, by which words
// people call it, and how it behaves in a simulator. Its priors on size and shape are in
// slam/objects/class_priors.h.
struct ClassTraits {
  std::vector<std::string> synonyms = {};  // other words for it, in lower case with underscores
  bool hollow = false;                     // things may stand within its hull
  bool floor = false;                      // stands on the floor, not on furniture
  bool back = false;                       // a seat with a back: things stand on the seat, within the hull
  bool legs = false;                       // a top on legs: things stand under it, within the hull
  bool holds = false;                      // a container: things stand in it
  double mass = 0.0;                       // of one of typical size, kg; 0: unknown
  double volume = 0.0;                     // of the box of typical size, cubic metres; 0: unknown
  double friction = 0.6;                   // sliding friction coefficient
};

// The traits of all classes.
class ClassTraitsTable {
 public:
  ClassTraitsTable() = default;  // knows no class

  // Reads configs/classes.yaml or a file like it. Throws InputError that names it.
  static ClassTraitsTable Read(const std::filesystem::path& path);
  // Reads the bundled file.
  static ClassTraitsTable Bundled();

  const ClassTraits& Of(const std::string& label) const;  // default traits for an unknown label
  const std::map<std::string, ClassTraits>& All() const { return by_label_; }

 private:
  std::map<std::string, ClassTraits> by_label_;
  ClassTraits unknown_;
};

}  // namespace sqslam
