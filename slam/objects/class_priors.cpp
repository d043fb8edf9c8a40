#include "slam/objects/class_priors.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "slam/util/data_path.h"
#include "slam/util/enum_names.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

// One entry of the file, bound like any other options.
struct ClassEntry {
  std::array<double, 3> size = {0.0, 0.0, 0.0};  // typical width, depth and height, metres
  double spread = 0.4;                           // standard deviation of the logarithm of the size as a whole
  std::array<double, 2> aspect = {0.3, 0.3};  // and of the logarithms of width to depth and of height to plan
  double box = 0.0;                           // relative weights of the shapes
  double cylinder = 0.0;
  double ellipsoid = 0.0;
  double handle = 0.0;  // share of those with a handle on one side
  bool hollow = false;  // one sees into or through the hull
  bool floor = false;   // stands on the floor
  bool back = false;    // a seat with a back
  // Traits for questions and simulators (ClassTraits, slam/scene), which no estimate uses:
  bool legs = false;
  bool holds = false;
  double mass = 0.0;
  double friction = 0.6;
  std::vector<std::string> synonyms = {};

  void VisitFields(auto&& visit) {
    visit("size", size, 1e-4, 100.0);
    visit("spread", spread, 0.01, 10.0);
    visit("aspect", aspect, 0.01, 10.0);
    visit("box", box, 0.0, 1.0);
    visit("cylinder", cylinder, 0.0, 1.0);
    visit("ellipsoid", ellipsoid, 0.0, 1.0);
    visit("handle", handle, 0.0, 0.99);
    visit("hollow", hollow);
    visit("floor", floor);
    visit("back", back);
    visit("legs", legs);
    visit("holds", holds);
    visit("mass", mass, 0.0, 1e6);
    visit("friction", friction, 0.0, 10.0);
    visit("synonyms", synonyms);
  }
};

ClassPrior ToPrior(const ClassEntry& entry) {
  constexpr double kLeastShare = 0.02;  // no shape is impossible
  ClassPrior prior;
  const auto& [width, depth, height] = entry.size;
  const double log_area = std::log(width) + std::log(depth);
  prior.log_width_ratio = std::abs(std::log(width / depth));
  prior.log_height_ratio = std::log(height) - 0.5 * log_area;
  prior.width_sigma = entry.aspect[0];
  prior.height_sigma = entry.aspect[1];
  prior.log_metres = (log_area + std::log(height)) / 3.0;
  prior.size_sigma = entry.spread;
  prior.handle = entry.handle;
  prior.hollow = entry.hollow;
  prior.on_floor = entry.floor;
  prior.back = entry.back;
  prior.shapes = {entry.box, entry.cylinder, entry.ellipsoid};
  double sum = 0.0;
  for (double& share : prior.shapes) {
    share = std::max(share, kLeastShare);
    sum += share;
  }
  for (double& share : prior.shapes) {
    share /= sum;
  }
  return prior;
}

}  // namespace

ClassPrior BackOf(const ClassPrior& seat) {
  constexpr double kDepthSigma = 0.5;        // of the logarithm
  const double log_thinner = std::log(5.0);  // than the seat is deep
  ClassPrior back = seat;
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

ClassPriors ClassPriors::Read(const std::filesystem::path& path) {
  ClassPriors priors;
  YAML::Node file;
  try {
    file = YAML::LoadFile(path.string());
  } catch (const YAML::Exception& e) {
    throw InputError("{}: {}, expected labels with their priors", path.string(), e.what());
  }
  if (!file.IsMap()) {
    throw InputError("{}: expected labels with their priors", path.string());
  }
  for (const auto& node : file) {
    ClassEntry entry;
    const std::string label = node.first.Scalar();
    YAML::Node fields = node.second;
    const YAML::Node parts = fields.IsMap() ? fields["parts"] : YAML::Node(YAML::NodeType::Undefined);
    std::vector<PartTemplate> templates;
    if (parts) {
      templates = ReadPartTemplates(parts, path.string(), label);
      fields.remove("parts");
    }
    AssignOptions(fields, path.string(), OptionFields(entry));
    if (*std::ranges::min_element(entry.size) <= 0.0) {
      throw InputError("{}:{}: {} has no size, expected size: [width, depth, height] in metres",
                       path.string(), node.first.Mark().line + 1, label);
    }
    priors.by_label_[label] = ToPrior(entry);
    priors.by_label_[label].parts = std::move(templates);
  }
  return priors;
}

ClassPriors ClassPriors::Named(const std::string& option) {
  return option == "off"
             ? ClassPriors()
             : Read(option == "default" ? DataPath("configs/classes.yaml") : std::filesystem::path(option));
}

const ClassPrior& ClassPriors::Of(const std::string& label) const {
  const auto it = by_label_.find(label);
  return it == by_label_.end() ? unknown_ : it->second;
}

std::optional<MetricScale> ScaleExcluding(std::optional<int> id, const std::vector<SizedObject>& objects) {
  constexpr int kLeast = 3;
  constexpr int kRounds = 10;
  std::vector<SizedObject> others;
  std::ranges::copy_if(objects, std::back_inserter(others), [&](const SizedObject& o) { return o.id != id; });
  if (static_cast<int>(others.size()) < kLeast) {
    return std::nullopt;
  }
  auto middle = others.begin() + static_cast<std::ptrdiff_t>(others.size() / 2);
  std::ranges::nth_element(others, middle, {}, &SizedObject::log_scale);
  MetricScale scale{middle->log_scale, 0.0};
  for (int round = 0; round < kRounds; ++round) {
    double sum = 0.0;
    double weights = 0.0;
    for (const SizedObject& other : others) {
      const double residual = (other.log_scale - scale.log_scale) / other.sigma;
      const double weight = 1.0 / (other.sigma * other.sigma * (1.0 + residual * residual));
      sum += weight * other.log_scale;
      weights += weight;
    }
    scale = {sum / weights, 1.0 / std::sqrt(weights)};
  }
  return scale;
}

double LogSize(const Superquadric& shape) { return (2.0 * shape.half_size).array().log().mean(); }

}  // namespace sqslam
