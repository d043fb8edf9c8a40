#include "slam/snapshot/object_edits.h"

#include <fmt/format.h>

#include <algorithm>

#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

std::string Trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

// Where the things of an object go: under which id they are now.
class Destinations {
 public:
  Destinations(const ObjectEdits& edits, HiddenObjects hidden) : edits_(edits), hidden_(hidden) {}

  // -1 where the object is left out, or there is none.
  int Of(int id) const {
    if (id < 0) {
      return id;
    }
    const int kept = edits_.KeptIdOf(id);
    const ObjectEdit edit = edits_.Of(kept);
    return edit.deleted || (edit.hidden && hidden_ == HiddenObjects::kLeaveOut) ? -1 : kept;
  }

 private:
  const ObjectEdits& edits_;
  HiddenObjects hidden_;
};

void Join(SnapshotObject& kept, const SnapshotObject& absorbed) {
  if (kept.label == absorbed.label && kept.observations + absorbed.observations > 0) {
    kept.score = (kept.score * kept.observations + absorbed.score * absorbed.observations) /
                 (kept.observations + absorbed.observations);
  }
  kept.observations += absorbed.observations;
  kept.points += absorbed.points;
}

// The objects under their new ids; the order is that of the map.
std::vector<SnapshotObject> Joined(const std::vector<SnapshotObject>& objects,
                                   const Destinations& destinations) {
  const auto with_id = [](std::vector<SnapshotObject>& list, int id) {
    return std::find_if(list.begin(), list.end(), [id](const auto& object) { return object.id == id; });
  };
  std::vector<SnapshotObject> joined;
  for (const SnapshotObject& object : objects) {
    if (destinations.Of(object.id) == object.id) {
      joined.push_back(object);
    }
  }
  for (const SnapshotObject& object : objects) {
    const int id = destinations.Of(object.id);
    if (id < 0 || id == object.id) {
      continue;
    }
    const auto kept = with_id(joined, id);
    if (kept != joined.end()) {
      Join(*kept, object);
    } else {
      joined.push_back(object);
      joined.back().id = id;
    }
  }
  return joined;
}

}  // namespace

template <typename Change>
void ObjectEdits::Update(int id, Change change) {
  ObjectEdit& edit = edits_[id];
  change(edit);
  if (edit == ObjectEdit{}) {
    edits_.erase(id);
  }
}

void ObjectEdits::Rename(int id, const std::string& name) {
  Update(id, [&](ObjectEdit& edit) { edit.name = Trimmed(name); });
}

void ObjectEdits::SetLabel(int id, const std::string& label) {
  std::string word = Trimmed(label);
  std::replace(word.begin(), word.end(), ' ', '_');
  Update(id, [&](ObjectEdit& edit) { edit.label = word; });
}

void ObjectEdits::Hide(int id, bool hidden) {
  Update(id, [&](ObjectEdit& edit) { edit.hidden = hidden; });
}

void ObjectEdits::Delete(int id, bool deleted) {
  Update(id, [&](ObjectEdit& edit) { edit.deleted = deleted; });
}

void ObjectEdits::Merge(int kept, int absorbed) {
  const int root = KeptIdOf(kept);
  const int part = KeptIdOf(absorbed);
  if (root == part) {
    throw UsageError(fmt::format("objects {} and {} are one already, expected two", kept, absorbed));
  }
  Update(part, [&](ObjectEdit& edit) { edit.merged_into = root; });
}

void ObjectEdits::Separate(int absorbed) {
  Update(absorbed, [](ObjectEdit& edit) { edit.merged_into.reset(); });
}

ObjectEdit ObjectEdits::Of(int id) const {
  const auto found = edits_.find(id);
  return found == edits_.end() ? ObjectEdit{} : found->second;
}

int ObjectEdits::KeptIdOf(int id) const {
  for (auto found = edits_.find(id); found != edits_.end() && found->second.merged_into;
       found = edits_.find(id)) {
    id = *found->second.merged_into;
  }
  return id;
}

std::vector<int> ObjectEdits::PartsOf(int id) const {
  std::vector<int> parts;
  for (const auto& [part, edit] : edits_) {
    if (part != id && edit.merged_into && KeptIdOf(part) == KeptIdOf(id) && id == KeptIdOf(id)) {
      parts.push_back(part);
    }
  }
  return parts;
}

MapSnapshotPtr Apply(const ObjectEdits& edits, const MapSnapshot& snapshot, HiddenObjects hidden) {
  auto edited = std::make_shared<MapSnapshot>(snapshot);
  if (edits.Empty()) {
    return edited;
  }
  const Destinations destinations(edits, hidden);
  edited->objects = Joined(snapshot.objects, destinations);
  for (SnapshotObject& object : edited->objects) {
    const ObjectEdit edit = edits.Of(object.id);
    object.name = edit.name;
    object.label = edit.label.empty() ? object.label : edit.label;
  }
  for (SnapshotPoint& point : edited->points) {
    point.object_id = destinations.Of(point.object_id);
    point.rejected_by = destinations.Of(point.rejected_by);
  }
  for (SnapshotDetection& detection : edited->detections) {
    detection.object_id = destinations.Of(detection.object_id);
  }
  return edited;
}

std::vector<int> UnknownIds(const ObjectEdits& edits, const MapSnapshot& map) {
  std::vector<int> unknown;
  for (const auto& [id, edit] : edits.All()) {
    if (std::none_of(map.objects.begin(), map.objects.end(),
                     [id = id](const SnapshotObject& object) { return object.id == id; })) {
      unknown.push_back(id);
    }
  }
  return unknown;
}

std::filesystem::path EditsFileOf(const std::filesystem::path& recording) {
  return recording.string() + ".edits.json";
}

}  // namespace sqslam::viewer
