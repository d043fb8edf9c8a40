#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A user's changes to one object of a map.
struct ObjectEdit {
  std::string name;   // shown name; empty: the label
  std::string label;  // class; empty: that of the map
  bool hidden = false;
  bool deleted = false;
  std::optional<int> merged_into;  // id of the object that it is part of

  bool operator==(const ObjectEdit&) const = default;
};

// A user's edits of the objects of a map, by id. A value: the recording never changes; readers apply the
// edits to the states they read (Apply).
class ObjectEdits {
 public:
  // Leading and trailing blanks are removed, and texts longer than kMaxLabelBytes are cut. An empty name or
  // label restores that of the map.
  void Rename(int id, const std::string& name);
  void SetLabel(int id, const std::string& label);  // blanks become underscores, as in boxes.txt
  void Hide(int id, bool hidden = true);
  void Delete(int id, bool deleted = true);

  // Makes `absorbed` a part of `kept`, which keeps its id and its solid. If either was merged before, all of
  // their parts are joined. Throws UsageError if they are already merged.
  void Merge(int kept, int absorbed);
  void Separate(int absorbed);  // undoes a merge

  bool Empty() const { return edits_.empty(); }
  const std::map<int, ObjectEdit>& All() const { return edits_; }
  ObjectEdit Of(int id) const;             // default if it was not edited
  int KeptIdOf(int id) const;              // the object that it was merged into; itself if not merged
  std::vector<int> PartsOf(int id) const;  // ids merged into it, directly or through others, ascending

  bool operator==(const ObjectEdits&) const = default;

 private:
  friend ObjectEdits ReadObjectEdits(const std::filesystem::path& path);

  void Update(int id, auto change);

  std::map<int, ObjectEdit> edits_;  // edited objects only
};

enum class HiddenObjects {
  kLeaveOut,  // in pictures
  kKeep       // in files and lists: hidden is not deleted
};

// Returns the edited snapshot. Edits of objects that it does not hold (yet) are ignored. If it holds both of
// two merged objects, their observations, points and boxes are joined and the kept one's solid stays; if only
// the absorbed one, it takes the id of the kept one. Points and boxes of omitted objects belong to no object.
MapSnapshotPtr Apply(const ObjectEdits& edits, const MapSnapshot& snapshot,
                     HiddenObjects hidden = HiddenObjects::kLeaveOut);

// Returns the edited ids that the map does not have, ascending: many if the edits belong to another map.
std::vector<int> UnknownIds(const ObjectEdits& edits, const MapSnapshot& map);

// Returns the file with the edits of a recording: map.sqmap.edits.json beside it.
std::filesystem::path EditsFileOf(const std::filesystem::path& recording);

// {"format": "sqslam-edits", "version": 1, "objects": [{"id", "name", "label", "hidden", "deleted",
// "merged_into"}]}, with changed fields only. Reading throws InputError that names file and field.
void WriteObjectEdits(const std::filesystem::path& path, const ObjectEdits& edits);
ObjectEdits ReadObjectEdits(const std::filesystem::path& path);

}  // namespace sqslam
