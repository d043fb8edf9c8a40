#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace sqslam::app {

// A YAML map read key by key. What is there but of the wrong kind ends with a UsageError that names file and
// line, what stands there and what was expected; CheckKeys finds keys that nobody asked for.
class YamlGroup {
 public:
  // `name` tells in messages what the group is: "sequence", "grid", ...
  YamlGroup(YAML::Node node, std::string source, std::string name);

  std::optional<std::string> Text(const std::string& key);
  std::optional<bool> Flag(const std::string& key);
  std::optional<std::int64_t> Whole(const std::string& key, std::int64_t min);
  // A list, or one word instead of a list of one. Not empty where it is there.
  std::optional<std::vector<std::string>> Texts(const std::string& key);
  std::vector<YamlGroup> Groups(const std::string& key);  // empty where the key is missing

  void CheckKeys() const;  // throws on the first unknown key, with the nearest valid one
  std::string Where(
      const std::string& key) const;  // "FILE:LINE" of the key, of the group where it is missing
  std::string Where() const;
  [[noreturn]] void ThrowMissing(const std::string& key, const std::string& expected) const;

 private:
  YAML::Node Find(const std::string& key);  // remembers that the key is known

  YAML::Node node_;
  std::string source_;
  std::string name_;
  std::vector<std::string> known_;
};

}  // namespace sqslam::app
