#include "slam/snapshot/object_edits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/trim.hpp>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "slam/util/error.h"
#include "slam/util/json_file.h"
#include "slam/util/limits.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

// Maps an object's id to the one that owns its points and boxes after the edits; -1 if it is omitted.
using Destinations = std::function<int(int)>;

void Join(SnapshotObject& kept, const SnapshotObject& absorbed) {
  if (kept.label == absorbed.label && kept.observations + absorbed.observations > 0) {
    kept.score = (kept.score * kept.observations + absorbed.score * absorbed.observations) /
                 (kept.observations + absorbed.observations);
  }
  kept.observations += absorbed.observations;
  kept.points += absorbed.points;
}

// Returns the objects under their new ids, in the order of the map.
std::vector<SnapshotObject> Joined(const std::vector<SnapshotObject>& objects,
                                   const Destinations& destinations) {
  std::vector<SnapshotObject> joined;
  for (const SnapshotObject& object : objects) {
    if (destinations(object.id) == object.id) {
      joined.push_back(object);
    }
  }
  for (const SnapshotObject& object : objects) {
    const int id = destinations(object.id);
    if (id < 0 || id == object.id) {
      continue;
    }
    const auto kept = std::ranges::find(joined, id, &SnapshotObject::id);
    if (kept != joined.end()) {
      Join(*kept, object);
    } else {
      joined.push_back(object);
      joined.back().id = id;
    }
  }
  return joined;
}

using Json = nlohmann::ordered_json;

constexpr const char* kEditsFormat = "sqslam-edits";
constexpr int kEditsVersion = 1;

// Reads one entry of the list; messages name file and field: "FILE: objects[2].label: ...".
std::pair<int, ObjectEdit> ParseEdit(const std::filesystem::path& path, const std::string& where,
                                     const Json& entry) {
  if (!entry.is_object() || !entry.contains("id")) {
    throw InputError("{}: {}: has no id, expected an object with the key 'id'", path.string(), where);
  }
  std::pair<int, ObjectEdit> parsed;
  auto& [id, edit] = parsed;
  for (const auto& [key, value] : entry.items()) {
    const auto check = [&, &key = key, &value = value](bool valid, const std::string& expected) {
      if (!valid) {
        constexpr std::size_t kMaxShownBytes = 80;  // bytes
        throw InputError("{}: {}.{}: {}, expected {}", path.string(), where, key,
                         CutText(value.dump(), kMaxShownBytes), expected);
      }
    };
    if (key == "id" || key == "merged_into") {
      check(value.is_number_integer() && value.get<std::int64_t>() >= 0 &&
                value.get<std::int64_t>() <= std::numeric_limits<int>::max(),
            "the id of an object, a whole number from 0");
      if (key == "id") {
        id = value.get<int>();
      } else {
        edit.merged_into = value.get<int>();
      }
    } else if (key == "name" || key == "label") {
      const std::string text = value.is_string() ? ValidText(value.get<std::string>()) : "";
      check(!text.empty() && text.size() <= kMaxLabelBytes,
            fmt::format("a text of 1 to {} bytes", kMaxLabelBytes));
      (key == "name" ? edit.name : edit.label) = text;
    } else if (key == "hidden" || key == "deleted") {
      check(value.is_boolean(), "true or false");
      (key == "hidden" ? edit.hidden : edit.deleted) = value.get<bool>();
    } else {
      const std::vector<std::string> known = {"id", "name", "label", "hidden", "deleted", "merged_into"};
      const std::string hint = DidYouMean(key, known);
      throw InputError("{}: {}: unknown key '{}'{}", path.string(), where, key,
                       hint.empty() ? fmt::format(", expected one of {}", fmt::join(known, ", ")) : hint);
    }
  }
  return parsed;
}

// Merges must end at an object: a chain of them must not be a cycle.
void CheckMerges(const std::filesystem::path& path, const std::map<int, ObjectEdit>& edits) {
  for (const auto& [id, edit] : edits) {
    std::set<int> seen{id};
    for (auto at = edits.find(id); at != edits.end() && at->second.merged_into;
         at = edits.find(*at->second.merged_into)) {
      if (!seen.insert(*at->second.merged_into).second) {
        throw InputError(
            "{}: object {}: merged_into leads back to itself, expected an object that is not merged",
            path.string(), id);
      }
    }
  }
}

Json ParseDocument(const std::filesystem::path& path) {
  const Json root = ReadJsonFile(path, "edits of a map");
  const Json format = root.is_object() ? root.value("format", Json()) : Json();
  if (format != kEditsFormat || !root.contains("objects") || !root["objects"].is_array()) {
    throw InputError("{}: expected edits of a map: \"format\": \"{}\" and a list \"objects\"", path.string(),
                     kEditsFormat);
  }
  const Json version = root.value("version", Json());
  if (version != kEditsVersion) {
    throw InputError("{}: version: {}, expected {}", path.string(), version.dump(), kEditsVersion);
  }
  return root;
}

}  // namespace

void ObjectEdits::Update(int id, auto change) {
  ObjectEdit& edit = edits_[id];
  change(edit);
  if (edit == ObjectEdit{}) {
    edits_.erase(id);
  }
}

void ObjectEdits::Rename(int id, const std::string& name) {
  Update(id, [&](ObjectEdit& edit) { edit.name = ValidLabel(boost::algorithm::trim_copy(name)); });
}

void ObjectEdits::SetLabel(int id, const std::string& label) {
  Update(id, [&](ObjectEdit& edit) {
    edit.label = ValidLabel(boost::algorithm::trim_copy(label));
    std::ranges::replace(edit.label, ' ', '_');
  });
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
    throw UsageError("objects {} and {} are already merged, expected two objects", kept, absorbed);
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
  const Destinations destinations = [&](int id) {
    if (id < 0) {
      return id;
    }
    const int kept = edits.KeptIdOf(id);
    const ObjectEdit edit = edits.Of(kept);
    return edit.deleted || (edit.hidden && hidden == HiddenObjects::kLeaveOut) ? -1 : kept;
  };
  edited->objects = Joined(snapshot.objects, destinations);
  for (SnapshotObject& object : edited->objects) {
    const ObjectEdit edit = edits.Of(object.id);
    object.name = edit.name;
    if (!edit.label.empty() && edit.label != object.label) {
      object.label = edit.label;
      object.parts.clear();  // those of another class
    }
  }
  for (SnapshotPoint& point : edited->points) {
    point.object_id = destinations(point.object_id);
    point.rejected_by = destinations(point.rejected_by);
  }
  for (SnapshotDetection& detection : edited->detections) {
    detection.object_id = destinations(detection.object_id);
  }
  return edited;
}

std::vector<int> UnknownIds(const ObjectEdits& edits, const MapSnapshot& map) {
  std::vector<int> unknown;
  for (const auto& [id, edit] : edits.All()) {
    if (std::ranges::find(map.objects, id, &SnapshotObject::id) == map.objects.end()) {
      unknown.push_back(id);
    }
  }
  return unknown;
}

std::filesystem::path EditsFileOf(const std::filesystem::path& recording) {
  return recording.string() + ".edits.json";
}

void WriteObjectEdits(const std::filesystem::path& path, const ObjectEdits& edits) {
  Json list = Json::array();
  for (const auto& [id, edit] : edits.All()) {
    Json entry = {{"id", id}};
    if (!edit.name.empty()) {
      entry["name"] = edit.name;
    }
    if (!edit.label.empty()) {
      entry["label"] = edit.label;
    }
    if (edit.hidden) {
      entry["hidden"] = true;
    }
    if (edit.deleted) {
      entry["deleted"] = true;
    }
    if (edit.merged_into) {
      entry["merged_into"] = *edit.merged_into;
    }
    list.push_back(std::move(entry));
  }
  const Json root = {{"format", kEditsFormat}, {"version", kEditsVersion}, {"objects", list}};
  WriteJsonFile(path, root);
}

ObjectEdits ReadObjectEdits(const std::filesystem::path& path) {
  const Json root = ParseDocument(path);
  ObjectEdits edits;
  std::set<int> ids;
  int index = 0;
  for (const Json& entry : root["objects"]) {
    const std::string where = fmt::format("objects[{}]", index++);
    auto [id, edit] = ParseEdit(path, where, entry);
    if (!ids.insert(id).second) {
      throw InputError("{}: {}.id: {} is a duplicate, expected each object once", path.string(), where, id);
    }
    if (edit != ObjectEdit{}) {
      edits.edits_.emplace(id, std::move(edit));
    }
  }
  CheckMerges(path, edits.edits_);
  return edits;
}

}  // namespace sqslam
