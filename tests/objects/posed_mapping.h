#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/objects/object_types.h"

namespace sqslam::testing {

// A sequence folder with ground truth, as far as the object tests need it (no image is held).
struct PosedSequence {
  struct Entry {
    double timestamp = 0.0;
    std::filesystem::path image;
    Rigid3d T_world_camera;
    std::vector<Detection> detections;
  };
  struct TruthObject {
    int id = 0;
    std::string label;
    bool scored = true;
    int detector_boxes = 0;
    PosedSuperquadric superquadric;
  };
  Camera camera;
  std::vector<Entry> entries;  // frames without a pose are left out
  std::vector<TruthObject> objects;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

// Empty where the folder is missing. `boxes`: name of the box file.
std::optional<PosedSequence> LoadPosedSequence(const std::filesystem::path& folder, const std::string& boxes);

// A map of ORB points triangulated with known poses: the points that a SLAM system would give the objects,
// with their noise and their wrong matches, before there is a SLAM system.
class PosedMapping {
 public:
  explicit PosedMapping(const Camera& camera) : camera_(camera) {}

  // Tracked points of this frame; every `keyframe_interval`-th frame makes new ones.
  std::vector<TrackedPoint> Process(const cv::Mat& gray, const Rigid3d& T_map_camera, int frame_index);

  std::optional<Eigen::Vector3d> Position(std::int64_t id) const;
  std::vector<Eigen::Vector3d> Positions() const;  // of all points that were seen often enough

 private:
  struct Sighting {
    Rigid3d T_map_camera;
    Eigen::Vector2d pixel;  // undistorted
  };
  struct Point {
    Eigen::Vector3d p_map;
    cv::Mat descriptor;
    std::vector<Sighting> sightings;
    int last_frame = 0;
    int visible = 1;
    int found = 1;
  };
  struct View {
    Rigid3d T_map_camera;
    std::vector<Eigen::Vector2d> raw;
    std::vector<Eigen::Vector2d> pixels;  // undistorted
    cv::Mat descriptors;
    std::vector<std::int64_t> points;  // -1: none
  };

  View Extract(const cv::Mat& gray, const Rigid3d& T_map_camera) const;
  void MatchMap(View& view, int frame_index);
  void Triangulate(View& view, View& other, int frame_index);
  bool Locate(const std::vector<Sighting>& sightings, Eigen::Vector3d& p) const;

  Camera camera_;
  std::map<std::int64_t, Point> points_;
  std::deque<View> keyframes_;
  std::int64_t next_id_ = 0;
};

}  // namespace sqslam::testing
