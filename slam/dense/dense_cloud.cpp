#include "slam/dense/dense_cloud.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/map_scale.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is written in the machine's byte order");

// Returns a tangent of the surface: between the pixels at (dx, dy) before and after this one, or from it to
// the one that shows the same surface; zero if neither does.
Eigen::Vector3d Tangent(const DepthMap& map, int x, int y, int dx, int dy) {
  constexpr double kMaxSlope = 5.0;  // tangent; beyond is another surface
  const double z = map.depth.at<float>(y, x);
  const double step = kMaxSlope * std::max(dx, dy) / map.camera.fx * z;
  const auto shows = [&](int u, int v) {
    return u >= 0 && v >= 0 && u < map.depth.cols && v < map.depth.rows && map.depth.at<float>(v, u) > 0.0F &&
           std::abs(map.depth.at<float>(v, u) - z) <= step;
  };
  const bool before = shows(x - dx, y - dy);
  const bool after = shows(x + dx, y + dy);
  if (!before && !after) {
    return Eigen::Vector3d::Zero();
  }
  return map.PointAt(after ? x + dx : x, after ? y + dy : y) -
         map.PointAt(before ? x - dx : x, before ? y - dy : y);
}

std::uint8_t Rounded(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

std::string HeaderOf(std::size_t points, double metres_per_unit) {
  const std::string unit = UnitComment(metres_per_unit);
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment map frame, z up; views {}: filled by a plane\n{}"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar views\nproperty float "
      "sigma\nend_header\n",
      kFilledByPlane, unit.empty() ? "" : fmt::format("comment metres, {}\n", unit), points);
}

constexpr double kSheetCubes = 4.0;  // edge of the cubes that a sheet is averaged over, in cubes of the cloud

// Mean plane of the points in a cube with normals towards one side: weighted sums.
struct Sheet {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double weight = 0.0;

  void Add(const Sheet& other) {
    position += other.position;
    normal += other.normal;
    weight += other.weight;
  }
};

// Sheets by cube. The last number of a key is the dominant axis of the normals with its sign.
using SheetTable = VoxelTable<4, Sheet>;

// Returns the dominant axis of a normal with its sign.
std::int32_t SideOf(const Eigen::Vector3d& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<std::int32_t>(2 * axis + (normal[axis] > 0.0 ? 1 : 0));
}

SheetTable::Key SheetKey(const Eigen::Array3d& place, std::int32_t side) {
  const auto [x, y, z] = CubeAt(place);
  return {x, y, z, side};
}

struct OrientedPoint {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of length one
};

// Mean of some sheets.
struct MeanSheet {
  double offset = 0.0;  // from a point along its normal
  double weight = 0.0;  // 0: there are none
};

// Averages the sheets in the eight cubes around a point that have its side and face as it does.
MeanSheet SheetsAround(const SheetTable& sheets, double edge, const OrientedPoint& point) {
  constexpr double kMinCosine = 0.8;  // between normals of one surface
  const Eigen::Array3d cube = point.p_map.array() / edge - 0.5;
  const Eigen::Array3d first = cube.floor();
  MeanSheet around;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Eigen::Array3d step(corner & 1U, corner >> 1U & 1U, corner >> 2U);
    const Sheet* sheet = sheets.Find(SheetKey(first + step, SideOf(point.normal)));
    if (sheet == nullptr) {
      continue;
    }
    const Eigen::Vector3d plane = sheet->normal.normalized();
    const double distance = plane.dot(sheet->position / sheet->weight - point.p_map);
    const double cosine = plane.dot(point.normal);
    if (cosine > kMinCosine && std::abs(distance) < 0.5 * edge) {
      const double weight = (1.0 - (cube - first - step).abs()).prod() * sheet->weight;
      around.offset += weight * distance / cosine;
      around.weight += weight;
    }
  }
  around.offset /= std::max(around.weight, std::numeric_limits<double>::min());
  return around;
}

// Returns true if a surface with far more evidence than the point's own sheet lies so near that the point
// shows this surface, badly. Its normal may be off, too.
bool IsStray(const SheetTable& sheets, double edge, const OrientedPoint& point, const MeanSheet& own) {
  constexpr double kMinEvidenceRatio = 16.0;
  constexpr double kMinCosine = 0.5;  // between the normals
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = (point.normal[axis] > 0.0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(axis);
    for (const double step : {-1.0, 0.0, 1.0}) {
      const Sheet* sheet =
          sheets.Find(SheetKey(point.p_map.array() / edge + step * normal.array(), SideOf(normal)));
      if (sheet != nullptr && sheet->weight > kMinEvidenceRatio * own.weight &&
          sheet->normal.dot(point.normal) > kMinCosine * sheet->normal.norm()) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

Eigen::Vector3d NormalAt(const DepthMap& map, int x, int y) {
  constexpr int kReach = 2;  // pixels: depth noise matters less than between adjacent pixels
  const Eigen::Vector3d normal = Tangent(map, x, y, kReach, 0).cross(Tangent(map, x, y, 0, kReach));
  const double length = normal.norm();
  if (!(length > 0.0)) {
    return Eigen::Vector3d::Zero();
  }
  const bool towards = normal.dot(map.T_map_camera.translation - map.PointAt(x, y)) > 0.0;
  return normal / (towards ? length : -length);
}

void CloudFusion::Cell::Add(const Cell& other) {
  if (filled && !other.filled) {
    *this = other;
  } else if (filled == other.filled) {
    position += other.position;
    normal += other.normal;
    rgb += other.rgb;
    weight += other.weight;
    points += other.points;
    views = std::max(views, other.views);
  }
}

void CloudFusion::Add(const DepthMap& map) {
  constexpr int kParts = 16;  // of the rows
  grid_.Add(kParts, threads_, [&](std::size_t part, const auto& put) {
    const int first = map.depth.rows * static_cast<int>(part) / kParts;
    const int end = map.depth.rows * (static_cast<int>(part) + 1) / kParts;
    for (int y = first; y < end; ++y) {
      for (int x = 0; x < map.depth.cols; ++x) {
        const double z = map.depth.at<float>(y, x);
        if (!(z > 0.0)) {
          continue;
        }
        const Eigen::Vector3d p_map = map.PointAt(x, y);
        const std::uint8_t views = map.views.at<std::uint8_t>(y, x);
        const double sigma = z * map.SigmaAt(x, y);
        const double weight = 1.0 / (sigma * sigma);
        const cv::Vec3b& bgr = map.bgr.at<cv::Vec3b>(y, x);
        put(CubeAt(p_map.array() / spacing_),
            {weight * p_map, weight * NormalAt(map, x, y), weight * Eigen::Vector3d(bgr[2], bgr[1], bgr[0]),
             weight, 1, views, views == kFilledByPlane});
      }
    }
  });
}

CloudFusion::Grid CloudFusion::Flattened() const {
  const double edge = kSheetCubes * spacing_;
  SheetTable sheets;
  sheets.Add(Grid::kShards, threads_, [&](std::size_t shard, const auto& put) {
    for (const Cell& cell : grid_.Values(shard)) {
      if (const double length = cell.normal.norm(); length > 0.0) {
        put(SheetKey(cell.Mean().array() / edge, SideOf(cell.normal)),
            {cell.position, cell.weight / length * cell.normal, cell.weight});
      }
    }
  });
  constexpr int kConfirmedViews = 5;  // depth maps that prove a point not to be a stray
  Grid flat;
  constexpr std::size_t kShardsAtOnce = 4;  // copies of all cells would take a lot of memory
  for (std::size_t first = 0; first < Grid::kShards; first += kShardsAtOnce) {
    flat.Add(kShardsAtOnce, threads_, [&](std::size_t part, const auto& put) {
      for (Cell cell : grid_.Values(first + part)) {
        Eigen::Vector3d p = cell.Mean();
        if (const double length = cell.normal.norm(); length > 0.0) {
          const OrientedPoint point{p, cell.normal / length};
          const MeanSheet own = SheetsAround(sheets, edge, point);
          if (cell.views < kConfirmedViews && IsStray(sheets, edge, point, own)) {
            continue;
          }
          p += own.offset * point.normal;
        }
        cell.position = cell.weight * p;
        put(CubeAt(p.array() / spacing_), cell);
      }
    });
  }
  return flat;
}

DenseCloud CloudFusion::Cloud() const {
  const Grid flat = Flattened();
  DenseCloud cloud;
  for (std::size_t shard = 0; shard < Grid::kShards; ++shard) {
    for (const Cell& cell : flat.Values(shard)) {
      const double length = cell.normal.norm();
      DensePoint point;
      point.p_map = cell.Mean().cast<float>();
      point.normal = (length > 0.0 ? cell.normal / length : cell.normal).cast<float>();
      for (int i = 0; i < 3; ++i) {
        point.rgb[static_cast<std::size_t>(i)] = Rounded(cell.rgb[i] / cell.weight);
      }
      point.views = static_cast<std::uint8_t>(cell.views);
      point.sigma = static_cast<float>(cell.Sigma());
      cloud.push_back(point);
    }
  }
  return cloud;
}

void WriteDenseCloud(const std::filesystem::path& path, const DenseCloud& cloud, double metres_per_unit) {
  ByteWriter body;
  for (const DensePoint& point : cloud) {
    body(point.p_map, point.normal, point.rgb, point.views, point.sigma);
  }
  WriteFileAtomically(path, HeaderOf(cloud.size(), metres_per_unit) + body.Take());
}

DenseCloud ReadDensePoints(const std::filesystem::path& path) {
  constexpr std::size_t kPointBytes = 32;
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::size_t count_at = bytes.find("element vertex ");
  const std::size_t points =
      count_at == std::string::npos
          ? 0
          : static_cast<std::size_t>(std::strtoull(bytes.c_str() + count_at + 15, nullptr, 10));
  const std::string header = HeaderOf(points, MetresPerUnitIn(bytes));
  // Compared by division: kPointBytes times a number from a file may wrap.
  const std::size_t body_size = bytes.starts_with(header) ? bytes.size() - header.size() : 1;
  if (body_size % kPointBytes != 0 || body_size / kPointBytes != points) {
    throw InputError("{}: expected a dense.ply as sqslam densify writes it", path.string());
  }
  DenseCloud cloud(points);
  ByteReader body(std::string_view(bytes).substr(header.size()), path.string(), ByteReader::Numbers::kAny);
  for (DensePoint& point : cloud) {
    body(point.p_map, point.normal, point.rgb, point.views, point.sigma);
  }
  return cloud;
}

}  // namespace sqslam
