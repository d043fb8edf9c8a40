#include "render/scene/color_scale.h"

#include <algorithm>
#include <array>

#include "render/scene/style.h"

namespace sqslam {

Eigen::Vector3d Viridis(double value) {
  static constexpr std::array<const char*, 9> kColors = {
      "#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"};
  const double at = std::clamp(value, 0.0, 1.0) * (kColors.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(at), kColors.size() - 2);
  const double share = at - static_cast<double>(low);
  return (1.0 - share) * ParseColor(kColors[low]) + share * ParseColor(kColors[low + 1]);
}

}  // namespace sqslam
