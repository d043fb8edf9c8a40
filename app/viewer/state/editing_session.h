#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "app/viewer/frames/history_reader.h"
#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Keeps what is shown up to what was edited: between what the viewer reads and what its panels see.
class EditingSession {
 public:
  // Once a frame, after what is new was put into the state and before panels are drawn.
  void Update(ViewerState& state);

  // The next document is another one even where it lies in the same file: it is read anew.
  void Forget() { file_.clear(); }

  // Whether a history is still being read.
  bool Busy() const { return reader_ && !reader_->Done(); }

 private:
  void TakeDocument(ViewerState& state);
  void TakeFrame(ViewerState& state);
  void TakeHistory(ViewerState& state);

  std::filesystem::path file_;  // of the document that the edits belong to
  bool recorded_ = false;       // it is one that does not grow any more
  // What was given to the state, so that what is new in it can be told apart.
  ShownFramePtr given_;
  MapSnapshotPtr given_last_;
  MapSnapshotPtr raw_last_;
  ObjectEdits edits_;  // with which they were made
  Representation representation_ = Representation::kSuperquadric;
  std::unique_ptr<HistoryReader> reader_;
};

// Where unsaved changes are in the way of quitting or opening, asks first: true, and the panel of the
// question shows. Otherwise false.
bool Postpone(ViewerState& state, const Postponed& what);

}  // namespace sqslam::viewer
