#include "slam/run/joined_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "slam/io/cameras.h"
#include "slam/io/sequence.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Returns nothing if there are no image files to list.
std::optional<Sequence> ListFiles(const fs::path& path, const Camera& camera) {
  try {
    Sequence sequence = OpenSequence({.path = path, .known_camera = camera});
    return sequence.video_path.empty() ? std::optional(std::move(sequence)) : std::nullopt;
  } catch (const InputError&) {  // moved, deleted, or a live camera
    return std::nullopt;
  }
}

}  // namespace

fs::path WriteJoinedSequence(const fs::path& result, const fs::path& first, const fs::path& second,
                             const AddedFrames& added, const Camera& camera) {
  std::error_code error;
  if (added.index_shift == 0 && fs::equivalent(first, second, error)) {
    return first;
  }
  const std::optional<Sequence> a = ListFiles(first, camera);
  const std::optional<Sequence> b = ListFiles(second, camera);
  const std::int64_t begin = added.first - added.index_shift;  // of the frames of b that are listed
  if (!a || !b || begin < 0 || begin >= static_cast<std::int64_t>(b->frames.size())) {
    return {};
  }
  const std::int64_t listed = std::min(added.first, static_cast<std::int64_t>(a->frames.size()));
  const double first_time = b->frames[static_cast<std::size_t>(begin)].timestamp + added.time_shift;
  std::string text = "# timestamp path, of the frames of two sequences as the map numbers them\n";
  double time = -1.0;
  const auto list = [&](double timestamp, const fs::path& image) {
    text += fmt::format("{:.9f} {}\n", timestamp, fs::absolute(image).string());
    time = timestamp;
  };
  for (std::int64_t i = 0; i < listed; ++i) {
    const SequenceFrame& frame = a->frames[static_cast<std::size_t>(i)];
    list(frame.timestamp, frame.image_path);
  }
  if (time >= first_time) {
    return {};
  }
  // Frame numbers that neither sequence has are listed with any image, to keep the count.
  const double gap = (first_time - time) / static_cast<double>(added.first - listed + 1);
  for (std::int64_t i = listed; i < added.first; ++i) {
    list(time + gap, a->frames.back().image_path);
  }
  for (std::size_t i = static_cast<std::size_t>(begin); i < b->frames.size(); ++i) {
    list(b->frames[i].timestamp + added.time_shift, b->frames[i].image_path);
  }
  const fs::path folder = result / "sequence";
  fs::create_directories(folder);
  WriteCamera(folder / "camera.yaml", camera);
  WriteFileAtomically(folder / "rgb.txt", text);
  return fs::absolute(folder);
}

}  // namespace sqslam
