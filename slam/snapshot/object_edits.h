#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Changes that somebody made to one object of a map.
struct ObjectEdit {
  std::string name;   // what it is called; empty: by its label
  std::string label;  // its class; empty: the map's
  bool hidden = false;
  bool deleted = false;
  std::optional<int> merged_into;  // id of the object that it is a part of

  bool operator==(const ObjectEdit&) const = default;
};

// Edits of the objects of a map, by id. A value: the recording of the map is never changed, and what is read
// from it is edited on the way (Apply).
class ObjectEdits {
 public:
  // Blanks at the ends are taken off. An empty name or label gives back the map's own.
  void Rename(int id, const std::string& name);
  void SetLabel(int id, const std::string& label);  // blanks become underscores, as in boxes.txt
  void Hide(int id, bool hidden = true);
  void Delete(int id, bool deleted = true);

  // `absorbed` becomes a part of `kept`, which keeps its id and its solid. Both may have been merged before:
  // then all of their parts belong together. Throws UsageError where they are one object already.
  void Merge(int kept, int absorbed);
  void Separate(int absorbed);  // takes a merge back

  bool Empty() const { return edits_.empty(); }
  const std::map<int, ObjectEdit>& All() const { return edits_; }
  ObjectEdit Of(int id) const;             // nothing where it was not edited
  int KeptIdOf(int id) const;              // the object that it is a part of now; itself if it was not merged
  std::vector<int> PartsOf(int id) const;  // ids merged into it, directly or through others, ascending

  bool operator==(const ObjectEdits&) const = default;

 private:
  friend ObjectEdits ReadObjectEdits(const std::filesystem::path& path);

  void Update(int id, auto change);

  std::map<int, ObjectEdit> edits_;  // only objects about which something was changed
};

enum class HiddenObjects {
  kLeaveOut,  // in pictures
  kKeep       // in files and lists: hidden is not deleted
};

// The snapshot as edited. Objects that it does not hold (yet) are passed over; of two merged ones the
// absorbed alone goes under the id of the kept one, and where both are there, observations, points and boxes
// are joined and the kept one's solid stays. Points and boxes of objects that are left out belong to no
// object.
MapSnapshotPtr Apply(const ObjectEdits& edits, const MapSnapshot& snapshot,
                     HiddenObjects hidden = HiddenObjects::kLeaveOut);

// Ids of the edits that the map does not know, ascending: edits of another map have many.
std::vector<int> UnknownIds(const ObjectEdits& edits, const MapSnapshot& map);

// The file with the edits of a recording: map.sqmap.edits.json beside it.
std::filesystem::path EditsFileOf(const std::filesystem::path& recording);

// {"format": "sqslam-edits", "version": 1, "objects": [{"id", "name", "label", "hidden", "deleted",
// "merged_into"}]}; of each object only what was changed. Reading throws InputError that names file and
// field.
void WriteObjectEdits(const std::filesystem::path& path, const ObjectEdits& edits);
ObjectEdits ReadObjectEdits(const std::filesystem::path& path);

}  // namespace sqslam
