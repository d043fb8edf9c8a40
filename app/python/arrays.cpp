#include "app/python/arrays.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "slam/util/throw_if.h"

namespace sqslam::python {
namespace {

// Returns an array with a row of shape `columns` per item (empty: one number). `fill(item, row)` writes it.
template <typename Number, typename Items>
py::array_t<Number> Rows(const Items& items, std::vector<py::ssize_t> columns, const auto& fill) {
  columns.insert(columns.begin(), static_cast<py::ssize_t>(items.size()));
  py::array_t<Number> array(columns);
  const std::size_t step = items.empty() ? 0 : static_cast<std::size_t>(array.size()) / items.size();
  Number* numbers = array.mutable_data();
  for (const auto& item : items) {
    fill(item, numbers);
    numbers += step;
  }
  return array;
}

}  // namespace

py::array_t<float> PointPositions(const MapSnapshot& map) {
  return Rows<float>(map.points, {3},
                     [](const SnapshotPoint& point, float* row) { std::ranges::copy(point.p_map, row); });
}

py::array_t<std::uint8_t> PointColors(const MapSnapshot& map) {
  return Rows<std::uint8_t>(map.points, {3}, [](const SnapshotPoint& point, std::uint8_t* row) {
    std::ranges::copy(point.rgb, row);
  });
}

py::array_t<std::int32_t> PointObjects(const MapSnapshot& map) {
  return Rows<std::int32_t>(map.points, {},
                            [](const SnapshotPoint& point, std::int32_t* id) { *id = point.object_id; });
}

py::array_t<double> Poses(const Trajectory& trajectory) {
  return Rows<double>(trajectory, {4, 4}, [](const TimedPose& pose, double* matrix) {
    const Eigen::Matrix4d by_columns = pose.T_map_camera.Matrix().transpose();
    std::copy_n(by_columns.data(), 16, matrix);
  });
}

py::array_t<double> Times(const Trajectory& trajectory) {
  return Rows<double>(trajectory, {}, [](const TimedPose& pose, double* time) { *time = pose.timestamp; });
}

py::array_t<std::uint8_t> Image(const cv::Mat& image) {
  const int channels = image.channels();
  py::array_t<std::uint8_t> array({image.rows, image.cols, channels});
  cv::Mat target(image.size(), image.type(), array.mutable_data());
  cv::cvtColor(image, target, channels == 4 ? cv::COLOR_BGRA2RGBA : cv::COLOR_BGR2RGB);
  return array;
}

std::vector<Eigen::Vector3d> Points(
    const py::array_t<double, py::array::c_style | py::array::forcecast>& array) {
  ThrowIf<UsageError>(array.ndim() != 2 || array.shape(1) != 3,
                      "points: an array of {} dimensions, expected N x 3", array.ndim());
  std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(array.shape(0)));
  std::copy_n(array.data(), array.size(),
              reinterpret_cast<double*>(points.data()));  // NOLINT: 3 doubles each
  return points;
}

}  // namespace sqslam::python
