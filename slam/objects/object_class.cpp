#include "slam/objects/object_class.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// One entry of the file, bound like any other options.
struct ClassEntry {
  ObjectClass known;  // takes over the rest as it is
  TypicalSize typical;
  double box = 0.0;  // relative weights of the shapes
  double cylinder = 0.0;
  double ellipsoid = 0.0;

  void VisitFields(auto&& visit) {
    typical.VisitFields(visit);
    visit("box", box, 0.0, 1.0);
    visit("cylinder", cylinder, 0.0, 1.0);
    visit("ellipsoid", ellipsoid, 0.0, 1.0);
    visit("hollow", known.hollow);
    visit("floor", known.on_floor);
    visit("back", known.back);
    visit("legs", known.legs);
    visit("holds", known.holds);
    visit("mass", known.mass, 0.0, 1e6);
    visit("friction", known.friction, 0.0, 10.0);
    visit("synonyms", known.synonyms);
  }
};

ObjectClass ClassOf(const ClassEntry& entry) {
  constexpr double kMinShare = 0.02;  // no shape is impossible
  ObjectClass known = entry.known;
  static_cast<SizePrior&>(known) = entry.typical.Prior();
  known.volume = entry.typical.size[0] * entry.typical.size[1] * entry.typical.size[2];
  known.shapes = {entry.box, entry.cylinder, entry.ellipsoid};
  double sum = 0.0;
  for (double& share : known.shapes) {
    share = std::max(share, kMinShare);
    sum += share;
  }
  for (double& share : known.shapes) {
    share /= sum;
  }
  return known;
}

}  // namespace

ObjectClass BackOf(const ObjectClass& seat) {
  constexpr double kDepthSigma = 0.5;        // of the logarithm
  const double log_thinner = std::log(5.0);  // than the seat is deep
  ObjectClass back = seat;
  back.log_width_ratio += log_thinner;
  back.width_sigma = kDepthSigma;
  back.log_height_ratio += 0.5 * log_thinner;
  back.height_sigma = std::hypot(seat.height_sigma, 0.5 * kDepthSigma);
  if (back.log_metres) {
    *back.log_metres -= log_thinner / 3.0;
  }
  back.size_sigma = std::hypot(seat.size_sigma, kDepthSigma / 3.0);
  return back;
}

ClassTable ClassTable::Named(const std::string& name) {
  ClassTable table;
  if (name == "off") {
    return table;
  }
  const std::string path = name == "default" ? DataPath("configs/classes.yaml").string() : name;
  YAML::Node file;
  try {
    file = YAML::LoadFile(path);
  } catch (const YAML::Exception& e) {
    throw InputError("{}: {}, expected labels with their priors", path, e.what());
  }
  ThrowIf<InputError>(!file.IsMap(), "{}: expected labels with their priors", path);
  for (const auto& node : file) {
    const std::string label = node.first.Scalar();
    ClassEntry entry;
    AssignOptions(node.second, path, OptionFields(entry), {"parts"});
    ThrowIf<InputError>(*std::ranges::min_element(entry.typical.size) <= 0.0,
                        "{}:{}: {} has no size, expected size: [width, depth, height] in metres", path,
                        node.first.Mark().line + 1, label);
    if (const YAML::Node parts = node.second["parts"]) {
      entry.known.parts = ReadPartTemplates(parts, path, label);
    }
    table.by_label_[label] = ClassOf(entry);
  }
  return table;
}

const ObjectClass& ClassTable::Of(const std::string& label) const {
  const auto it = by_label_.find(label);
  return it == by_label_.end() ? unknown_ : it->second;
}

}  // namespace sqslam
