#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/object_matching.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

struct EvaluationOptions {
  double max_time_difference = 0.02;            // seconds between an estimated pose and its ground truth
  Alignment alignment = Alignment::kPositions;  // of the map with the true poses, for its objects
  double min_iou = kMinMatchIou;                // 3D IoU that suffices for a match

  void VisitFields(auto&& visit) {
    visit("max_time_difference", max_time_difference, 0.0, 10.0);
    visit("alignment", alignment);
    visit("min_iou", min_iou, 0.0, 1.0);
  }
};

// Number of mapped objects among the ground-truth objects with at least min_detections boxes.
struct CoverageCount {
  int min_detections = 0;
  int mapped = 0;
  int total = 0;
};

// A mapped object that matches no ground-truth object, with its position and its nearest ground-truth object
// to help identify it. World frame of the ground truth, metres.
struct ExtraLandmark {
  int mapped = 0;
  Eigen::Vector3d center_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();
  int nearest = -1;       // ground-truth object with the nearest centre; -1 if there is none
  double distance = 0.0;  // between the two centres
  double iou = 0.0;       // 3D IoU with it
  double inside = 0.0;    // share of the landmark's volume inside it
};

// 3D IoU of a set of ground-truth objects with their matches.
struct IouSummary {
  int objects = 0;
  int matched = 0;
  int matched_25 = 0;           // with a 3D IoU of at least 0.25
  int matched_50 = 0;           // with one of at least 0.5
  double mean = 0.0;            // over the matched ones
  double mean_ellipsoid = 0.0;  // the same as ellipsoids (ObjectMatch::iou_ellipsoid)
  double mean_all = 0.0;        // over all, with 0 for missed ones
};

// Mapped objects of similar reliability. Reliability is meaningful if the mean IoU increases with it.
struct ReliabilityBin {
  double least = 0.0;  // lower bound of the reliability; the upper one is that of the next bin
  int objects = 0;
  double mean_iou = 0.0;  // with their matches; 0 for extra ones and duplicates
};

// Evaluation of a run against the ground truth of its sequence. The indices in `objects` refer to mapped and
// truth.
struct Evaluation {
  std::string sequence;  // folder of the ground truth
  int frames = 0;        // frames of the sequence
  int tracked = 0;       // lines of trajectory.txt
  double tracked_share = 0.0;
  TrajectoryError trajectory;
  bool has_objects = false;  // the sequence has true objects; otherwise all below is empty
  bool has_detection_counts = false;
  bool has_scored = false;
  std::vector<SnapshotObject> mapped;  // in the map frame
  std::vector<GroundTruthObject> truth;
  ObjectMatching objects;
  std::vector<ExtraLandmark> extra;         // in the order of objects.extra
  int uncertain = 0;                        // mapped objects that are not reliable (IsReliable)
  int extra_reliable = 0;                   // extra ones that are reliable
  std::vector<ReliabilityBin> reliability;  // five bins of width 0.2
  IouSummary iou;                           // of all ground-truth objects
  IouSummary scored_iou;                    // of the scored ones
  std::vector<CoverageCount> coverage;      // for 20 and for 60 detections, if counts are known

  // The ground-truth camera positions in the map frame, for drawing beside the estimated ones.
  std::vector<Eigen::Vector3d> truth_positions_map;

  const GroundTruthObject& Truth(int index) const { return truth[static_cast<std::size_t>(index)]; }
  const SnapshotObject& Mapped(int index) const { return mapped[static_cast<std::size_t>(index)]; }
};

// Returns for example "4 teapot".
std::string NumberedName(const GroundTruthObject& object);
std::string NumberedName(const SnapshotObject& object);

// Aligns a trajectory with the true one. Throws InputError if that is impossible; `where` begins the message.
TrajectoryError AlignWithTruth(const Trajectory& estimated, const GroundTruth& truth,
                               const EvaluationOptions& options, const std::string& where);

// Throws InputError like AlignWithTruth, or if there are more poses than frames.
Evaluation Evaluate(const Trajectory& estimated, const std::vector<SnapshotObject>& mapped,
                    const GroundTruth& truth, const EvaluationOptions& options,
                    const std::string& where = "trajectory");

// The same from a result folder (trajectory.txt, objects.json) and a sequence folder. Throws InputError.
Evaluation EvaluateResult(const std::filesystem::path& result, const std::filesystem::path& sequence,
                          const EvaluationOptions& options = {});

// Returns tables for the terminal.
std::string FormatEvaluation(const Evaluation& evaluation);

// Returns eval.json as text; angles in radians, lengths in the ground truth's unit.
std::string EvaluationJson(const Evaluation& evaluation);
void WriteEvaluation(const std::filesystem::path& path, const Evaluation& evaluation);

// The score of one ground-truth object in an eval.json.
struct ObjectScore {
  int id = 0;
  std::string name;  // the label if the ground truth has no name
  std::string label;
  bool scored = true;  // counts for 3D IoU
  bool found = false;
  double iou = 0.0;            // 0 if not found
  double iou_ellipsoid = 0.0;  // as an ellipsoid (ObjectMatch::iou_ellipsoid)
};

// Returns the objects of an eval.json by id. Throws nlohmann::json::exception if it holds none.
std::vector<ObjectScore> ScoresIn(const nlohmann::ordered_json& eval);

}  // namespace sqslam
