#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace sqslam {

// One of several equal pieces of a video, for as many programs at once.
struct Shard {
  int index = 1;  // from 1
  int count = 1;
};

// "2/8". Throws UsageError on anything but 1 <= I <= N.
Shard ParseShard(const std::string& text);

// The frames of [first, end) that the shard makes: [first, second).
std::pair<int, int> FramesOf(const Shard& shard, int first, int end);

// a/turn.mp4 -> a/turn.part-2-of-8.mp4. A numbered name stays: its files have the numbers of their frames.
std::filesystem::path PartName(const std::filesystem::path& output, const Shard& shard);

// Puts videos made by shards, or numbered pictures, together in order: `pieces` are FILE.part-I-of-N.mp4 in
// any order, or pictures with numbers in their names, or one name with {frame:04}. `fps` is that of pictures;
// videos keep theirs, and are put together as they are, without encoding them anew.
// Returns frames written. Throws InputError that names what is missing (parts, numbers), double, of another
// size or rate, of another video, or cut short.
int JoinVideo(const std::vector<std::string>& pieces, const std::filesystem::path& output, double fps,
              const std::function<bool(int done, int total)>& progress = {});

}  // namespace sqslam
