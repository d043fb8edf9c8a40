#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/viewer/model/map_objects.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

// Search of the field above the table of objects: finds rows by words and comparisons (RowFilter) or, if no
// row has the words, the answers to a question (AnswerQuery), such as "cups on the table".
class ObjectSearch {
 public:
  // Searches again if the text or the map has changed. `map`: the finished map, null if there is none yet;
  // `folder`: of its result, for the walls.
  void Update(const std::string& text, const std::vector<ObjectRow>& rows, const MapSnapshotPtr& map,
              const std::filesystem::path& folder);

  bool Shows(const ObjectRow& row) const;

  // Names the answers in one line, or says why there are none; empty for words and comparisons.
  const std::string& Message() const { return message_; }
  bool Failed() const { return failed_; }  // the message tells what is wrong with the text

  // Returns the ids of the answers; empty if the text is no question.
  const std::optional<std::set<int>>& Answers() const { return answers_; }

 private:
  void Ask(const MapSnapshotPtr& map, const std::filesystem::path& folder);

  std::string text_;
  MapSnapshotPtr map_;
  RowFilter filter_;
  std::optional<std::set<int>> answers_;
  std::string message_;
  bool failed_ = false;
  MapSnapshotPtr graph_of_;  // the map of the graph
  SceneGraph graph_;
};

}  // namespace sqslam::viewer
