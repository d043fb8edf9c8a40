#include "slam/scene/class_traits.h"

#include <yaml-cpp/yaml.h>

#include "slam/util/data_path.h"
#include "slam/util/error.h"

namespace sqslam {

ClassTraitsTable ClassTraitsTable::Read(const std::filesystem::path& path) {
  ClassTraitsTable table;
  try {
    for (const auto& node : YAML::LoadFile(path.string())) {
      const YAML::Node& entry = node.second;
      ClassTraits& traits = table.by_label_[node.first.Scalar()];
      const auto read = [&entry](const char* name, auto& value) {
        if (entry[name]) {
          value = entry[name].as<std::remove_reference_t<decltype(value)>>();
        }
      };
      read("synonyms", traits.synonyms);
      read("hollow", traits.hollow);
      read("floor", traits.floor);
      read("back", traits.back);
      read("legs", traits.legs);
      read("holds", traits.holds);
      read("mass", traits.mass);
      read("friction", traits.friction);
      std::vector<double> size;
      read("size", size);
      traits.volume = size.size() == 3 ? size[0] * size[1] * size[2] : 0.0;
    }
  } catch (const YAML::Exception& e) {
    throw InputError("{}: {}, expected labels with their traits", path.string(), e.what());
  }
  return table;
}

ClassTraitsTable ClassTraitsTable::Bundled() { return Read(DataPath("configs/classes.yaml")); }

const ClassTraits& ClassTraitsTable::Of(const std::string& label) const {
  const auto it = by_label_.find(label);
  return it == by_label_.end() ? unknown_ : it->second;
}

}  // namespace sqslam
