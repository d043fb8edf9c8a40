#include "render/scene/style.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>

#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// Adds the labels below `objects: colors:` of a style file, so that the options know them. The values are
// read with all others.
void DeclareColors(const std::filesystem::path& file, SceneStyle& style) {
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    const YAML::Node colors = root["objects"]["colors"];
    ThrowIf<UsageError>(colors && colors.size() == 0,
                        "{}:{}: objects.colors: expected a colour for each label, such as cup: \"#0072b2\"",
                        file.string(), colors.Mark().line + 1);
    for (const auto& entry : colors) {
      style.objects.colors[entry.first.Scalar()];
    }
  } catch (const YAML::Exception&) {  // invalid, or without such a group: LoadOptions says what is wrong
  }
}

}  // namespace

std::string FormatColor(const Eigen::Vector3d& color) {
  const Eigen::Vector3i rgb = (255.0 * color).array().round().cast<int>().max(0).min(255);
  return fmt::format("#{:02x}{:02x}{:02x}", rgb.x(), rgb.y(), rgb.z());
}

Eigen::Vector3d ParseColor(std::string_view text) {
  unsigned value = 0;
  const bool shaped = text.size() == 7 && text[0] == '#';
  if (shaped) {
    const auto [end, error] = std::from_chars(text.data() + 1, text.data() + 7, value, 16);
    if (error == std::errc() && end == text.data() + 7) {
      return Eigen::Vector3d((value >> 16) & 255u, (value >> 8) & 255u, value & 255u) / 255.0;
    }
  }
  throw UsageError("colour \"{}\": expected #rrggbb, such as \"#0072b2\", in quotes in a YAML file", text);
}

void CheckStyle(const SceneStyle& style) {
  CheckOptions(style);
  SceneStyle copy = style;
  for (const OptionField& field : OptionFields(copy)) {
    if (std::string* const* color = std::get_if<std::string*>(&field.value)) {  // a style's only strings
      try {
        ParseColor(**color);
      } catch (const UsageError& error) {
        throw UsageError("{}: {}", field.key, error.what());
      }
    }
  }
}

SceneStyle LoadStyle(const std::string& name_or_file) {
  SceneStyle style;
  const std::filesystem::path file = ConfigFile("configs/styles", "style", name_or_file);
  DeclareColors(file, style);
  LoadOptions(file, style);
  try {
    CheckStyle(style);
  } catch (const UsageError& error) {
    throw UsageError("{}: {}", file.string(), error.what());
  }
  return style;
}

void SetStyle(const std::vector<std::string>& assignments, SceneStyle& style) {
  constexpr std::string_view kColors = "objects.colors.";
  for (std::string assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    const std::string key = assignment.substr(0, equals);
    if (key.starts_with(kColors) && key.size() > kColors.size() && equals != std::string::npos) {
      style.objects.colors[key.substr(kColors.size())];
    }
    if (equals != std::string::npos && assignment.substr(equals + 1).starts_with('#')) {  // else a comment
      assignment = fmt::format("{}=\"{}\"", key, assignment.substr(equals + 1));
    }
    SetOption(assignment, style);
  }
}

Eigen::Vector3d ReadableOn(const Eigen::Vector3d& background, const Eigen::Vector3d& color,
                           double min_contrast) {
  const double lightness = Lightness(color);
  if (const double paper = Lightness(background); paper >= 0.5) {
    const double most = std::max(0.0, paper - min_contrast);
    return lightness > most ? Eigen::Vector3d(color * (most / lightness)) : color;
  }
  const double least = std::min(1.0, Lightness(background) + min_contrast);
  const double mix = lightness < least ? (least - lightness) / (1.0 - lightness) : 0.0;
  return (1.0 - mix) * color + Eigen::Vector3d::Constant(mix);
}

}  // namespace sqslam
