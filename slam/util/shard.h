#pragma once

#include <filesystem>
#include <string>
#include <utility>

namespace sqslam {

// One of several parts of a task that programs process in parallel.
struct Shard {
  int index = 1;  // from 1
  int count = 1;
};

// Parses "2/8". Throws UsageError unless it is I/N with 1 <= I <= N.
Shard ParseShard(const std::string& text);

// Returns the items of [first, end) in the shard: [first, second), cut at multiples of `unit` from `first`.
std::pair<int, int> ItemsOf(const Shard& shard, int first, int end, int unit = 1);

// Converts a/turn.mp4 to a/turn.part-2-of-8.mp4; for a single shard returns `output`.
std::filesystem::path PartName(const std::filesystem::path& output, const Shard& shard);

}  // namespace sqslam
