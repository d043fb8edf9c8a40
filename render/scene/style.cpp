#include "render/scene/style.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <set>
#include <utility>

#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

// Okabe and Ito, "Color Universal Design", without black (used for text) and with yellow last (pale on
// white).
constexpr std::array<const char*, 7> kPalette = {"#0072b2", "#e69f00", "#009e73", "#cc79a7",
                                                 "#56b4e9", "#d55e00", "#f0e442"};

// FNV-1a: the same on every machine, unlike std::hash.
std::uint32_t StableHash(const std::string& text) {
  std::uint32_t hash = 2166136261u;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  }
  return hash;
}

int PreferredSlot(const std::string& label) {
  return static_cast<int>((StableHash(label) >> 4) % kPalette.size());
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
  throw UsageError("colour \"{}\": expected #rrggbb, such as #0072b2", text);
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
  LoadOptions(file, style);
  try {
    CheckStyle(style);
  } catch (const UsageError& error) {
    throw UsageError("{}: {}", file.string(), error.what());
  }
  return style;
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

LabelColors::LabelColors(std::span<const std::string> labels, std::map<std::string, Eigen::Vector3d> fixed)
    : fixed_(std::move(fixed)) {
  std::set<int> taken;
  const std::set<std::string> sorted(labels.begin(), labels.end());
  const int colors = static_cast<int>(kPalette.size());
  for (const std::string& label : sorted) {
    const int preferred = PreferredSlot(label);
    const int level = static_cast<int>(taken.size()) / colors;
    int slot = level * colors + preferred;
    for (int step = 0; taken.contains(slot); ++step) {
      slot = level * colors + (preferred + step) % colors;
    }
    taken.insert(slot);
    slots_[label] = slot;
  }
}

Eigen::Vector3d LabelColors::operator()(const std::string& label) const {
  if (const auto own = fixed_.find(label); own != fixed_.end()) {
    return own->second;
  }
  const auto found = slots_.find(label);
  const int slot = found == slots_.end() ? PreferredSlot(label) : found->second;
  const int colors = static_cast<int>(kPalette.size());
  const Eigen::Vector3d base = ParseColor(kPalette[static_cast<std::size_t>(slot % colors)]);
  // Factor and added white for further classes: darker, lighter, much darker, slightly darker.
  constexpr std::array<std::pair<double, double>, 5> kLevels = {
      {{1.0, 0.0}, {0.62, 0.0}, {0.5, 0.5}, {0.46, 0.0}, {0.82, 0.0}}};
  const auto& [share, white] = kLevels[static_cast<std::size_t>(slot / colors) % kLevels.size()];
  return share * base + Eigen::Vector3d::Constant(white);
}

}  // namespace sqslam
