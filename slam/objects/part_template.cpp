#include "slam/objects/part_template.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// One solid of the file, bound like any other options.
struct SolidEntry {
  std::vector<std::string> x, y, z;
  std::string shape = "box";
  std::string mirror;

  void VisitFields(auto&& visit) {
    visit("x", x);
    visit("y", y);
    visit("z", z);
    visit("shape", shape, {"box", "cylinder", "ellipsoid"});
    visit("mirror", mirror, {"x", "y", "xy"});
  }
};

// One entry of the file, without its proportions and solids.
struct TemplateEntry {
  PartTemplate of;
  TypicalSize typical;

  void VisitFields(auto&& visit) {
    visit("share", of.share, 0.0, 0.99);
    visit("turns", of.turns, 1, 36);
    visit("hangs", of.hangs);
    typical.VisitFields(visit);
  }
};

class TemplateReader {
 public:
  TemplateReader(const std::string& source, const std::string& label) : source_(source), label_(label) {}

  PartTemplate Read(const YAML::Node& node) {
    TemplateEntry entry;
    AssignOptions(node, source_, OptionFields(entry), {"free", "solids"});
    template_ = std::move(entry.of);
    if (node["size"]) {
      Check(entry.typical.size[0] >= entry.typical.size[1], node, "a size whose longer side is along x");
      template_.size = entry.typical.Prior();
    }
    for (const auto& free : node["free"]) {
      AddProportion(free.first.Scalar(), free.second);
    }
    Check(template_.free.size() <= kMaxProportions, node, "at most four free proportions");
    Check(node["solids"] && node["solids"].IsSequence() && node["solids"].size() > 0, node,
          "a list 'solids' of parts");
    for (const YAML::Node& solid : node["solids"]) {
      AddPart(solid);
    }
    Check(template_.parts.size() <= kMaxParts, node, "at most eight parts with their mirror images");
    return std::move(template_);
  }

 private:
  void Check(bool valid, const YAML::Node& at, const std::string& expected) const {
    ThrowIf<InputError>(!valid, "{}:{}: parts of {}: expected {}", source_, at.Mark().line + 1, label_,
                        expected);
  }

  void AddProportion(const std::string& name, const YAML::Node& node) {
    constexpr double kMinSigma = 1e-3;
    std::array<double, 2> mean_and_sigma{};
    AssignOption(node, {name, std::span<double>(mean_and_sigma), 0.0, 1.0},
                 fmt::format("{}:{}", source_, node.Mark().line + 1));
    Check(mean_and_sigma[1] >= kMinSigma, node,
          fmt::format("a standard deviation of at least {}", kMinSigma));
    template_.free.push_back({name, mean_and_sigma[0], mean_and_sigma[1]});
  }

  // Adds numbers, names of proportions, and products of both, such as `1 - 2*leg`.
  PartCoordinate ReadCoordinate(const std::string& text, const YAML::Node& node) const {
    PartCoordinate sum;
    std::size_t at = 0;
    while (at < text.size()) {
      const auto end = std::min(text.find_first_of("+-", at + 1), text.size());
      std::string term = text.substr(at, end - at);
      std::erase_if(term, [](unsigned char c) { return std::isspace(c) != 0; });
      const double sign = term.starts_with('-') ? -1.0 : 1.0;
      term.erase(0, term.starts_with('-') || term.starts_with('+') ? 1 : 0);
      const auto star = term.find('*');
      const std::string name = star == std::string::npos ? term : term.substr(star + 1);
      const auto free = std::ranges::find(template_.free, name, &FreeProportion::name);
      const auto factor = ParseNumber<double>(star == std::string::npos ? term : term.substr(0, star));
      if (free != template_.free.end()) {
        Check(star == std::string::npos || factor, node, "a number before '*'");
        sum.slopes[static_cast<std::size_t>(free - template_.free.begin())] += sign * factor.value_or(1.0);
      } else {
        Check(star == std::string::npos && factor, node,
              fmt::format("a sum of numbers and free proportions, not '{}'", term));
        sum.constant += sign * *factor;
      }
      at = end;
    }
    Check(!text.empty(), node, "a sum of numbers and free proportions");
    return sum;
  }

  void AddPart(const YAML::Node& node) {
    SolidEntry entry;
    AssignOptions(node, source_, OptionFields(entry));
    TemplatePart part;
    std::size_t axis = 0;
    for (const std::vector<std::string>* range : {&entry.x, &entry.y, &entry.z}) {
      Check(range->size() == 2, node, "x, y and z: [low, high]");
      part.range[axis] = {ReadCoordinate(range->front(), node), ReadCoordinate(range->back(), node)};
      CheckAtMean(part.range[axis++], node);
    }
    part.shape = entry.shape == "box"        ? SolidKind::kCuboid
                 : entry.shape == "cylinder" ? SolidKind::kCylinder
                                             : SolidKind::kEllipsoid;
    const std::size_t first = template_.parts.size();
    template_.parts.push_back(part);
    for (const char across : entry.mirror) {
      for (std::size_t i = first, count = template_.parts.size(); i < count; ++i) {
        template_.parts.push_back(Mirrored(template_.parts[i], static_cast<std::size_t>(across - 'x')));
      }
    }
  }

  // The typical part has an extent and lies in the box of a hull that is as wide as deep.
  void CheckAtMean(const std::array<PartCoordinate, 2>& range, const YAML::Node& node) const {
    Proportions means{};
    std::ranges::transform(template_.free, means.begin(), &FreeProportion::mean);
    const std::array<double, 2> at = {CoordinateAt(range[0], means, 1.0, 1.0),
                                      CoordinateAt(range[1], means, 1.0, 1.0)};
    constexpr double kRounding = 1e-9;
    Check(at[0] < at[1] && at[0] >= -1.0 - kRounding && at[1] <= 1.0 + kRounding, node,
          fmt::format("low < high between -1 and 1, not {:.3g} to {:.3g} at the means", at[0], at[1]));
  }

  static TemplatePart Mirrored(TemplatePart part, std::size_t axis) {
    std::swap(part.range[axis][0], part.range[axis][1]);
    for (PartCoordinate& coordinate : part.range[axis]) {
      coordinate.constant *= -1.0;
      std::ranges::for_each(coordinate.slopes, [](double& slope) { slope *= -1.0; });
    }
    return part;
  }

  const std::string& source_;
  const std::string& label_;
  PartTemplate template_;  // so far
};

}  // namespace

std::vector<PartTemplate> ReadPartTemplates(const YAML::Node& node, const std::string& source,
                                            const std::string& label) {
  ThrowIf<InputError>(!node.IsSequence(),
                      "{}:{}: parts of {}: expected a list of entries with free and solids", source,
                      node.Mark().line + 1, label);
  std::vector<PartTemplate> templates;
  TemplateReader reader(source, label);
  for (const YAML::Node& entry : node) {
    templates.push_back(reader.Read(entry));
  }
  for (const SolidKind kind : kPrimitives) {
    double share = 0.0;
    for (const PartTemplate& of : templates) {
      share += of.parts.front().shape == kind ? of.share : 0.0;
    }
    ThrowIf<InputError>(share > 1.0, "{}:{}: parts of {}: expected shares whose sum is at most 1, not {:.3g}",
                        source, node.Mark().line + 1, label, share);
  }
  return templates;
}

std::vector<SolidPart> PartsWith(const PartTemplate& of, const Proportions& proportions,
                                 const Eigen::Vector3d& half_size, int turn) {
  constexpr double kMinHalfSize = 1e-3;  // of the hull's
  const bool across = turn % 2 != 0;     // x of the template lies along y of the hull
  const Eigen::Vector3d own(half_size[across ? 1 : 0], half_size[across ? 0 : 1], half_size.z());
  const double narrow = half_size.head<2>().minCoeff();
  const Eigen::Vector3d unit = Eigen::Vector3d(narrow, narrow, half_size.z()).cwiseQuotient(own);
  std::vector<SolidPart> parts;
  for (const TemplatePart& part : of.parts) {
    Eigen::Vector3d centre, half;
    for (int axis = 0; axis < 3; ++axis) {
      std::array<double, 2> end{};
      for (std::size_t i = 0; i < 2; ++i) {
        const PartCoordinate& at = part.range[static_cast<std::size_t>(axis)][i];
        end[i] = std::clamp(CoordinateAt(at, proportions, 1.0, unit[axis]), -1.0, 1.0);
      }
      centre[axis] = 0.5 * (end[0] + end[1]);
      half[axis] = std::max(0.5 * (end[1] - end[0]), kMinHalfSize);
    }
    for (int quarter = 0; quarter < turn; ++quarter) {
      centre = {-centre.y(), centre.x(), centre.z()};
    }
    if (across) {
      std::swap(half.x(), half.y());
    }
    const auto [e1, e2] = UsualExponents(part.shape);
    parts.push_back({centre, {half, e1, e2}});
  }
  return parts;
}

}  // namespace sqslam
