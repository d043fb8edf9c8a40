#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "slam/snapshot/object_edits.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"

namespace sqslam::viewer {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "sqslam-edits";
constexpr int kVersion = 1;

// One value of the file with its name in it, for messages: "FILE: objects[2].label: ...".
class Field {
 public:
  Field(const std::filesystem::path& path, std::string name, const Json& value)
      : path_(path), name_(std::move(name)), value_(value) {}

  [[noreturn]] void Fail(const std::string& expected) const {
    throw InputError(fmt::format("{}: {}: {}, expected {}", path_.string(), name_, value_.dump(), expected));
  }

  int Id() const {
    if (!value_.is_number_integer() || value_.get<std::int64_t>() < 0 ||
        value_.get<std::int64_t>() > std::numeric_limits<int>::max()) {
      Fail("the id of an object, a whole number from 0");
    }
    return value_.get<int>();
  }
  bool Flag() const {
    if (!value_.is_boolean()) {
      Fail("true or false");
    }
    return value_.get<bool>();
  }
  std::string Text() const {
    if (!value_.is_string() || value_.get<std::string>().empty()) {
      Fail("a text that is not empty");
    }
    return value_.get<std::string>();
  }

 private:
  const std::filesystem::path& path_;
  std::string name_;
  const Json& value_;
};

std::pair<int, ObjectEdit> ParseEdit(const std::filesystem::path& path, const std::string& where,
                                     const Json& entry) {
  if (!entry.is_object() || !entry.contains("id")) {
    throw InputError(
        fmt::format("{}: {}: has no id, expected an object with the key 'id'", path.string(), where));
  }
  std::pair<int, ObjectEdit> parsed;
  for (const auto& [key, value] : entry.items()) {
    const Field field(path, where + "." + key, value);
    ObjectEdit& edit = parsed.second;
    if (key == "id") {
      parsed.first = field.Id();
    } else if (key == "name") {
      edit.name = field.Text();
    } else if (key == "label") {
      edit.label = field.Text();
    } else if (key == "hidden") {
      edit.hidden = field.Flag();
    } else if (key == "deleted") {
      edit.deleted = field.Flag();
    } else if (key == "merged_into") {
      edit.merged_into = field.Id();
    } else {
      const std::vector<std::string> known = {"id", "name", "label", "hidden", "deleted", "merged_into"};
      const std::string nearest = NearestWord(key, known);
      throw InputError(fmt::format("{}: {}: unknown key '{}'{}", path.string(), where, key,
                                   nearest.empty()
                                       ? fmt::format(", expected one of {}", fmt::join(known, ", "))
                                       : fmt::format("; did you mean '{}'?", nearest)));
    }
  }
  return parsed;
}

// Merges must end at an object: following them from any must not come back to where it began.
void CheckMerges(const std::filesystem::path& path, const std::map<int, ObjectEdit>& edits) {
  for (const auto& [id, edit] : edits) {
    std::set<int> seen{id};
    for (auto at = edits.find(id); at != edits.end() && at->second.merged_into;
         at = edits.find(*at->second.merged_into)) {
      if (!seen.insert(*at->second.merged_into).second) {
        throw InputError(fmt::format(
            "{}: object {}: merged_into leads back to itself, expected an object that is not merged",
            path.string(), id));
      }
    }
  }
}

Json ParseDocument(const std::filesystem::path& path) {
  const std::string text = ReadFile(path, "edits of a map");
  Json root;
  try {
    root = Json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    throw InputError(fmt::format("{}:{}: no valid JSON, expected edits of a map", path.string(),
                                 1 + std::count(text.begin(), end, '\n')));
  }
  const Json format = root.is_object() ? root.value("format", Json()) : Json();
  if (format != kFormat || !root.contains("objects") || !root["objects"].is_array()) {
    throw InputError(fmt::format("{}: expected edits of a map: \"format\": \"{}\" and a list \"objects\"",
                                 path.string(), kFormat));
  }
  const Json version = root.value("version", Json());
  if (version != kVersion) {
    throw InputError(fmt::format("{}: version: {}, expected {}", path.string(), version.dump(), kVersion));
  }
  return root;
}

}  // namespace

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
  const Json root = {{"format", kFormat}, {"version", kVersion}, {"objects", list}};
  WriteFileAtomically(path, root.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
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
      throw InputError(
          fmt::format("{}: {}.id: {} is there twice, expected each object once", path.string(), where, id));
    }
    if (edit != ObjectEdit{}) {
      edits.edits_.emplace(id, std::move(edit));
    }
  }
  CheckMerges(path, edits.edits_);
  return edits;
}

}  // namespace sqslam::viewer
