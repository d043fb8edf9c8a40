#include "render/scene/class_colors.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <utility>

#include "render/scene/style.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

// The classes of configs/classes.yaml. The twelve that most often stand together on and around a desk (chair,
// table, tv, monitor, laptop, keyboard, mouse, cup, bottle, vase, bowl, book) differ by at least 12 in
// CIEDE2000 for dichromats (Machado, Oliveira and Fernandes 2009), by at least 20 for all others, and by 3 in
// lightness L* for prints in grey; any two classes of a room differ by 5 for everybody.
constexpr std::array<std::pair<const char*, const char*>, 107> kColors = {{
    {"chair", "#2d5ad2"},
    {"couch", "#f096d2"},
    {"sofa", "#1e7878"},
    {"armchair", "#785a96"},
    {"stool", "#e15a69"},
    {"bench", "#693c1e"},
    {"bed", "#ffb4c3"},
    {"dining_table", "#e1c387"},
    {"table", "#a57800"},
    {"coffee_table", "#780096"},
    {"desk", "#5a693c"},
    {"tv_stand", "#96d23c"},
    {"cabinet", "#78b496"},
    {"bookshelf", "#b478a5"},
    {"bookcase", "#87784b"},
    {"shelf", "#964b5a"},
    {"wardrobe", "#87a54b"},
    {"nightstand", "#d296ff"},
    {"dresser", "#c30f78"},
    {"ottoman", "#0f78d2"},
    {"pouf", "#78c3e1"},
    {"cushion", "#a55a00"},
    {"pillow", "#871e4b"},
    {"lamp", "#7896d2"},
    {"tv", "#692d69"},
    {"monitor", "#005a4b"},
    {"laptop", "#2d96a5"},
    {"keyboard", "#c3c3ff"},
    {"mouse", "#e18778"},
    {"remote", "#782d3c"},
    {"cell_phone", "#ff4bc3"},
    {"microwave", "#d2002d"},
    {"oven", "#0fb478"},
    {"toaster", "#69b4ff"},
    {"refrigerator", "#78d25a"},
    {"sink", "#4b4b87"},
    {"toilet", "#4b783c"},
    {"clock", "#c36996"},
    {"hair_drier", "#87963c"},
    {"parking_meter", "#ffa5d2"},
    {"fire_hydrant", "#a52d69"},
    {"traffic_light", "#a52db4"},
    {"stop_sign", "#96875a"},
    {"bottle", "#a5b400"},
    {"wine_glass", "#a56987"},
    {"cup", "#e10f69"},
    {"mug", "#7869e1"},
    {"can", "#0f784b"},
    {"jar", "#ffb469"},
    {"bowl", "#00d2b4"},
    {"plate", "#d296c3"},
    {"pot", "#b43c3c"},
    {"fork", "#693ca5"},
    {"knife", "#a596e1"},
    {"spoon", "#e16987"},
    {"scissors", "#78873c"},
    {"vase", "#c369ff"},
    {"cereal_box", "#a5962d"},
    {"box", "#a5d2a5"},
    {"potted_plant", "#7869a5"},
    {"apple", "#5a87c3"},
    {"orange", "#874b87"},
    {"banana", "#69a55a"},
    {"broccoli", "#871e2d"},
    {"carrot", "#4b692d"},
    {"sandwich", "#d2b487"},
    {"hot_dog", "#ff96b4"},
    {"pizza", "#960000"},
    {"donut", "#87690f"},
    {"cake", "#962d5a"},
    {"book", "#963c0f"},
    {"backpack", "#78964b"},
    {"handbag", "#96001e"},
    {"suitcase", "#d278b4"},
    {"umbrella", "#87c396"},
    {"tie", "#d2a569"},
    {"teddy_bear", "#2d8769"},
    {"sports_ball", "#a54b87"},
    {"frisbee", "#5a78b4"},
    {"baseball_bat", "#3c3c87"},
    {"baseball_glove", "#b496d2"},
    {"tennis_racket", "#5ab4a5"},
    {"skateboard", "#ff3c96"},
    {"snowboard", "#d26978"},
    {"surfboard", "#695aa5"},
    {"skis", "#006969"},
    {"kite", "#783c3c"},
    {"toothbrush", "#b44b3c"},
    {"bicycle", "#b42d96"},
    {"motorcycle", "#e196a5"},
    {"car", "#b46978"},
    {"bus", "#5a5a2d"},
    {"truck", "#e1a5e1"},
    {"train", "#e15aa5"},
    {"airplane", "#9678d2"},
    {"boat", "#b4d296"},
    {"person", "#4b2da5"},
    {"cat", "#b45a78"},
    {"dog", "#b487c3"},
    {"bird", "#ffa578"},
    {"horse", "#ff78f0"},
    {"sheep", "#7869c3"},
    {"cow", "#873c4b"},
    {"elephant", "#87874b"},
    {"bear", "#0f6987"},
    {"zebra", "#c3a54b"},
    {"giraffe", "#965a4b"},
}};

std::string Normalised(std::string label) {
  std::ranges::transform(label, label.begin(),
                         [](unsigned char c) { return c == ' ' ? '_' : static_cast<char>(std::tolower(c)); });
  return label;
}

// FNV-1a: the same on every machine, unlike std::hash.
std::uint32_t StableHash(const std::string& text) {
  std::uint32_t hash = 2166136261u;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  }
  return hash;
}

}  // namespace

LabelColors::LabelColors(const ClassColors& own) {
  for (const auto& [label, color] : own) {
    own_[Normalised(label)] = ParseColor(color);
  }
}

Eigen::Vector3d LabelColors::operator()(const std::string& label) const {
  const std::string name = Normalised(label);
  if (const auto own = own_.find(name); own != own_.end()) {
    return own->second;
  }
  const auto known =
      std::ranges::find(kColors, name, [](const auto& entry) { return std::string(entry.first); });
  return ParseColor(known != kColors.end() ? known->second
                                           : kColors[(StableHash(name) >> 4) % kColors.size()].second);
}

}  // namespace sqslam
