#include "render/studio_light.h"

#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace sqslam {
namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 32;

double Smooth(double low, double high, double value) {
  const double t = std::clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// Radiance from a direction given by its share of up, front and right.
Eigen::Vector3d Radiance(const Eigen::Vector3d& direction, const Eigen::Vector3d& lamp) {
  const double height = direction.z();
  const Eigen::Vector3d floor(0.50, 0.49, 0.48);
  const Eigen::Vector3d wall(0.66, 0.67, 0.69);
  const Eigen::Vector3d ceiling(0.86, 0.87, 0.885);
  Eigen::Vector3d color = height < 0.0 ? Eigen::Vector3d(wall + Smooth(0.0, -0.5, height) * (floor - wall))
                                       : Eigen::Vector3d(wall + Smooth(0.0, 0.8, height) * (ceiling - wall));
  const double toward_lamp = direction.dot(lamp);
  color += 2.2 * Smooth(0.80, 0.97, toward_lamp) * Eigen::Vector3d(1.0, 0.985, 0.96);
  // A long window opposite the lamp draws the far edges.
  const Eigen::Vector3d window = Eigen::Vector3d(-lamp.x(), -0.3 * lamp.y(), 0.25).normalized();
  color += 0.35 * Smooth(0.86, 0.96, direction.dot(window)) * Eigen::Vector3d(0.95, 0.98, 1.0);
  return color;
}

}  // namespace

Eigen::Vector3d Studio::Lamp() const { return (1.5 * up - 0.75 * Right() + 0.55 * front).normalized(); }

vtkSmartPointer<vtkTexture> StudioRoom(const Studio& studio) {
  const auto in_room = [&studio](const Eigen::Vector3d& d) {
    return Eigen::Vector3d(d.dot(studio.Right()), d.dot(studio.front), d.dot(studio.up));
  };
  const Eigen::Vector3d lamp = in_room(studio.Lamp());
  const vtkNew<vtkFloatArray> values;
  values->SetNumberOfComponents(3);
  values->SetNumberOfTuples(kWidth * kHeight);
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const double elevation = std::numbers::pi * ((row + 0.5) / kHeight - 0.5);
      const double heading = 2.0 * std::numbers::pi * ((column + 0.5) / kWidth - 0.5);
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(heading),
                                      std::cos(elevation) * std::sin(heading), std::sin(elevation));
      const Eigen::Vector3f color = Radiance(direction, lamp).cast<float>();
      values->SetTypedTuple(row * kWidth + column, color.data());
    }
  }
  const vtkNew<vtkImageData> image;
  image->SetDimensions(kWidth, kHeight, 1);
  image->GetPointData()->SetScalars(values);
  const auto texture = vtkSmartPointer<vtkTexture>::New();
  texture->SetInputData(image);
  texture->SetColorModeToDirectScalars();
  texture->MipmapOn();
  texture->InterpolateOn();
  return texture;
}

}  // namespace sqslam
