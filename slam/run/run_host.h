#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "slam/dense/dense_options.h"
#include "slam/io/frame.h"
#include "slam/io/result_files.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// All that a run came to.
struct FinishedRun {
  std::filesystem::path output;  // its result folder
  std::string sequence;          // what was mapped
  RunResult result;
  RunStats stats;
  bool interrupted = false;  // the host ended it; what had been mapped is saved all the same
};

// The program that a run is made for: it may end the run, shows how far it is, and draws what comes of it.
// Called from the threads of the run; only AdmitFrame and the pictures may take long.
class RunHost {
 public:
  virtual ~RunHost() = default;

  virtual bool Stopped() const { return false; }    // true ends the run early, as on Ctrl-C
  virtual bool AdmitFrame() { return !Stopped(); }  // before each frame; false ends the run

  virtual void Say(const std::string& /*news*/) {}
  // `total` frames are to come, 0: nobody knows how many. EndProgress comes before anything else is said.
  virtual void ShowProgress(std::int64_t /*done*/, std::int64_t /*total*/, const std::string& /*state*/) {}
  virtual void EndProgress() {}
  virtual void Tracked(const Frame&, TrackingState, const System&) {}  // from the tracking thread
  virtual void Mapped(const MapSnapshotPtr&) {}                        // from the mapping thread

  // Depth maps and cloud are written; a mesh of them is the host's to make.
  virtual void Mesh(const FinishedRun&) {}

  // Pictures of the map, a video of its growth and a page, all in the result folder or beside it, once its
  // other files are written. What one of them throws keeps nothing else from being made.
  virtual void Draw(const FinishedRun&, StageTimes& /*times*/) {}
  virtual void Film(const FinishedRun&) {}
  virtual void Report(const FinishedRun&) {}
};

}  // namespace sqslam
