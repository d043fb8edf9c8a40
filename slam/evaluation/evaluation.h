#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/object_matching.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/trajectory.h"
#include "slam/map/snapshot.h"

namespace sqslam {

struct EvaluationOptions {
  double max_time_difference = 0.02;  // seconds between an estimated pose and its ground truth
  MatchingOptions matching;

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("max_time_difference", max_time_difference, 0.0, 10.0);
    visit("matching", matching);
  }
};

// "Of the ground-truth objects with at least min_detections boxes, so many are in the map."
struct CoverageCount {
  int min_detections = 0;
  int mapped = 0;
  int total = 0;
};

// A run held against the ground truth of its sequence. The index fields of `objects` point into mapped and
// truth.
struct Evaluation {
  std::string sequence;  // folder of the ground truth
  int frames = 0;        // of the sequence
  int tracked = 0;       // lines of trajectory.txt
  double tracked_share = 0.0;
  TrajectoryError trajectory;
  bool has_objects = false;  // the sequence knows its objects; otherwise all below is empty
  bool has_detection_counts = false;
  bool has_scored = false;
  std::vector<SnapshotObject> mapped;  // in the map frame
  std::vector<GroundTruthObject> truth;
  ObjectMatching objects;
  double mean_iou = 0.0;  // over the matched objects
  double mean_iou_ellipsoid = 0.0;
  int scored = 0;  // ground-truth objects whose IoU counts, and how many of them are matched
  int scored_matched = 0;
  double mean_iou_scored = 0.0;  // over the matched ones of them
  double mean_iou_scored_ellipsoid = 0.0;
  std::vector<CoverageCount> coverage;  // for 20 and for 60 detections, where counts are known

  // The ground-truth camera positions in the map frame, for drawing beside the estimated ones.
  std::vector<Eigen::Vector3d> truth_positions_map;
};

// Throws InputError where the trajectory cannot be aligned; `where` begins that message.
Evaluation Evaluate(const Trajectory& estimated, const std::vector<SnapshotObject>& mapped,
                    const GroundTruth& truth, const EvaluationOptions& options,
                    const std::string& where = "trajectory");

// The same from a result folder (trajectory.txt, objects.json) and a sequence folder. Throws InputError.
Evaluation EvaluateResult(const std::filesystem::path& result, const std::filesystem::path& sequence,
                          const EvaluationOptions& options = {});

// Tables for the terminal.
std::string FormatEvaluation(const Evaluation& evaluation);

// eval.json; angles in radians, lengths in the ground truth's unit.
void WriteEvaluation(const std::filesystem::path& path, const Evaluation& evaluation);

}  // namespace sqslam
