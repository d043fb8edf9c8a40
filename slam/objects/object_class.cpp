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
  ObjectClass known;                             // takes over the rest as it is
  std::array<double, 3> size = {0.0, 0.0, 0.0};  // typical width, depth and height, metres
  double spread = 0.4;                           // standard deviation of the logarithm of the size as a whole
  std::array<double, 2> aspect = {0.3, 0.3};  // and of the logarithms of width to depth and of height to plan
  double box = 0.0;                           // relative weights of the shapes
  double cylinder = 0.0;
  double ellipsoid = 0.0;

  void VisitFields(auto&& visit) {
    visit("size", size, 1e-4, 100.0);
    visit("spread", spread, 0.01, 10.0);
    visit("aspect", aspect, 0.01, 10.0);
    visit("box", box, 0.0, 1.0);
    visit("cylinder", cylinder, 0.0, 1.0);
    visit("ellipsoid", ellipsoid, 0.0, 1.0);
    visit("handle", known.handle, 0.0, 0.99);
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
  const auto& [width, depth, height] = entry.size;
  const double log_area = std::log(width) + std::log(depth);
  known.log_width_ratio = std::abs(std::log(width / depth));
  known.log_height_ratio = std::log(height) - 0.5 * log_area;
  known.width_sigma = entry.aspect[0];
  known.height_sigma = entry.aspect[1];
  known.log_metres = (log_area + std::log(height)) / 3.0;
  known.size_sigma = entry.spread;
  known.volume = width * depth * height;
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
    ThrowIf<InputError>(*std::ranges::min_element(entry.size) <= 0.0,
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
