#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/evaluation/ground_truth.h"
#include "slam/evaluation/object_matching.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

struct EvaluationOptions {
  double max_time_difference = 0.02;  // seconds between an estimated pose and its ground truth
  MatchingOptions matching;

  void VisitFields(auto&& visit) {
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

// A mapped object that is no ground-truth object, with what helps to tell what it is: where it lies and which
// ground-truth object is the nearest. World frame of the ground truth, metres.
struct ExtraLandmark {
  int mapped = 0;
  Eigen::Vector3d center_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();
  int nearest = -1;       // ground-truth object with the nearest centre; -1 where there is none at all
  double distance = 0.0;  // between the two centres
  double iou = 0.0;       // 3D IoU with it
  double inside = 0.0;    // share of the landmark's volume that lies in it
};

// 3D IoU of some ground-truth objects with the mapped ones that stand for them.
struct IouSummary {
  int objects = 0;
  int matched = 0;
  double mean = 0.0;            // over the matched ones
  double mean_ellipsoid = 0.0;  // the same with e1 = e2 = 1
  double mean_all = 0.0;        // over all, a missed one counting 0
};

// Mapped objects of about the same reliability. It is worth something where the mean rises with it.
struct ReliabilityBin {
  double least = 0.0;  // reliability, up to that of the next bin
  int objects = 0;
  double mean_iou = 0.0;  // with the objects that they stand for; extra ones and duplicates count 0
};

// A run held against the ground truth of its sequence. The index fields of `objects` point into mapped and
// truth.
struct Evaluation {
  std::string sequence;  // folder of the ground truth
  int frames = 0;        // frames of the sequence
  int tracked = 0;       // lines of trajectory.txt
  double tracked_share = 0.0;
  TrajectoryError trajectory;
  bool has_objects = false;  // the sequence knows its objects; otherwise all below is empty
  bool has_detection_counts = false;
  bool has_scored = false;
  std::vector<SnapshotObject> mapped;  // in the map frame
  std::vector<GroundTruthObject> truth;
  ObjectMatching objects;
  std::vector<ExtraLandmark> extra;         // in the order of objects.extra
  int uncertain = 0;                        // mapped objects that are not reliable (IsReliable)
  int extra_reliable = 0;                   // extra ones that claim to be
  std::vector<ReliabilityBin> reliability;  // five, each a fifth wide
  IouSummary iou;                           // of all ground-truth objects
  IouSummary scored_iou;                    // of those whose IoU counts
  std::vector<CoverageCount> coverage;      // for 20 and for 60 detections, where counts are known

  // The ground-truth camera positions in the map frame, for drawing beside the estimated ones.
  std::vector<Eigen::Vector3d> truth_positions_map;

  const GroundTruthObject& Truth(int index) const { return truth[static_cast<std::size_t>(index)]; }
  const SnapshotObject& Mapped(int index) const { return mapped[static_cast<std::size_t>(index)]; }
};

// "4 teapot".
std::string NumberedName(const GroundTruthObject& object);
std::string NumberedName(const SnapshotObject& object);

// Throws InputError where the trajectory cannot be aligned; `where` begins that message.
Evaluation Evaluate(const Trajectory& estimated, const std::vector<SnapshotObject>& mapped,
                    const GroundTruth& truth, const EvaluationOptions& options,
                    const std::string& where = "trajectory");

// The same from a result folder (trajectory.txt, objects.json) and a sequence folder. Throws InputError.
Evaluation EvaluateResult(const std::filesystem::path& result, const std::filesystem::path& sequence,
                          const EvaluationOptions& options = {});

// Tables for the terminal.
std::string FormatEvaluation(const Evaluation& evaluation);

// eval.json as text; angles in radians, lengths in the ground truth's unit.
std::string EvaluationJson(const Evaluation& evaluation);
void WriteEvaluation(const std::filesystem::path& path, const Evaluation& evaluation);

}  // namespace sqslam
