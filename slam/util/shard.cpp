#include "slam/util/shard.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {

Shard ParseShard(const std::string& text) {
  constexpr int kMaxShards = 100000;
  const std::size_t slash = std::min(text.find('/'), text.size());
  const auto index = ParseNumber<int>(text.substr(0, slash));
  const auto count = ParseNumber<int>(text.substr(std::min(slash + 1, text.size())));
  ThrowIf<UsageError>(!index || !count || *count > kMaxShards || *index < 1 || *index > *count,
                      "piece {}: expected I/N with I from 1 to N, such as 2/8", text);
  return {*index, *count};
}

std::pair<int, int> ItemsOf(const Shard& shard, int first, int end, int unit) {
  const std::int64_t total = end - first;
  const std::int64_t units = (total + unit - 1) / unit;
  const auto cut = [&](int index) {
    return first + static_cast<int>(std::min(total, units * index / shard.count * unit));
  };
  return {cut(shard.index - 1), cut(shard.index)};
}

std::filesystem::path PartName(const std::filesystem::path& output, const Shard& shard) {
  if (shard.count == 1) {
    return output;
  }
  return output.parent_path() / fmt::format("{}.part-{}-of-{}{}", output.stem().string(), shard.index,
                                            shard.count, output.extension().string());
}

}  // namespace sqslam
