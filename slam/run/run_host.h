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

// Everything that a run produced.
struct FinishedRun {
  std::filesystem::path output;  // its result folder
  std::string sequence;          // what was mapped
  RunResult result;
  RunStats stats;
  bool interrupted = false;  // stopped by the host; the map so far is saved anyway
};

// The program that a run is made for: it may stop the run, shows progress, and draws the result. Called from
// the threads of the run; only AdmitFrame and the pictures may take long.
class RunHost {
 public:
  virtual ~RunHost() = default;

  virtual bool Stopped() const { return false; }    // true ends the run early, as on Ctrl-C
  virtual bool AdmitFrame() { return !Stopped(); }  // before each frame; false ends the run

  virtual void Say(const std::string& /*news*/) {}
  // `total`: 0 if unknown. EndProgress comes before any other message.
  virtual void ShowProgress(std::int64_t /*done*/, std::int64_t /*total*/, const std::string& /*state*/) {}
  virtual void EndProgress() {}
  virtual void Tracked(const Frame&, TrackingState, const System&) {}  // from the tracking thread
  virtual void Mapped(const MapSnapshotPtr&) {}                        // from the mapping thread

  // Called once depth maps and cloud are written, for the host to make a mesh.
  virtual void Mesh(const FinishedRun&) {}

  // Pictures of the map, a video of its growth and a page, in the result folder or beside it, after all other
  // files. An exception from one of them does not prevent the others.
  virtual void Draw(const FinishedRun&, StageTimes& /*times*/) {}
  virtual void Film(const FinishedRun&) {}
  virtual void Report(const FinishedRun&) {}
};

}  // namespace sqslam
