#include "posed_mapping.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/features2d.hpp>
#include <sstream>

namespace sqslam::testing {
namespace {

constexpr int kKeyframeInterval = 5;
constexpr int kMaxHamming = 50;

std::vector<std::vector<std::string>> ReadTable(const std::filesystem::path& path) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') {
      continue;
    }
    std::istringstream stream(line);
    rows.emplace_back();
    for (std::string word; stream >> word;) {
      rows.back().push_back(word);
    }
  }
  return rows;
}

int Hamming(const cv::Mat& a, int row_a, const cv::Mat& b, int row_b) {
  const auto* p = reinterpret_cast<const std::uint64_t*>(a.ptr(row_a));
  const auto* q = reinterpret_cast<const std::uint64_t*>(b.ptr(row_b));
  int distance = 0;
  for (int i = 0; i < 4; ++i) {
    distance += __builtin_popcountll(p[i] ^ q[i]);
  }
  return distance;
}

long Key(double timestamp) { return std::lround(timestamp * 1e4); }

void LoadObjects(const std::filesystem::path& path, PosedSequence& sequence) {
  std::ifstream file(path);
  if (!file) {
    return;
  }
  const nlohmann::json root = nlohmann::json::parse(file);
  if (root.is_object() && root.contains("up_world")) {
    for (int i = 0; i < 3; ++i) {
      sequence.up[i] = root["up_world"][i];
    }
  }
  for (const auto& item : root.is_object() ? root["objects"] : root) {
    PosedSequence::TruthObject object;
    object.id = item["id"];
    object.label = item["label"];
    object.scored = item.value("scored", true);
    object.detector_boxes = item.value("detector_boxes", 0);
    Eigen::Matrix4d T;
    for (int i = 0; i < 16; ++i) {
      const auto& m = item["T_world_object"];
      T(i / 4, i % 4) = m[0].is_array() ? double(m[i / 4][i % 4]) : double(m[i]);
    }
    object.superquadric.T_map_object.rotation = Eigen::Quaterniond(Eigen::Matrix3d(T.topLeftCorner<3, 3>()));
    object.superquadric.T_map_object.translation = T.topRightCorner<3, 1>();
    for (int i = 0; i < 3; ++i) {
      object.superquadric.shape.half_size[i] = item["half_size"][i];
    }
    object.superquadric.shape.e1 = item["shape"][0];
    object.superquadric.shape.e2 = item["shape"][1];
    sequence.objects.push_back(object);
  }
}

}  // namespace

std::optional<PosedSequence> LoadPosedSequence(const std::filesystem::path& folder,
                                               const std::string& boxes) {
  if (!std::filesystem::exists(folder / "rgb.txt")) {
    return std::nullopt;
  }
  PosedSequence sequence;
  const YAML::Node yaml = YAML::LoadFile(folder / "camera.yaml");
  Camera& camera = sequence.camera;
  camera.width = yaml["width"].as<int>();
  camera.height = yaml["height"].as<int>();
  camera.fx = yaml["fx"].as<double>();
  camera.fy = yaml["fy"].as<double>();
  camera.cx = yaml["cx"].as<double>();
  camera.cy = yaml["cy"].as<double>();
  for (int i = 0; i < 5; ++i) {
    camera.distortion[i] = yaml["distortion"][i].as<double>();
  }
  std::map<long, std::vector<Detection>> detections;
  for (const auto& row : ReadTable(folder / boxes)) {
    detections[Key(std::stod(row[0]))].push_back(
        {row[1],
         std::stod(row[2]),
         {std::stod(row[3]), std::stod(row[4]), std::stod(row[5]), std::stod(row[6])}});
  }
  std::map<long, Rigid3d> poses;
  for (const auto& row : ReadTable(folder / "groundtruth.txt")) {
    std::vector<double> v;
    for (const std::string& word : row) {
      v.push_back(std::stod(word));
    }
    poses[Key(v[0])] = {Eigen::Quaterniond(v[7], v[4], v[5], v[6]).normalized(), {v[1], v[2], v[3]}};
  }
  for (const auto& row : ReadTable(folder / "rgb.txt")) {
    const double timestamp = std::stod(row[0]);
    if (poses.contains(Key(timestamp))) {
      sequence.entries.push_back(
          {timestamp, folder / row[1], poses[Key(timestamp)], detections[Key(timestamp)]});
    }
  }
  LoadObjects(folder / "objects_gt.json", sequence);
  return sequence;
}

PosedMapping::View PosedMapping::Extract(const cv::Mat& gray, const Rigid3d& T_map_camera) const {
  View view;
  view.T_map_camera = T_map_camera;
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(1200, 1.2f, 8, 19, 0, 2, cv::ORB::HARRIS_SCORE, 31, 10);
  std::vector<cv::KeyPoint> keypoints;
  orb->detectAndCompute(gray, cv::noArray(), keypoints, view.descriptors);
  for (const cv::KeyPoint& keypoint : keypoints) {
    view.raw.emplace_back(keypoint.pt.x, keypoint.pt.y);
    view.pixels.push_back(camera_.Undistort(view.raw.back()));
  }
  view.points.assign(keypoints.size(), -1);
  return view;
}

bool PosedMapping::Locate(const std::vector<Sighting>& sightings, Eigen::Vector3d& p) const {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double parallax = 1.0;
  const Eigen::Vector3d first =
      (sightings.front().T_map_camera.rotation * camera_.Unproject(sightings.front().pixel)).normalized();
  for (const Sighting& s : sightings) {
    const Eigen::Vector3d ray = (s.T_map_camera.rotation * camera_.Unproject(s.pixel)).normalized();
    const Eigen::Matrix3d M = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    A += M;
    b += M * s.T_map_camera.translation;
    parallax = std::min(parallax, ray.dot(first));
  }
  if (parallax > std::cos(1.0 * M_PI / 180.0)) {
    return false;
  }
  p = A.ldlt().solve(b);
  for (const Sighting& s : sightings) {
    const Eigen::Vector3d q = s.T_map_camera.Inverse() * p;
    if (q.z() < 0.05 || (camera_.Project(q) - s.pixel).norm() > 3.0) {
      return false;
    }
  }
  return true;
}

void PosedMapping::MatchMap(View& view, int frame_index) {
  constexpr double kRadius = 5.0;
  constexpr int kCell = 10;
  const int columns = camera_.width / kCell + 1;
  const int rows = camera_.height / kCell + 1;
  std::vector<std::vector<int>> grid(columns * rows);
  for (std::size_t i = 0; i < view.pixels.size(); ++i) {
    const int c = std::clamp(static_cast<int>(view.pixels[i].x()) / kCell, 0, columns - 1);
    const int r = std::clamp(static_cast<int>(view.pixels[i].y()) / kCell, 0, rows - 1);
    grid[r * columns + c].push_back(static_cast<int>(i));
  }
  const Rigid3d T_camera_map = view.T_map_camera.Inverse();
  for (auto it = points_.begin(); it != points_.end();) {
    Point& point = it->second;
    if (point.visible > 10 && point.found < 0.25 * point.visible) {
      it = points_.erase(it);
      continue;
    }
    const Eigen::Vector3d p = T_camera_map * point.p_map;
    const Eigen::Vector2d pixel = p.z() > 0.05 ? camera_.Project(p) : Eigen::Vector2d(-1.0, -1.0);
    if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() >= camera_.width || pixel.y() >= camera_.height ||
        frame_index - point.last_frame > 90) {
      ++it;
      continue;
    }
    ++point.visible;
    int best = kMaxHamming;
    int best_index = -1;
    for (int r = (pixel.y() - kRadius) / kCell; r <= (pixel.y() + kRadius) / kCell; ++r) {
      for (int c = (pixel.x() - kRadius) / kCell; c <= (pixel.x() + kRadius) / kCell; ++c) {
        if (r < 0 || c < 0 || r >= rows || c >= columns) {
          continue;
        }
        for (const int i : grid[r * columns + c]) {
          if (view.points[i] >= 0 || (view.pixels[i] - pixel).norm() > kRadius) {
            continue;
          }
          const int distance = Hamming(point.descriptor, 0, view.descriptors, i);
          if (distance < best) {
            best = distance;
            best_index = i;
          }
        }
      }
    }
    if (best_index >= 0) {
      view.points[best_index] = it->first;
      ++point.found;
      point.last_frame = frame_index;
      if (frame_index % kKeyframeInterval == 0) {
        point.sightings.push_back({view.T_map_camera, view.pixels[best_index]});
        point.descriptor = view.descriptors.row(best_index).clone();
        Eigen::Vector3d better;
        if (point.sightings.size() <= 20 && Locate(point.sightings, better)) {
          point.p_map = better;
        }
      }
    }
    ++it;
  }
}

void PosedMapping::Triangulate(View& view, View& other, int frame_index) {
  const Rigid3d T_view_other = view.T_map_camera.Inverse() * other.T_map_camera;
  const Eigen::Vector3d t = T_view_other.translation;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  const Eigen::Matrix3d E = cross * T_view_other.RotationMatrix();
  for (std::size_t j = 0; j < other.pixels.size(); ++j) {
    if (other.points[j] >= 0) {
      continue;
    }
    const Eigen::Vector3d line = E * camera_.Unproject(other.pixels[j]);
    int best = kMaxHamming;
    int second = 256;
    int best_index = -1;
    for (std::size_t i = 0; i < view.pixels.size(); ++i) {
      if (view.points[i] >= 0) {
        continue;
      }
      const double distance_px =
          std::abs(line.dot(camera_.Unproject(view.pixels[i]))) / line.head<2>().norm() * camera_.fx;
      if (distance_px > 1.5) {
        continue;
      }
      const int distance =
          Hamming(view.descriptors, static_cast<int>(i), other.descriptors, static_cast<int>(j));
      if (distance < best) {
        second = best;
        best = distance;
        best_index = static_cast<int>(i);
      } else if (distance < second) {
        second = distance;
      }
    }
    Point point;
    if (best_index < 0 || best > 0.8 * second) {
      continue;
    }
    point.sightings = {{other.T_map_camera, other.pixels[j]}, {view.T_map_camera, view.pixels[best_index]}};
    if (Locate(point.sightings, point.p_map)) {
      point.descriptor = view.descriptors.row(best_index).clone();
      point.last_frame = frame_index;
      view.points[best_index] = next_id_;
      other.points[j] = next_id_;
      points_[next_id_++] = point;
    }
  }
}

std::vector<TrackedPoint> PosedMapping::Process(const cv::Mat& gray, const Rigid3d& T_map_camera,
                                                int frame_index) {
  View view = Extract(gray, T_map_camera);
  MatchMap(view, frame_index);
  if (frame_index % kKeyframeInterval == 0) {
    for (View& other : keyframes_) {
      Triangulate(view, other, frame_index);
    }
  }
  std::vector<TrackedPoint> tracked;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const auto it = points_.find(view.points[i]);
    if (it != points_.end()) {
      tracked.push_back({it->first, view.raw[i], it->second.p_map});
    }
  }
  if (frame_index % kKeyframeInterval == 0) {
    keyframes_.push_back(std::move(view));
    if (keyframes_.size() > 4) {
      keyframes_.pop_front();
    }
  }
  return tracked;
}

std::optional<Eigen::Vector3d> PosedMapping::Position(std::int64_t id) const {
  const auto it = points_.find(id);
  return it == points_.end() ? std::nullopt : std::optional<Eigen::Vector3d>(it->second.p_map);
}

std::vector<Eigen::Vector3d> PosedMapping::Positions() const {
  std::vector<Eigen::Vector3d> positions;
  for (const auto& [id, point] : points_) {
    if (point.sightings.size() >= 3) {
      positions.push_back(point.p_map);
    }
  }
  return positions;
}

}  // namespace sqslam::testing
