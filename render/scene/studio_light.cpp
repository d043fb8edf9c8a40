#include "render/scene/studio_light.h"

#include <fmt/format.h>

#include <algorithm>

namespace sqslam {
namespace {

const Eigen::Vector3d kFloor(0.36, 0.352, 0.344);
const Eigen::Vector3d kWall(0.48, 0.487, 0.50);
const Eigen::Vector3d kCeiling(0.62, 0.626, 0.636);
const Eigen::Vector3d kLamp(3.5, 3.45, 3.36);
const Eigen::Vector3d kWindow(0.70, 0.72, 0.74);
constexpr double kLampRim[2] = {0.82, 0.97};  // cosines at the lamp's edge and where it is fully bright
constexpr double kWindowRim[2] = {0.80, 0.96};

double Smooth(double low, double high, double value) {
  const double t = std::clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

Eigen::Vector3d Room(double up) {
  return up < 0.0 ? Eigen::Vector3d(kWall + Smooth(0.0, -0.5, up) * (kFloor - kWall))
                  : Eigen::Vector3d(kWall + Smooth(0.0, 0.8, up) * (kCeiling - kWall));
}
Eigen::Vector3d Lamp(double cosine) { return Smooth(kLampRim[0], kLampRim[1], cosine) * kLamp; }
Eigen::Vector3d Window(double cosine) { return Smooth(kWindowRim[0], kWindowRim[1], cosine) * kWindow; }

// Irradiance / pi from light that is symmetric about an axis: c0 + c1 x + c2 x^2, x the cosine between normal
// and axis.
struct Zonal {
  Eigen::Vector3d c0, c1, c2;
  Eigen::Vector3d operator()(double x) const { return c0 + x * c1 + x * x * c2; }
};

Zonal Convolve(const auto& light) {
  constexpr int kSteps = 4000;
  Eigen::Vector3d f0 = Eigen::Vector3d::Zero();
  Eigen::Vector3d f1 = f0;
  Eigen::Vector3d f2 = f0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = 2.0 * (i + 0.5) / kSteps - 1.0;
    const Eigen::Vector3d value = light(t) * (2.0 / kSteps);
    f0 += 0.5 * value;
    f1 += 1.5 * t * value;
    f2 += 2.5 * (1.5 * t * t - 0.5) * value;
  }
  // The cosine lobe's factors are 1, 2/3 and 1/4; the second harmonic is (3 x^2 - 1) / 2.
  return {f0 - 0.125 * f2, 2.0 / 3.0 * f1, 0.375 * f2};
}

struct Studied {
  Zonal room = Convolve(Room);
  Zonal lamp = Convolve(Lamp);
  Zonal window = Convolve(Window);

  static const Studied& Once() {
    static const Studied studied;
    return studied;
  }
};

std::string Vec3(const Eigen::Vector3d& v) {
  return fmt::format("vec3({:.5f}, {:.5f}, {:.5f})", v[0], v[1], v[2]);
}

}  // namespace

Eigen::Vector3d Studio::Lamp() const { return (1.5 * up - 0.75 * Right() + 0.55 * front).normalized(); }
Eigen::Vector3d Studio::Window() const { return (0.25 * up + Right() - 0.2 * front).normalized(); }

Eigen::Vector3d StudioRadiance(double up, double lamp, double window) {
  return Room(up) + Lamp(lamp) + Window(window);
}

Eigen::Vector3d StudioIrradiance(double up, double lamp, double window) {
  const Studied& s = Studied::Once();
  return s.room(up) + s.lamp(lamp) + s.window(window);
}

std::string StudioShader() {
  const Studied& s = Studied::Once();
  return fmt::format(
      R"(
vec3 studioIrradiance(vec3 c) {{
  return {} + c.x * ({} + c.x * {}) + c.y * ({} + c.y * {}) + c.z * ({} + c.z * {});
}}
// The rims of lamp and window grow wider, and what they send weaker, as the surface gets rougher.
vec3 studioReflection(vec3 c, float roughness) {{
  float blur = roughness * roughness;
  vec3 room = mix({}, {}, smoothstep(-0.5 - blur, 0.8 + blur, c.x));
  float lamp = smoothstep({:.3f} - 0.9 * blur, {:.3f} + 0.1 * blur, c.y) / (1.0 + 9.0 * blur);
  float window = smoothstep({:.3f} - 0.9 * blur, {:.3f} + 0.1 * blur, c.z) / (1.0 + 5.0 * blur);
  return room + lamp * {} + window * {};
}}
)",
      Vec3(s.room.c0 + s.lamp.c0 + s.window.c0), Vec3(s.room.c1), Vec3(s.room.c2), Vec3(s.lamp.c1),
      Vec3(s.lamp.c2), Vec3(s.window.c1), Vec3(s.window.c2), Vec3(kFloor), Vec3(kCeiling), kLampRim[0],
      kLampRim[1], kWindowRim[0], kWindowRim[1], Vec3(kLamp), Vec3(kWindow));
}

}  // namespace sqslam
