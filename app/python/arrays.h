#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

// Copies the contents of a map into NumPy arrays, which may outlive the map.
namespace sqslam::python {
namespace py = pybind11;

py::array_t<float> PointPositions(const MapSnapshot& map);       // N x 3, map frame
py::array_t<std::uint8_t> PointColors(const MapSnapshot& map);   // N x 3, red green blue
py::array_t<std::int32_t> PointObjects(const MapSnapshot& map);  // N, -1 for none

py::array_t<double> Poses(const Trajectory& trajectory);  // N x 4 x 4, T_map_camera
py::array_t<double> Times(const Trajectory& trajectory);  // N, seconds

// Converts an image (8UC3 BGR or 8UC4 BGRA) to H x W x 3 RGB or H x W x 4 RGBA.
py::array_t<std::uint8_t> Image(const cv::Mat& image);

// Reads points from an N x 3 array of any number type. Throws UsageError on any other shape.
std::vector<Eigen::Vector3d> Points(
    const py::array_t<double, py::array::c_style | py::array::forcecast>& array);

}  // namespace sqslam::python
